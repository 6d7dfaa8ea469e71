"""Procedurals that ship, and how those of others are found: docs/procedurals.md.

A plug-in is a function that gives RIB (str or bytes). `function(detail, data)` gets the size of its bound in pixels
and the scene's text; one that is marked by `@procedural` gets the whole request:

    @kanuka.procedural
    def spikes(request):
        size = float(request.parameters.get("size", 1))
        return f"Cone {size} 0.1 360"

    scene = kanuka.load("scene.rib", procedurals={"spikes": spikes})

A file `spikes.py` beside the scene (or in Option "searchpath" "procedural") that defines such a function of its own
name is found without being registered.
"""

from __future__ import annotations

import importlib
import runpy
from collections.abc import Callable
from pathlib import Path

from .._native import ProceduralRequest
from . import library
from .parameters import Parameter

Plugin = Callable[[ProceduralRequest], str | bytes]

SHIPPED = ("hair", "trees", "scatter", "cloth")


def procedural(function: Plugin) -> Plugin:
    """Marks a plug-in that takes a ProceduralRequest."""
    function.takes_request = True
    return function


def table(name: str) -> tuple[Parameter, ...]:
    """The parameters of a procedural that ships."""
    return importlib.import_module(f".{name}", __name__).PARAMETERS


def expand(request: ProceduralRequest) -> str | bytes | None:
    """RIB for a request that nobody has registered a function for; None = it is not known here."""
    if request.type in ("DelayedReadArchive", "RunProgram"):
        return None
    name = Path(request.name)
    if name.suffix == ".py":
        return from_file(request)
    if request.name in SHIPPED:
        module = importlib.import_module(f".{request.name}", __name__)
        return module.expand(request)
    if not name.suffix and request.find(f"{request.name}.py"):
        return from_file(request)
    return library.expand(request) if request.type == "DynamicLoad" else None


def from_file(request: ProceduralRequest) -> str | bytes:
    name = Path(request.name).with_suffix(".py")
    path = request.find(str(name))
    if path is None:
        raise FileNotFoundError(f"{name} is in none of {', '.join(f or '.' for f in request.folders)}")
    if not request.may_run:
        raise PermissionError("running code that is no part of the renderer is forbidden")
    function = runpy.run_path(path).get(name.stem)
    if function is None:
        raise LookupError(f'{path} defines no function "{name.stem}"')
    takes_request = getattr(function, "takes_request", False)
    return function(request) if takes_request else function(request.detail, request.data)
