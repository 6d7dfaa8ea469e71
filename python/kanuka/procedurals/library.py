"""Shared libraries of procedurals (RISpec 3.2, DynamicLoad). Their Ri… calls need libkanuka, which records them."""

from __future__ import annotations

import ctypes
import os
from functools import cache
from pathlib import Path

from kanuka import paths


def candidates() -> list[Path]:
    """Where libkanuka is looked for."""
    return [Path(os.environ.get("KANUKA_LIBRARY") or paths.libkanuka())]


@cache
def libkanuka() -> ctypes.CDLL:
    for path in candidates():
        if path.exists():
            # Plug-ins that are not linked against it find its functions among the global ones.
            library = ctypes.CDLL(str(path), mode=ctypes.RTLD_GLOBAL)
            library.RiLibraryRib.restype = ctypes.c_void_p
            library.RiFreeLibraryRib.argtypes = [ctypes.c_void_p]
            return library
    tried = ", ".join(map(str, candidates()))
    raise FileNotFoundError(f"libkanuka.so, which its calls need, is not there ({tried}); KANUKA_LIBRARY may name it")


def expand(request) -> bytes | None:
    """RIB of a library that the request names; None = there is no such file."""
    found = request.find(request.name) or (None if request.name.endswith(".so") else request.find(f"{request.name}.so"))
    if found is None:
        if not request.name.endswith(".so"):
            return None
        folders = ", ".join(f'"{f}"' for f in dict.fromkeys(f or "." for f in request.folders))
        raise FileNotFoundError(f'there is no such library in {folders}; set Option "searchpath" "procedural"')
    if not request.may_run:
        raise PermissionError("running code that is no part of the renderer is forbidden")
    library = libkanuka()
    declared = [text.encode() for text in request.declared]
    problem = ctypes.c_void_p()
    rib = library.RiLibraryRib(
        str(Path(found).resolve()).encode(),
        request.data.encode(),
        ctypes.c_float(min(request.detail, 3e38)),
        (ctypes.c_char_p * max(1, len(declared)))(*declared),
        len(declared),
        ctypes.byref(problem),
    )
    try:
        if problem.value:
            raise RuntimeError(ctypes.string_at(problem.value).decode(errors="replace"))
        return ctypes.string_at(rib)
    finally:
        for text in (rib, problem.value):
            if text:
                library.RiFreeLibraryRib(text)
