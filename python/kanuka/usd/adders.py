"""Which prims have a shape, and what adds them."""

from __future__ import annotations

from collections.abc import Callable

from . import curves, meshes, patches, solids, splines

ADDERS: dict[str, Callable] = {
    "Mesh": meshes.add_mesh,
    "TetMesh": meshes.add_tetrahedra,
    "Sphere": solids.add_sphere,
    "Cylinder": solids.add_cylinder,
    "Cylinder_1": solids.add_cylinder_1,
    "Cone": solids.add_cone,
    "Capsule": solids.add_capsule,
    "Capsule_1": solids.add_capsule_1,
    "Cube": solids.add_cube,
    "Plane": solids.add_plane,
    "BasisCurves": curves.add_basis_curves,
    "HermiteCurves": curves.add_hermite_curves,
    "NurbsCurves": splines.add_nurbs_curves,
    "NurbsPatch": patches.add_nurbs_patch,
    "Points": curves.add_points,
}
