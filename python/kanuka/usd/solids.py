"""Cubes, spheres, cylinders, cones, capsules and planes."""

from __future__ import annotations

import math

import numpy as np

from .geometry import Shapes, shown
from .items import Item

# From the z axis, about which quadrics lie, to USD's axis.
AXES = {
    "X": np.array([[0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]], dtype=float),
    "Y": np.array([[0, 1, 0, 0], [0, 0, 1, 0], [1, 0, 0, 0], [0, 0, 0, 1]], dtype=float),
    "Z": np.eye(4),
}


def number(shapes: Shapes, item: Item, name: str) -> float:
    return float(item.value(name, shapes.shutter.frame))


def solid(shapes: Shapes, item: Item, sizes: dict[str, int] | None = None) -> dict[str, object]:
    """Settings of what is added, about USD's axis. Constant primvars are values of the material. `sizes`: of primvars
    that vary over the shape, where it is a mesh; USD leaves open what they mean on the others."""
    made = shapes.material_of(item)
    primvars = shapes.primvars(item, [made])
    varying = {key: values for key, values in primvars.items() if not key.startswith("constant ")}
    numbers = {}
    for key, values in primvars.items():
        storage, _, rest = key.partition(" ")
        if storage != "constant" and sizes is None:
            shapes.gathered.note(
                f"primvar {shown(rest)} varies over a {item.kind}; its first value stands",
                item.path,
            )
        if storage == "constant" or sizes is None:
            row = values[0] if isinstance(values[0], str) else values[0].tolist()
            numbers[rest] = row if isinstance(row, str) else row[0] if len(row) == 1 else tuple(row)
    looks = shapes.looks(item, made)
    shapes.own_values |= {name for name in made.primvars if f"primvars:{name}" in item.names}
    if numbers:
        looks["material"] = made.with_values(numbers)
    if sizes is not None:
        looks["primvars"] = shapes.fitting(item, varying | shapes.layers(item), sizes)
    if axis := item.value("axis", shapes.shutter.frame):
        looks["transform"] = looks["transform"] @ AXES[str(axis)]
    return looks


def shifted(looks: dict[str, object], z: float, turned: bool = False) -> dict[str, object]:
    """Along the axis; turned: upside down."""
    local = np.eye(4)
    local[2, 3] = z
    if turned:
        local[1, 1] = local[2, 2] = -1
    return looks | {"transform": looks["transform"] @ local}


def add_sphere(shapes: Shapes, place, item: Item) -> None:
    place.add_sphere(number(shapes, item, "radius"), **solid(shapes, item))


def add_cylinder(shapes: Shapes, place, item: Item) -> None:
    radius, half = number(shapes, item, "radius"), number(shapes, item, "height") / 2
    looks = solid(shapes, item)
    place.add_cylinder(radius, -half, half, **looks)
    place.add_disk(radius, **shifted(looks, half))
    place.add_disk(radius, **shifted(looks, -half, turned=True))


def add_cone(shapes: Shapes, place, item: Item) -> None:
    radius, height = number(shapes, item, "radius"), number(shapes, item, "height")
    looks = solid(shapes, item)
    place.add_cone(radius, height, **shifted(looks, -height / 2))
    place.add_disk(radius, **shifted(looks, -height / 2, turned=True))


# A circle, as four quarters of a rational curve of order 3 (The NURBS Book, example 7.2).
CIRCLE = np.array([(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)])
CIRCLE_WEIGHTS = np.array([1, math.sqrt(0.5)] * 4 + [1])
AROUND = np.repeat([0.0, 1, 2, 3, 4], [3, 2, 2, 2, 3])


def add_revolved(place, profile: np.ndarray, knots: np.ndarray, looks: dict[str, object]) -> None:
    """A profile (radius, z, weight; the first two times it) turned about the axis; it faces outwards where z grows."""
    points = np.empty((len(profile), len(CIRCLE), 4))
    points[..., :2] = profile[:, None, :1] * (CIRCLE * CIRCLE_WEIGHTS[:, None])
    points[..., 2:] = profile[:, None, 1:] * CIRCLE_WEIGHTS[:, None]
    place.add_nurbs(points, AROUND, knots, **looks)


def add_capsule(shapes: Shapes, place, item: Item) -> None:
    radius = number(shapes, item, "radius")
    capsule(shapes, place, item, radius, radius)


def add_capsule_1(shapes: Shapes, place, item: Item) -> None:
    capsule(shapes, place, item, number(shapes, item, "radiusBottom"), number(shapes, item, "radiusTop"))


def capsule(shapes: Shapes, place, item: Item, bottom: float, top: float) -> None:
    """One surface: balls around the ends, and what touches both. It touches them where the sine of the latitude is the
    difference of radii by the distance (as USD's imaging has it)."""
    height, looks = number(shapes, item, "height"), solid(shapes, item)
    if not (bottom >= 0 and top >= 0 and height >= 0 and bottom + top > 0):
        raise ValueError(f"radii of {bottom:g} and {top:g} and a height of {height:g}")
    if height <= abs(bottom - top):  # one ball is in the other
        place.add_sphere(max(bottom, top), **shifted(looks, height / 2 * (1 if top > bottom else -1)))
        return
    latitude = math.asin((bottom - top) / height)
    lower = arc(bottom, -height / 2, -math.pi / 2, latitude)
    upper = arc(top, height / 2, latitude, math.pi / 2)
    middle = (lower[-1] + upper[0]) / 2  # the tangent, as a curve of the arcs' order
    profile = np.concatenate([lower, middle[None], upper])
    add_revolved(place, profile, np.repeat([0.0, 1, 2, 3, 4, 5], [3, 2, 2, 2, 2, 3]), looks)


def arc(radius: float, z: float, first: float, last: float) -> np.ndarray:
    """(5, 3): two equal arcs of order 3 from a latitude to another: radius, z, weight; the first two times it."""
    half = (last - first) / 4
    angles = np.linspace(first, last, 5)
    weights = np.array([1, math.cos(half), 1, math.cos(half), 1])
    far = radius / weights  # where the tangents of the ends meet
    return np.stack([far * np.cos(angles), z + far * np.sin(angles), np.ones(5)], axis=-1) * weights[:, None]


def add_cylinder_1(shapes: Shapes, place, item: Item) -> None:
    bottom, top = number(shapes, item, "radiusBottom"), number(shapes, item, "radiusTop")
    half, looks = number(shapes, item, "height") / 2, solid(shapes, item)
    if not (bottom >= 0 and top >= 0 and half > 0 and bottom + top > 0):
        raise ValueError(f"radii of {bottom:g} and {top:g} and a height of {2 * half:g}")
    add_revolved(place, np.array([(bottom, -half, 1), (top, half, 1)]), np.array([0.0, 0, 1, 1]), looks)
    if top > 0:
        place.add_disk(top, **shifted(looks, half))
    if bottom > 0:
        place.add_disk(bottom, **shifted(looks, -half, turned=True))


# The meshes of cubes and planes are those of USD's imaging, in the order of their points and faces: primvars may vary
# over them.
CUBE = np.array(
    [(1, 1, 1), (-1, 1, 1), (-1, -1, 1), (1, -1, 1), (-1, -1, -1), (-1, 1, -1), (1, 1, -1), (1, -1, -1)], dtype=float
)
CUBE_FACES = [[0, 1, 2, 3], [4, 5, 6, 7], [0, 6, 5, 1], [4, 7, 3, 2], [0, 3, 7, 6], [4, 2, 1, 5]]
SQUARE = np.array([(1, 1, 0), (-1, 1, 0), (-1, -1, 0), (1, -1, 0)], dtype=float)


def add_cube(shapes: Shapes, place, item: Item) -> None:
    looks = solid(shapes, item, {"uniform": 6, "vertex": 8, "varying": 8, "facevarying": 24})
    place.add_mesh(CUBE * (number(shapes, item, "size") / 2), CUBE_FACES, **looks)


def add_plane(shapes: Shapes, place, item: Item) -> None:
    looks = solid(shapes, item, {"uniform": 1, "vertex": 4, "varying": 4, "facevarying": 4})
    size = np.array([number(shapes, item, "width") / 2, number(shapes, item, "length") / 2, 0])
    if str(item.value("axis", shapes.shutter.frame)) != "Z":
        size = size[[1, 0, 2]]  # width goes along z about x, and along x about y
    place.add_mesh(SQUARE * size, [[0, 1, 2, 3]], **looks)
