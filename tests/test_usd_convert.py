"""Stages and models as RIB: the picture of a RIB is that of what it was made of."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka
import kanuka.models
import kanuka.usd
from usd_stages import CAMERA, FLOOR, MATTE, SUN, TEXTURED, stage

SIZE = (24, 24)
GLOSSY = MATTE.replace("matte", "glossy").replace("(0, 0, 0)", "(0.4, 0.4, 0.4)")
BOUND = ' (prepend apiSchemas = ["MaterialBindingAPI"]) {\n    rel material:binding = </glossy>\n'


def both(path: Path, samples: int = 8, **options) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Pictures of a stage and of its RIB, and what is said of the latter."""
    rib, journal = path.with_suffix(".rib"), kanuka.Journal()
    kanuka.usd.convert(path, rib, journal=journal, **options)
    scenes = kanuka.usd.load(path, journal=kanuka.Journal(), **options), kanuka.load(rib, journal=journal)
    layers = []
    for scene in scenes:
        scene.resolution = SIZE
        picture = kanuka.render(scene, progressions=samples, threads=1, journal=kanuka.Journal())
        layers.append(np.dstack([picture["rgb"], picture["alpha"]]))
    return *layers, [f"{m.severity}: {m.message}" for m in journal if m.severity != "info"]


def assert_same(path: Path, **options) -> np.ndarray:
    """Matrices are multiplied in another order, which turns a ray in hundreds to the other side of an edge; all else is
    the same to the last bits. Returns the picture."""
    stage, rib, told = both(path, **options)
    assert told == []
    assert stage[..., :3].max() > 0.02 and stage[..., :3].std() > 0.002, "there is something to see"
    off = np.abs(stage - rib).max(-1) > 1e-3 + 1e-3 * np.abs(stage).max(-1)
    assert off.mean() < 0.02, f"{off.sum()} of {off.size} pixels differ"
    assert rib.mean() == pytest.approx(stage.mean(), rel=2e-3)
    return stage


MESH = (
    'def Mesh "it"'
    + BOUND
    + """
    uniform token subdivisionScheme = "SCHEME"
    int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]
    int[] faceVertexIndices = [0,1,3,2, 4,6,7,5, 0,2,6,4, 1,5,7,3, 0,4,5,1, 2,3,7,6]
    point3f[] points = [(-.5,-.5,-.5), (-.5,-.5,.5), (-.5,.5,-.5), (-.5,.5,.5),
                        (.5,-.5,-.5), (.5,-.5,.5), (.5,.5,-.5), (.5,.5,.5), (9, 9, 9)]
    EXTRA
}
"""
)
SHAPES = {
    "polygons": MESH.replace("SCHEME", "none").replace("EXTRA", "int[] holeIndices = [5]"),
    "normals": MESH.replace("SCHEME", "none").replace(
        "EXTRA", f'normal3f[] normals = [{", ".join(["(0.6, 0.8, 0)"] * 24)}] (interpolation = "faceVarying")'
    ),
    "left hand": MESH.replace("SCHEME", "none").replace(
        "EXTRA", 'uniform token orientation = "leftHanded"\nuniform bool doubleSided = 0'
    ),
    "subdivision": MESH.replace("SCHEME", "catmullClark").replace(
        "EXTRA",
        """int[] creaseIndices = [2, 3, 7, 6, 2]
    int[] creaseLengths = [5]
    float[] creaseSharpnesses = [2.5]
    int[] cornerIndices = [7]
    float[] cornerSharpnesses = [10]
    int[] holeIndices = [0]""",
    ),
    "bilinear": MESH.replace("SCHEME", "bilinear").replace("EXTRA", ""),
    "sphere": 'def Sphere "it"' + BOUND + "double radius = 0.7\n}\n",
    "cone": 'def Cone "it"' + BOUND + 'uniform token axis = "X"\n}\n',
    "cylinder": 'def Cylinder "it"' + BOUND + 'uniform token axis = "Z"\ndouble radius = 0.3\n}\n',
    "points": 'def Points "it"' + BOUND + "point3f[] points = [(-.5,0,0), (.5,0,0)]\nfloat[] widths = [.4, .8]\n}\n",
    **{
        f"{basis} {wrap}": 'def BasisCurves "it"'
        + BOUND
        + f"""uniform token basis = "{basis}"
    uniform token wrap = "{wrap}"
    int[] curveVertexCounts = [7, 4]
    point3f[] points = [(-1,0,-.6), (-.5,0,.8), (0,0,-.8), (.5,0,.8), (.8,0,-.6), (.9,0,0), (1,0,.3),
                        (-1,0,.2), (-.5,0,.3), (.5,0,.4), (1,0,.2)]
    float[] widths = [WIDTHS] (interpolation = "KIND")
}}
""".replace("WIDTHS", widths).replace("KIND", kind)
        for basis, wrap, widths, kind in (
            ("bezier", "nonperiodic", "0.1, 0.3, 0.1, 0.2, 0.2", "varying"),
            ("bspline", "nonperiodic", "0.2, 0.4", "uniform"),
            ("catmullRom", "pinned", "0.3", "constant"),
        )
    },
    "ribbons": 'def BasisCurves "it"'
    + BOUND
    + """uniform token type = "linear"
    int[] curveVertexCounts = [2]
    point3f[] points = [(-1, 0, 0), (1, 0, 0)]
    normal3f[] normals = [(0, 1, 0), (0, 1, 0)]
    float[] widths = [0.4, 0.8] (interpolation = "vertex")
}
""",
}


@pytest.mark.parametrize("shape", SHAPES)
def test_shapes_are_the_same(tmp_path: Path, shape: str) -> None:
    assert_same(stage(tmp_path, CAMERA, GLOSSY, SUN, SHAPES[shape]))


PLACED = """    matrix4d xformOp:transform = ((0.8,0.1,0.2,0), (0,0.9,-0.3,0), (-0.1,0.2,1,0), (0.3,2,0.2,1))
    uniform token[] xformOpOrder = ["xformOp:transform"]
}
"""
LIGHTS = {
    "distant": 'def DistantLight "l" {\nfloat inputs:intensity = 3\nfloat inputs:angle = 20\n'
    "bool inputs:normalize = 1\n",
    "dome": 'def DomeLight "l" {\nasset inputs:texture:file = @./quarters.png@\n',
    "rect": 'def RectLight "l" {\nfloat inputs:intensity = 4\nasset inputs:texture:file = @./quarters.png@\n'
    "float inputs:width = 1.4\n",
    "disk": 'def DiskLight "l" {\nfloat inputs:intensity = 4\ncolor3f inputs:color = (1, 0.5, 0.2)\n',
    "sphere": 'def SphereLight "l" {\nfloat inputs:intensity = 4\n',
    "cylinder": 'def CylinderLight "l" {\nfloat inputs:intensity = 4\nfloat inputs:length = 1.5\n',
    "point": 'def SphereLight "l" {\nfloat inputs:intensity = 9\nbool treatAsPoint = 1\n',
    "spot": 'def SphereLight "l" (prepend apiSchemas = ["ShapingAPI"]) {\nfloat inputs:intensity = 40\n'
    "float inputs:shaping:cone:angle = 35\nfloat inputs:shaping:cone:softness = 0.4\nfloat inputs:shaping:focus = 3\n",
}


def quarters(folder: Path) -> None:
    picture = np.zeros((16, 16, 3), np.float32)
    picture[:8, :8], picture[:8, 8:], picture[8:, :8], picture[8:, 8:] = (
        (1, 0, 0),
        (0, 1, 0),
        (0, 0, 1),
        (0.4, 0.4, 0.4),
    )
    kanuka.Picture({"rgb": picture}).write(folder / "quarters.png", display="linear")


@pytest.mark.parametrize("light", LIGHTS)
def test_lights_are_the_same(tmp_path: Path, light: str) -> None:
    quarters(tmp_path)
    ball = 'def Sphere "ball"' + BOUND + "double radius = 0.4\n}\n"
    placed = PLACED
    if light in ("distant", "rect", "disk", "spot"):  # shine down
        turned = 'float xformOp:rotateX = -80\nuniform token[] xformOpOrder = ["xformOp:transform", "xformOp:rotateX"]'
        placed = PLACED.replace('uniform token[] xformOpOrder = ["xformOp:transform"]', turned)
    assert_same(stage(tmp_path, CAMERA, MATTE, GLOSSY, FLOOR.replace("EXTRA", ""), ball, LIGHTS[light] + placed))


def test_textures_and_primvars_are_the_same(tmp_path: Path) -> None:
    quarters(tmp_path)
    st = 'texCoord2f[] primvars:map = [(0, 0), (2, 0), (2, 2), (0, 1)] (interpolation = "faceVarying")'
    textured = TEXTURED.replace("SPACE", "raw").replace("SCALE", "0.5")
    shown = assert_same(stage(tmp_path, CAMERA, textured, SUN, FLOOR.replace("EXTRA", st)))
    assert shown[..., :3].std(axis=(0, 1)).min() > 0.01


NESTED = """
def "tree" (instanceable = true) {
}
def Xform "forest" {
    def PointInstancer "grove" {
        rel prototypes = [</forest/grove/pair>, </forest/grove/ball>]
        int[] protoIndices = [0, 1, 0]
        point3f[] positions = [(-0.6, 0, -0.5), (0, 0, 0.6), (0.6, 0, -0.2)]
        quath[] orientations = [(1, 0, 0, 0), (1, 0, 0, 0), (0.7, 0, 0.7, 0)]
        def Xform "pair" {
            def Xform "a" (
                instanceable = true
                references = </leaf>
            ) {}
            def Xform "b" (
                instanceable = true
                references = </leaf>
            ) {
                double3 xformOp:translate = (0.3, 0, 0.2)
                uniform token[] xformOpOrder = ["xformOp:translate"]
            }
        }
        def Sphere "ball" {
            double radius = 0.2
            color3f[] primvars:displayColor = [(0.9, 0.2, 0.1)]
        }
    }
}
class Xform "leaf" {
    def Cube "c" {
        double size = 0.2
        color3f[] primvars:displayColor = [(0.1, 0.8, 0.2)]
    }
}
"""


def test_instances_are_the_same(tmp_path: Path) -> None:
    path = stage(tmp_path, CAMERA, SUN, NESTED)
    assert_same(path)
    found = kanuka.load(path.with_suffix(".rib")).summary()
    assert (found["instances"], found["groups"]) == (5, 3)  # three of the grove, and two in each pair


MOVES = """
def Camera "moving" {
    float focalLength = 40
    float horizontalAperture = 20
    float verticalAperture = 20
    double shutter:open = 0
    double shutter:close = 1
    matrix4d xformOp:transform.timeSamples = {
        1: ((1,0,0,0), (0,0,-1,0), (0,1,0,0), (0,4,0,1)),
        2: ((1,0,0,0), (0,0,-1,0), (0,1,0,0), (0.3,4,0,1))
    }
    uniform token[] xformOpOrder = ["xformOp:transform"]
}
def Sphere "ball" {
    double radius = 0.3
    double3 xformOp:translate.timeSamples = {1: (-0.4, 0, 0), 2: (0.5, 0, 0.2)}
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Mesh "bent" {
    uniform token subdivisionScheme = "none"
    int[] faceVertexCounts = [3]
    int[] faceVertexIndices = [0, 1, 2]
    point3f[] points.timeSamples = {
        1: [(-1, 0, -1), (-0.4, 0, -1), (-0.4, 0, -0.4)],
        2: [(-1, 0, -0.5), (-0.4, 0, -0.6), (0, 0, -0.4)]
    }
}
def Xform "tree" (
    instanceable = true
    references = </kind>
) {
    double3 xformOp:translate.timeSamples = {1: (0.4, 0, -0.4), 2: (0.7, 0, -0.8)}
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
class Xform "kind" {
    def Sphere "s" {
        double radius = 0.2
    }
}
"""


def test_what_moves_is_the_same(tmp_path: Path) -> None:
    still = stage(tmp_path, SUN, MOVES.replace("shutter:close = 1", "shutter:close = 0"), name="still.usda")
    moving = stage(tmp_path, SUN, MOVES, name="moving.usda")
    sharp, blurred = (assert_same(path, frame=1, samples=32) for path in (still, moving))
    assert np.abs(sharp - blurred).mean() > 0.005


def test_links_between_lights_and_shapes_are_the_same(tmp_path: Path) -> None:
    linked = SUN.replace("{", '(prepend apiSchemas = ["CollectionAPI:lightLink", "CollectionAPI:shadowLink"]) {', 1)
    linked = linked.replace(
        "}", "rel collection:lightLink:excludes = </a>\nrel collection:shadowLink:excludes = </b>\n}"
    )
    second = SUN.replace('"sun"', '"moon"').replace("intensity = 2", "intensity = 0.3")
    balls = "".join(
        f'def Sphere "{name}" {{\ndouble radius = 0.4\ndouble3 xformOp:translate = ({x}, 1, 0)\n'
        'uniform token[] xformOpOrder = ["xformOp:translate"]\n}\n'
        for name, x in (("a", -0.5), ("b", 0.5))
    )
    path = stage(tmp_path, CAMERA, MATTE, FLOOR.replace("EXTRA", ""), balls, linked, second)
    assert_same(path)
    text = path.with_suffix(".rib").read_text()
    for category in ("lighting", "shadow"):
        assert f'Attribute "{category}" "string[1] excludesubset" ["/sun"]' in text


@pytest.mark.parametrize(
    "settings",
    [
        "uniform int2 resolution = (48, 24)",
        "uniform int2 resolution = (20, 40)",
        "uniform int2 resolution = (24, 24)\nuniform float pixelAspectRatio = 2",
    ],
)
def test_views_are_the_same(tmp_path: Path, settings: str) -> None:
    lens = "float horizontalApertureOffset = 3\nfloat fStop = 10\nfloat focusDistance = 2\nfloat exposure = 1\n"
    for kind in ("perspective", "orthographic"):
        wide = CAMERA.replace('"cam" {', f'"cam" {{\ntoken projection = "{kind}"\n{lens}')
        window = "uniform float4 dataWindowNDC = (0.1, 0, 1, 0.8)"
        render = f'def RenderSettings "settings" {{\n{window}\n{settings}\n}}\n'
        path = stage(tmp_path, wide, MATTE, SUN, FLOOR.replace("EXTRA", ""), render, name=f"{kind}.usda")
        path.write_text(path.read_text().replace("(\n", '(\n    renderSettingsPrimPath = "/settings"\n', 1))
        rib = path.with_suffix(".rib")
        kanuka.usd.convert(path, rib)
        pictures = [kanuka.render(s, progressions=4, threads=1) for s in (kanuka.usd.load(path), kanuka.load(rib))]
        assert pictures[0].full_size == pictures[1].full_size and pictures[0].offset == pictures[1].offset
        shown = pictures[0]["rgb"]
        assert shown.mean() > 0.05 and np.abs(shown - pictures[1]["rgb"]).mean() < 2e-3 * shown.mean()
