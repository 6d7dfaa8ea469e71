"""Lights in what is instanced: Kanuka's groups hold shapes alone, so each is a light of the scene for each place."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from pxr import Sdf, Usd

from .shaped_lights import MEMBERS
from .stage import silent

if TYPE_CHECKING:
    from .reader import Reader

MOST = 10_000  # of a scene

Places = list[tuple[Usd.Prim, np.ndarray]]  # lights with matrices, (N, 4, 4)


class InstancedLights:
    """Has no reader of its own, which holds it: the stage would outlive both."""

    def __init__(self) -> None:
        self._told: set[str] = set()
        self._full = False
        self.number = 0

    def add(self, reader: Reader, found: Places) -> None:
        """At matrices of the scene."""
        for prim, matrices in found:
            room = MOST - self.number
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


def instanced(lights: Places, matrices: np.ndarray, path: Sdf.Path, at: Sdf.Path) -> Places:
    """Those of a group, (N, 3, 4) or (T, N, 3, 4) being its instances' matrices. Lights stand still. Their prims are
    those below `at`, where `path` is what the group was made of."""
    if not lights or not matrices.size:
        return []
    still = (matrices if matrices.ndim == 3 else matrices[0])[: MOST + 1]
    outer = np.zeros((len(still), 4, 4))
    outer[:, :3], outer[:, 3, 3] = still, 1
    stage = lights[0][0].GetStage()
    return [
        (stage.GetPrimAtPath(prim.GetPath().ReplacePrefix(path, at)), products(outer, inner, MOST + 1))
        for prim, inner in lights
    ]


def products(outer: np.ndarray, inner: np.ndarray, most: int) -> np.ndarray:
    """(N * M, 4, 4), or the first of them."""
    inner = inner[:most]
    return (outer[: -(-most // len(inner))][:, None] @ inner[None]).reshape(-1, 4, 4)[:most] if most else outer[:0]
