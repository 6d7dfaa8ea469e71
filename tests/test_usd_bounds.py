"""What a camera is fitted to where a stage has none: boxes worked out by hand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka
import kanuka.usd
from kanuka import standins
from usd_shapes import alpha
from usd_stages import HEAD, SUN, read, stage

BOX = """
    int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]
    int[] faceVertexIndices = [0,1,3,2, 4,6,7,5, 0,2,6,4, 1,5,7,3, 0,4,5,1, 2,3,7,6]
    point3f[] points = [(-.5,-.5,-.5), (-.5,-.5,.5), (-.5,.5,-.5), (-.5,.5,.5),
                        (.5,-.5,-.5), (.5,-.5,.5), (.5,.5,-.5), (.5,.5,.5), (99, 99, 99)]
    uniform token subdivisionScheme = "none"
"""
UNIT = ((-0.5, -0.5, -0.5), (0.5, 0.5, 0.5))


def moved(x: float, y: float = 0, z: float = 0, scale: float = 1) -> str:
    return f"""
    double3 xformOp:translate = ({x}, {y}, {z})
    float3 xformOp:scale = ({scale}, {scale}, {scale})
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]
"""


def place_of(scene: kanuka.Scene) -> np.ndarray:
    return np.asarray(scene.camera.camera_from_world)


def fitted(low, high) -> np.ndarray:
    corners = np.array([[(low, high)[i >> axis & 1][axis] for axis in range(3)] for i in range(8)], dtype=float)
    return np.asarray(standins.camera(corners, 960 / 540).camera_from_world)


@pytest.mark.parametrize(
    "extent",
    [
        "",
        "[(-.5, -.5, -.5), (.5, .5, .5)]",
        "[(-5, -5, -5), (5, 5, 5)]",
        "[(1, 1, 1), (0, 0, 0)]",
        "[(0, 0, 0), (0, 0, 0)]",
    ],
)
def test_the_camera_goes_by_the_shape_whatever_its_extent(tmp_path: Path, extent: str):
    own = f"float3[] extent = {extent}" if extent else ""
    scene, told = read(stage(tmp_path, f'def Mesh "m" {{{BOX}{own}\n}}\n'))
    assert [text[:23] for text in told] == ["the stage has no camera", "the stage has no lights"]
    assert place_of(scene) == pytest.approx(fitted(*UNIT), abs=1e-5)
    seen = alpha(scene, 32, 4)
    assert seen[[0, -1]].max() == 0 and seen[:, [0, -1]].max() == 0 and seen[16, 16] == 1
    assert seen.mean() > 0.2


# Text, and the box that it fills.
FILLED = {
    "sphere": ('def Sphere "s" {\ndouble radius = 2\n}', (-2, -2, -2), (2, 2, 2)),
    "cylinder": (
        'def Cylinder "s" {\nuniform token axis = "Z"\ndouble radius = 2\ndouble height = 3\n}',
        (-2, -2, -1.5),
        (2, 2, 1.5),
    ),
    "cone": (
        'def Cone "s" {\nuniform token axis = "X"\ndouble radius = 2\ndouble height = 3\n}',
        (-1.5, -2, -2),
        (1.5, 2, 2),
    ),
    "capsule": (
        'def Capsule "s" {\nuniform token axis = "Y"\ndouble radius = 0.5\ndouble height = 2\n}',
        (-0.5, -1.5, -0.5),
        (0.5, 1.5, 0.5),
    ),
    "cube": (f'def Cube "s" {{\ndouble size = 3\n{moved(1, 2, 3)}\n}}', (-0.5, 0.5, 1.5), (2.5, 3.5, 4.5)),
    "curves": (
        'def BasisCurves "s" {\nuniform token type = "linear"\nint[] curveVertexCounts = [2]\n'
        "point3f[] points = [(-1, 0, 0), (1, 2, 0)]\nfloat[] widths = [0.2, 0.6]\n}",
        (-1.3, -0.3, -0.3),
        (1.3, 2.3, 0.3),
    ),
    "points": (
        'def Points "s" {\npoint3f[] points = [(-1, 0, 0), (1, 2, 0)]\n'
        'float[] widths = [0.5] (interpolation = "constant")\n}',
        (-1.25, -0.25, -0.25),
        (1.25, 2.25, 0.25),
    ),
    "weights": (
        'def NurbsPatch "s" {\nint uVertexCount = 2\nint vVertexCount = 2\nint uOrder = 2\nint vOrder = 2\n'
        "double[] uKnots = [0, 0, 1, 1]\ndouble[] vKnots = [0, 0, 1, 1]\ndouble[] pointWeights = [1, 2, 4, 1]\n"
        "point3f[] points = [(0, 0, 1), (3, 0, 1), (0, 2, -1), (3, 2, -1)]\n}",
        (0, 0, -1),
        (3, 2, 1),
    ),
    "a prim scaled": (
        f'def Xform "x" {{\n{moved(1, scale=3)}\ndef Mesh "m" {{{BOX}}}\n}}',
        (-0.5, -1.5, -1.5),
        (2.5, 1.5, 1.5),
    ),
    "two": (f'def Mesh "m" {{{BOX}}}\ndef Sphere "s" {{\n{moved(7)}\n}}', (-0.5, -1, -1), (8, 1, 1)),
    "what is not shown": (
        f'def Mesh "m" {{{BOX}}}\ndef Sphere "s" {{\n{moved(7)}\ntoken visibility = "invisible"\n}}\n'
        f'def Sphere "g" {{\n{moved(7)}\nuniform token purpose = "guide"\n}}',
        *UNIT,
    ),
    "a light": (f'def Mesh "m" {{{BOX}}}\ndef RectLight "l" {{\n{moved(0, 50)}\n}}', *UNIT),
    "instances": (
        f'class "box" {{\ndef Mesh "m" {{{BOX}}}\n}}\n'
        + "".join(
            f'def Xform "i{x}" (instanceable = true\ninherits = </box>) {{\n{moved(x, scale=2)}\n}}\n' for x in (0, 4)
        ),
        (-1, -1, -1),
        (5, 1, 1),
    ),
    "instances of instances": (
        f"""
class "box" {{
    def Mesh "m" {{{BOX}}}
}}
def PointInstancer "outer" {{
    rel prototypes = </protos/inner>
    int[] protoIndices = [0, 0]
    point3f[] positions = [(0, 0, 0), (0, 10, 0)]
    {moved(1)}
}}
class Scope "protos" {{
    def PointInstancer "inner" {{
        rel prototypes = </protos/inner/i>
        int[] protoIndices = [0, 0]
        point3f[] positions = [(0, 0, 0), (3, 0, 0)]
        float3[] scales = [(1, 1, 1), (2, 2, 2)]
        def Xform "i" (instanceable = true
            inherits = </box>) {{
        }}
    }}
}}
""",
        (0.5, -1, -1),
        (5, 11, 1),
    ),
}


@pytest.mark.parametrize("name", FILLED)
def test_the_camera_is_fitted_to_what_is_there(tmp_path: Path, name: str):
    text, low, high = FILLED[name]
    scene, told = read(stage(tmp_path, SUN, text + "\n"))
    assert [text[:23] for text in told] == ["the stage has no camera"]
    assert place_of(scene) == pytest.approx(fitted(low, high), abs=1e-4)


def test_stages_that_stand_on_z_are_turned_first(tmp_path: Path):
    path = stage(tmp_path, SUN, FILLED["points"][0] + "\n", head=HEAD.replace('"Y"', '"Z"'))
    scene, _ = read(path)
    assert place_of(scene) == pytest.approx(fitted((-1.25, -0.25, -2.25), (1.25, 0.25, 0.25)), abs=1e-4)


def test_a_stage_of_nothing_is_told(tmp_path: Path):
    for text in ("", 'def Points "p" {\npoint3f[] points = []\n}\n'):
        scene, told = read(stage(tmp_path, SUN, text))
        assert told == ["the stage has nothing to look at"]
        assert scene.summary()["primitives"] == {}


def test_the_rib_of_a_stage_is_seen_from_the_same_place(tmp_path: Path):
    path = stage(tmp_path, SUN, FILLED["instances"][0])
    kanuka.usd.convert(path, tmp_path / "a.rib", journal=kanuka.Journal())
    scene = kanuka.load(tmp_path / "a.rib", journal=kanuka.Journal())
    assert place_of(scene) == pytest.approx(fitted(*FILLED["instances"][1:]), abs=1e-4)
