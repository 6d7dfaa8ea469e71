"""Rational B-splines (NURBS): the basis, curves as Bézier pieces, surfaces as grids. Arrays in, arrays out.

Piegl and Tiller, The NURBS Book (1997): equations 2.5 (basis), 2.9 (derivatives), 4.1 and 4.15 (rational ones).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

FINE = 2e-5  # how far a piece may be from the surface, of its size
MOST_PIECES = 256  # of a span
RATIONAL_PIECES = 8  # cubic ones of a span of a curve: within 1e-5 of the radius of a quarter circle
PROBES = 8  # of a span, by which its bend is measured


@dataclass(frozen=True)
class Direction:
    """An order, knots and a range of a B-spline of `count` vertices."""

    order: int
    count: int
    knots: np.ndarray
    low: float
    high: float

    def __post_init__(self) -> None:
        if not 1 <= self.order <= self.count:
            raise ValueError(f"an order of {self.order} for {self.count} vertices")
        if len(self.knots) != self.count + self.order:
            raise ValueError(
                f"{len(self.knots)} knots; an order of {self.order} and {self.count} vertices need "
                f"{self.count + self.order}"
            )
        if not np.isfinite(self.knots).all() or (np.diff(self.knots) < 0).any():
            raise ValueError("knots that do not increase")
        if not self.low < self.high:
            raise ValueError(f"a range from {self.low:g} to {self.high:g}")

    def spans(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Index, start and end of each stretch between knots that is in the range."""
        index = np.arange(self.order - 1, self.count)
        start = np.maximum(self.knots[index], self.low)
        end = np.minimum(self.knots[index + 1], self.high)
        kept = end > start
        return index[kept], start[kept], end[kept]

    def basis(self, span: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(S, count): weights of the vertices at parameters that are taken to be in the given spans, and their
        derivatives."""
        degree = self.order - 1
        local, lower = np.ones((len(at), 1)), np.zeros((len(at), 0))
        for p in range(1, degree + 1):
            lower = local
            local = np.zeros((len(at), p + 1))
            for i in range(p):
                left, right = self.knots[span - p + 1 + i], self.knots[span + 1 + i]
                share = lower[:, i] / (right - left)
                local[:, i] += (right - at) * share
                local[:, i + 1] += (at - left) * share
        slope = np.zeros((len(at), degree + 1))
        for i in range(degree):
            steep = degree * lower[:, i] / (self.knots[span + 1 + i] - self.knots[span - degree + 1 + i])
            slope[:, i] -= steep
            slope[:, i + 1] += steep
        full, derivative = np.zeros((len(at), self.count)), np.zeros((len(at), self.count))
        rows, columns = np.arange(len(at))[:, None], span[:, None] - degree + np.arange(degree + 1)
        full[rows, columns], derivative[rows, columns] = local, slope
        return full, derivative


def homogeneous(points: np.ndarray, weights: np.ndarray | None) -> np.ndarray:
    """(…, N, K + 1): points (…, N, K) times their weights (N), and these."""
    each = np.ones((*points.shape[:-1], 1))
    if weights is not None:
        each = each * weights[:, None]
    return np.concatenate([points * each, each], axis=-1)


def projected(values: np.ndarray, slopes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points and their derivatives."""
    point = values[..., :-1] / values[..., -1:]
    return point, (slopes[..., :-1] - point * slopes[..., -1:]) / values[..., -1:]


# ---- curves


def samples_of(direction: Direction, rational: bool) -> tuple[np.ndarray, np.ndarray]:
    """(M, 2): spans and parameters of the ends of the Bézier pieces of a curve. A span of a polynomial of degree 3 or
    less is one; of others each is fitted at its ends."""
    index, start, end = direction.spans()
    pieces = 1 if direction.order <= 4 and not rational else RATIONAL_PIECES
    step = np.linspace(0, 1, pieces + 1)
    knots = start[:, None] + (end - start)[:, None] * step
    ends = np.stack([knots[:, :-1], knots[:, 1:]], axis=-1).reshape(-1, 2)
    return np.repeat(index, pieces), ends


def bezier(direction: Direction, points: np.ndarray, rational: bool) -> np.ndarray:
    """(…, 3 M + 1, K): control points of the M cubic pieces of a curve of homogeneous points (…, N, K + 1)."""
    span, ends = samples_of(direction, rational)
    sides = []
    for at in ends.T:
        full, derivative = direction.basis(span, at)
        sides.append(projected(full @ points, derivative @ points))
    (begin, leaving), (finish, arriving) = sides
    third = ((ends[:, 1] - ends[:, 0]) / 3)[:, None]
    made = np.stack([begin, begin + leaving * third, finish - arriving * third], axis=-2)
    return np.concatenate([made.reshape(*points.shape[:-2], -1, made.shape[-1]), finish[..., -1:, :]], axis=-2)


def between(direction: Direction, values: np.ndarray, at: np.ndarray, axis: int = -2) -> np.ndarray:
    """Values at the ends of spans (along an axis; empty spans have ends too), linearly between them."""
    knots = direction.knots[direction.order - 1 : direction.count + 1]
    after = np.clip(np.searchsorted(knots, at, side="right"), 1, len(knots) - 1)
    gap = knots[after] - knots[after - 1]
    share = np.clip((at - knots[after - 1]) / np.where(gap > 0, gap, 1), 0, 1)
    values = np.moveaxis(values, axis, -1)
    return np.moveaxis(values[..., after - 1] * (1 - share) + values[..., after] * share, -1, axis)


# ---- surfaces


@dataclass(frozen=True)
class Grid:
    """A surface at the crossings of parameters; vertices are u fastest."""

    u: np.ndarray
    v: np.ndarray
    points: np.ndarray  # (…, V * U, 3)
    normals: np.ndarray
    weights: tuple[np.ndarray, np.ndarray]  # of vertices along u and v

    @property
    def faces(self) -> np.ndarray:
        """(F, 4), counterclockwise where u goes right and v up."""
        across = len(self.u)
        corner = (np.arange(len(self.v) - 1)[:, None] * across + np.arange(across - 1)).reshape(-1)
        return np.stack([corner, corner + 1, corner + across + 1, corner + across], axis=-1).astype(np.int32)

    def values(self, values: np.ndarray) -> np.ndarray:
        """Of values at the vertices, u fastest: those at the crossings."""
        u, v = self.weights
        return sum_over(values.reshape(*values.shape[:-2], v.shape[1], u.shape[1], -1), u, v)


def sum_over(values: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """(…, V * U, K) of vertices (…, Nv, Nu, K) by weights (U, Nu) and (V, Nv)."""
    found = np.einsum("vj,...jik,ui->...vuk", v, values, u, optimize=True)
    return found.reshape(*values.shape[:-3], -1, values.shape[-1])


def parameters(direction: Direction, pieces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Spans and parameters; each span in as many pieces as it is told."""
    index, start, end = direction.spans()
    span = np.repeat(index, pieces)
    first = np.cumsum(pieces) - pieces
    step = (np.arange(len(span)) - np.repeat(first, pieces)) / np.repeat(pieces, pieces)
    at = np.repeat(start, pieces) + step * np.repeat(end - start, pieces)
    return np.append(span, index[-1]), np.append(at, end[-1])


def bends(points: np.ndarray, spans: int) -> np.ndarray:
    """How far the middle of each two steps is from the line between their ends, at most: for each span of PROBES steps
    along the last axis but one."""
    middle = points[..., 1:-1, :] - (points[..., :-2, :] + points[..., 2:, :]) / 2
    far = np.sqrt((middle**2).sum(-1)).reshape(-1, middle.shape[-2]).max(0)
    starts = np.arange(spans) * PROBES
    inside = starts[:, None] + np.arange(PROBES - 1)
    return far[inside].max(1)


def grid(u: Direction, v: Direction, points: np.ndarray) -> Grid:
    """A surface of homogeneous points (…, Nv, Nu, 4), fine enough that its facets are not seen."""
    probes = [parameters(d, np.full(len(d.spans()[0]), PROBES)) for d in (u, v)]
    (bu, _), (bv, _) = (d.basis(*probe) for d, probe in zip((u, v), probes, strict=True))
    rough = sum_over(points, bu, bv)
    rough = (rough[..., :3] / rough[..., 3:]).reshape(*points.shape[:-3], len(bv), len(bu), 3)
    size = np.linalg.norm(np.ptp(rough.reshape(-1, 3), axis=0))
    if not np.isfinite(size):
        raise ValueError("weights that place it nowhere")
    pieces = []
    for direction, along in ((u, rough), (v, np.swapaxes(rough, -3, -2))):
        # Halving steps quarters their distance.
        wanted = PROBES / 2 * np.sqrt(bends(along, len(direction.spans()[0])) / max(FINE * size, 1e-30))
        pieces.append(np.clip(np.ceil(wanted), 1, MOST_PIECES).astype(int))
    at_u, at_v = parameters(u, pieces[0]), parameters(v, pieces[1])
    made, normals, weights = evaluated(u, v, points, at_u, at_v)
    lengths = np.linalg.norm(normals, axis=-1, keepdims=True)
    flat = lengths[..., 0] <= 1e-9 * lengths.max(initial=0)
    if flat.any():
        # At poles, where a side of the surface is one point, normals are those a little further in.
        inner = [(span, at + (d.low + d.high - 2 * at) * 1e-5) for d, (span, at) in ((u, at_u), (v, at_v))]
        nearby = evaluated(u, v, points, *inner)[1]
        normals = np.where(flat[..., None], nearby, normals)
        lengths = np.linalg.norm(normals, axis=-1, keepdims=True)
    return Grid(at_u[1], at_v[1], made, normals / np.maximum(lengths, 1e-30), weights)


def evaluated(u: Direction, v: Direction, points: np.ndarray, at_u, at_v):
    """Points, normals (of any length), and weights of the vertices."""
    (bu, du), (bv, dv) = u.basis(*at_u), v.basis(*at_v)
    values = sum_over(points, bu, bv)
    made, along_u = projected(values, sum_over(points, du, bv))
    _, along_v = projected(values, sum_over(points, bu, dv))
    return made, np.cross(along_u, along_v), (bu, bv)
