"""Prims as the walk meets them: what they have, and what they inherit."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache
from typing import NamedTuple

import numpy as np
from pxr import Gf, Usd, UsdGeom, UsdShade, Vt

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


def is_each(found: UsdGeom.Primvar, frame: Usd.TimeCode) -> bool:
    """Whether it is for each instance of a PointInstancer, and nothing that prims below inherit. Files leave its
    interpolation out, which is constant then."""
    if not found.GetAttr().GetPrim().IsA(UsdGeom.PointInstancer) or not found.GetTypeName().isArray:
        return False
    values = found.ComputeFlattened(frame)
    return values is not None and len(values) > 1


def above_of(prim: Usd.Prim, frame: Usd.TimeCode) -> Above:
    """What a prim inherits by its place in the stage, but for its matrix; for walks that do not begin at the root."""
    parent = prim.GetParent()
    if not parent or parent.IsPseudoRoot():
        return Above()
    imageable = UsdGeom.Imageable(parent)
    info = imageable.ComputePurposeInfo() if imageable else None
    return Above(
        purpose=str(info.purpose) if info is not None and info.isInheritable else "",
        draw_mode=str(UsdGeom.ModelAPI(parent).ComputeModelDrawMode()),
        primvars=tuple(p for p in UsdGeom.PrimvarsAPI(parent).FindInheritablePrimvars() if not is_each(p, frame)),
    )


@dataclass(slots=True)
class Item:
    """A prim with a shape. `names`: properties that have opinions; others cost nothing to ask for. `shines`: whether it
    is a light."""

    prim: Usd.Prim
    path: str
    kind: str
    names: frozenset[str]
    above: Above
    children: bool = False
    shines: bool = False
    matrix: np.ndarray | None = None  # place_from_prim, on columns: (4, 4) or (T, 4, 4); set by place_all()
    bound: UsdShade.Material | None = None
    ahead: dict[str, object] = field(default_factory=dict)  # values that were read ahead, at the frame

    def authored(self, name: str, frame: Usd.TimeCode):
        """Of an attribute; None: there is no opinion."""
        if name in self.ahead:
            return self.ahead.pop(name)
        return self.prim.GetAttribute(name).Get(frame) if name in self.names else None

    def value(self, name: str, frame: Usd.TimeCode):
        """Of an attribute; its schema's fallback where there is no opinion."""
        found = self.authored(name, frame)
        return fallback(self.kind, name) if found is None else found


def place_all(items: list[Item]) -> None:
    """Sets their matrices: for NumPy those of hundreds that stand still are as much work as a single one."""
    still = [item for item in items if len(item.above.matrices) == 1]
    matrices = np.array(Vt.Matrix4dArray([item.above.matrices[0] for item in still])).reshape(-1, 4, 4)
    for item, matrix in zip(still, matrices.transpose(0, 2, 1), strict=True):
        item.matrix = matrix
    for item in items:
        if item.matrix is None:
            item.matrix = item.above.columns


@cache
def fallback(kind: str, name: str):
    definition = Usd.SchemaRegistry().FindConcretePrimDefinition(kind)
    return definition.GetAttributeFallbackValue(name) if definition else None


def primvars_of(item: Item, *names: str) -> Iterator[UsdGeom.Primvar]:
    """Those of some names that a prim has, or inherits, the best first. Ones of no value are among them: to ask for the
    value itself tells these as well."""
    for name in names:
        full = f"primvars:{name}"
        if full in item.names:
            yield UsdGeom.Primvar(item.prim.GetAttribute(full))
        for found in item.above.primvars:
            if found.GetName() == full:
                yield found


def primvar_of(item: Item, *names: str) -> UsdGeom.Primvar | None:
    """The first of them that has a value."""
    return next((found for found in primvars_of(item, *names) if found.HasValue()), None)
