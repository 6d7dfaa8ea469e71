"""Where prims are: matrices that act on columns, in the space of what holds them."""

from __future__ import annotations

import numpy as np
from pxr import Gf, Usd, UsdGeom

# Stages whose up axis is z are turned so that +y is up, as Kanuka's skies and pictures of light have it.
Y_FROM_Z = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]], dtype=np.float64)


def columns(matrix: Gf.Matrix4d) -> np.ndarray:
    """USD's matrices act on rows."""
    return np.array(matrix, dtype=np.float64).T


def stage_matrix(stage: Usd.Stage) -> np.ndarray:
    """world_from_stage: (4, 4). Units stay as they are."""
    return Y_FROM_Z if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z else np.eye(4)


class Transforms:
    """Matrices of prims at the times of the shutter."""

    def __init__(self, times: list[Usd.TimeCode]) -> None:
        self.times = times
        self._caches = [UsdGeom.XformCache(time) for time in times]

    def within(self, prim: Usd.Prim, ancestor: Usd.Prim) -> np.ndarray:
        """ancestor_from_prim: (4, 4), or (T, 4, 4) where it moves."""
        found = []
        for cache in self._caches:
            # The second value says whether a prim between resets the stack: then it is placed in the stage.
            matrix, _ = cache.ComputeRelativeTransform(prim, ancestor)
            found.append(columns(matrix))
        return still_or_moving(found)


def still_or_moving(matrices: list[np.ndarray]) -> np.ndarray:
    """One matrix if all are the same, else all."""
    first = matrices[0]
    return first if all(np.array_equal(first, m) for m in matrices[1:]) else np.stack(matrices)
