"""Prims with a shape, added to a scene or a group of it: what all kinds of them share."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from pxr import UsdShade

import kanuka

from .arrays import is_list, primvar
from .items import Item, primvar_of, primvars_of
from .linking import Links
from .materials import Made, Materials
from .mesh_lights import INDEPENDENT, TINTED, Glow, MeshLights
from .motion import Shutter
from .render_vars import Shown
from .spaces import Spaces
from .stage import Gathered, Say

AHEAD = ("faceVertexCounts", "faceVertexIndices", "subdivisionScheme")  # attributes that are read for many prims
AS_POINTS = 100
MOST_POINTS = 1 << 15  # of prims whose attributes are read together
WHOLE = ("string", "matrix")  # types that do not vary over a shape
ST = ("st", "UVMap", "map1", "uv")  # and some exporters' names of it


def whole(key: str) -> str:
    """The key of a primvar; of a type of which shapes have one value, under that class."""
    _, kind, name = key.split(" ")
    return f"constant {kind} {name}" if kind in WHOLE else key


def shown(name: str) -> str:
    """A primvar's name as USD has it, of what it is in shaders; with its declaration or by itself."""
    return name.split()[-1].removeprefix("usd_")


@dataclass
class Shapes:
    """Adds prims; `adders` are by their types."""

    materials: Materials
    say: Say
    shutter: Shutter
    links: Links
    mesh_lights: MeshLights
    spaces: Spaces
    gathered: Gathered
    adders: dict[str, Callable]
    shown: Sequence[Shown] = ()
    asked: set[str] = field(default_factory=set)  # names of primvars that materials and layers read
    own_values: set[str] = field(default_factory=set)  # names of primvars that solids have themselves
    points: int = 0  # of all that was added; solids have none, and count as AS_POINTS
    named: dict[str, tuple[str, str]] = field(default_factory=dict)  # those of materials: Kanuka's names and kinds

    def add(self, place: kanuka.Scene | kanuka.Group, items: Sequence[Item]) -> None:
        self.bind(items)
        for some in self.read_ahead(items):
            for item in some:
                try:
                    self.adders[item.kind](self, place, item)
                except (ValueError, TypeError) as error:
                    self.say("error", f"{item.path}: {error}. It is left out")

    def read_ahead(self, items: Sequence[Item]) -> Iterator[list[Item]]:
        """Some at a time, with values that each will be asked for: an attribute of many prims is read sooner than many
        attributes of a prim, whose code is not in the processor's caches each time. Those of large ones would fill the
        memory."""
        frame, left = self.shutter.frame, iter(items)
        while some := list(self.up_to(MOST_POINTS, left)):
            for name in AHEAD:
                for item in some:
                    if name in item.names:
                        item.ahead[name] = item.prim.GetAttribute(name).Get(frame)
            yield some

    def up_to(self, most: int, items: Iterator[Item]) -> Iterator[Item]:
        """With their points."""
        count = 0
        while count < most and (item := next(items, None)):
            points = item.ahead["points"] = item.authored("points", self.shutter.frame)
            count += len(points) if is_list(points) else 0
            self.points += len(points) if is_list(points) else AS_POINTS
            yield item

    def bind(self, items: Sequence[Item]) -> None:
        """Finds the materials that prims are bound to."""
        # All at once: USD keeps what it finds of bindings above prims, and works in parallel.
        bound, _ = UsdShade.MaterialBindingAPI.ComputeBoundMaterials([item.prim for item in items])
        for item, material in zip(items, bound, strict=True):
            item.bound = material

    def looks(self, item: Item, made: Made) -> dict[str, object]:
        looks = {"transform": item.matrix, "name": item.path, "material": made.material, **self.links.of(item.prim)}
        variants = item.authored("primvars:kanuka:variants", self.shutter.frame)
        return looks | ({"variants": int(variants)} if variants is not None else {})

    def material(self, bound: UsdShade.Material | None, glow: Glow | None = None) -> Made:
        shine = glow.shine if glow else None
        if glow and glow.mode not in (TINTED, INDEPENDENT):
            return self.materials.dark(shine)
        return (self.materials.of(bound, shine) if bound else None) or self.materials.plain(shine)

    def material_of(self, item: Item, glow: Glow | None = None) -> Made:
        return self.material(item.bound, glow)

    def primvars(self, item: Item, wanted: Sequence[Made]) -> dict[str, np.ndarray]:
        """Of those that the materials read, what the prim or its parents have."""
        found: dict[str, np.ndarray] = {}
        for made in wanted:
            for name, (ours, kind) in made.primvars.items():
                names = ST if name == "st" else (name,)
                self.asked.update(names)
                self.named.setdefault(name, (ours, kind))
                for have in primvars_of(item, *names):
                    if values := primvar(have, ours, kind, self.shutter.frame, self.spaces.colors):
                        found |= {whole(key): self.one(item, name, key, array) for key, array in values.items()}
                        break
                    if have.HasValue():
                        self.say("warning", f"{item.path}: primvar {name} is no {kind}; it is not read")
                        break
        return found

    def layers(self, item: Item) -> dict[str, np.ndarray]:
        """Primvars that layers of the picture show."""
        found: dict[str, np.ndarray] = {}
        for layer in self.shown:
            self.asked.add(layer.primvar)
            if (have := primvar_of(item, layer.primvar)) is not None:
                found |= layer.values(have, self.shutter.frame, self.spaces.colors)
        return found

    def one(self, item: Item, name: str, key: str, array: np.ndarray) -> np.ndarray:
        if key.split()[1] in WHOLE and not key.startswith("constant"):
            if len(array) > 1:
                self.gathered.note(
                    f"primvar {name} varies, but shapes have one text or matrix; the first stands", item.path
                )
            return array[:1]
        if len(array) > 1 and key.startswith("constant"):
            # As USD's imaging; an array without an interpolation is constant.
            self.gathered.note(f"primvar {name} is constant, but has several values; the first one stands", item.path)
            return array[:1]
        return array

    def fitting(self, item: Item, primvars: dict[str, np.ndarray], sizes: dict[str, int]) -> dict[str, np.ndarray]:
        """Those of as many values as their storage classes have on a shape; others are told."""
        made = {}
        for key, values in primvars.items():
            storage, _, name = key.split(" ")
            if len(values) == sizes.get(storage, 1):
                made[key] = values
            else:
                count = f"{len(values)} {storage} values of {shown(name)} for {sizes.get(storage, 1)}"
                self.say("warning", f"{item.path}: {count}; they have no effect")
        return made
