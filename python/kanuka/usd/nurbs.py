"""Rational B-splines (NURBS): the basis, and curves as Bézier pieces. Arrays in, arrays out.

Piegl and Tiller, The NURBS Book (1997): equations 2.5 (basis), 2.9 (derivatives), 4.1 (rational ones).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

RATIONAL_PIECES = 8  # cubic ones of a span of a curve: within 1e-5 of the radius of a quarter circle


@dataclass(frozen=True)
class Direction:
    """An order, knots and a range of a B-spline of `count` vertices."""

    order: int
    count: int
    knots: np.ndarray
    low: float
    high: float

    def __post_init__(self) -> None:
        if not 2 <= self.order <= self.count:
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

    def whole(self) -> bool:
        return self.low == self.knots[self.order - 1] and self.high == self.knots[self.count]

    def abscissae(self) -> np.ndarray:
        """Greville's: with these at its vertices a spline is its own parameter."""
        return np.lib.stride_tricks.sliding_window_view(self.knots[1:-1], self.order - 1).mean(-1)

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


def between(direction: Direction, values: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Values (…, S, K) at the ends of spans (empty ones have ends too), linearly between them."""
    knots = direction.knots[direction.order - 1 : direction.count + 1]
    after = np.clip(np.searchsorted(knots, at, side="right"), 1, len(knots) - 1)
    gap = knots[after] - knots[after - 1]
    share = np.clip((at - knots[after - 1]) / np.where(gap > 0, gap, 1), 0, 1)
    share = share[:, None]
    return values[..., after - 1, :] * (1 - share) + values[..., after, :] * share
