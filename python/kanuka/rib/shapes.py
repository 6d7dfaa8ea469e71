"""Shapes of Scene.add_…() as requests of RIB."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from .encode import Value, holds_texts, moving, request, rows_of_matrices, times_of

STEPS = {"bezier": 3, "b-spline": 1, "catmull-rom": 1}


class Counts:
    """How many values there are of each storage class, the first that fits counts."""

    def __init__(self, vertex: int, varying: int, facevarying: int, uniform: int) -> None:
        self.of = {"vertex": vertex, "varying": varying, "facevarying": facevarying, "uniform": uniform, "constant": 1}

    def declared(self, key: str, values: np.ndarray, kind: str = "") -> str:
        """ "vertex color Cs" of "Cs", with what its values say."""
        words = key.split()
        rows = len(values) if values.ndim else 1
        if len(words) == 3 or (len(words) == 2 and words[0] in self.of):
            return key
        storage = next((name for name, count in self.of.items() if count == rows), "constant")
        kind = kind or (words[0] if len(words) == 2 else ("float", "color")[values.ndim > 1 and values.shape[1] == 3])
        return f"{storage} {kind} {words[-1]}"


def slices(values: object, dimensions: int = 2) -> list[np.ndarray]:
    """One array for each time."""
    array = np.asarray(values, dtype=np.float32)
    return list(array) if array.ndim > dimensions else [array]


def shape(
    name: str,
    arguments: Sequence[Value],
    points: list[np.ndarray],
    normals: object,
    primvars: Mapping[str, object],
    counts: Counts,
    times: Sequence[float] | None,
) -> bytes:
    """A request for each time that the points are given for; those with four numbers are homogeneous. RIB counts points
    by the faces' indices: those that none has are left out."""
    bent = slices(normals) if normals is not None else []
    used = counts.of["vertex"]
    common: dict[str, Value] = {}
    for key, values in primvars.items():
        if holds_texts(values):
            common[f"constant string {key.split()[-1]}"] = values if isinstance(values, str) else str(values[0])
            continue
        array = np.asarray(values, dtype=np.float32)
        if "matrix" in key.split() or (len(key.split()) == 1 and array.ndim > 1 and array.size == 16 * len(array)):
            array = rows_of_matrices(array)
            key = key if "matrix" in key.split() else f"matrix {key}"
        declared = Counts(len(points[0]), *list(counts.of.values())[1:4]).declared(key, array)
        whole = declared.split()[0] in ("vertex", "varying") and len(array) == len(points[0])
        common[declared] = array[:used] if whole and used < len(array) else array
    made = []
    for k, at in enumerate(points):
        own: dict[str, Value] = {"P" if at.shape[-1] == 3 else "Pw": at[:used]}
        if bent:
            n = bent[min(k, len(bent) - 1)]
            key = Counts(len(at), *list(counts.of.values())[1:4]).declared("normal N", n)
            own[key] = n[:used] if key.startswith("v") else n
        made.append(request(name, *arguments, parameters=own | common))
    return moving(made, times_of(len(made), times))


def faces_of(faces: object, counts: object) -> tuple[np.ndarray, np.ndarray]:
    """Corners of each face, and all of them."""
    array = np.asarray(faces, dtype=np.int32)
    if counts is None:
        return np.full(len(array), array.shape[1], dtype=np.int32), array.reshape(-1)
    return np.asarray(counts, dtype=np.int32), array.reshape(-1)


def mesh_counts(counts: np.ndarray, faces: np.ndarray) -> Counts:
    bound = int(faces.max()) + 1 if len(faces) else 0
    return Counts(bound, bound, len(faces), len(counts))


# As the tags number them, and what holds without a tag.
BOUNDARIES = ("none", "edge-and-corner", "edge-only")
FACE_VARYINGS = ("none", "corners-only", "corners-plus1", "corners-plus2", "boundaries", "all")
USUAL = {"interpolateboundary": 0, "facevaryinginterpolateboundary": 2, "smoothtriangles": 0}


def tags(settings: Mapping[str, object]) -> tuple[Value, ...]:
    """Creases, corners, holes and boundary of a subdivision surface, as SubdivisionMesh takes them."""
    chains, sharpness = list(settings.get("creases", ())), list(settings.get("crease_sharpness", ()))  # type: ignore
    names = ["crease"] * len(chains)
    sizes = [number for chain in chains for number in (len(chain), 1)]
    whole = [vertex for chain in chains for vertex in chain]
    real = list(sharpness)
    if corners := list(settings.get("corners", ())):  # type: ignore
        names.append("corner")
        sizes += [len(corners), len(corners)]
        whole += corners
        real += list(settings.get("corner_sharpness", ()))  # type: ignore
    if holes := list(settings.get("holes", ())):  # type: ignore
        names.append("hole")
        sizes += [len(holes), 0]
        whole += holes
    rules = {
        "interpolateboundary": BOUNDARIES.index(settings.get("boundary", "edge-and-corner")),
        "facevaryinginterpolateboundary": FACE_VARYINGS.index(settings.get("facevarying", "corners-plus1")),
        "smoothtriangles": int(bool(settings.get("smooth_triangles"))),
    }
    for name, rule in rules.items():
        if rule != USUAL[name]:
            names.append(name)
            sizes += [1, 0]
            whole.append(rule)
    return names, np.array(sizes, np.int32), np.array(whole, np.int32), np.array(real, np.float32)


def curve_counts(counts: np.ndarray, points: int, basis: str, periodic: bool) -> Counts:
    """RISpec 3.2, table of storage classes: a curve has a varying value at each end of its segments."""
    if basis == "linear":
        varying = counts
    elif periodic:
        varying = counts // STEPS[basis]
    else:
        varying = (counts - 4) // STEPS[basis] + 2
    return Counts(points, int(varying.sum()), int(varying.sum()), len(counts))


def trim_curves(loops: Sequence[Sequence[tuple[object, object]]]) -> bytes:
    """Loops of curves (points, knots), as TrimCurve has them. A curve's range is all that its knots define."""
    curves = [
        (np.asarray(at, dtype=float), np.asarray(knots, dtype=np.float32)) for loop in loops for at, knots in loop
    ]
    numbers = [len(at) for at, _ in curves]
    orders = [len(knots) - len(at) for at, knots in curves]
    points = np.concatenate([np.column_stack([at, np.ones((len(at), 3 - at.shape[1]))]) for at, _ in curves])
    return request(
        "TrimCurve",
        np.array([len(loop) for loop in loops], np.int32),
        np.array(orders, np.int32),
        np.concatenate([knots for _, knots in curves]),
        np.array([knots[order - 1] for (_, knots), order in zip(curves, orders, strict=True)]),
        np.array([knots[number] for (_, knots), number in zip(curves, numbers, strict=True)]),
        np.array(numbers, np.int32),
        *points.T,
    )


def direction_of(count: int, knots: object, part: tuple[float, float] | None) -> tuple[tuple, int, int]:
    """Of a NuPatch: number of points, order, knots and range; with the numbers of varying and of uniform values."""
    knots = np.asarray(knots, dtype=np.float32)
    order = len(knots) - count
    low, high = part if part is not None else (knots[order - 1], knots[count])
    return (count, order, knots, float(low), float(high)), count - order + 2, count - order + 1
