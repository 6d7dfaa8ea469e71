"""Colour spaces of a stage's attributes: their own, their MaterialX document's, their prims' (UsdColorSpaceAPI).

Names are those that prims define (UsdColorSpaceDefinitionAPI), else those of a configuration, else those built in.
"""

from __future__ import annotations

from collections import Counter

import numpy as np
from pxr import Sdf, Usd, UsdRender

import kanuka
from kanuka.looks import colors
from kanuka.looks.colors import Lookup, Space

from .color_config import LINEAR_ROLE, Configuration, Configured
from .stage import Say, input_error

AUTO = "auto"
MOST_TOLD = 16  # of a name: many prims may have the same


class Spaces:
    """`rendered`: the space that Kanuka renders in. `converts`: whether pictures are made that stand for others."""

    def __init__(
        self, say: Say, rendered: str = "rec709", config: Configuration | None = None, *, converts: bool = True
    ) -> None:
        self._say, self.rendered, self._config, self._converts = say, rendered, config, converts
        self._told: set[tuple[str, str]] = set()
        self._often: Counter[str] = Counter()
        self._by_parent: dict[Sdf.Path, str] = {}
        self.on_prims = True  # whether prims with primvars may say one; walks know

    def of(self, attribute: Usd.Attribute, inherits: bool = True) -> Space | None:
        """None: nothing says one, or one that nobody knows, which is told."""
        name = attribute.GetColorSpace() or (self._inherited(attribute) if inherits else "")
        return self.named(name, attribute) if name and name.lower() != AUTO else None

    def of_file(self, attribute: Usd.Attribute, file: str, inherits: bool = True) -> Space | None:
        """Of a picture. Rules of a configuration are for those that say "auto": what nothing is said of is as its file
        has it."""
        if self._config and attribute.GetColorSpace().lower() == AUTO:
            return self.named(self._config.of_file(file), attribute)
        return self.of(attribute, inherits)

    def named(self, name: str, attribute: Usd.Attribute) -> Space | None:
        found = self._defined(name, attribute.GetPrim())
        try:
            found = found or (self._config.named(name, self.rendered) if self._config else None)
        except ValueError as error:
            self._tell(name, f'{attribute.GetPath()}: values of "{name}" cannot be converted ({error}); they stay')
            return None
        found = found or colors.named(name)
        if found is None:
            self._tell(name, f'{attribute.GetPath()}: there is no colour space "{name}"; it is taken for none')
        return found

    def value(self, attribute: Usd.Attribute, value: object) -> object:
        """A colour, as it is in the space that is rendered in. Values that nothing is said of are in that."""
        space = self.of_color(attribute)
        if space is None:
            return value
        return tuple(float(x) for x in space.converted(np.array(value, dtype=float), self.rendered))

    def of_color(self, attribute: Usd.Attribute) -> Space | None:
        return self.of(attribute) if str(attribute.GetTypeName()).removesuffix("[]") in COLORS else None

    def colors(self, attribute: Usd.Attribute, values: np.ndarray) -> np.ndarray:
        """Those of a primvar, (…, 3) or (…, 4)."""
        space = self.of_color(attribute) if self.on_prims or attribute.HasColorSpace() else None
        return values if space is None else space.converted(values, self.rendered)

    def light(self, attribute: Usd.Attribute, time: Usd.TimeCode, default: tuple[float, ...]) -> np.ndarray:
        """A colour of light. One that has less than nothing of a primary, being purer than what is rendered in can be,
        has nothing of it."""
        given = np.array(attribute.Get(time) or default, dtype=float)
        found = np.array(self.value(attribute, given), dtype=float)
        return np.maximum(found, 0) if (given >= 0).all() else found

    def from_rec709(self, rgb: object) -> np.ndarray:
        space = Space("lin_rec709", colors.LINEAR, colors.PRIMARIES["rec709"])
        return np.maximum(space.converted(np.array(rgb, dtype=float), self.rendered), 0)

    def lookup(self, file: str, space: Space | None) -> Lookup:
        if not isinstance(space, Configured) or space.fits(file):
            return colors.lookup(space, self.rendered, file) if space else colors.AUTO
        try:
            return Lookup("raw", file=space.picture(file)) if self._converts else colors.RAW
        except (kanuka.Error, OSError, ValueError) as error:
            self._tell(file, f"{file}: it is not converted ({error})")
            return colors.AUTO

    def _inherited(self, attribute: Usd.Attribute) -> str:
        """Of its MaterialX document, which has no primvars, else of its prim or the nearest above it that says one."""
        if not attribute.GetName().startswith("primvars:"):
            for spec in attribute.GetPropertyStack(Usd.TimeCode.Default()):
                if spec.layer.GetFileFormat().formatId == "mtlx":
                    return str(spec.layer.customLayerData.get("colorSpace", ""))
        return self._above(attribute.GetPrim()) if hasattr(Usd, "ColorSpaceAPI") else ""

    def _above(self, prim: Usd.Prim) -> str:
        if prim.HasAPI(Usd.ColorSpaceAPI) and (name := Usd.ColorSpaceAPI(prim).GetColorSpaceNameAttr().Get()):
            return str(name)
        parent = prim.GetParent()
        if not parent or parent.IsPseudoRoot():
            return ""
        if (path := parent.GetPath()) not in self._by_parent:
            self._by_parent[path] = self._above(parent)
        return self._by_parent[path]

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
        if (key := (name, text.partition(":")[0])) in self._told:
            return
        self._told.add(key)
        self._often[name] += 1
        if self._often[name] <= MOST_TOLD:
            self._say("warning", text)
        elif self._often[name] == MOST_TOLD + 1:
            self._say("warning", f'more is to be said of "{name}" than is told')


def rendering_space(stage: Usd.Stage, wanted: str, say: Say, config: Configuration | None = None) -> str:
    """What to render in, of Kanuka's spaces: as it is wanted, or by the stage's settings, or by the configuration, or
    Rec. 709."""
    if wanted and wanted not in colors.RENDERED:
        raise input_error(f'color_space "{wanted}": there are {", ".join(colors.RENDERED)}')
    if wanted:
        return wanted
    settings = UsdRender.Settings.GetStageRenderSettings(stage)
    name = str(settings.GetRenderingColorSpaceAttr().Get() or "") if settings else ""
    asked = str(settings.GetPath()) if name else config.path if config else ""
    name = name or (LINEAR_ROLE if config and config.is_anchored else "")
    if not name:
        return "rec709"
    if config and (ours := config.rendered(name)):
        return ours
    found = colors.named(name)
    for ours, primaries in colors.RENDERED.items():
        if found and found.primaries == colors.PRIMARIES[primaries]:
            return ours
    say("warning", f'{asked}: nothing is rendered in "{name}"; there are {", ".join(colors.RENDERED)}')
    return "rec709"


COLORS = {f"color{n}{kind}" for n in (3, 4) for kind in "hfd"}


def path_word(of: Usd.ColorSpaceDefinitionAPI) -> str:
    return str(of.GetPrim().GetPath()).strip("/")
