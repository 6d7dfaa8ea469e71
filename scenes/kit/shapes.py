"""Meshes of quads as arrays: lattices, tubes, balls, leaves. y is up, outsides are counter-clockwise."""

from __future__ import annotations

import functools

import numpy as np

from kanuka.procedurals.surface import hashed, rings, unit

PIECE = 1 << 15  # points that noise is worked out for at a time: they fit into caches
PRIMES = (73856093, 19349663, 83492791)  # of cells' keys (Teschner et al. 2003)


@functools.lru_cache(maxsize=64)
def lattice_faces(rows: int, columns: int, closed: bool = False, over: bool = False) -> np.ndarray:
    """The quads of a lattice of points, row after row; closed: its last column is beside its first; over: as seen from
    behind, so that what has columns along x and rows along z looks up. The same array for the same question."""
    across_, last = np.arange(columns if closed else columns - 1), columns
    a = np.arange(rows - 1)[:, None] * last + across_
    b = np.arange(rows - 1)[:, None] * last + (across_ + 1) % last
    corners = [a, a + last, b + last, b] if over else [a, b, b + last, a + last]
    faces = np.stack(corners, axis=-1).reshape(-1, 4).astype(np.int32)
    faces.setflags(write=False)
    return faces


def tubes(course: np.ndarray, radius: np.ndarray, sides: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Along courses (n, k, 3) with radii (n, k): points, normals and faces."""
    n, k = radius.shape
    points, arm, _ = rings(course, radius, sides)
    faces = lattice_faces(k, sides, closed=True) + (np.arange(n, dtype=np.int32) * k * sides)[:, None, None]
    return points.reshape(-1, 3).astype(np.float32), arm.reshape(-1, 3).astype(np.float32), faces.reshape(-1, 4)


def longer(course: np.ndarray, radius: np.ndarray, points: int) -> tuple[np.ndarray, np.ndarray]:
    """Courses and radii with another number of points: Catmull and Rom's cubics between those that there are."""
    k = radius.shape[1]
    padded = np.concatenate([2 * course[:, :1] - course[:, 1:2], course, 2 * course[:, -1:] - course[:, -2:-1]], axis=1)
    at = np.linspace(0, k - 1, points)
    i = np.minimum(at.astype(int), k - 2)
    t = (at - i)[:, None]
    p0, p1, p2, p3 = (padded[:, i + j] for j in range(4))
    curve = 0.5 * (2 * p1 + (p2 - p0) * t + (2 * p0 - 5 * p1 + 4 * p2 - p3) * t**2 + (3 * (p1 - p2) + p3 - p0) * t**3)
    thick = radius[:, i] * (1 - t[:, 0]) + radius[:, i + 1] * t[:, 0]
    return curve, thick


def ball(side: int) -> tuple[np.ndarray, np.ndarray]:
    """A unit ball of 6 side² quads: a cube's lattice, with its angles even. Seams share no points."""
    t = np.tan(np.linspace(-np.pi / 4, np.pi / 4, side + 1))
    u, v = np.meshgrid(t, t)
    one = np.ones_like(u)
    sheets = [(u, v, one), (-u, v, -one), (one, v, -u), (-one, v, u), (u, one, -v), (u, -one, v)]
    points = np.concatenate([unit(np.stack(sheet, axis=-1)).reshape(-1, 3) for sheet in sheets])
    face = lattice_faces(side + 1, side + 1)
    faces = np.concatenate([face + k * (side + 1) ** 2 for k in range(6)])
    return points, faces.astype(np.int32)


def normals(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Smooth ones, by area; points in one place (seams) share theirs."""
    a, b, c, d = (points[faces[:, k]].astype(np.float64) for k in range(4))
    flat = np.cross(c - a, d - b)
    fine = np.round((points - points.min(axis=0)) * (2**20 / max(np.ptp(points), 1e-30))).astype(np.int64)
    _, same = np.unique(fine[:, 0] | fine[:, 1] << 21 | fine[:, 2] << 42, return_inverse=True)
    sums = np.zeros((same.max() + 1, 3))
    for k in range(4):
        for axis in range(3):
            sums[:, axis] += np.bincount(same[faces[:, k]], flat[:, axis], minlength=len(sums))
    return unit(sums)[same].astype(np.float32)


def lattice_normals(points: np.ndarray) -> np.ndarray:
    """Of points (rows, columns, 3) with columns along x and rows along z, by differences of neighbours; (N, 3)."""
    along_z, along_x = np.gradient(points, axis=(0, 1))
    return unit(np.cross(along_z, along_x)).reshape(-1, 3).astype(np.float32)


def blade(rows: int, width: float, fold: float, droop: float, point: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """A leaf of 2 rows quads and length 1 along +z from the origin, its upper side to +y: folded along its rib."""
    t = np.linspace(0, 1, rows + 1)
    half = 0.5 * width * np.sin(np.pi * np.clip(t, 0.03, 1) ** (0.75 * point)) ** 0.8 + 0.01 * width
    y = -droop * t**2
    rib = np.stack([0 * t, y, t], axis=-1)
    left = np.stack([half, y + fold * half, t], axis=-1)
    right = np.stack([-half, y + fold * half, t], axis=-1)
    points = np.stack([left, rib, right], axis=1).reshape(-1, 3)
    return points.astype(np.float32), lattice_faces(rows + 1, 3)


def joined(parts: list[tuple[np.ndarray, np.ndarray, np.ndarray]]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(points, normals, faces) of several as one."""
    firsts = np.cumsum([0] + [len(points) for points, _, _ in parts[:-1]])
    return (
        np.concatenate([p for p, _, _ in parts]),
        np.concatenate([n for _, n, _ in parts]),
        np.concatenate([f + first for (_, _, f), first in zip(parts, firsts, strict=True)]).astype(np.int32),
    )


class Noise:
    """Smooth noise in [-1, 1] over space: values at lattice points by hashing, joined by quintics (Perlin 2002)."""

    def __init__(self, seed: int) -> None:
        self.seed = seed

    def __call__(self, p: np.ndarray) -> np.ndarray:
        flat = np.ascontiguousarray(p.reshape(-1, p.shape[-1]))
        out = np.empty(len(flat))
        for first in range(0, len(flat), PIECE):
            out[first : first + PIECE] = self.of(flat[first : first + PIECE])
        return out.reshape(p.shape[:-1])

    def of(self, p: np.ndarray) -> np.ndarray:
        cell = np.floor(p).astype(np.int64)
        f = p - cell
        w = f**3 * (f * (6 * f - 15) + 10)
        axes = range(p.shape[1])
        keys = [(cell[:, a] * PRIMES[a], (cell[:, a] + 1) * PRIMES[a]) for a in axes]
        shares = [(1 - w[:, a], w[:, a]) for a in axes]
        total = np.zeros(len(p))
        for corner in np.ndindex((2,) * p.shape[1]):
            key = functools.reduce(np.bitwise_xor, [keys[a][corner[a]] for a in axes])
            share = functools.reduce(np.multiply, [shares[a][corner[a]] for a in axes])
            total += share * (2 * hashed(key, self.seed) - 1)
        return total

    def fractal(self, p: np.ndarray, octaves: int, gain: float = 0.5, ridged: bool = False) -> np.ndarray:
        """Octaves of it in about [-1, 1]; ridged: creases where each changes its sign, in [0, 1] (Musgrave)."""
        total, amplitude, size = np.zeros(p.shape[:-1]), 1.0, 0.0
        for k in range(octaves):
            value = self(p * 2.03**k + 17.3 * k)
            total += amplitude * ((1 - np.abs(value)) ** 2 if ridged else value)
            size += amplitude
            amplitude *= gain
        return total / size
