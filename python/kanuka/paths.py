"""Where the files that ship with Kanuka lie: in the package where a wheel was installed, else in the checkout."""

from __future__ import annotations

import os
from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent
_CHECKOUT = _PACKAGE.parents[1]
_INSTALLED = (_PACKAGE / "shaders").is_dir()


def standard_shaders() -> str:
    """Folder of the standard shaders: KANUKA_SHADERS, else what ships."""
    given = os.environ.get("KANUKA_SHADERS")
    return given or str((_PACKAGE if _INSTALLED else _CHECKOUT) / "shaders")


def include_dir() -> str:
    """Folder of ri.h, for C programs that call Ri…"""
    return str((_PACKAGE if _INSTALLED else _CHECKOUT) / "include")


def library_dir() -> str:
    """Folder of libkanuka, which they are linked with. In a checkout `make build` fills it."""
    if _INSTALLED:
        return str(_PACKAGE / "lib")
    return str(Path(os.environ.get("KANUKA_BUILD", _CHECKOUT / "build")) / "src/ri")


def libkanuka() -> str:
    """The library itself."""
    return str(Path(library_dir()) / "libkanuka.so.0")


def compiler_flags() -> list[str]:
    """What a C compiler is given to make a program that calls Ri…, and that finds the library when it runs."""
    library = library_dir()
    return [f"-I{include_dir()}", f"-L{library}", f"-Wl,-rpath,{library}", "-lkanuka"]
