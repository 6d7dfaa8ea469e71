"""Solids, rarer shapes and volumes of USD stages: against closed forms and the Python interface."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka
from usd_shapes import (
    SQUARE,
    TINT,
    ZERO,
    alpha,
    from_above,
    geometry,
    instancer,
    listed,
    looked_at,
    mesh,
    same,
)
from usd_stages import CAMERA, FLOOR, MATTE, SUN, read, stage

# ---- solids, and rarer shapes


def hull(a: float, b: float, apart: float) -> float:
    """Area around two circles: sectors, and the trapezoids to the tangents."""
    lean = np.arcsin((a - b) / apart)
    return a**2 * (np.pi / 2 + lean) + b**2 * (np.pi / 2 - lean) + apart * np.cos(lean) * (a + b)


@pytest.mark.parametrize(
    ("kind", "body", "area"),
    [
        ("Capsule_1", "double radiusTop = 0.15\ndouble radiusBottom = 0.4\ndouble height = 0.8", hull(0.4, 0.15, 0.8)),
        ("Capsule_1", "double radiusTop = 0.3\ndouble radiusBottom = 0\ndouble height = 0.9", hull(0, 0.3, 0.9)),
        ("Capsule_1", "double radiusTop = 0.1\ndouble radiusBottom = 0.6\ndouble height = 0.2", np.pi * 0.36),
        ("Capsule", "double radius = 0.25\ndouble height = 1", hull(0.25, 0.25, 1)),
        ("Capsule", "double radius = 0.25\ndouble height = 0", np.pi / 16),
        ("Cylinder_1", "double radiusTop = 0.2\ndouble radiusBottom = 0.5\ndouble height = 1.2", 0.7 * 1.2),
        ("Cylinder_1", "double radiusTop = 0\ndouble radiusBottom = 0.5\ndouble height = 1.2", 0.5 * 1.2),
    ],
)
@pytest.mark.parametrize("axis", "XZ")
def test_solids_of_two_radii_cover_their_areas(tmp_path: Path, kind: str, body: str, area: float, axis: str):
    scene, told = read(stage(tmp_path, CAMERA, SUN, f'def {kind} "it" {{\n{body}\nuniform token axis = "{axis}"\n}}\n'))
    assert told == []
    seen = alpha(from_above(scene), 64)
    assert 4 * seen.mean() == pytest.approx(area, rel=0.01)
    if "Bottom" in body and area != pytest.approx(np.pi * 0.36):
        # The bottom is at -x, or at the upper side of the picture.
        along = seen.sum(0 if axis == "X" else 1)
        wide, narrow = (along[:32].max(), along[32:].max())
        assert (wide > narrow) == ("Bottom = 0\n" not in body)


def test_capsules_are_smooth_and_closed(tmp_path: Path):
    """Normals of a ball at its ends, of a cone's tangent between: as seen from the side."""
    body = 'double radiusTop = 0.2\ndouble radiusBottom = 0.5\ndouble height = 0.6\nuniform token axis = "Z"'
    scene, _ = read(stage(tmp_path, CAMERA, SUN, f'def Capsule_1 "it" {{\n{body}\n}}\n'))
    from_above(scene).resolution = 33, 33
    picture = kanuka.render(scene, progressions=4, threads=1, journal=kanuka.Journal())
    n, p = picture["N"], picture["P"]
    assert geometry(scene) == {"nu patch": 1}
    middle_z, tilt = p[:, 16, 2], n[:, 16, 2] / np.maximum(np.linalg.norm(n[:, 16], axis=1), 1e-9)
    sine = 0.5  # (0.5 - 0.2) / 0.6
    between = (middle_z > -0.3 + 0.5 * sine) & (middle_z < 0.3 + 0.2 * sine) & (picture["alpha"][:, 16] == 1)
    assert between.sum() >= 5
    assert np.abs(np.abs(tilt[between]) - sine).max() < 0.01


@pytest.mark.parametrize(
    ("axis", "place", "up", "wide"),
    [("X", (4, 0, 0), (0, 1, 0), True), ("Y", (0, 4, 0), (0, 0, -1), True), ("Z", (0, 0, 4), (0, 1, 0), True)],
)
def test_planes_lie_as_their_axis_says(tmp_path: Path, axis: str, place, up, wide: bool):
    """Width along z, x, x; length along y, z, y."""
    body = f'double width = 1.6\ndouble length = 0.5\nuniform token axis = "{axis}"'
    scene, _ = read(stage(tmp_path, CAMERA, SUN, f'def Plane "it" {{\n{body}\n}}\n'))
    seen = alpha(from_above(scene, up=up, place=place), 40) > 0.5
    assert (seen.any(0).sum(), seen.any(1).sum()) == ((32, 10) if wide else (10, 32))


@pytest.mark.parametrize("storage", ["uniform", "faceVarying"])
def test_colors_vary_over_the_faces_of_cubes(tmp_path: Path, storage: str):
    """In the order of USD's imaging: +z, -z, +y, -y, +x, -x."""
    colors = np.array([(0.1 + 0.15 * i, 0, 0) for i in range(6)])
    listed_ = listed(colors if storage == "uniform" else colors.repeat(4, 0))
    body = f'double size = 1\ncolor3f[] primvars:displayColor = {listed_} (interpolation = "{storage}")'
    scene, told = read(stage(tmp_path, CAMERA, SUN, f'def Cube "it" {{\n{body}\n}}\n'))
    assert told == []
    for view, color in zip(("ZPos", "ZNeg", "YPos", "YNeg", "XPos", "XNeg"), colors, strict=True):
        assert looked_at(scene, view)[6, 6] == pytest.approx(color, abs=TINT)


def test_colors_vary_over_the_corners_of_planes(tmp_path: Path):
    colors = listed([(0.9, 0, 0), (0, 0.9, 0), (0, 0, 0.9), (0.5, 0.5, 0.5)])
    body = f'uniform token axis = "Z"\ncolor3f[] primvars:displayColor = {colors} (interpolation = "vertex")'
    scene, told = read(stage(tmp_path, CAMERA, SUN, f'def Plane "it" {{\n{body}\n}}\n'))
    assert told == []
    from_above(scene, up=(0, 1, 0), place=(0, 0, 4)).resolution = 20, 20
    seen = kanuka.render(scene, progressions=4, threads=1)["albedo"]
    # +x +y, then counterclockwise.
    for place, color in (((1, 18), (0.9, 0, 0)), ((1, 1), (0, 0.9, 0)), ((18, 1), (0, 0, 0.9)), ((18, 18), (0.5,) * 3)):
        assert seen[place] == pytest.approx(color, abs=0.15)


@pytest.mark.parametrize(
    ("kind", "storage", "said"),
    [
        ("Sphere", "vertex", "/it: primvar displayColor varies over a Sphere; its first value stands"),
        ("Sphere", "constant", "/it: primvar displayColor is constant, but has several values; the first one stands"),
        ("Cube", "vertex", "/it: 2 vertex values of displayColor for 8; they have no effect"),
        ("Mesh", "faceVarying", "/it: 2 facevarying values of displayColor for 4; they have no effect"),
        ("Mesh", "constant", "/it: primvar displayColor is constant, but has several values; the first one stands"),
    ],
)
def test_colors_that_do_not_fit_are_told(tmp_path: Path, kind: str, storage: str, said: str):
    body = f'color3f[] primvars:displayColor = [(0.9, 0, 0), (0, 0.9, 0)] (interpolation = "{storage}")'
    if kind == "Mesh":
        body += SQUARE.replace("MORE", "point3f[] points = [(-1, 0, 1), (1, 0, 1), (1, 0, -1), (-1, 0, -1)]")
    scene, told = read(stage(tmp_path, CAMERA, SUN, f'def {kind} "it" {{\n{body}\n}}\n'))
    assert told == [said]
    scene.resolution = 8, 8
    seen = kanuka.render(scene, progressions=4, threads=1)["albedo"][4, 4]
    assert seen == pytest.approx((0.9, 0, 0) if "first" in said else (0.18,) * 3, abs=TINT)


TETRA = np.array([(-0.7, 0, 0.5), (0.7, 0, 0.5), (0, 0, -0.7), (0, 0.8, 0), (0.9, 0.5, -0.6)])


@pytest.mark.parametrize("surface", [True, False])
def test_the_surface_of_tetrahedra_is_seen(tmp_path: Path, surface: bool):
    """Two with a face in common; the faces of each by hand, outwards, but for that one."""
    faces = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 4), (1, 4, 3), (2, 3, 4)]
    authored = f"int3[] surfaceFaceVertexIndices = {[tuple(f) for f in faces]}" if surface else ""
    text = f"""
def TetMesh "t" {{
    int4[] tetVertexIndices = [(3, 0, 2, 1), (4, 2, 1, 3)]
    point3f[] points = {listed(TETRA)}
    {authored}
}}
"""
    scene, told = read(stage(tmp_path, CAMERA, SUN, text))
    assert told == []
    own = kanuka.Scene()
    own.add_mesh(TETRA, faces)
    same(scene, own)
    normals = [kanuka.render(s, progressions=4, threads=1, journal=kanuka.Journal())["N"] for s in (scene, own)]
    assert np.abs(normals[0] - normals[1]).mean() < 1e-2


def test_hermite_curves_are_bezier_curves(tmp_path: Path):
    text = """
def HermiteCurves "h" {
    int[] curveVertexCounts = [3, 2]
    point3f[] points = [(-0.8, 0, 0), (0, 0, -0.6), (0.8, 0, 0), (-0.8, 0, 0.8), (0.8, 0, 0.8)]
    vector3f[] tangents = [(0, 0, -2), (2, 0, 0), (0, 0, 2), (1, 0, -2), (1, 0, 2)]
    float[] widths = [0.1, 0.2, 0.1, 0.05, 0.2] (interpolation = "varying")
}
"""
    scene, told = read(stage(tmp_path, CAMERA, SUN, text))
    assert told == []
    own = kanuka.Scene()
    third, two = 1 / 3, 2 / 3
    first = [(-0.8, 0, 0), (-0.8, 0, -two), (-two, 0, -0.6), (0, 0, -0.6), (two, 0, -0.6), (0.8, 0, -two), (0.8, 0, 0)]
    second = [(-0.8, 0, 0.8), (-0.8 + third, 0, 0.8 - two), (0.8 - third, 0, 0.8 - two), (0.8, 0, 0.8)]
    own.add_curves(
        [*first, *second],
        [7, 4],
        basis="bezier",
        primvars={"varying float width": [0.1, 0.2, 0.1, 0.05, 0.2]},
    )
    same(scene, own)


@pytest.mark.parametrize("basis", ["bspline", "catmullRom"])
@pytest.mark.parametrize("storage", ["vertex", "varying"])
def test_values_reach_the_ends_of_pinned_curves(tmp_path: Path, basis: str, storage: str):
    """Two straight ones: colours and widths go evenly from end to end."""
    reds = "[(0, 0, 0), (0.8, 0, 0), (0.8, 0, 0), (0, 0, 0)]"
    text = f"""
def BasisCurves "c" {{
    uniform token basis = "{basis}"
    uniform token wrap = "pinned"
    int[] curveVertexCounts = [2, 2]
    point3f[] points = [(-1, 0, -0.5), (1, 0, -0.5), (-1, 0, 0.5), (1, 0, 0.5)]
    color3f[] primvars:displayColor = {reds} (interpolation = "{storage}")
    float[] widths = [0.2, 0.6, 0.6, 0.2] (interpolation = "{storage}")
    normal3f[] normals = [(0, 1, 0), (0, 1, 0), (0, 1, 0), (0, 1, 0)] (interpolation = "{storage}")
}}
"""
    scene, told = read(stage(tmp_path, CAMERA, SUN, text))
    assert told == []
    scene.resolution = 20, 40
    scene.options.filter, scene.options.filter_width = "box", (1, 1)
    picture = kanuka.render(from_above(scene), progressions=16, threads=1, resolution=(40, 40))
    x = (np.arange(40) + 0.5) / 40
    for red, width, row, half in (
        (0.8 * x, 0.2 + 0.4 * x, 10, np.s_[:20]),
        (0.8 - 0.8 * x, 0.6 - 0.4 * x, 30, np.s_[20:]),
    ):
        assert picture["albedo"][row, 1:-1, 0] == pytest.approx(red[1:-1], abs=2 * TINT)
        assert picture["alpha"][half].sum(0)[1:-1] * 2 / 40 == pytest.approx(width[1:-1], abs=0.03)


def test_curves_and_points_of_wrong_length_are_told(tmp_path: Path):
    curve = 'def {} "c" {{\n{}\nint[] curveVertexCounts = [2]\npoint3f[] points = [(0, 0, 0), (1, 0, 0)]\n{}\n}}\n'
    for kind, a, b, said in (
        ("HermiteCurves", "", "vector3f[] tangents = [(0, 0, 1)]", "/c: 1 tangents for 2 points. It is left out"),
        ("HermiteCurves", "", "", "/c: 0 tangents for 2 points. It is left out"),
        (
            "BasisCurves",
            'uniform token wrap = "pinned"\nuniform token basis = "bspline"',
            "int[] curveVertexCounts = [1, 1]",
            "/c: pinned curves of fewer than two points. It is left out",
        ),
        (
            "BasisCurves",
            "",
            "int[] curveVertexCounts = [3]",
            "/c: curveVertexCounts add up to 3, but there are 2 points. It is left out",
        ),
    ):
        text = curve.format(kind, a, b)
        if "curveVertexCounts" in b:
            text = text.replace("int[] curveVertexCounts = [2]\n", "", 1)
        scene, told = read(stage(tmp_path, CAMERA, SUN, text, mesh(), name=f"{len(said)}.usda"))
        assert told == [said]
        assert geometry(scene) == {"polygon mesh": 1}


def test_points_have_colors_and_widths_of_their_own(tmp_path: Path):
    text = """
def Points "p" {
    point3f[] points = [(-0.5, 0, 0), (0.5, 0, 0)]
    float[] widths = [0.4, 0.8] (interpolation = "varying")
    color3f[] primvars:displayColor = [(0.9, 0, 0), (0, 0.9, 0)] (interpolation = "vertex")
    NORMALS
}
"""
    scene, told = read(stage(tmp_path, CAMERA, SUN, text.replace("NORMALS", "")))
    assert told == []
    from_above(scene).resolution = 40, 40
    picture = kanuka.render(scene, progressions=4, threads=1)
    assert picture["albedo"][20, 10] == pytest.approx((0.9, 0, 0), abs=TINT)
    assert picture["albedo"][20, 30] == pytest.approx((0, 0.9, 0), abs=TINT)
    seen = alpha(scene, 40)
    assert seen[:, 20:].sum() / seen[:, :20].sum() == pytest.approx(4, rel=0.05)
    # Disks across normals: one is seen as it is, the other from its edge.
    normals = "normal3f[] normals = [(0, 1, 0), (1, 0, 0)]"
    scene, told = read(stage(tmp_path, CAMERA, SUN, text.replace("NORMALS", normals), name="b.usda"))
    assert told == []
    seen = alpha(from_above(scene), 40)
    assert 4 * seen[:, :20].mean() / 2 == pytest.approx(np.pi * 0.04, rel=0.05) and seen[:, 20:].max() < 0.2


# ---- volumes


SMOKE = """
def Volume "smoke" {
    rel field:density = </smoke/d>
    rel field:heat = </smoke/t>
    rel field:none = </smoke/nothing>
    def OpenVDBAsset "d" {
        asset filePath = @./smoke.vdb@
        token fieldName = "density"
    }
    def Field3DAsset "t" {
        asset filePath = @./gone.f3d@
    }
}
def Volume "empty" {
}
"""


def test_volumes_are_told_once_with_their_files(tmp_path: Path, kanuka_command):
    (tmp_path / "smoke.vdb").write_bytes(b"")
    path = stage(tmp_path, CAMERA, SUN, SMOKE, mesh())
    scene, told = read(path)
    expected = (
        "2 volumes are not rendered yet: /smoke (density of ./smoke.vdb, heat of ./gone.f3d, which is not found, "
        "none: there is nothing at /smoke/nothing); /empty (no fields)"
    )
    assert told == [expected]
    assert geometry(scene) == {"polygon mesh": 1}
    done = kanuka_command("info", path)
    assert done.returncode == 0 and "2, the first is /smoke" in done.stdout


@pytest.mark.parametrize("kind", ["class", "over", "def"])
def test_prototypes_may_be_where_nothing_else_renders_them(tmp_path: Path, kind: str):
    more = f'over "not" {{\n}}\nclass {mesh(name="no")[4:]}'  # neither is a prim of its own
    hidden = f'{kind} Scope "hidden" {{\ndef Xform "it" {{\n{mesh()}\n{more}\n}}\n}}\n'
    text = instancer(ZERO).replace("</pi/protos/it>", "</hidden/it>")
    scene, told = read(stage(tmp_path, CAMERA, SUN, hidden, text))
    assert told == []
    assert geometry(scene) == {"polygon mesh": 2 if kind == "def" else 1}
    assert alpha(scene).mean() == pytest.approx(0.125, abs=0.01)


def test_normals_of_other_types_are_no_reason_to_leave_a_mesh_out(tmp_path: Path):
    for normals in ("double normals = 7", "int normals = 7", "float3 normals = (0, 1, 0)"):
        scene, told = read(stage(tmp_path, CAMERA, MATTE, SUN, FLOOR.replace("EXTRA", normals)))
        assert scene.summary()["primitives"] == {"polygon mesh": 1}, normals
        assert all("have no effect" in message for message in told)  # one normal for four corners
