"""Lights in what is instanced: Kanuka's groups hold shapes alone, so each is a light of the scene for each place."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from pxr import Usd

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


def whole_matrices(matrices: np.ndarray) -> np.ndarray:
    """(N, 4, 4) of (N, 3, 4)."""
    made = np.zeros((len(matrices), 4, 4))
    made[:, :3], made[:, 3, 3] = matrices, 1
    return made


def products(outer: np.ndarray, inner: np.ndarray, most: int) -> np.ndarray:
    """(N * M, 4, 4), or the first of them."""
    inner = inner[:most]
    return (outer[: -(-most // len(inner))][:, None] @ inner[None]).reshape(-1, 4, 4)[:most] if most else outer[:0]
