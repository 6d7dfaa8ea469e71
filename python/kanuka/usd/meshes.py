"""Meshes: polygons and subdivision surfaces."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from pxr import UsdGeom, UsdShade

from .arrays import extremes, is_list, primvar, rows, whole
from .geometry import Shapes
from .items import Item, primvar_of
from .materials import Made
from .mesh_lights import Glow
from .subdivision import area_of
from .transforms import at_start

SCHEMES = {"catmullClark": "catmull-clark", "loop": "loop", "bilinear": "bilinear"}
SHARPEST = 10.0  # of USD's creases: infinitely sharp from there on


def add_mesh(shapes: Shapes, place, item: Item) -> None:
    counts = whole(item.value("faceVertexCounts", shapes.shutter.frame))
    add_faces(shapes, place, item, counts, whole(item.value("faceVertexIndices", shapes.shutter.frame)))


def add_tetrahedra(shapes: Shapes, place, item: Item) -> None:
    """The surface of a TetMesh: what it has authored, or the faces that one tetrahedron has alone."""
    faces = item.value("surfaceFaceVertexIndices", shapes.shutter.frame)
    if faces is None or not len(faces):
        faces = UsdGeom.TetMesh.ComputeSurfaceFaces(UsdGeom.TetMesh(item.prim), shapes.shutter.frame)
    faces = whole(faces)
    add_faces(shapes, place, item, np.full(len(faces) // 3, 3, dtype=np.int32), faces)


def add_faces(shapes: Shapes, place, item: Item, counts: np.ndarray, faces: np.ndarray) -> None:
    frame = shapes.shutter.frame
    points = shapes.shutter.points(item, shapes.say)
    if points is None or not len(counts):
        return
    if small := least_corners(points, counts, faces) < 3:
        shapes.say("warning", f"{item.path}: faces of fewer than three corners are left out")
    scheme = item.value("subdivisionScheme", frame)
    glow = glow_of(shapes, item, points, counts, faces)
    parts = subsets(shapes, item, len(counts), glow)
    vertices = points.shape[-2]
    sizes = {"vertex": vertices, "varying": vertices, "uniform": len(counts), "facevarying": len(faces)}
    primvars = shapes.fitting(item, shapes.primvars(item, [made for made, _ in parts]), sizes)
    layers = shapes.fitting(item, shapes.layers(item), sizes)
    if scheme not in SCHEMES and (normals := normals_of(item, frame)) is not None:
        primvars |= shapes.fitting(item, {f"{normals[0]} normal N": normals[1]}, sizes)
    for made, mask in parts:
        looks = shapes.looks(item, made)
        if glow:
            looks["area_light"] = glow.area_light(made.shines)
        if item.value("orientation", frame) == UsdGeom.Tokens.leftHanded:
            looks["reverse_orientation"] = True
        mine = primvars
        if len(parts) > 1:
            read = {key: made.reads(key.split()[-1]) or key.endswith(" N") for key in primvars}
            mine = {key: values for key, values in primvars.items() if read[key]}
        mine = mine | layers
        if scheme in SCHEMES and not (scheme == "loop" and (counts != 3).any()):
            looks["scheme"] = SCHEMES[scheme]
            add_subdivision(shapes, place, item, points, counts, faces, mask, mine, looks)
        else:
            keep = mask & (counts >= 3) if mask is not None else (counts >= 3) if small else None
            add_polygons(shapes, place, item, points, counts, faces, keep, mine, looks)


def least_corners(points: np.ndarray, counts: np.ndarray, faces: np.ndarray) -> int:
    """That a face has; raises what is wrong with the topology."""
    least, most = extremes(counts)
    if (total := least * len(counts) if least == most else counts.sum()) != len(faces):
        raise ValueError(f"faceVertexCounts add up to {total}, but there are {len(faces)} faceVertexIndices")
    # Their squares have no sum where one of them is no number; that takes a quarter of the time.
    if not math.isfinite(np.vdot(points, points)) and not np.isfinite(points).all():
        raise ValueError("some of its points are no numbers")
    lowest, highest = extremes(faces) if len(faces) else (0, -1)
    if lowest < 0 or highest >= points.shape[-2]:
        reach = lowest if lowest < 0 else highest
        raise ValueError(f"faceVertexIndices reach {reach}, but there are {points.shape[-2]} points")
    return least


def glow_of(shapes: Shapes, item: Item, points: np.ndarray, counts: np.ndarray, faces: np.ndarray) -> Glow | None:
    """What a mesh shines with, if it is a light."""
    if item.kind != "Mesh" or (light := shapes.mesh_lights.light_of(item)) is None:
        return None
    first, linear = points if points.ndim == 2 else points[0], at_start(item.matrix)[:3, :3]
    mesh, frame = UsdGeom.Mesh(item.prim), shapes.shutter.frame
    return shapes.mesh_lights.of(light, frame, lambda: area_of(mesh, frame, first, faces, counts, linear))


def subsets(shapes: Shapes, item: Item, faces: int, glow: Glow | None) -> list[tuple[Made, np.ndarray | None]]:
    """Materials with the faces that they are on; None = all."""
    if not item.children:
        return [(shapes.material_of(item, glow), None)]
    found: list[tuple[Made, np.ndarray | None]] = []
    rest = np.ones(faces, dtype=bool)
    for subset in UsdShade.MaterialBindingAPI(item.prim).GetMaterialBindSubsets():
        if subset.GetElementTypeAttr().Get() != UsdGeom.Tokens.face:
            continue
        mask = np.zeros(faces, dtype=bool)
        indices = whole(subset.GetIndicesAttr().Get(shapes.shutter.frame))
        mask[indices[(indices >= 0) & (indices < faces)]] = True
        mask &= rest
        rest &= ~mask
        if mask.any():
            bound, _ = UsdShade.MaterialBindingAPI(subset.GetPrim()).ComputeBoundMaterial()
            found.append((shapes.material(bound, glow), mask))
    if not found:
        return [(shapes.material_of(item, glow), None)]
    if rest.any():
        found.append((shapes.material_of(item, glow), rest))
    return found


def creases(item: Item, frame) -> tuple[list[list[int]], np.ndarray]:
    """Chains of vertices, and how sharp each is."""
    lengths, indices = whole(item.value("creaseLengths", frame)), whole(item.value("creaseIndices", frame))
    sharpness = rows(item.value("creaseSharpnesses", frame) or (), 1).reshape(-1)
    if not len(lengths):
        return [], sharpness[:0]
    ends = np.cumsum(lengths)
    if ends[-1] != len(indices):
        raise ValueError(f"creaseLengths add up to {ends[-1]}, but there are {len(indices)} creaseIndices")
    chains = [indices[end - n : end].tolist() for n, end in zip(lengths, ends, strict=True)]
    if len(sharpness) == (lengths - 1).sum() and len(sharpness) != len(lengths):  # one an edge
        chains = [[a, b] for chain in chains for a, b in pairwise(chain)]
    if len(sharpness) != len(chains):
        raise ValueError(f"{len(sharpness)} creaseSharpnesses for {len(chains)} creases")
    return chains, sharpness


def add_subdivision(shapes: Shapes, place, item: Item, points, counts, faces, mask, primvars, looks) -> None:
    """What is not of the material is holes: the surface keeps its shape where materials meet."""
    frame, tags = shapes.shutter.frame, rules(shapes, item)
    if "creaseLengths" in item.names:
        chains, sharpness = creases(item, frame)
        tags |= {"creases": chains, "crease_sharpness": np.minimum(sharpness, SHARPEST).tolist()}
    if "cornerIndices" in item.names:
        sharpness = rows(item.value("cornerSharpnesses", frame) or (), 1).reshape(-1)
        corners = whole(item.value("cornerIndices", frame))[: len(sharpness)]
        sharpness = np.minimum(sharpness[: len(corners)], SHARPEST)
        tags |= {"corners": corners.tolist(), "corner_sharpness": sharpness.tolist()}
    if mask is not None or "holeIndices" in item.names:
        holes = np.zeros(len(counts), dtype=bool) if mask is None else ~mask
        holes[within(item.value("holeIndices", frame), len(counts))] = True
        tags["holes"] = np.flatnonzero(holes).tolist()
    place.add_subdivision(points, faces, counts, **tags, primvars=primvars, **looks)


# How a surface follows its cage: arguments of add_subdivision(), and their values by those of USD's attributes.
RULES: dict[str, tuple[str, dict[str, object]]] = {
    "interpolateBoundary": (
        "boundary",
        {"edgeAndCorner": "edge-and-corner", "edgeOnly": "edge-only", "none": "none"},
    ),
    "faceVaryingLinearInterpolation": (
        "facevarying",
        {"cornersPlus1": "corners-plus1", "cornersPlus2": "corners-plus2", "cornersOnly": "corners-only"}
        | {name: name for name in ("none", "boundaries", "all")},
    ),
    "triangleSubdivisionRule": ("smooth_triangles", {"catmullClark": False, "smooth": True}),
}


def rules(shapes: Shapes, item: Item) -> dict[str, object]:
    found = {}
    for name, (argument, known) in RULES.items():
        if name in item.names:
            value = str(item.value(name, shapes.shutter.frame))
            if value not in known:
                usual = next(iter(known))
                shapes.gathered.note(f'there is no {name} "{value}"; it is taken for "{usual}"', item.path)
                value = usual
            found[argument] = known[value]
    return found


def within(indices: object, count: int) -> np.ndarray:
    """Those that are of something."""
    found = whole(indices)
    return found[(found >= 0) & (found < count)]


def add_polygons(shapes: Shapes, place, item: Item, points, counts, faces, keep, primvars, looks) -> None:
    """Faces that are kept (None: all), without holes."""
    frame = shapes.shutter.frame
    if "holeIndices" in item.names and len(holes := within(item.value("holeIndices", frame), len(counts))):
        keep = np.ones(len(counts), dtype=bool) if keep is None else keep
        keep[holes] = False
    if keep is None or keep.all():
        place.add_mesh(points, faces, counts, primvars=primvars, **looks)
        return
    if not keep.any():
        return
    of_corners = np.repeat(keep, counts)

    def kept(key: str, values: np.ndarray) -> np.ndarray:
        if key.startswith("uniform") and len(values) == len(keep):
            return values[keep]
        if key.startswith("facevarying") and len(values) == len(of_corners):
            return values[of_corners]
        return values

    primvars = {key: kept(key, values) for key, values in primvars.items()}
    place.add_mesh(points, faces[of_corners], counts[keep], primvars=primvars, **looks)


def normals_of(item: Item, frame) -> tuple[str, np.ndarray] | None:
    """With their storage class. primvars:normals goes over normals."""
    if "primvars:normals" in item.names and (found := primvar_of(item, "normals")) is not None:
        for key, values in primvar(found, "N", "normal", frame).items():
            return key.split()[0], values
        return None
    values = item.value("normals", frame)
    if not is_list(values):
        return None
    interpolation = str(UsdGeom.PointBased(item.prim).GetNormalsInterpolation())
    return {"faceVarying": "facevarying"}.get(interpolation, interpolation), rows(values, 3)
