"""NurbsCurves, which become cubic Bézier curves; and what NurbsPatch reads alike."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .arrays import whole
from .curves import counts_of, strands
from .geometry import Shapes, shown
from .items import Item
from .nurbs import Direction, between, bezier, homogeneous, samples_of


def doubles(item: Item, name: str, frame, width: int = 1) -> np.ndarray | None:
    values = item.value(name, frame)
    return None if values is None or not len(values) else np.asarray(values, dtype=np.float64).reshape(-1, width)


def weights_of(item: Item, frame, count: int) -> np.ndarray | None:
    """None: all are one."""
    weights = doubles(item, "pointWeights", frame)
    if weights is None or (weights == 1).all():
        return None
    if len(weights) != count:
        raise ValueError(f"{len(weights)} pointWeights for {count} points")
    if not np.isfinite(weights).all() or (weights <= 0).any():
        raise ValueError("some of its pointWeights are not positive")
    return weights[:, 0]


def direction(order: int, count: int, knots: np.ndarray, bounds: np.ndarray | None) -> Direction:
    """All of the curve, or the part of it that a range says."""
    if not 1 <= order <= count or len(knots) != count + order:
        return Direction(order, count, knots, 0, 1)  # which raises what is wrong
    low, high = knots[order - 1], knots[count]
    if bounds is not None:
        low, high = max(low, bounds[0]), min(high, bounds[1])
    return Direction(order, count, knots, float(low), float(high))


@dataclass
class Batch:
    """Curves of one order, number of vertices, knots and range: `which` of all."""

    direction: Direction
    which: np.ndarray
    vertices: np.ndarray  # (curves, count): indices of points


def batches(item: Item, frame, counts: np.ndarray) -> list[Batch]:
    orders, knots = whole(item.value("order", frame)), doubles(item, "knots", frame)
    ranges = doubles(item, "ranges", frame, 2)
    if len(orders) != len(counts):
        raise ValueError(f"{len(orders)} orders for {len(counts)} curves")
    have = 0 if knots is None else len(knots)
    if knots is None or have != (counts + orders).sum():
        raise ValueError(f"{have} knots; its curves need {(counts + orders).sum()}")
    if ranges is not None and len(ranges) != len(counts):
        raise ValueError(f"{len(ranges)} ranges for {len(counts)} curves")
    points, firsts = np.cumsum(counts) - counts, np.cumsum(counts + orders) - counts - orders
    made = []
    for order, count in np.unique(np.stack([orders, counts], axis=1), axis=0).tolist():
        alike = np.flatnonzero((orders == order) & (counts == count))
        own = knots[firsts[alike, None] + np.arange(order + count), 0]
        if ranges is not None:
            own = np.concatenate([own, ranges[alike]], axis=1)
        kinds, member = np.unique(own, axis=0, return_inverse=True)
        for kind, values in enumerate(kinds):
            which = alike[member.reshape(-1) == kind]
            bounds = values[-2:] if ranges is not None else None
            made.append(
                Batch(
                    direction(order, count, values[: order + count], bounds),
                    which,
                    points[which, None] + np.arange(count),
                )
            )
    return made


@dataclass
class Pieces:
    """Cubic Bézier curves that NURBS became. `at`: for each batch, where the control points of its curves are."""

    made: list[Batch]
    rational: bool
    counts: np.ndarray

    def __post_init__(self) -> None:
        for batch in self.made:
            self.counts[batch.which] = 3 * len(samples_of(batch.direction, self.rational)[0]) + 1

    def of_vertices(self, values: np.ndarray, weights: np.ndarray | None = None) -> np.ndarray:
        """(…, N, K) at the vertices → (…, M, K) at control points."""
        starts = np.cumsum(self.counts) - self.counts
        out = np.empty((*values.shape[:-2], int(self.counts.sum()), values.shape[-1]))
        whole_ = homogeneous(values, weights)
        for batch in self.made:
            found = bezier(batch.direction, whole_[..., batch.vertices, :], self.rational)
            out[..., starts[batch.which, None] + np.arange(found.shape[-2]), :] = found
        return out

    def of_ends(self, values: np.ndarray) -> np.ndarray | None:
        """At the ends of spans → at the ends of pieces; None: they are not as many."""
        spans = np.empty(len(self.counts), dtype=int)
        for batch in self.made:
            spans[batch.which] = batch.direction.count - batch.direction.order + 2
        if spans.sum() != len(values):
            return None
        lengths = (self.counts - 1) // 3 + 1
        froms, tos = np.cumsum(spans) - spans, np.cumsum(lengths) - lengths
        out = np.empty((int(lengths.sum()), values.shape[-1]), dtype=np.float32)
        for batch in self.made:
            ends = samples_of(batch.direction, self.rational)[1]
            given = values[froms[batch.which, None] + np.arange(spans[batch.which[0]])]
            found = between(batch.direction, given, np.append(ends[:, 0], ends[-1, 1]))
            out[tos[batch.which, None] + np.arange(found.shape[-2])] = found
        return out


def add_nurbs_curves(shapes: Shapes, place, item: Item) -> None:
    frame = shapes.shutter.frame
    points = shapes.shutter.points(item, shapes.say)
    if points is None or not points.shape[-2]:
        return
    counts = counts_of(shapes, item, points)
    weights = weights_of(item, frame, int(counts.sum()))
    pieces = Pieces(batches(item, frame, counts), weights is not None, np.empty(len(counts), dtype=np.int32))
    primvars, looks = strands(shapes, item)
    converted = {}
    for key, values in primvars.items():
        storage, _, rest = key.partition(" ")
        if storage in ("constant", "uniform") or len(values) == 1:
            converted[key] = values
            continue
        if storage not in ("vertex", "varying"):  # of no class that was authored
            rest = key
            if len(values) == len(counts) != counts.sum():
                converted[f"uniform {key}"] = values
                continue
        if storage != "varying" and len(values) == counts.sum():
            converted[f"vertex {rest}"] = pieces.of_vertices(values)
        elif storage != "vertex" and (found := pieces.of_ends(values)) is not None:
            converted[f"varying {rest}"] = found
        else:
            shapes.say(
                "warning",
                f"{item.path}: {len(values)} values of {shown(rest)} fit nothing of its curves",
            )
    place.add_curves(pieces.of_vertices(points, weights), pieces.counts, basis="bezier", primvars=converted, **looks)
