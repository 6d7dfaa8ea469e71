"""Prims with a shape: meshes, the simple solids, curves and points, added to a scene or a group of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from pxr import Usd, UsdGeom, UsdShade

import kanuka

from .arrays import primvar, rows, sampled, whole
from .linking import Links
from .materials import Made, Materials
from .mesh_lights import INDEPENDENT, TINTED, Glow, MeshLights
from .render_vars import Shown
from .stage import Say
from .subdivision import area_of

SCHEMES = {"catmullClark": "catmull-clark", "loop": "loop", "bilinear": "bilinear"}
SHARPEST = 10.0  # of USD's creases: infinitely sharp from there on
# From the z axis, about which quadrics lie, to USD's axis.
AXES = {
    "X": np.array([[0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]], dtype=float),
    "Y": np.array([[0, 1, 0, 0], [0, 0, 1, 0], [1, 0, 0, 0], [0, 0, 0, 1]], dtype=float),
    "Z": np.eye(4),
}


@dataclass
class Shapes:
    """Adds prims; `times` are those of the shutter."""

    materials: Materials
    say: Say
    times: list[Usd.TimeCode]
    links: Links
    mesh_lights: MeshLights
    shown: Sequence[Shown] = ()

    def add(self, place: kanuka.Scene | kanuka.Group, prim: Usd.Prim, matrix: np.ndarray) -> bool:
        """False: not a shape that Kanuka has."""
        adder = ADDERS.get(prim.GetTypeName())
        if adder is None:
            return False
        try:
            adder(self, place, prim, matrix)
        except (ValueError, TypeError) as error:
            self.say("error", f"{prim.GetPath()}: {error}. It is left out")
        return True

    def looks(self, prim: Usd.Prim, matrix: np.ndarray) -> dict[str, object]:
        return {"transform": matrix, "name": str(prim.GetPath()), **self.links.of(prim)}

    def material(self, prim: Usd.Prim, glow: Glow | None = None) -> Made:
        if glow and glow.mode not in (TINTED, INDEPENDENT):
            return self.materials.dark()
        bound, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
        factor = None if glow is None else (glow.radiance if glow.mode == TINTED else (0.0, 0.0, 0.0))
        made = self.materials.of(bound, factor) if bound else None
        return made or self.materials.plain()

    def primvars(self, prim: Usd.Prim, wanted: Sequence[Made]) -> dict[str, np.ndarray]:
        """Of those that the materials read, what the prim or its parents have."""
        api = UsdGeom.PrimvarsAPI(prim)
        found: dict[str, np.ndarray] = {}
        for made in wanted:
            for name, (ours, kind) in made.primvars.items():
                have = api.FindPrimvarWithInheritance(name)
                if not have and name == "st":  # some exporters' names
                    have = next((p for n in ("UVMap", "map1", "uv") if (p := api.FindPrimvarWithInheritance(n))), have)
                if not have or not have.HasValue():
                    continue
                values = primvar(have, ours, kind, self.times[0])
                if not values:
                    self.say("warning", f"{prim.GetPath()}: primvar {name} is no {kind}; it is not read")
                found |= values
        return found

    def layers(self, prim: Usd.Prim) -> dict[str, np.ndarray]:
        """Primvars that layers of the picture show."""
        found: dict[str, np.ndarray] = {}
        for shown in self.shown:
            found |= shown.of(prim, self.times[0])
        return found


# ---- meshes ----------------------------------------------------------------------------------------------------------


def add_mesh(shapes: Shapes, place, prim: Usd.Prim, matrix: np.ndarray) -> None:
    mesh, time = UsdGeom.Mesh(prim), shapes.times[0]
    points = sampled(mesh.GetPointsAttr(), shapes.times, 3)
    counts = whole(mesh.GetFaceVertexCountsAttr().Get(time))
    faces = whole(mesh.GetFaceVertexIndicesAttr().Get(time))
    if points is None or not len(counts):
        return
    if counts.sum() != len(faces):
        raise ValueError(f"faceVertexCounts add up to {counts.sum()}, but there are {len(faces)} faceVertexIndices")
    if not np.isfinite(points).all():
        raise ValueError("some of its points are no numbers")
    if len(faces) and (faces.min() < 0 or faces.max() >= points.shape[-2]):
        raise ValueError(f"faceVertexIndices reach {faces.max()}, but there are {points.shape[-2]} points")
    if (counts < 3).any():
        shapes.say("warning", f"{prim.GetPath()}: faces of fewer than three corners are left out")
    looks = shapes.looks(prim, matrix)
    if mesh.GetOrientationAttr().Get(time) == UsdGeom.Tokens.leftHanded:
        looks["reverse_orientation"] = True
    scheme = mesh.GetSubdivisionSchemeAttr().Get(time)
    first, place_of = points if points.ndim == 2 else points[0], matrix if matrix.ndim == 2 else matrix[0]
    glow = shapes.mesh_lights.of(prim, time, lambda: area_of(mesh, time, first, faces, counts, place_of[:3, :3]))
    parts = subsets(shapes, prim, len(counts), glow)
    primvars, layers = shapes.primvars(prim, [made for made, _ in parts]), shapes.layers(prim)
    for made, mask in parts:
        mine = {key: values for key, values in primvars.items() if made.reads(key.split()[-1])} | layers
        if glow:
            looks["area_light"] = glow.area_light(made.shines)
        if scheme in SCHEMES and not (scheme == "loop" and (counts != 3).any()):
            add_subdivision(place, mesh, time, points, counts, faces, mask, mine, looks | {"material": made.material})
        else:
            keep = (counts >= 3) if mask is None else (mask & (counts >= 3))
            add_polygons(place, mesh, shapes, points, counts, faces, keep, mine, looks | {"material": made.material})


def subsets(shapes: Shapes, prim: Usd.Prim, faces: int, glow: Glow | None) -> list[tuple[Made, np.ndarray | None]]:
    """Materials with the faces that they are on; None = all."""
    found = []
    rest = np.ones(faces, dtype=bool)
    for subset in UsdShade.MaterialBindingAPI(prim).GetMaterialBindSubsets():
        if subset.GetElementTypeAttr().Get() != UsdGeom.Tokens.face:
            continue
        mask = np.zeros(faces, dtype=bool)
        indices = whole(subset.GetIndicesAttr().Get(shapes.times[0]))
        mask[indices[(indices >= 0) & (indices < faces)]] = True
        mask &= rest
        rest &= ~mask
        if mask.any():
            found.append((shapes.material(subset.GetPrim(), glow), mask))
    if not found:
        return [(shapes.material(prim, glow), None)]
    if rest.any():
        found.append((shapes.material(prim, glow), rest))
    return found


def add_subdivision(place, mesh: UsdGeom.Mesh, time, points, counts, faces, mask, primvars, looks) -> None:
    """What is not of the material is holes: the surface keeps its shape where materials meet."""
    holes = set(whole(mesh.GetHoleIndicesAttr().Get(time)).tolist())
    if mask is not None:
        holes |= set(np.flatnonzero(~mask).tolist())
    lengths = whole(mesh.GetCreaseLengthsAttr().Get(time))
    indices = whole(mesh.GetCreaseIndicesAttr().Get(time))
    sharpness = rows(mesh.GetCreaseSharpnessesAttr().Get(time) or (), 1).reshape(-1)
    ends = np.cumsum(lengths)
    if len(lengths) and ends[-1] == len(indices):
        chains = [indices[end - n : end].tolist() for n, end in zip(lengths, ends, strict=True)]
        if len(sharpness) == (lengths - 1).sum() and len(sharpness) != len(lengths):  # one an edge
            chains = [[a, b] for chain in chains for a, b in pairwise(chain)]
        if len(sharpness) != len(chains):
            raise ValueError(f"{len(sharpness)} creaseSharpnesses for {len(chains)} creases")
    elif len(lengths):
        raise ValueError(f"creaseLengths add up to {ends[-1]}, but there are {len(indices)} creaseIndices")
    else:
        chains, sharpness = [], sharpness[:0]
    corners = whole(mesh.GetCornerIndicesAttr().Get(time))
    corner_sharpness = rows(mesh.GetCornerSharpnessesAttr().Get(time) or (), 1).reshape(-1)[: len(corners)]
    place.add_subdivision(
        points,
        faces,
        counts,
        scheme=SCHEMES[mesh.GetSubdivisionSchemeAttr().Get(time)],
        creases=chains,
        crease_sharpness=np.minimum(sharpness, SHARPEST).tolist(),
        corners=corners[: len(corner_sharpness)].tolist(),
        corner_sharpness=np.minimum(corner_sharpness, SHARPEST).tolist(),
        holes=sorted(h for h in holes if 0 <= h < len(counts)),
        interpolate_boundary=mesh.GetInterpolateBoundaryAttr().Get(time) != UsdGeom.Tokens.none,
        primvars=primvars,
        **looks,
    )


def add_polygons(place, mesh: UsdGeom.Mesh, shapes: Shapes, points, counts, faces, keep, primvars, looks) -> None:
    """Faces that are kept, without holes."""
    holes = whole(mesh.GetHoleIndicesAttr().Get(shapes.times[0]))
    keep[holes[(holes >= 0) & (holes < len(counts))]] = False
    normals = mesh_normals(mesh, shapes.times)
    if normals is not None:
        key, values = normals
        primvars = primvars | {f"{key} normal N": values}
    if keep.all():
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


def mesh_normals(mesh: UsdGeom.Mesh, times: list[Usd.TimeCode]) -> tuple[str, np.ndarray] | None:
    """primvars:normals goes over normals."""
    found = UsdGeom.PrimvarsAPI(mesh.GetPrim()).GetPrimvar("normals")
    if found and found.HasValue():
        for key, values in primvar(found, "N", "normal", times[0]).items():
            return key.split()[0], values
        return None
    values = mesh.GetNormalsAttr().Get(times[0])
    if values is None or not len(values):
        return None
    storage = {"faceVarying": "facevarying"}.get(mesh.GetNormalsInterpolation(), str(mesh.GetNormalsInterpolation()))
    return storage, rows(values, 3)


# ---- solids ----------------------------------------------------------------------------------------------------------


def placed(matrix: np.ndarray, local: np.ndarray) -> np.ndarray:
    return matrix @ local


def number(attribute: Usd.Attribute, time: Usd.TimeCode) -> float:
    return float(attribute.Get(time))


def solid(shapes: Shapes, prim: Usd.Prim, matrix: np.ndarray) -> dict[str, object]:
    made = shapes.material(prim)
    primvars = shapes.primvars(prim, [made])
    constant = {k.removeprefix("constant "): v for k, v in primvars.items() if k.startswith("constant ")}
    values = {key: v.reshape(-1).tolist() for key, v in constant.items()}
    numbers = {key: v[0] if len(v) == 1 else tuple(v) for key, v in values.items()}
    return shapes.looks(prim, matrix) | {"material": made.with_values(numbers) if numbers else made.material}


def add_sphere(shapes: Shapes, place, prim: Usd.Prim, matrix: np.ndarray) -> None:
    place.add_sphere(number(UsdGeom.Sphere(prim).GetRadiusAttr(), shapes.times[0]), **solid(shapes, prim, matrix))


def about_axis(matrix: np.ndarray, axis: str) -> np.ndarray:
    return placed(matrix, AXES[str(axis)])


def shifted(matrix: np.ndarray, z: float, turned: bool = False) -> np.ndarray:
    local = np.eye(4)
    local[2, 3] = z
    if turned:  # upside down
        local[1, 1] = local[2, 2] = -1
    return placed(matrix, local)


def add_cylinder(shapes: Shapes, place, prim: Usd.Prim, matrix: np.ndarray) -> None:
    shape, time = UsdGeom.Cylinder(prim), shapes.times[0]
    radius, height = number(shape.GetRadiusAttr(), time), number(shape.GetHeightAttr(), time)
    looks = solid(shapes, prim, about_axis(matrix, shape.GetAxisAttr().Get(time)))
    place.add_cylinder(radius, -height / 2, height / 2, **looks)
    upper, lower = shifted(looks["transform"], height / 2), shifted(looks["transform"], -height / 2, turned=True)
    for lid in (upper, lower):
        place.add_disk(radius, **(looks | {"transform": lid}))


def add_cone(shapes: Shapes, place, prim: Usd.Prim, matrix: np.ndarray) -> None:
    shape, time = UsdGeom.Cone(prim), shapes.times[0]
    radius, height = number(shape.GetRadiusAttr(), time), number(shape.GetHeightAttr(), time)
    looks = solid(shapes, prim, about_axis(matrix, shape.GetAxisAttr().Get(time)))
    base = looks["transform"]
    place.add_cone(radius, height, **(looks | {"transform": shifted(base, -height / 2)}))
    place.add_disk(radius, **(looks | {"transform": shifted(base, -height / 2, turned=True)}))


def add_capsule(shapes: Shapes, place, prim: Usd.Prim, matrix: np.ndarray) -> None:
    shape, time = UsdGeom.Capsule(prim), shapes.times[0]
    radius, height = number(shape.GetRadiusAttr(), time), number(shape.GetHeightAttr(), time)
    looks = solid(shapes, prim, about_axis(matrix, shape.GetAxisAttr().Get(time)))
    if height > 0:
        place.add_cylinder(radius, -height / 2, height / 2, **looks)
    for z in (height / 2, -height / 2):
        place.add_sphere(radius, **(looks | {"transform": shifted(looks["transform"], z)}))


CUBE_FACES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 2, 6, 4], [1, 5, 7, 3], [0, 4, 5, 1], [2, 3, 7, 6]]


def add_cube(shapes: Shapes, place, prim: Usd.Prim, matrix: np.ndarray) -> None:
    half = number(UsdGeom.Cube(prim).GetSizeAttr(), shapes.times[0]) / 2
    points = np.array([[x, y, z] for x in (-half, half) for y in (-half, half) for z in (-half, half)])
    place.add_mesh(points, CUBE_FACES, **solid(shapes, prim, matrix))


def add_plane(shapes: Shapes, place, prim: Usd.Prim, matrix: np.ndarray) -> None:
    shape, time = UsdGeom.Plane(prim), shapes.times[0]
    x, y = number(shape.GetWidthAttr(), time) / 2, number(shape.GetLengthAttr(), time) / 2
    points = np.array([[-x, -y, 0], [x, -y, 0], [x, y, 0], [-x, y, 0]])
    looks = solid(shapes, prim, about_axis(matrix, shape.GetAxisAttr().Get(time)))
    place.add_mesh(points, [[0, 1, 2, 3]], **looks)


# ---- curves and points -----------------------------------------------------------------------------------------------

BASES = {"bezier": "bezier", "bspline": "b-spline", "catmullRom": "catmull-rom"}


def widths_of(prim: Usd.Prim, attribute: Usd.Attribute, time, fallback: float) -> np.ndarray:
    values = attribute.Get(time)
    return np.full(1, fallback, dtype=np.float32) if values is None or not len(values) else rows(values, 1).reshape(-1)


def add_curves(shapes: Shapes, place, prim: Usd.Prim, matrix: np.ndarray) -> None:
    curves, time = UsdGeom.BasisCurves(prim), shapes.times[0]
    points = sampled(curves.GetPointsAttr(), shapes.times, 3)
    counts = whole(curves.GetCurveVertexCountsAttr().Get(time))
    if points is None or not len(counts):
        return
    cubic = curves.GetTypeAttr().Get(time) == UsdGeom.Tokens.cubic
    basis = BASES.get(str(curves.GetBasisAttr().Get(time)), "bezier") if cubic else "linear"
    wrap = curves.GetWrapAttr().Get(time)
    widths = widths_of(prim, curves.GetWidthsAttr(), time, 1.0)
    made = shapes.material(prim)
    primvars = shapes.primvars(prim, [made]) | shapes.layers(prim)
    if wrap == UsdGeom.Tokens.pinned and basis in ("b-spline", "catmull-rom"):
        points, counts, widths = pinned(points, counts, widths, basis)
        primvars = {k: v for k, v in primvars.items() if k.split()[0] in ("constant", "uniform")}
    normals = curves.GetNormalsAttr().Get(time)
    settings = {"normals": rows(normals, 3)} if normals is not None and len(normals) else {}
    place.add_curves(
        points,
        counts,
        basis=basis,
        periodic=wrap == UsdGeom.Tokens.periodic,
        widths=widths,
        primvars=primvars,
        **settings,
        **(shapes.looks(prim, matrix) | {"material": made.material}),
    )


def pinned(points: np.ndarray, counts: np.ndarray, widths: np.ndarray, basis: str):
    """With a point more at each end, through which curves begin and end where their first and last points are."""
    still = points.ndim == 2
    slices = points[None] if still else points
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    of_vertices = len(widths) == slices.shape[1]
    out, wide = [], []
    for start, n in zip(starts, counts, strict=True):
        first, last = start, start + n - 1
        head = 2 * slices[:, first] - slices[:, min(first + 1, last)]
        tail = 2 * slices[:, last] - slices[:, max(last - 1, first)]
        out.append(np.concatenate([head[:, None], slices[:, start : start + n], tail[:, None]], axis=1))
        if of_vertices:
            wide.append(np.concatenate([[widths[first]], widths[start : start + n], [widths[last]]]))
    joined = np.concatenate(out, axis=1)
    return joined[0] if still else joined, counts + 2, np.concatenate(wide) if of_vertices else widths


def add_points(shapes: Shapes, place, prim: Usd.Prim, matrix: np.ndarray) -> None:
    cloud, time = UsdGeom.Points(prim), shapes.times[0]
    points = sampled(cloud.GetPointsAttr(), shapes.times, 3)
    if points is None or not points.shape[-2]:
        return
    made = shapes.material(prim)
    place.add_points(
        points,
        widths=widths_of(prim, cloud.GetWidthsAttr(), time, 1.0),
        primvars=shapes.primvars(prim, [made]) | shapes.layers(prim),
        **(shapes.looks(prim, matrix) | {"material": made.material}),
    )


ADDERS: dict[str, Callable] = {
    "Mesh": add_mesh,
    "Sphere": add_sphere,
    "Cylinder": add_cylinder,
    "Cone": add_cone,
    "Capsule": add_capsule,
    "Cube": add_cube,
    "Plane": add_plane,
    "BasisCurves": add_curves,
    "Points": add_points,
}
