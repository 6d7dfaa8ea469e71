"""Where things stand: how many of a kind each cell of a lattice has, and matrices of single things."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kanuka.procedurals.surface import spaced

CHUNK = 1 << 20  # things at a time: what is worked on fits into caches and memory


@dataclass(frozen=True)
class Cells:
    """A lattice of cells in x and z, and how many things each holds: numbers that need not be whole."""

    low: tuple[float, float]  # x and z of its first corner
    size: float  # of a cell
    many: np.ndarray  # (rows along z, columns along x)


def filled(room: np.ndarray, liked: np.ndarray, count: float) -> np.ndarray:
    """`count` things over cells of which each has room for some: those that are liked are filled first.

    A cell gets room (1 - exp(-k liked)): for few things in proportion to room times liking, for many up to its room.
    """
    out = np.zeros(room.shape)
    some = room > 0
    if count <= 0 or not some.any():
        return out
    room, liked = room[some], liked[some]
    room = room * max(1.0, 1.15 * count / room.sum())  # there is no less room than things
    low, high = -40.0, 40.0
    for _ in range(50):
        middle = 0.5 * (low + high)
        if -(room * np.expm1(-np.exp(middle) * liked)).sum() < count:
            low = middle
        else:
            high = middle
    many = -room * np.expm1(-np.exp(high) * liked)
    out[some] = many * (count / many.sum())
    return out


def scattered(cells: Cells, count: int, rng: np.random.Generator) -> np.ndarray:
    """x and z of `count` things, (count, 2) float64, cell by cell: stratified, so each cell gets what it should."""
    sums = np.cumsum(cells.many.reshape(-1))
    if count == 0 or not sums[-1] > 0:
        return np.zeros((0, 2))
    at = (np.arange(count) + rng.random(count)) * (sums[-1] / count)
    cell = np.minimum(np.searchsorted(sums, at, side="right"), len(sums) - 1)
    row, column = np.divmod(cell, cells.many.shape[1])
    inside = rng.random((count, 2))
    return np.array(cells.low) + cells.size * (np.stack([column, row], axis=1) + inside)


def apart(cells: Cells, count: int, distance: float, rng: np.random.Generator) -> np.ndarray:
    """The same of things that keep a distance: darts, of which those stay that fall far enough from earlier ones.

    Where there is no room for so many they come nearer.
    """
    if count == 0 or distance <= 0:
        return scattered(cells, count, rng)
    while True:
        darts = scattered(cells, 2 * count + 8, rng)
        kept = spaced(np.insert(darts, 1, 0.0, axis=1), distance, rng)
        if len(kept) >= count:
            return darts[kept[:count]]
        distance *= 0.85


def matrices(
    where: np.ndarray, turn: np.ndarray, scale: np.ndarray, lean: np.ndarray | None = None, up: np.ndarray | None = None
) -> np.ndarray:
    """(N, 3, 4) float32: turned about y by `turn`, then y goes along `up`, or y tilted by lean (N, 2) in x and z."""
    n = len(where)
    out = np.zeros((n, 3, 4), np.float32)
    if up is None:
        up = np.tile(np.array([0.0, 1, 0], np.float32), (n, 1))
        if lean is not None:
            up[:, 0], up[:, 2] = lean[:, 0], lean[:, 1]
    up = up / np.linalg.norm(up, axis=1, keepdims=True)
    c, s = np.cos(turn), np.sin(turn)
    # The shortest way from y to up takes x and z along: (a, b, c) of up give the columns below.
    a, b, d = up[:, 0], up[:, 1], up[:, 2]
    k = 1 / (1 + np.maximum(b, -0.999))
    x = np.stack([1 - a * a * k, -a, -a * d * k], axis=1)
    z = np.stack([-a * d * k, -d, 1 - d * d * k], axis=1)
    scale = np.asarray(scale, np.float32)
    scales = scale if scale.ndim == 2 else np.repeat(scale[:, None], 3, axis=1)
    out[:, :, 0] = (x * c[:, None] - z * s[:, None]) * scales[:, :1]
    out[:, :, 1] = up * scales[:, 1:2]
    out[:, :, 2] = (x * s[:, None] + z * c[:, None]) * scales[:, 2:]
    out[:, :, 3] = where
    return out


def frames(where: np.ndarray, along: np.ndarray, up: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """(N, 3, 4): a thing's z goes along `along`, its y as near to `up` as that allows."""
    z = along / np.linalg.norm(along, axis=1, keepdims=True)
    x = np.cross(up, z)
    x /= np.maximum(np.linalg.norm(x, axis=1, keepdims=True), 1e-9)
    out = np.stack([x, np.cross(z, x), z, where], axis=2)
    out[:, :, :3] *= np.asarray(scale)[:, None, None]
    return out.astype(np.float32)
