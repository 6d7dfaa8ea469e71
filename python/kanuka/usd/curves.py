"""BasisCurves, HermiteCurves and Points."""

from __future__ import annotations

import numpy as np
from pxr import UsdGeom

from .arrays import class_of, is_list, primvar, rows, whole
from .geometry import Shapes
from .items import Item, primvar_of

BASES = {"bezier": "bezier", "bspline": "b-spline", "catmullRom": "catmull-rom"}
DEFAULT_WIDTH = 1.0  # of what has none


def counts_of(shapes: Shapes, item: Item, points: np.ndarray) -> np.ndarray:
    """Points of each curve."""
    counts = whole(item.value("curveVertexCounts", shapes.shutter.frame))
    if (counts < 0).any() or counts.sum() != points.shape[-2]:
        raise ValueError(f"curveVertexCounts add up to {counts.sum()}, but there are {points.shape[-2]} points")
    if not np.isfinite(points).all():
        raise ValueError("some of its points are no numbers")
    return counts


def detail(shapes: Shapes, item: Item, name: str, kind: str) -> tuple[str, np.ndarray] | None:
    """Widths or normals: storage class (empty: none was authored, and the number of values tells) and values. A primvar
    of the name goes over the attribute (UsdGeomCurves, UsdGeomPoints, UsdGeomPointBased)."""
    frame = shapes.shutter.frame
    if (found := primvar_of(item, name)) is not None:
        for key, values in primvar(found, "it", kind, frame).items():
            return key.split()[0], values
    values = item.value(name, frame)
    if not is_list(values):
        return None
    authored = item.prim.GetAttribute(name).GetMetadata("interpolation")
    return class_of(authored or ""), rows(values, 1 if kind == "float" else 3)


def strands(shapes: Shapes, item: Item) -> tuple[dict[str, np.ndarray], dict[str, object]]:
    """Primvars of curves and points, their widths and normals among them; and their looks."""
    made = shapes.material_of(item)
    primvars = shapes.primvars(item, [made]) | shapes.layers(item)
    storage, widths = detail(shapes, item, "widths", "float") or ("constant", np.full((1, 1), DEFAULT_WIDTH))
    primvars[f"{storage} float width".strip()] = widths
    if (normals := detail(shapes, item, "normals", "normal")) is not None:
        primvars[f"{normals[0]} normal N".strip()] = normals[1]
    return primvars, shapes.looks(item, made)


def add_basis_curves(shapes: Shapes, place, item: Item) -> None:
    frame = shapes.shutter.frame
    points = shapes.shutter.points(item, shapes.say)
    if points is None or not points.shape[-2]:
        return
    counts = counts_of(shapes, item, points)
    cubic = item.value("type", frame) == UsdGeom.Tokens.cubic
    basis = BASES.get(str(item.value("basis", frame)), "bezier") if cubic else "linear"
    wrap = item.value("wrap", frame)
    primvars, looks = strands(shapes, item)
    if wrap == UsdGeom.Tokens.pinned and basis in ("b-spline", "catmull-rom"):
        points, counts, primvars = pinned(points, counts, primvars)
    place.add_curves(points, counts, basis=basis, periodic=wrap == UsdGeom.Tokens.periodic, primvars=primvars, **looks)


def pinned(points: np.ndarray, counts: np.ndarray, primvars: dict[str, np.ndarray]):
    """With a point more at each end, through which curves begin and end where their first and last points are, and the
    values of points with them. There are as many segments' ends as before, so `varying` values stay."""
    if (counts < 2).any():
        raise ValueError("pinned curves of fewer than two points")
    total = int(counts.sum())
    longer = counts + 2
    ends = np.cumsum(longer)
    firsts, lasts = np.cumsum(counts) - counts, np.cumsum(counts) - 1
    own = np.ones(ends[-1], dtype=bool)
    own[ends - longer] = own[ends - 1] = False

    def extended(values: np.ndarray) -> np.ndarray:
        out = np.empty((*values.shape[:-2], len(own), values.shape[-1]), dtype=np.float32)
        out[..., own, :] = values
        out[..., ends - longer, :] = 2 * values[..., firsts, :] - values[..., firsts + 1, :]
        out[..., ends - 1, :] = 2 * values[..., lasts, :] - values[..., lasts - 1, :]
        return out

    of_points = ("vertex ", "float width", "normal N")  # the last two: of no class
    made = {
        key: extended(v) if key.startswith(of_points) and v.shape[-2] == total else v for key, v in primvars.items()
    }
    return extended(points), longer, made


def add_hermite_curves(shapes: Shapes, place, item: Item) -> None:
    """As Bézier curves, which are the same."""
    points = shapes.shutter.points(item, shapes.say)
    if points is None or not points.shape[-2]:
        return
    counts = counts_of(shapes, item, points)
    if (counts < 2).any():
        raise ValueError("Hermite curves of fewer than two points")
    tangents = shapes.shutter.values(item, "tangents", 3)
    if tangents is None or tangents.shape[-2] != points.shape[-2]:
        have = 0 if tangents is None else tangents.shape[-2]
        raise ValueError(f"{have} tangents for {points.shape[-2]} points")
    points, tangents = np.broadcast_arrays(points, tangents)
    # A point with its handles before and after it; the first curve's first handle and its last one are none.
    handles = np.stack([points - tangents / 3, points, points + tangents / 3], axis=-2)
    flat = handles.reshape(*points.shape[:-2], -1, 3)
    ends = 3 * np.cumsum(counts)
    kept = np.ones(ends[-1], dtype=bool)
    kept[ends - 3 * counts] = kept[ends - 1] = False
    primvars, looks = strands(shapes, item)
    # USD: values at points go along segments linearly, for want of tangents of their own.
    primvars = {key.replace("vertex ", "varying ", 1): values for key, values in primvars.items()}
    place.add_curves(flat[..., kept, :], 3 * counts - 2, basis="bezier", primvars=primvars, **looks)


def add_points(shapes: Shapes, place, item: Item) -> None:
    points = shapes.shutter.points(item, shapes.say)
    if points is None or not points.shape[-2]:
        return
    if not np.isfinite(points).all():
        raise ValueError("some of its points are no numbers")
    primvars, looks = strands(shapes, item)
    # Points with normals are disks across them; UsdGeomPoints leaves the shape to the renderer.
    shape = "disk" if any(key.endswith("normal N") for key in primvars) else "sphere"
    place.add_points(points, shape=shape, primvars=primvars, **looks)
