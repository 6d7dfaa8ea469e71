"""NurbsPatch, with its trim curves. uForm and vForm change nothing: points and knots are those of a closed surface, and
the forms say so to programs that model (UsdGeomNurbsPatch)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pxr import UsdGeom

from kanuka.looks.rsl import halves

from .arrays import whole
from .geometry import ST, Shapes
from .items import Item, primvar_of
from .nurbs import Direction, bezier, homogeneous
from .splines import direction, doubles, weights_of

Curve = tuple[np.ndarray, np.ndarray]  # homogeneous points, (N, 3), and knots


def patch_direction(item: Item, frame, name: str) -> Direction:
    order, count = item.value(f"{name}Order", frame), item.value(f"{name}VertexCount", frame)
    knots, bounds = doubles(item, f"{name}Knots", frame), item.value(f"{name}Range", frame)
    if order is None or count is None or knots is None:
        raise ValueError(f"no {name}Order, {name}VertexCount or {name}Knots")
    try:
        return direction(int(order), int(count), knots[:, 0], None if bounds is None else np.array(bounds))
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None


def add_nurbs_patch(shapes: Shapes, place, item: Item) -> None:
    frame = shapes.shutter.frame
    points = shapes.shutter.points(item, shapes.say)
    if points is None or not points.shape[-2]:
        return
    u, v = (patch_direction(item, frame, name) for name in "uv")
    if points.shape[-2] != u.count * v.count:
        raise ValueError(f"{points.shape[-2]} points; it has {u.count} by {v.count} vertices")
    if not np.isfinite(points).all():
        raise ValueError("some of its points are no numbers")
    if (weights := weights_of(item, frame, u.count * v.count)) is not None:
        points = homogeneous(points, weights)
    made = shapes.material_of(item)
    looks = shapes.looks(item, made)
    if item.value("orientation", frame) == UsdGeom.Tokens.leftHanded:
        looks["reverse_orientation"] = True
    place.add_nurbs(
        # The vertices are u fastest, as RenderMan's and USD's imaging have them.
        points.reshape(*points.shape[:-2], v.count, u.count, points.shape[-1]),
        u.knots,
        v.knots,
        u_range=(u.low, u.high),
        v_range=(v.low, v.high),
        trim=trim_of(shapes, item),
        primvars=primvars_of(shapes, item, u, v, made),
        **looks,
    )


def primvars_of(shapes: Shapes, item: Item, u: Direction, v: Direction, made) -> dict[str, np.ndarray]:
    """As RenderMan has them: `vertex` of each vertex; `varying` of the corners of spans, empty ones as well; `uniform`
    of each span. Where there is no st, it goes from 0 to 1."""
    along, up = u.count - u.order + 1, v.count - v.order + 1
    corners = (along + 1) * (up + 1)
    sizes = {"vertex": u.count * v.count, "varying": corners, "facevarying": corners, "uniform": along * up}
    found = shapes.fitting(item, shapes.primvars(item, [made]) | shapes.layers(item), sizes)
    for name, (ours, kind) in made.primvars.items():
        if name == "st" and kind == "float2" and primvar_of(item, *ST) is None:
            st = np.meshgrid(*((d.abscissae() - d.low) / (d.high - d.low) for d in (u, v)))
            for half, at in zip(halves(ours), st, strict=True):
                found[f"vertex float {half}"] = at.reshape(-1)
    return found


# ---- trim curves


@dataclass
class Trim:
    """As UsdGeomNurbsPatch has them: curves of all loops, one after the other."""

    loops: np.ndarray
    orders: np.ndarray
    counts: np.ndarray
    knots: np.ndarray
    points: np.ndarray  # (u w, v w, w)
    ranges: np.ndarray | None

    def __post_init__(self) -> None:
        number = int(self.loops.sum())
        if (self.loops < 1).any():
            raise ValueError("trimCurve:counts has loops of no curves")
        for name, have, need in (
            ("orders", len(self.orders), number),
            ("vertexCounts", len(self.counts), number),
            ("ranges", number if self.ranges is None else len(self.ranges), number),
            ("points", len(self.points), self.counts.sum()),
            ("knots", len(self.knots), self.counts.sum() + self.orders.sum()),
        ):
            if have != need:
                raise ValueError(f"trimCurve:{name} has {have} values; its {number} curves need {need}")
        if not np.isfinite(self.points).all() or (self.points[:, 2] <= 0).any():
            raise ValueError("trimCurve:points are not all finite, of positive weights")

    def curve(self, index: int, point: int, knot: int) -> Curve:
        """`point`, `knot`: where those of the curve start."""
        order, count = int(self.orders[index]), int(self.counts[index])
        points, knots = self.points[point : point + count], self.knots[knot : knot + count + order]
        d = direction(order, count, knots, None if self.ranges is None else self.ranges[index])
        if d.whole():
            return points, knots
        cubic = bezier(d, points, bool(np.ptp(points[:, 2])))
        pieces = len(cubic) // 3
        ends = np.concatenate([np.zeros(4), np.repeat(np.arange(1.0, pieces), 3), np.full(4, pieces)])
        return homogeneous(cubic, None), ends

    def made(self) -> list[list[Curve]]:
        points = np.cumsum(self.counts) - self.counts
        knots = points + np.cumsum(self.orders) - self.orders
        curves = [self.curve(i, int(p), int(k)) for i, (p, k) in enumerate(zip(points, knots, strict=True))]
        ends = np.cumsum(self.loops).tolist()
        return [curves[end - count : end] for end, count in zip(ends, self.loops.tolist(), strict=True)]


def trim_of(shapes: Shapes, item: Item) -> list[list[Curve]]:
    """Loops of curves; what is within them stays. Bad ones are told, and the patch is whole."""
    frame = shapes.shutter.frame
    loops = whole(item.value("trimCurve:counts", frame))
    if not len(loops):
        return []

    def numbers(name: str, width: int) -> np.ndarray:
        found = doubles(item, f"trimCurve:{name}", frame, width)
        return np.zeros((0, width)) if found is None else found

    ranges = doubles(item, "trimCurve:ranges", frame, 2)
    orders, counts = (whole(item.value(f"trimCurve:{name}", frame)) for name in ("orders", "vertexCounts"))
    try:
        return Trim(loops, orders, counts, numbers("knots", 1)[:, 0], numbers("points", 3), ranges).made()
    except ValueError as error:
        shapes.say("warning", f"{item.path}: {error}. It is not trimmed")
        return []
