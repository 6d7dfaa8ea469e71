"""Lights in what is instanced: Kanuka's groups hold shapes alone, so each is a light of the scene for each place."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from pxr import Usd, UsdGeom, UsdLux

from .linking import is_geometry
from .shaped_lights import MEMBERS
from .stage import silent

if TYPE_CHECKING:
    from .scene import Reader

MOST = 10_000  # of a scene

Places = list[tuple[Usd.Prim, np.ndarray]]  # lights with matrices, (N, 4, 4)


class InstancedLights:
    """Has no reader of its own, which holds it: the stage would outlive both."""

    def __init__(self) -> None:
        self._without: set[str] = set()  # prototypes
        self._told: set[str] = set()
        self._on_the_way: set[str] = set()
        self._full = False
        self.number = 0

    def add_instance(self, reader: Reader, instance: Usd.Prim, matrix: np.ndarray) -> None:
        """Of a prim that is instanced natively, at a matrix of the scene."""
        key = str(instance.GetPrototype().GetPath())
        if key in self._without:
            return
        found = self._below(reader, instance)
        if not found:
            self._without.add(key)
        self._place(reader, found, matrix[None])

    def add_prototype(self, reader: Reader, prototype: Usd.Prim, matrices: Callable[[], np.ndarray]) -> None:
        """Of what an instancer places, (N, 4, 4)."""
        if found := self._below(reader, prototype):
            self._place(reader, found, matrices())

    def _place(self, reader: Reader, found: Places, outer: np.ndarray) -> None:
        for prim, inner in found:
            room = MOST - self.number
            matrices = products(outer, inner, room + 1)
            if len(matrices) > room and not self._full:
                self._full = True
                rest = "it and those after it are left out"
                reader.say("warning", f"{prim.GetPath()}: no more than {MOST} lights in instances are read; {rest}")
            self.number += min(len(matrices), room)
            members = int(np.clip(MOST // max(self.number, 1), 1, MEMBERS))
            for matrix in matrices[:room]:
                tell = reader.say if self._is_new(prim) else silent
                reader.add_light(prim, matrix, tell, members)

    def _is_new(self, light: Usd.Prim) -> bool:
        """What is to be told of a light is told of its first place."""
        key = str((light.GetPrimInPrototype() if light.IsInstanceProxy() else light).GetPath())
        known = key in self._told
        self._told.add(key)
        return not known

    def _below(self, reader: Reader, top: Usd.Prim) -> Places:
        """Lights in it, with matrices to its space. One that holds itself, which is told elsewhere, ends there."""
        key = str(top.GetPath())
        if key in self._on_the_way:
            return []
        self._on_the_way.add(key)
        found: Places = []
        prims = iter(Usd.PrimRange(top, Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)))
        for prim in prims:
            if not reader.shows(prim):
                prims.PruneChildren()
            elif prim.IsA(UsdGeom.PointInstancer):
                prims.PruneChildren()
                outer = at_start(reader.transforms.within(prim, top))
                for inner, matrices, mine in reader.placements(UsdGeom.PointInstancer(prim), silent):
                    places = outer @ matrices[mine[: MOST + 1]]
                    found += [(light, products(places, own, MOST + 1)) for light, own in self._below(reader, inner)]
            elif prim.HasAPI(UsdLux.LightAPI) and not is_geometry(prim):
                found.append((prim, at_start(reader.transforms.within(prim, top))[None]))
        self._on_the_way.discard(key)
        return found


def at_start(matrices: np.ndarray) -> np.ndarray:
    """Of those of the shutter: lights stand still."""
    return matrices if matrices.ndim == 2 else matrices[0]


def products(outer: np.ndarray, inner: np.ndarray, most: int) -> np.ndarray:
    """(N * M, 4, 4), or the first of them."""
    inner = inner[:most]
    return (outer[: -(-most // len(inner))][:, None] @ inner[None]).reshape(-1, 4, 4)[:most] if most else outer[:0]
