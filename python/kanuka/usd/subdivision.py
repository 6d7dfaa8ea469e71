"""How large a subdivision surface is: Catmull and Clark's rules (1978) with sharp edges (DeRose, Kass and Truong 1998),
some steps of them, and what the differences between these say of the limit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pxr import Usd, UsdGeom

from .arrays import rows, whole

STEPS = 3
MOST_FACES = 200_000  # beyond that a cage is fine enough to be taken for its surface


@dataclass
class Cage:
    points: np.ndarray  # (N, 3)
    faces: np.ndarray  # corners, flat
    counts: np.ndarray
    seen: np.ndarray  # faces that are no holes
    creases: np.ndarray  # (K, 2) vertices
    sharpness: np.ndarray  # (K,): the steps for which they are sharp
    corners: np.ndarray  # vertices that stay, likewise
    corner_sharpness: np.ndarray

    def starts(self) -> np.ndarray:
        return np.cumsum(self.counts) - self.counts

    def following(self) -> np.ndarray:
        """Of each corner, where its face's next one is."""
        after = np.arange(1, len(self.faces) + 1)
        after[self.starts() + self.counts - 1] = self.starts()
        return after

    def area(self) -> float:
        """Half of the sum of the cross products along each outline."""
        if not len(self.counts):
            return 0.0
        starts = self.starts()
        spokes = self.points[self.faces] - np.repeat(self.points[self.faces[starts]], self.counts, axis=0)
        across = np.add.reduceat(np.cross(spokes, spokes[self.following()]), starts, axis=0)
        return float(np.linalg.norm(across, axis=1)[self.seen].sum() / 2)


def area_of(
    mesh: UsdGeom.Mesh,
    time: Usd.TimeCode,
    points: np.ndarray,
    faces: np.ndarray,
    counts: np.ndarray,
    linear: np.ndarray,
) -> float:
    """Of a mesh after a linear map, (3, 3). Loop's surfaces are taken for Catmull and Clark's."""
    seen = np.ones(len(counts), dtype=bool)
    holes = whole(mesh.GetHoleIndicesAttr().Get(time))
    seen[holes[(holes >= 0) & (holes < len(counts))]] = False
    creases, sharpness = creases_of(mesh, time)
    corners = whole(mesh.GetCornerIndicesAttr().Get(time))
    corner_sharpness = rows(mesh.GetCornerSharpnessesAttr().Get(time) or (), 1).reshape(-1)
    both = min(len(corners), len(corner_sharpness))
    there = (corners[:both] >= 0) & (corners[:both] < len(points))
    solid = counts >= 3
    cage = Cage(
        points @ linear.T,
        faces[np.repeat(solid, counts)],
        counts[solid],
        seen[solid],
        creases,
        sharpness,
        corners[:both][there],
        corner_sharpness[:both][there],
    )
    if mesh.GetSubdivisionSchemeAttr().Get(time) not in (UsdGeom.Tokens.catmullClark, UsdGeom.Tokens.loop):
        return cage.area()
    return limit_area(cage)


def creases_of(mesh: UsdGeom.Mesh, time: Usd.TimeCode) -> tuple[np.ndarray, np.ndarray]:
    """Edges, (K, 2), with their sharpness. Bad ones, which are told where the mesh is added, are none."""
    lengths, chains = whole(mesh.GetCreaseLengthsAttr().Get(time)), whole(mesh.GetCreaseIndicesAttr().Get(time))
    sharpness = rows(mesh.GetCreaseSharpnessesAttr().Get(time) or (), 1).reshape(-1)
    if (
        (lengths < 1).any()
        or lengths.sum() != len(chains)
        or len(sharpness) not in (len(lengths), len(chains) - len(lengths))
    ):
        return np.zeros((0, 2), dtype=np.int32), np.zeros(0)
    within = np.ones(len(chains), dtype=bool)
    within[np.cumsum(lengths) - 1] = False  # a chain's last vertex begins no edge
    begin = np.flatnonzero(within)
    each = np.repeat(sharpness, lengths - 1) if len(sharpness) == len(lengths) else sharpness
    return np.stack([chains[begin], chains[begin + 1]], -1), each


def limit_area(cage: Cage) -> float:
    """Differences from step to step are a quarter of the last ones."""
    areas = [cage.area()]
    while len(areas) <= STEPS and len(cage.faces) <= MOST_FACES:
        cage = refined(cage)
        areas.append(cage.area())
    return areas[-1] + (areas[-1] - areas[-2]) / 3 if len(areas) > 1 else areas[0]


def refined(cage: Cage) -> Cage:
    """By one step. Vertices of one face stay, as Kanuka's surfaces have it."""
    number, after = len(cage.points), cage.following()
    of_face = np.repeat(np.arange(len(cage.counts)), cage.counts)
    middles = np.add.reduceat(cage.points[cage.faces], cage.starts(), axis=0) / cage.counts[:, None]
    keys, edge = np.unique(edge_keys(cage.faces, cage.faces[after], number), return_inverse=True)
    ends = np.stack([keys // number, keys % number], -1)
    sharp = np.bincount(edge, minlength=len(keys)) != 2
    at = np.searchsorted(keys, edge_keys(*cage.creases.T, number)) if len(cage.creases) else np.zeros(0, dtype=int)
    known = (at < len(keys)) & (keys[np.minimum(at, len(keys) - 1)] == edge_keys(*cage.creases.T, number))
    sharp[at[known & (cage.sharpness > 0)]] = True

    halves = cage.points[ends].mean(1)
    beside = summed(edge, middles[of_face], len(keys))
    edge_points = np.where(sharp[:, None], halves, (2 * halves + beside) / 4)
    moved = moved_points(cage, ends, halves, sharp, middles[of_face])

    before = np.empty_like(after)
    before[after] = np.arange(len(after))
    quads = np.stack([cage.faces, number + edge, number + len(keys) + of_face, number + edge[before]], -1)
    crease_points = number + at[known]
    creases = [np.stack([cage.creases[known][:, k], crease_points], -1) for k in (0, 1)]
    return Cage(
        np.concatenate([moved, edge_points, middles]),
        quads.reshape(-1),
        np.full(len(quads), 4),
        np.repeat(cage.seen, cage.counts),
        np.concatenate(creases),
        np.tile(cage.sharpness[known] - 1, 2),
        cage.corners,
        cage.corner_sharpness - 1,
    )


def moved_points(
    cage: Cage, ends: np.ndarray, halves: np.ndarray, sharp: np.ndarray, middles: np.ndarray
) -> np.ndarray:
    """Vertices: smooth, on a crease of two sharp edges, or where they are. `middles`: of the face, for each corner."""
    number, P = len(cage.points), cage.points
    both, twice = ends.reshape(-1), np.repeat(np.arange(len(ends)), 2)
    valence = np.maximum(np.bincount(both, minlength=number), 1)[:, None]
    of_faces = np.bincount(cage.faces, minlength=number)[:, None]
    Q = summed(cage.faces, middles, number) / np.maximum(of_faces, 1)
    R = summed(both, halves[twice], number) / valence
    smooth = (Q + 2 * R + (valence - 3) * P) / valence
    on = sharp[twice]
    sharps = np.bincount(both[on], minlength=number)[:, None]
    crease = P / 2 + summed(both[on], halves[twice[on]], number) / 4
    stays = (sharps > 2) | (of_faces <= 1)
    stays[cage.corners[cage.corner_sharpness > 0]] = True
    return np.where(stays, P, np.where(sharps == 2, crease, smooth))


def edge_keys(a: np.ndarray, b: np.ndarray, number: int) -> np.ndarray:
    return np.minimum(a, b).astype(np.int64) * number + np.maximum(a, b)


def summed(where: np.ndarray, values: np.ndarray, number: int) -> np.ndarray:
    return np.stack([np.bincount(where, values[:, k], number) for k in range(3)], -1)
