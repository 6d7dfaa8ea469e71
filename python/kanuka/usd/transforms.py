"""Where prims are: matrices that act on columns, in the space of what holds them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pxr import Gf, Usd, UsdGeom

from .motion import together

# Stages whose up axis is z are turned so that +y is up, as Kanuka's skies and pictures of light have it.
Y_FROM_Z = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]], dtype=np.float64)


def columns(matrix: Gf.Matrix4d) -> np.ndarray:
    """USD's matrices act on rows."""
    return np.array(matrix, dtype=np.float64).T


def at_start(matrices: np.ndarray) -> np.ndarray:
    """Of those of the shutter, the first."""
    return matrices if matrices.ndim == 2 else matrices[0]


def stage_matrix(stage: Usd.Stage) -> np.ndarray:
    """world_from_stage: (4, 4). Units stay as they are."""
    return Y_FROM_Z if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z else np.eye(4)


class Transforms:
    """Matrices of prims at the times of the shutter."""

    def __init__(self, frame: Usd.TimeCode, times: Sequence[Usd.TimeCode]) -> None:
        self._times = tuple(times)
        self._caches = {time: UsdGeom.XformCache(time) for time in {frame, *times}}
        self._own = [self._caches[time] for time in times]
        self._frame = self._caches[frame]

    def local(self, prim: Usd.Prim) -> Gf.Matrix4d:
        """parent_from_prim at the frame, on rows."""
        return self._frame.GetLocalTransformation(prim)[0]

    def steps(self, prim: Usd.Prim) -> tuple[list[Gf.Matrix4d], bool]:
        """parent_from_prim at the times of the shutter, on rows, and whether it is the stage's root instead that they
        start from (resetXformStack)."""
        if len(self._own) == 1:
            matrix, resets = self._own[0].GetLocalTransformation(prim)
            return [matrix], resets
        found = [cache.GetLocalTransformation(prim) for cache in self._own]
        return [matrix for matrix, _ in found], found[0][1]

    def within(self, prim: Usd.Prim, ancestor: Usd.Prim, times: Sequence[Usd.TimeCode] = ()) -> np.ndarray:
        """ancestor_from_prim: (4, 4), or (T, 4, 4) where it moves; at the times of the shutter or at others."""
        found = []
        for time in times or self._times:
            cache = self._caches.setdefault(time, UsdGeom.XformCache(time))
            # The second value says whether a prim between resets the stack: then it is placed in the stage.
            matrix, _ = cache.ComputeRelativeTransform(prim, ancestor)
            found.append(columns(matrix))
        if times:
            return np.stack(found)
        return together(found)
