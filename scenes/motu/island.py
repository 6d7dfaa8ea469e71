"""The island: how high it is, what may stand where. Metres, y up, the sea at 0, the beach of the picture to +z."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

SIDE = 2560.0  # of the square that has a ground, in metres
CELL = 3.2  # of the lattice that the shape is made on
BASE = round(SIDE / CELL) + 1
COARSE = 161  # lattice of distances from the shore

# Height over the way inland from the shore: open sea, reef, lagoon, beach, dunes, plain.
PROFILE = np.array(
    [
        [-900, -34], [-300, -30], [-240, -14], [-205, -3.2], [-186, -0.9], [-165, -1.5], [-130, -2.9], [-70, -2.6],
        [-30, -1.35], [-10, -0.5], [0, 0.0], [8, 0.55], [18, 1.35], [30, 2.2], [42, 2.6], [70, 2.9], [110, 5.0],
        [170, 10], [260, 20], [420, 34], [700, 40],
    ]
)  # fmt: skip


def spline(count: int, size: int) -> tuple[np.ndarray, np.ndarray]:
    """`count` places over a row of `size` numbers: the first of four for each, and the weights of a cubic B-spline."""
    at = np.linspace(0, size - 1, count)
    first = np.minimum(at.astype(int), size - 2)
    t = at - first
    weights = np.stack([(1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, -3 * t**3 + 3 * t**2 + 3 * t + 1, t**3], axis=1) / 6
    return first, weights


def resampled(values: np.ndarray, rows: int, columns: int) -> np.ndarray:
    """A smooth surface over a lattice of numbers, at another lattice's points."""

    def tall(values: np.ndarray, count: int) -> np.ndarray:
        padded = np.pad(values, ((1, 1), (0, 0)), mode="edge")
        first, weights = spline(count, values.shape[0])
        return sum(weights[:, k, None].astype(np.float32) * padded[first + k] for k in range(4))

    return tall(tall(values.astype(np.float32), rows).T, columns).T


def noise(rng: np.random.Generator, cells: int, octaves: int, gain: float = 0.5, ridged: bool = False) -> np.ndarray:
    """Over the base lattice: `cells` waves to a side in the first octave. In about [-1, 1]; ridged: in [0, 1]."""
    total, amplitude, size = np.zeros((BASE, BASE)), 1.0, 0.0
    for _ in range(octaves):
        wave = np.clip(1.6 * resampled(rng.uniform(-1, 1, (cells, cells)), BASE, BASE), -1, 1)
        total += amplitude * ((1 - np.abs(wave)) ** 2 if ridged else wave)
        size += amplitude
        amplitude *= gain
        cells *= 2
    return total / size


def smooth(low: float, high: float, x: np.ndarray) -> np.ndarray:
    t = np.clip((x - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


@dataclass
class Ground:
    """Heights of a lattice of points over the square, as they are traced: quads, bilinear in between."""

    heights: np.ndarray  # (rows along z, columns along x)

    def __post_init__(self) -> None:
        self.heights = np.ascontiguousarray(self.heights)

    def axes(self) -> tuple[np.ndarray, np.ndarray]:
        rows, columns = self.heights.shape
        return np.linspace(-SIDE / 2, SIDE / 2, columns), np.linspace(-SIDE / 2, SIDE / 2, rows)

    def height(self, x: np.ndarray, z: np.ndarray) -> np.ndarray:
        rows, columns = self.heights.shape
        u = np.clip((x / SIDE + 0.5) * (columns - 1), 0, columns - 1.001)
        v = np.clip((z / SIDE + 0.5) * (rows - 1), 0, rows - 1.001)
        i, j = u.astype(np.int64), v.astype(np.int64)
        f, g = u - i, v - j
        at = j * columns + i
        flat = self.heights.reshape(-1)
        low = flat[at] * (1 - f) + flat[at + 1] * f
        return low * (1 - g) + (flat[at + columns] * (1 - f) + flat[at + columns + 1] * f) * g

    def normals(self) -> np.ndarray:
        rows, columns = self.heights.shape
        dz, dx = np.gradient(self.heights, SIDE / (rows - 1), SIDE / (columns - 1))
        n = np.stack([-dx, np.ones_like(dx), -dz], axis=-1)
        return (n / np.linalg.norm(n, axis=-1, keepdims=True)).astype(np.float32)


class Island:
    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng([seed, 1])
        axis = np.linspace(-SIDE / 2, SIDE / 2, BASE)
        self.x, self.z = np.meshgrid(axis, axis)
        self.inland = self.from_shore(rng)
        self.base = self.shape(rng)
        dz, dx = np.gradient(self.base, CELL)
        self.slope = np.hypot(dx, dz)
        self.patches = noise(rng, 40, 4)  # where plants of a kind stand together
        self.other_patches = noise(rng, 60, 4)

    def from_shore(self, rng: np.random.Generator) -> np.ndarray:
        """Metres inland from the water's edge; below 0 in the sea."""
        angle = np.linspace(-np.pi, np.pi, 2400, endpoint=False)
        shore = 1 / np.sqrt((np.cos(angle) / 640) ** 2 + (np.sin(angle) / 430) ** 2)
        for k in range(2, 9):
            shore += 46 / k * np.cos(k * angle + rng.uniform(0, 2 * np.pi))
        bay = np.abs((angle - np.pi / 2 + np.pi) % (2 * np.pi) - np.pi)  # from the beach of the picture
        shore -= 54 * np.exp(-((bay / 0.3) ** 2)) - 40 * np.exp(-(((bay - 0.62) / 0.13) ** 2))
        line = (shore * np.exp(1j * angle)).astype(np.complex64)
        axis = np.linspace(-SIDE / 2, SIDE / 2, COARSE)
        place = (axis + 1j * axis[:, None]).astype(np.complex64)
        distance = np.stack([np.abs(row[:, None] - line).min(axis=1) for row in place])
        inside = np.abs(place) < np.interp(np.angle(place), angle, shore, period=2 * np.pi)
        return resampled(np.where(inside, distance, -distance), BASE, BASE) + 5 * noise(rng, 48, 3)

    def shape(self, rng: np.random.Generator) -> np.ndarray:
        inland = self.inland
        height = np.interp(inland, PROFILE[:, 0], PROFILE[:, 1])
        ridges = noise(rng, 12, 5, 0.5, ridged=True)
        large = 0.5 + 0.5 * noise(rng, 5, 2)
        peak = np.exp(-(((self.x - 210) / 260) ** 2) - ((self.z + 70) / 190) ** 2)
        rise = smooth(95, 330, inland)
        height += rise * (24 * large + 250 * ridges**1.6 * (0.25 + peak) + 70 * peak)
        dunes = smooth(14, 34, inland) * (1 - smooth(80, 130, inland)) * smooth(80, 200, self.x)
        height += dunes * (1.2 + 3.2 * noise(rng, 56, 3) + 1.2 * noise(rng, 140, 2))
        height += 0.35 * noise(rng, 120, 3) * smooth(8, 40, inland)
        bed = smooth(-4, -40, inland)  # holes and humps of the lagoon's floor
        height += bed * 0.55 * noise(rng, 60, 4)
        points = np.exp(-(((np.abs(self.x + 12) - 215) / 46) ** 2)) * smooth(100, 300, self.z)
        height += points * smooth(-22, 30, inland) * (1 - smooth(70, 120, inland)) * (2.5 + 5 * noise(rng, 64, 4))
        return height.astype(np.float32)

    def ground(self, rows: int, columns: int) -> Ground:
        """As a lattice of rows × columns quads."""
        return Ground(resampled(self.base, rows + 1, columns + 1).astype(np.float32))
