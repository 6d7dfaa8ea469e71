"""Colour spaces of a stage's attributes: their own, their MaterialX document's, their prims' (UsdColorSpaceAPI), and
those that prims define (UsdColorSpaceDefinitionAPI)."""

from __future__ import annotations

import numpy as np
from pxr import Usd, UsdRender

from kanuka.looks import colors
from kanuka.looks.colors import Lookup, Space

from .stage import Say, input_error


class Spaces:
    """`rendered`: the space that Kanuka renders in."""

    def __init__(self, say: Say, rendered: str = "rec709") -> None:
        self._say, self.rendered = say, rendered
        self._told: set[tuple[str, str]] = set()

    def of(self, attribute: Usd.Attribute, inherits: bool = True) -> Space | None:
        """None: nothing says one, or one that nobody knows, which is told."""
        name = attribute.GetColorSpace() or (inherited(attribute) if inherits else "")
        return self.named(name, attribute) if name and name.lower() != "auto" else None

    def named(self, name: str, attribute: Usd.Attribute) -> Space | None:
        found = self._defined(name, attribute.GetPrim()) or colors.named(name)
        if found is None:
            self._tell(name, f'{attribute.GetPath()}: there is no colour space "{name}"; it is taken for none')
        return found

    def value(self, attribute: Usd.Attribute, value: object) -> object:
        """A colour, as it is in the space that is rendered in. Values that nothing is said of are in that."""
        if str(attribute.GetTypeName()) not in COLORS or (space := self.of(attribute)) is None:
            return value
        return tuple(float(x) for x in space.converted(np.array(value, dtype=float), self.rendered))

    def lookup(self, file: str, space: Space | None) -> Lookup:
        return colors.lookup(space, self.rendered, file) if space else colors.AUTO

    def _defined(self, name: str, prim: Usd.Prim) -> Space | None:
        """By the prim or the nearest above it."""
        if not hasattr(Usd, "ColorSpaceDefinitionAPI"):
            return None
        while prim and not prim.IsPseudoRoot():
            for each in Usd.ColorSpaceDefinitionAPI.GetAll(prim):
                if each.GetNameAttr().Get() == name:
                    return self._read(name, each)
            prim = prim.GetParent()
        return None

    def _read(self, name: str, of: Usd.ColorSpaceDefinitionAPI) -> Space | None:
        chroma = (of.GetRedChromaAttr(), of.GetGreenChromaAttr(), of.GetBlueChromaAttr(), of.GetWhitePointAttr())
        primaries = tuple((float(x), float(y)) for x, y in (each.Get() for each in chroma))
        gamma, bias = float(of.GetGammaAttr().Get()), float(of.GetLinearBiasAttr().Get())
        whole = np.isfinite([gamma, bias, *np.ravel(primaries)]).all() and gamma > 0 and primaries[3][1] > 0
        if not whole or abs(np.linalg.det([(x, y, 1) for x, y in primaries[:3]])) < 1e-6:
            path = of.GetPrim().GetPath()
            self._tell(name, f'{path}: the definition of the colour space "{name}" is none: {primaries}, {gamma:g}')
            return None
        return Space(f"{name}_{path_word(of)}", colors.biased(gamma, bias), primaries)

    def _tell(self, name: str, text: str) -> None:
        if (name, text.partition(":")[0]) not in self._told:
            self._told.add((name, text.partition(":")[0]))
            self._say("warning", text)


def rendering_space(stage: Usd.Stage, wanted: str, say: Say) -> str:
    """What to render in, of Kanuka's spaces: as it is wanted, or by the stage's settings, or Rec. 709."""
    if stage.GetColorConfiguration().path:
        say(
            "info",
            f"{stage.GetColorConfiguration().path}: configurations of OpenColorIO are not read; spaces are known "
            "by name",
        )
    if wanted and wanted not in colors.RENDERED:
        raise input_error(f'color_space "{wanted}": there are {", ".join(colors.RENDERED)}')
    if wanted:
        return wanted
    settings = UsdRender.Settings.GetStageRenderSettings(stage)
    name = (settings.GetRenderingColorSpaceAttr().Get() or "") if settings else ""
    found = colors.named(name) if name else None
    for ours, primaries in colors.RENDERED.items():
        if found and found.primaries == colors.PRIMARIES[primaries]:
            return ours
    if name:
        say("warning", f'{settings.GetPath()}: nothing is rendered in "{name}"; there are {", ".join(colors.RENDERED)}')
    return "rec709"


COLORS = {f"color{n}{kind}" for n in (3, 4) for kind in "hfd"}


def path_word(of: Usd.ColorSpaceDefinitionAPI) -> str:
    return str(of.GetPrim().GetPath()).strip("/")


def inherited(attribute: Usd.Attribute) -> str:
    """Of its MaterialX document, else of its prim or the nearest above it that says one."""
    for spec in attribute.GetPropertyStack(Usd.TimeCode.Default()):
        if spec.layer.GetFileFormat().formatId == "mtlx":
            return str(spec.layer.customLayerData.get("colorSpace", ""))
    if not hasattr(Usd, "ColorSpaceAPI"):
        return ""
    prim = attribute.GetPrim()
    while prim and not prim.IsPseudoRoot():
        if prim.HasAPI(Usd.ColorSpaceAPI) and (name := Usd.ColorSpaceAPI(prim).GetColorSpaceNameAttr().Get()):
            return str(name)
        prim = prim.GetParent()
    return ""
