"""How large what is read is: where a stage has no camera, one is fitted to that. Extents of the stage are not asked
for: they may be wrong or missing, and USD takes them as they are."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

Box = np.ndarray  # (2, 3): lowest and highest; what is empty has infinite ones
EMPTY: Box = np.array([[np.inf] * 3, [-np.inf] * 3])
STEP = 1 << 16  # matrices at a time, where there may be millions


def of_points(points: object, *_: object) -> Box:
    """(…, 3), or homogeneous (…, 4). Splines are within their control points; those of Catmull and Rom nearly."""
    array = np.asarray(points)
    array = array.reshape(-1, array.shape[-1])
    if array.shape[-1] == 4:
        array = array[:, :3] / array[:, 3:]
    return np.array([array.min(0), array.max(0)], dtype=float) if len(array) else EMPTY


def of_faces(points: object, faces: object, *_: object) -> Box:
    """Of the points that faces have."""
    array = np.asarray(points)
    used = np.zeros(array.shape[-2], dtype=bool)
    used[np.asarray(faces).reshape(-1)] = True
    return of_points(array if used.all() else array[..., used, :])


def about_z(radius: float, low: float, high: float) -> Box:
    return np.array([[-radius, -radius, low], [radius, radius, high]], dtype=float)


# By the arguments of the methods that add shapes.
BOXES: dict[str, Callable[..., Box]] = {
    "add_mesh": of_faces,
    "add_subdivision": of_faces,
    "add_curves": of_points,
    "add_points": of_points,
    "add_nurbs": of_points,
    "add_sphere": lambda radius: about_z(radius, -radius, radius),
    "add_cylinder": about_z,
    "add_cone": lambda radius, height: about_z(radius, 0, height),
    "add_disk": lambda radius, height=0.0: about_z(radius, height, height),
}


def wider(box: Box, widths: object = None, primvars: dict | None = None) -> Box:
    """By half of the largest of the widths, as parameters or primvars have them."""
    given = [values for key, values in (primvars or {}).items() if key.endswith("float width")]
    if widths is not None:
        given.append(widths)
    half = max((float(np.max(values)) for values in given if np.size(values)), default=0.0) / 2
    return box + np.array([[-half], [half]])


def joined(a: Box, b: Box) -> Box:
    return np.array([np.minimum(a[0], b[0]), np.maximum(a[1], b[1])]) if np.isfinite(b).all() else a


def placed(box: Box, matrices: np.ndarray) -> Box:
    """Of a box at all of some matrices, (…, 3 or 4, 4)."""
    if not np.isfinite(box).all():
        return EMPTY
    every, found = matrices.reshape(-1, *matrices.shape[-2:]), EMPTY
    # Of the matrices' own precision: as a product of one array by a vector it is fast.
    middle = np.append(box.mean(0), 1).astype(every.dtype)
    half = np.append((box[1] - box[0]) / 2, 0).astype(every.dtype)
    for first in range(0, len(every), STEP):
        rows = every[first : first + STEP, :3].reshape(-1, 4)
        centers, reach = (rows @ middle).reshape(-1, 3), (np.abs(rows) @ half).reshape(-1, 3)
        found = joined(found, np.array([(centers - reach).min(0), (centers + reach).max(0)], dtype=float))
    return found


class Measured:
    """A scene or a group that knows the box around what was added to it; all else is as without."""

    def __init__(self, place) -> None:
        self.inner, self.box = place, EMPTY

    def __getattr__(self, name: str):
        found = getattr(self.inner, name)
        if name not in BOXES:
            return found

        def add(*given: object, **settings: object) -> object:
            made = found(*given, **settings)
            box = wider(BOXES[name](*given), settings.get("widths"), settings.get("primvars"))
            matrix = settings.get("transform")
            self.box = joined(self.box, box if matrix is None else placed(box, np.asarray(matrix)))
            return made

        return add

    def add_group(self, name: str = "") -> Measured:
        return Measured(self.inner.add_group(name))

    def add_instances(self, group: Measured, matrices: np.ndarray) -> None:
        self.inner.add_instances(group.inner, matrices)
        self.box = joined(self.box, placed(group.box, matrices))

    def corners(self) -> np.ndarray | None:
        """(8, 3); None: there is nothing in it."""
        if not np.isfinite(self.box).all():
            return None
        return np.stack(np.meshgrid(*self.box.T, indexing="ij"), axis=-1).reshape(-1, 3)
