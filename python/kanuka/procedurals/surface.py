"""Points on surfaces, and frames of curves: what hair, scatter and cloth share."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .._native import surface_mesh


@dataclass
class Samples:
    """Points spread over a surface."""

    P: np.ndarray
    N: np.ndarray
    st: np.ndarray
    primvars: dict[str, np.ndarray] = field(default_factory=dict)

    def take(self, which: np.ndarray) -> Samples:
        return Samples(self.P[which], self.N[which], self.st[which], {k: v[which] for k, v in self.primvars.items()})

    def factor(self, name: str) -> np.ndarray:
        """A primvar of the surface that scales something; 1 where it has none."""
        return np.ravel(self.primvars[name][:, :1]) if name in self.primvars else np.ones(len(self.P))


class Surface:
    """The triangles of an archive."""

    def __init__(self, path: str, edge: float = 0.0) -> None:
        mesh = surface_mesh(path, edge)
        self.P, self.N, self.st = mesh["P"].astype(np.float64), mesh["N"], mesh["st"]
        self.triangles, self.primvars = mesh["triangles"], mesh["primvars"]
        a, b, c = (self.P[self.triangles[:, k]] for k in range(3))
        self.areas = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
        self.area = float(self.areas.sum())

    def weights(self, primvar: str) -> np.ndarray:
        """Areas of triangles, times a primvar of the surface if it has it."""
        if primvar not in self.primvars:
            return self.areas
        return self.areas * np.clip(self.primvars[primvar][:, 0][self.triangles].mean(axis=1), 0, None)

    def sample(self, count: int, rng: np.random.Generator, weights: np.ndarray) -> Samples:
        """`count` points, one in each of as many equal parts of the area, in the order of the triangles."""
        sums = np.cumsum(weights)
        if count <= 0 or not sums[-1] > 0:
            return Samples(np.empty((0, 3)), np.empty((0, 3)), np.empty((0, 2)))
        places = (np.arange(count) + rng.random(count)) * (sums[-1] / count)
        t = self.triangles[np.minimum(np.searchsorted(sums, places), len(sums) - 1)]
        r, s = np.sqrt(rng.random(count)), rng.random(count)
        w = np.stack([1 - r, r * (1 - s), r * s], axis=1)[:, :, None]

        def blend(values: np.ndarray) -> np.ndarray:
            return (values[t] * w).sum(axis=1)

        return Samples(
            blend(self.P), unit(blend(self.N)), blend(self.st), {k: blend(v) for k, v in self.primvars.items()}
        )


def unit(v: np.ndarray) -> np.ndarray:
    return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-30)


def across(n: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two directions at right angles to each of `n` and to each other (Duff et al. 2017, without a branch)."""
    x, y, z = n[..., 0], n[..., 1], n[..., 2]
    sign = np.where(z < 0, -1.0, 1.0)
    a = -1 / (sign + z)
    b = x * y * a
    return (
        np.stack([1 + sign * x * x * a, sign * b, -sign * x], axis=-1),
        np.stack([b, sign + y * y * a, -y], axis=-1),
    )


def rings(course: np.ndarray, radius: np.ndarray, sides: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Around courses (n, k, 3) with radii (n, k): points and their directions from the course, (n, k, sides, 3), and
    angles (sides,). Frames are carried along, so that they do not twist."""
    tangent = np.empty_like(course)
    tangent[:, 1:-1] = course[:, 2:] - course[:, :-2]
    tangent[:, 0], tangent[:, -1] = course[:, 1] - course[:, 0], course[:, -1] - course[:, -2]
    tangent = unit(tangent)
    side = np.empty_like(course)
    side[:, 0] = across(tangent[:, 0])[0]
    for j in range(1, course.shape[1]):
        carried = side[:, j - 1] - tangent[:, j] * np.sum(side[:, j - 1] * tangent[:, j], axis=1)[:, None]
        side[:, j] = unit(carried)
    other = np.cross(tangent, side)
    angle = 2 * np.pi * np.arange(sides) / sides
    arm = np.cos(angle)[:, None] * side[:, :, None] + np.sin(angle)[:, None] * other[:, :, None]
    return course[:, :, None] + arm * radius[:, :, None, None], arm, angle


def cell_keys(cells: np.ndarray) -> np.ndarray:
    """One number for each cell of a lattice of integers."""
    c = cells.astype(np.int64)
    return (c[..., 0] * 73856093) ^ (c[..., 1] * 19349663) ^ (c[..., 2] * 83492791)


def hashed(keys: np.ndarray, salt: int) -> np.ndarray:
    """Numbers in [0, 1) that follow from keys alone (SplitMix64)."""
    with np.errstate(over="ignore"):
        z = keys.astype(np.uint64) + np.uint64((salt * 0x9E3779B97F4A7C15) & 0xFFFFFFFFFFFFFFFF)
        z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return ((z ^ (z >> np.uint64(31))) >> np.uint64(11)).astype(np.float64) * 2.0**-53


def nearest_feature(points: np.ndarray, size: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Worley 1996: the cell whose jittered feature point is nearest, as a key, and the distance to it."""
    cells = np.floor(points / size).astype(np.int64)
    best = np.full(len(points), np.inf)
    key = np.zeros(len(points), np.int64)
    for offset in np.stack(np.meshgrid(*[[-1, 0, 1]] * 3, indexing="ij"), axis=-1).reshape(-1, 3):
        here = cells + offset
        k = cell_keys(here)
        jitter = np.stack([hashed(k, 3 * seed + 7 * c + 1) for c in range(3)], axis=1)
        d = (((here + jitter) * size - points) ** 2).sum(axis=1)
        closer = d < best
        best[closer], key[closer] = d[closer], k[closer]
    return key, np.sqrt(best)


def close_pairs(points: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """All pairs of points nearer than `radius`, each once."""
    cells = np.floor(points / radius).astype(np.int64)
    cells -= cells.min(axis=0)
    size = cells.max(axis=0) + 3
    flat = ((cells[:, 0] + 1) * size[1] + cells[:, 1] + 1) * size[2] + cells[:, 2] + 1
    order = np.argsort(flat, kind="stable")
    flat = flat[order]
    firsts, seconds = [], []
    for dx, dy, dz in [
        (0, 0, 0),
        *((x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if (x, y, z) > (0, 0, 0)),
    ]:
        wanted = flat + (dx * size[1] + dy) * size[2] + dz
        begin, end = np.searchsorted(flat, wanted), np.searchsorted(flat, wanted, side="right")
        if (dx, dy, dz) == (0, 0, 0):
            begin = np.arange(len(flat)) + 1
        counts = np.maximum(end - begin, 0)
        i = np.repeat(np.arange(len(flat)), counts)
        j = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts) + np.repeat(begin, counts)
        near = ((points[order[i]] - points[order[j]]) ** 2).sum(axis=1) < radius * radius
        firsts.append(order[i[near]])
        seconds.append(order[j[near]])
    return np.concatenate(firsts), np.concatenate(seconds)


def spaced(points: np.ndarray, radius: float, rng: np.random.Generator) -> np.ndarray:
    """Indices of points that keep `radius` between them, in random order: dart throwing, all darts at once.

    A point stays if no neighbour that came before it stays. Rounds decide whatever can be decided.
    """
    rank = rng.permutation(len(points))
    a, b = close_pairs(points, radius)
    early, late = np.where(rank[a] < rank[b], a, b), np.where(rank[a] < rank[b], b, a)
    state = np.zeros(len(points), np.int8)  # 0 open, 1 stays, 2 goes
    while True:
        blocked = np.zeros(len(points), bool)
        blocked[late[state[early] == 0]] = True
        stays = (state == 0) & ~blocked
        if not stays.any():
            break
        state[stays] = 1
        loses = late[state[early] == 1]
        state[loses[state[loses] == 0]] = 2
        keep = (state[early] == 0) | (state[late] == 0)
        early, late = early[keep], late[keep]
    kept = np.flatnonzero(state == 1)
    return kept[np.argsort(rank[kept])]
