"""UsdRender: RenderVars, as layers of Kanuka's pictures.

UsdRender leaves names to renderers where sourceType is `raw` or `intrinsic`. Those of Hydra, RenderMan and Karma are
taken, upper case or lower. Normals and positions are the world's; depth is along the camera's axis, in units of the
stage, where Hydra's `depth` is that of the z buffer.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdRender

import kanuka

from .arrays import Colors, primvar
from .stage import Say

LAYERS = {
    **dict.fromkeys(("ci", "color", "colour", "beauty", "rgb", "combined"), ("rgb",)),
    "rgba": ("rgb", "alpha"),
    **dict.fromkeys(("a", "alpha", "oi", "opacity", "coverage"), ("alpha",)),
    **dict.fromkeys(("z", "depth", "cameradepth"), ("Z",)),
    **dict.fromkeys(("n", "normal", "nworld", "nn"), ("N",)),
    **dict.fromkeys(("p", "position", "pworld"), ("P",)),
    "albedo": ("albedo",),
    **dict.fromkeys(("id", "primid", "objectid"), ("id",)),
    "pref": ("Pref",),
    **dict.fromkeys(("sample_count", "samplecount"), ("sample_count",)),
}
ALWAYS = ("rgb", "alpha", "albedo", "N", "Z", "P", "id")  # every picture has them
# Names that are primvars by themselves.
PRIMVARS = {
    **dict.fromkeys(("displaycolor", "cs"), ("displayColor", "color")),
    **dict.fromkeys(("displayopacity", "os"), ("displayOpacity", "float")),
    **dict.fromkeys(("st", "uv"), ("st", "float2")),
}
KNOWN = "color, alpha, depth, N, P, albedo, id, Pref, displayColor, st, sample_count"
# What the shaders of materials call their parameters, and variables that grids hold in their own way.
_TAKEN = re.compile(r"p\d+|usd_.*|rgb|alpha|albedo|id|Pref|sample_count|Pw|Pz|N|Np|P|Z|s|t|st|width|constantwidth")


@dataclass(frozen=True)
class Shown:
    """A primvar that becomes a layer: its variables' names are those of the layer, with .X and .Y for two numbers."""

    primvar: str
    kind: str
    layer: str

    @property
    def variables(self) -> tuple[str, ...]:
        return (f"{self.layer}.X", f"{self.layer}.Y") if self.kind == "float2" else (self.layer,)

    def values(self, found: UsdGeom.Primvar, time: Usd.TimeCode, colors: Colors) -> dict[str, np.ndarray]:
        """As primvars of what is added to a scene."""
        values = primvar(found, self.layer, self.kind, time, colors)
        storage_and_kind = [key.rsplit(" ", 1)[0] for key in values]
        named = zip(storage_and_kind, self.variables, values.values(), strict=False)
        return {f"{before} {name}": array for before, name, array in named}


@dataclass(frozen=True)
class Var:
    """What a RenderVar is in a picture; without layers it cannot be had, which was told."""

    layers: tuple[str, ...] = ()
    shown: Shown | None = None

    @property
    def aovs(self) -> tuple[str, ...]:
        """What render() is asked for."""
        return self.shown.variables if self.shown else tuple(name for name in self.layers if name not in ALWAYS)


def var_of(prim: Usd.Prim, say: Say) -> Var:
    schema, path = UsdRender.Var(prim), prim.GetPath()
    name = str(schema.GetSourceNameAttr().Get() or "").strip() or prim.GetName()  # nothing: as the prim is called
    source = str(schema.GetSourceTypeAttr().Get())
    prefix, _, rest = name.partition(":")
    if source in ("raw", "intrinsic") and rest and prefix in ("lpe", "primvars"):  # as Hydra writes the others
        source, name = ("lpe" if prefix == "lpe" else "primvar"), rest
    if source == "lpe":
        return _expression(path, name, say)
    size, kind = _type_of(schema, say)
    if source == "primvar":
        return _primvar(prim, name.removeprefix("primvars:"), kind, say)
    if source not in ("raw", "intrinsic"):
        say("warning", f'{path}: there is no sourceType "{source}"; it is taken for raw')
    plain = name.lower().lstrip("_")
    if plain in PRIMVARS:
        return _primvar(prim, *PRIMVARS[plain], say)
    layers = LAYERS.get(plain)
    if layers is None:
        say("warning", f'{path}: there is no layer "{name}"; it is left out. Known are {KNOWN}')
        return Var()
    if layers == ("rgb",) and size == 4:
        layers = ("rgb", "alpha")
    have = sum(1 if layer in ("alpha", "Z", "id", "sample_count") else 3 for layer in layers)
    if schema.GetDataTypeAttr().HasAuthoredValue() and have != size:
        kind = schema.GetDataTypeAttr().Get()
        say("info", f'{path}: "{name}" is written with {have} numbers, whatever its dataType, {kind}, says')
    return Var(layers)


def _expression(path: Sdf.Path, text: str, say: Say) -> Var:
    """RenderMan writes "color lpe:C<RD>L"."""
    layer = "lpe:" + text.removeprefix("color ").strip().removeprefix("lpe:").strip()
    try:
        kanuka.check_layer(layer)
    except ValueError as error:
        say("warning", f"{path}: {str(error).removeprefix('text: ')}. It is left out")
        return Var()
    return Var((layer,))


def _primvar(prim: Usd.Prim, name: str, kind: str, say: Say) -> Var:
    if not kind or not name:
        return Var()
    layer = re.sub(r"\W", "_", prim.GetName(), flags=re.ASCII)
    shown = Shown(name, kind, layer)
    if any(_TAKEN.fullmatch(variable) for variable in shown.variables):
        shown = Shown(name, kind, f"primvar_{layer}")
    return Var((shown.layer,), shown)


def _type_of(schema: UsdRender.Var, say: Say) -> tuple[int, str]:
    """How many numbers a RenderVar's dataType has, and what primvars of it are read as."""
    name = str(schema.GetDataTypeAttr().Get())
    found = Sdf.ValueTypeNames.Find(name)
    value = found.defaultValue if found and not found.isArray else None
    if value is None or isinstance(value, str | Sdf.AssetPath):
        say("warning", f'{schema.GetPath()}: a dataType of "{name}" makes no layer; color3f stands in')
        return 3, "color"
    size = len(value) if hasattr(value, "__len__") else 1
    if size <= 2:
        return size, ("float", "float2")[size - 1]
    return size, {"Color": "color", "Normal": "normal"}.get(str(found.role), "vector" if size == 3 else "color")
