"""Prims as the walk meets them: what they have, and what they inherit."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np
from pxr import Gf, Usd, UsdGeom, UsdShade

IDENTITY = Gf.Matrix4d(1)
BINDING = "material:binding"


class Above(NamedTuple):
    """What prims inherit of those above them. The matrices act on rows, as USD's do: place_from_prim, one or one for
    each time of the shutter."""

    matrices: tuple[Gf.Matrix4d, ...] = (IDENTITY,)
    purpose: str = ""  # none was authored
    draw_mode: str = "default"
    primvars: tuple[UsdGeom.Primvar, ...] = ()
    bindings: tuple[tuple[Usd.Prim, frozenset[str]], ...] = ()  # prims with materials' bindings, and their properties

    @property
    def columns(self) -> np.ndarray:
        """(4, 4), or (T, 4, 4) of what moves; they act on columns."""
        if len(self.matrices) == 1:
            return np.array(self.matrices[0]).T
        return np.array([np.array(matrix) for matrix in self.matrices]).transpose(0, 2, 1)


def moved(steps: list[Gf.Matrix4d], start: tuple[Gf.Matrix4d, ...]) -> tuple[Gf.Matrix4d, ...]:
    """Matrices of a prim, by its own at the times of the shutter; `start`: those that they are relative to."""
    if len(start) == 1 and all(step == steps[0] for step in steps[1:]):
        return (steps[0] * start[0],)
    start = start if len(start) > 1 else start * len(steps)
    return tuple(step * outer for step, outer in zip(steps, start, strict=True))


def bindings_of(above: Above) -> tuple:
    """What is authored about materials, to tell instances apart: names, targets and strengths."""
    found = []
    for prim, names in above.bindings:
        for name in sorted(name for name in names if name.startswith(BINDING)):
            if rel := prim.GetRelationship(name):
                found.append((name, tuple(rel.GetForwardedTargets()), rel.GetMetadata("bindMaterialAs")))
    return tuple(found)


def handed_down(prim: Usd.Prim, names: frozenset[str], here: Above) -> Above:
    """What children inherit beside what their parent does: primvars and bindings of materials."""
    every = " ".join(names)
    if BINDING in every:
        here = here._replace(bindings=(*here.bindings, (prim, names)))
    if "primvars:" in every:
        primvars = UsdGeom.PrimvarsAPI(prim).FindIncrementallyInheritablePrimvars(list(here.primvars))
        here = here._replace(primvars=tuple(primvars)) if primvars else here
    return here


def above_of(prim: Usd.Prim) -> Above:
    """What a prim inherits by its place in the stage, but for its matrix; for walks that do not begin at the root."""
    parent = prim.GetParent()
    if not parent or parent.IsPseudoRoot():
        return Above()
    imageable = UsdGeom.Imageable(parent)
    info = imageable.ComputePurposeInfo() if imageable else None
    return Above(
        purpose=str(info.purpose) if info is not None and info.isInheritable else "",
        draw_mode=str(UsdGeom.ModelAPI(parent).ComputeModelDrawMode()),
        primvars=tuple(UsdGeom.PrimvarsAPI(parent).FindInheritablePrimvars()),
    )


@dataclass(slots=True)
class Item:
    """A prim with a shape. `names`: properties that have opinions; others cost nothing to ask for."""

    prim: Usd.Prim
    path: str
    kind: str
    names: frozenset[str]
    matrix: np.ndarray  # place_from_prim, on columns: (4, 4) or (T, 4, 4)
    above: Above
    children: bool
    bound: UsdShade.Material | None = None

    def value(self, name: str, time: Usd.TimeCode):
        """Of an attribute; its schema's fallback where there is no opinion."""
        if name in self.names and (found := self.prim.GetAttribute(name).Get(time)) is not None:
            return found
        return fallback(self.kind, name)


@cache
def fallback(kind: str, name: str):
    definition = Usd.SchemaRegistry().FindConcretePrimDefinition(kind)
    return definition.GetAttributeFallbackValue(name) if definition else None


def primvar_of(item: Item, *names: str) -> UsdGeom.Primvar | None:
    """The first of some names that a prim has, or inherits."""
    for name in names:
        full = f"primvars:{name}"
        if full in item.names:
            found = UsdGeom.Primvar(item.prim.GetAttribute(full))
            if found.HasValue():
                return found
        for found in item.above.primvars:
            if found.GetName() == full:
                return found
    return None
