"""USD stages: against scenes that the Python interface makes, and against closed forms. Lights and materials:
test_usd_looks.py."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path

import numpy as np
import pytest

import kanuka
import kanuka.usd
from usd_stages import CAMERA, FLOOR, HEAD, MATTE, MOVED, ST, STANDARD, SUN, TEXTURED, middle, picture, read, stage

# ---- geometry


def test_a_subdivision_surface_is_the_interfaces(tmp_path: Path):
    cube = """
def Mesh "cube" (prepend apiSchemas = ["MaterialBindingAPI"]) {
    rel material:binding = </matte>
    int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]
    int[] faceVertexIndices = [0,1,3,2, 4,6,7,5, 0,2,6,4, 1,5,7,3, 0,4,5,1, 2,3,7,6]
    point3f[] points = [(-.5,-.5,-.5), (-.5,-.5,.5), (-.5,.5,-.5), (-.5,.5,.5),
                        (.5,-.5,-.5), (.5,-.5,.5), (.5,.5,-.5), (.5,.5,.5)]
    int[] creaseIndices = [0, 1, 3, 2, 0]
    int[] creaseLengths = [5]
    float[] creaseSharpnesses = [2.5]
    int[] cornerIndices = [7]
    float[] cornerSharpnesses = [10]
    double3 xformOp:translate = (0.2, 0.1, 0)
    float xformOp:rotateY = 30
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateY"]
}
"""
    scene, told = read(stage(tmp_path, CAMERA, MATTE, SUN, cube))
    assert told == []
    own = kanuka.Scene()
    own.camera = scene.camera
    c, s = math.cos(math.radians(30)), math.sin(math.radians(30))
    points = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    own.add_subdivision(
        points,
        [[0, 1, 3, 2], [4, 6, 7, 5], [0, 2, 6, 4], [1, 5, 7, 3], [0, 4, 5, 1], [2, 3, 7, 6]],
        creases=[[0, 1, 3, 2, 0]],
        crease_sharpness=[2.5],
        corners=[7],
        corner_sharpness=[10],
        transform=[[c, 0, s, 0.2], [0, 1, 0, 0.1], [-s, 0, c, 0], [0, 0, 0, 1]],
        material=kanuka.Material("matte", color=(0.5, 0.5, 0.5)),
    )
    own.add_light("distant", amount=2, direction=(0, -1, 0))
    for each in (scene, own):
        each.resolution = (48, 48)
    a, b = (kanuka.render(each, progressions=16) for each in (scene, own))
    assert np.array_equal(a["alpha"], b["alpha"])  # the same surface, hit by the same rays
    assert a["rgb"].mean() == pytest.approx(b["rgb"].mean(), rel=0.01)
    assert 0.05 < a["alpha"].mean() < 0.9


def test_polygons_keep_normals_holes_and_orientation(tmp_path: Path):
    mesh = """
def Mesh "m" (prepend apiSchemas = ["MaterialBindingAPI"]) {
    rel material:binding = </matte>
    uniform token subdivisionScheme = "none"
    uniform token orientation = "leftHanded"
    int[] faceVertexCounts = [4, 4]
    int[] faceVertexIndices = [0, 3, 4, 1, 1, 4, 5, 2]
    int[] holeIndices = [1]
    point3f[] points = [(-1,0,1), (0,0,1), (1,0,1), (-1,0,-1), (0,0,-1), (1,0,-1)]
    normal3f[] normals = [(0,1,0), (0,1,0), (0,1,0), (0,1,0), (0,1,0), (0,1,0), (0,1,0), (0,1,0)] (
        interpolation = "faceVarying"
    )
}
"""
    scene, told = read(stage(tmp_path, CAMERA, MATTE, SUN, mesh))
    rgb = picture(scene)
    assert told == []
    assert rgb[:, :7].mean() == pytest.approx(0.5 / math.pi * 2, rel=1e-3)
    assert rgb[:, 9:].max() == 0


@pytest.mark.parametrize(
    ("kind", "body", "area"),
    [
        ("Sphere", "double radius = 0.5", math.pi / 4),
        ("Cube", "double size = 0.8", 0.64),
        ("Cylinder", 'double radius = 0.4\ndouble height = 1\nuniform token axis = "X"', 0.8),
        ("Cone", 'double radius = 0.5\ndouble height = 1\nuniform token axis = "Z"', 0.5),
        ("Capsule", 'double radius = 0.2\ndouble height = 0.8\nuniform token axis = "X"', 0.32 + math.pi * 0.04),
        ("Plane", 'double width = 1.2\ndouble length = 0.5\nuniform token axis = "Y"', 0.6),
        ("Points", "point3f[] points = [(-0.5, 0, 0), (0.5, 0, 0)]\nfloat[] widths = [0.4, 0.6]", math.pi * 0.13),
        (
            "BasisCurves",
            'uniform token type = "linear"\nint[] curveVertexCounts = [2]\npoint3f[] points = [(-0.8,0,0), (0.8,0,0)]\n'
            "float[] widths = [0.2, 0.2]",
            0.32,
        ),
    ],
)
def test_solids_cover_their_area_as_seen_from_above(tmp_path: Path, kind: str, body: str, area: float):
    scene, told = read(
        stage(tmp_path, CAMERA.replace("perspective", ""), MATTE, SUN, f'def {kind} "it" {{\n{body}\n}}\n')
    )
    scene.resolution = (64, 64)
    scene.camera = kanuka.Camera(
        (0, 4, 0), (0, 0, 0), up=(0, 0, -1), projection="orthographic", screen_window=(-1, 1, -1, 1)
    )
    alpha = kanuka.render(scene, progressions=16)["alpha"]
    assert told == []
    assert 4 * float(alpha.mean()) == pytest.approx(area, rel=0.02)


def test_pinned_curves_reach_their_ends(tmp_path: Path):
    curve = """
def BasisCurves "c" {
    uniform token type = "cubic"
    uniform token basis = "catmullRom"
    uniform token wrap = "pinned"
    int[] curveVertexCounts = [3]
    point3f[] points = [(-0.8, 0, 0), (0, 0, 0), (0.8, 0, 0)]
    float[] widths = [0.2] (interpolation = "constant")
}
"""
    scene, _ = read(stage(tmp_path, CAMERA, SUN, curve))
    covered = picture(scene, 64).max(-1).max(0) > 0
    assert covered[7:57].all() and not covered[:5].any() and not covered[59:].any()


def test_subsets_of_faces_have_materials_of_their_own(tmp_path: Path):
    red = MATTE.replace('"matte"', '"red"').replace("</matte", "</red").replace("(0.5, 0.5, 0.5)", "(0.5, 0, 0)")
    sub = """
    def GeomSubset "half" (prepend apiSchemas = ["MaterialBindingAPI"]) {
        uniform token elementType = "face"
        uniform token familyName = "materialBind"
        int[] indices = [1]
        rel material:binding = </red>
    }
"""
    for scheme in ("none", "catmullClark"):
        mesh = f"""
def Mesh "m" (prepend apiSchemas = ["MaterialBindingAPI"]) {{
    rel material:binding = </matte>
    uniform token subdivisionScheme = "{scheme}"
    int[] faceVertexCounts = [4, 4]
    int[] faceVertexIndices = [0, 1, 4, 3, 1, 2, 5, 4]
    point3f[] points = [(-1,0,1), (0,0,1), (1,0,1), (-1,0,-1), (0,0,-1), (1,0,-1)]
    {sub}
}}
"""
        scene, told = read(stage(tmp_path, CAMERA, MATTE, red, SUN, mesh, name=f"{scheme}.usda"))
        rgb = picture(scene)
        assert told == []
        assert rgb[8, 3] == pytest.approx(np.full(3, 1 / math.pi), rel=2e-2)
        assert rgb[8, 12, 0] == pytest.approx(1 / math.pi, rel=2e-2) and rgb[8, 12, 1:].max() < 0.03


def test_z_up_stages_are_turned(tmp_path: Path):
    ball = MOVED.replace("BODY", "double radius = 0.3").replace("PLACE", "(0, 0, 2)")
    scene, _ = read(stage(tmp_path, ball, SUN, head=HEAD.replace('"Y"', '"Z"')))
    scene.camera = kanuka.Camera((0, 2, 5), (0, 2, 0), fov=20)
    scene.add_light("environment")
    scene.resolution = (32, 32)
    covered = kanuka.render(scene, progressions=4)["alpha"] > 0
    assert np.argwhere(covered).mean(0) == pytest.approx([15.5, 15.5], abs=0.5)


# ---- instances


def test_instancers_place_masked_nested_prototypes(tmp_path: Path):
    text = """
def PointInstancer "outer" {
    rel prototypes = </outer/protos/pair>
    int[] protoIndices = [0, 0, 0]
    int64[] ids = [10, 11, 12]
    int64[] invisibleIds = [11]
    point3f[] positions = [(-0.5, 0, -0.5), (9, 0, 9), (0.5, 0, 0.5)]
    def Scope "protos" {
        def PointInstancer "pair" {
            rel prototypes = </outer/protos/pair/ball>
            int[] protoIndices = [0, 0]
            point3f[] positions = [(-0.2, 0, 0), (0.2, 0, 0)]
            float3[] scales = [(1, 1, 1), (0.5, 0.5, 0.5)]
            def Sphere "ball" {
                double radius = 0.15
            }
        }
    }
}
"""
    scene, told = read(stage(tmp_path, CAMERA, SUN, text))
    own = kanuka.Scene()
    for x in (-0.5, 0.5):
        for dx, r in ((-0.2, 0.15), (0.2, 0.075)):
            own.add_sphere(r, transform=[[1, 0, 0, x + dx], [0, 1, 0, 0], [0, 0, 1, x], [0, 0, 0, 1]])
    own.camera = scene.camera
    own.add_light("distant", direction=(0, -1, 0))
    for each in (scene, own):
        each.resolution = (64, 64)
    a, b = (kanuka.render(each, progressions=8)["alpha"] for each in (scene, own))
    assert told == []
    assert np.abs(a - b).mean() < 1e-3
    assert scene.summary()["instances"] == 4


def test_native_instances_share_what_is_in_them(tmp_path: Path):
    text = """
class "_proto" {
    def Sphere "ball" {
        double radius = 0.2
    }
}
def Xform "a" (instanceable = true
    inherits = </_proto>) {
    double3 xformOp:translate = (-0.5, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Xform "b" (instanceable = true
    inherits = </_proto>) {
    double3 xformOp:translate = (0.5, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
"""
    scene, _ = read(stage(tmp_path, CAMERA, SUN, text))
    assert scene.summary()["groups"] == 1 and scene.summary()["instances"] == 2
    rgb = picture(scene, 32)
    assert rgb[16, 8].min() > 0 and rgb[16, 24].min() > 0 and rgb[16, 16].max() == 0


# ---- what is wrong


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (("[0, 1, 2, 3]", "[0, 1, 2, 9]"), "faceVertexIndices reach 9, but there are 4 points"),
        (("[4]", "[5]"), "faceVertexCounts add up to 5, but there are 4 faceVertexIndices"),
        (("(-1, 0, 1)", "(nan, 0, 1)"), "some of its points are no numbers"),
        (("UsdPreviewSurface", "Phong"), "no surface that can be read (it has Phong"),
        (("EXTRA", "int[] creaseIndices = [0, 1]\nint[] creaseLengths = [3]"), ""),
    ],
)
def test_faults_are_told_with_their_prim_and_the_rest_is_rendered(
    tmp_path: Path, change: tuple[str, str], expected: str
):
    text = (MATTE + FLOOR).replace(*change).replace("EXTRA", "")
    ball = 'def Sphere "ball" {\ndouble radius = 0.5\n}\n'
    scene, told = read(stage(tmp_path, CAMERA, text, ball, SUN))
    assert middle(picture(scene)) > 0
    if expected:
        assert len(told) == 1 and expected in told[0] and ("/floor" in told[0] or "/matte" in told[0])


def test_networks_in_circles_unknown_nodes_and_missing_files_are_told(tmp_path: Path):
    bad = TEXTURED.replace("SPACE", "auto").replace("SCALE", "1")
    scene, told = read(stage(tmp_path, CAMERA, bad, FLOOR.replace("EXTRA", ST), SUN))
    assert len(told) == 1 and 'the file "./quarters.png" is not found' in told[0]
    circle = STANDARD.replace("float inputs:in1 = 3", "float inputs:in1.connect = </matte/half.outputs:out>")
    scene, told = read(stage(tmp_path, CAMERA, circle, FLOOR.replace("EXTRA", ""), SUN, name="b.usda"))
    assert len(told) == 1 and "runs in a circle" in told[0]
    unknown = STANDARD.replace("ND_multiply_float", "ND_wibble_float")
    scene, told = read(stage(tmp_path, CAMERA, unknown, FLOOR.replace("EXTRA", ""), SUN, name="c.usda"))
    assert len(told) == 1 and 'there is no node "ND_wibble_float"' in told[0]
    assert picture(scene).max() > 0


def test_odd_numbers_are_told_and_the_rest_is_rendered(tmp_path: Path):
    camera = CAMERA.replace("horizontalAperture = 20", "horizontalAperture = 0")
    text = """
def Sphere "hollow" {
    double radius = -1
}
def RectLight "narrow" {
    float inputs:width = -2
}
def PointInstancer "p" {
    rel prototypes = [</p>]
    int[] protoIndices = [0]
    point3f[] positions = [(0, 0, 0)]
}
"""
    scene, told = read(stage(tmp_path, camera, text, 'def Sphere "ball" {\ndouble radius = 0.5\n}\n', SUN))
    for path, what in (("/cam", "make no picture"), ("/hollow", "positive"), ("/narrow", "width"), ("/p", "in itself")):
        assert any(t.startswith(path) and what in t for t in told), (path, told)
    assert scene.resolution == (960, 540)
    assert len(told) == 4


def test_stages_without_camera_and_light_are_seen_and_say_so(tmp_path: Path):
    scene, told = read(stage(tmp_path, 'def Sphere "b" {\ndouble radius = 300\n}\n'))
    assert [("no camera" in t, "no lights" in t) for t in told] == [(True, False), (False, True)]
    alpha = kanuka.render(scene, progressions=4)["alpha"]
    assert 0.1 < alpha.mean() < 0.4 and alpha[0].max() == 0  # large, and whole


def test_what_cannot_be_opened_is_an_error(tmp_path: Path):
    (tmp_path / "bad.usda").write_text("#usda 1.0\ndef Sphere {{{")
    with pytest.raises(kanuka.Error, match=r"bad\.usda"):
        kanuka.usd.load(tmp_path / "bad.usda")
    path = stage(tmp_path, CAMERA, SUN)
    with pytest.raises(kanuka.Error, match='no camera "other"; it has /cam'):
        kanuka.usd.load(path, camera="other")
    with pytest.raises(kanuka.Error, match=r'expected "/prim\{set\}=choice"'):
        kanuka.usd.load(path, variants={"x": "y"})


def test_without_usd_the_error_names_the_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "pxr", None)
    with pytest.raises(kanuka.Error, match=r"pip install 'kanuka\[usd\]'"):
        kanuka.usd.load(stage(tmp_path, CAMERA))


# ---- cameras, times, the command


def test_apertures_offsets_and_projections(tmp_path: Path):
    ball = 'def Sphere "b" {\ndouble radius = 0.05\n}\n'
    for extra, expected in (
        ("", 31.5),
        ("float horizontalApertureOffset = 5", 15.5),
        ("float verticalApertureOffset = 5", None),
    ):
        scene, _ = read(stage(tmp_path, CAMERA.replace("float focalLength", f"{extra}\nfloat focalLength"), ball, SUN))
        lit = np.argwhere(picture(scene, 64).max(-1) > 0).mean(0)
        if expected is None:
            assert lit == pytest.approx([47.5, 31.5], abs=0.6)
        else:
            assert lit == pytest.approx([31.5, expected], abs=0.6)
    ortho = CAMERA.replace("float focalLength", 'token projection = "orthographic"\nfloat focalLength')
    scene, _ = read(stage(tmp_path, ortho, 'def Sphere "b" {\ndouble radius = 0.5\n}\n', SUN))
    scene.resolution = (64, 64)
    alpha = kanuka.render(scene, progressions=16)["alpha"]
    assert 4 * alpha.mean() == pytest.approx(math.pi / 4, rel=0.02)  # 20 tenths wide


def test_time_samples_and_the_shutter(tmp_path: Path):
    head = HEAD.replace("(\n", "(\n    startTimeCode = 1\n    endTimeCode = 3\n", 1)
    ball = """
def Sphere "b" {
    double radius = 0.1
    double3 xformOp:translate.timeSamples = { 1: (-0.5, 0, 0), 3: (0.5, 0, 0) }
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
"""
    path = stage(tmp_path, CAMERA, ball, SUN, head=head)
    assert kanuka.usd.frames(path) == [1, 2, 3]
    for frame, x in ((None, 16), (1, 16), (2, 32), (3, 48)):
        scene, _ = read(path, frame=frame)
        assert np.argwhere(picture(scene, 64).max(-1) > 0).mean(0)[1] == pytest.approx(x - 0.5, abs=1)
    path = stage(tmp_path, CAMERA.replace("float focal", "double shutter:close = 2\nfloat focal"), ball, SUN, head=head)
    scene, _ = read(path)
    streak = picture(scene, 64).max(-1).max(0) > 0
    assert streak[14:50].all() and not streak[:10].any()


def test_the_command_renders_and_shows_stages(tmp_path: Path, kanuka_command):
    path = stage(tmp_path, CAMERA, MATTE, FLOOR.replace("EXTRA", ""), SUN, name="shot.usda")
    done = kanuka_command("render", path, "--resolution", "16x16", "--progressions", "1", cwd=tmp_path)
    assert done.returncode == 0 and (tmp_path / "shot.exr").exists()
    done = kanuka_command("info", path, cwd=tmp_path)
    assert done.returncode == 0 and "floor" in done.stdout
    done = kanuka_command("render", path, path, cwd=tmp_path)
    assert done.returncode == 2 and "is rendered by itself" in done.stderr
    done = kanuka_command("render", tmp_path / "none.usda", cwd=tmp_path)
    assert done.returncode == 4


def test_a_store_serves_the_next_render_of_a_stage(tmp_path: Path, kanuka_command):
    path = stage(tmp_path, CAMERA, MATTE, FLOOR.replace("EXTRA", ""), SUN, name="shot.usda")
    pictures = []
    for number in (1, 2):
        stats = tmp_path / f"{number}.json"
        wanted = ("--resolution", "16x16", "--progressions", "1", "--store", tmp_path / "store", "--stats", stats)
        assert kanuka_command("render", path, *wanted, "-o", tmp_path / f"{number}.exr", cwd=tmp_path).returncode == 0
        pictures.append(kanuka.read(tmp_path / f"{number}.exr")["rgb"])
    assert np.array_equal(*pictures)
    found = json.loads((tmp_path / "2.json").read_text())
    assert found["bytes"]["store_read"] > 0 and found["time"]["shade_s"] == 0


ASSETS = Path(__file__).parents[2] / "shared" / "scenes" / "usd" / "test_assets"


@pytest.mark.skipif(not ASSETS.is_dir(), reason=f"the stages of {ASSETS.name} are not here")
def test_public_test_stages_load():
    stages = sorted(ASSETS.rglob("*.usd*"))
    assert len(stages) > 30
    for path in stages:
        scene, _ = read(path)
        scene.resolution = (16, 9)
        kanuka.render(scene, progressions=1, journal=kanuka.Journal())
