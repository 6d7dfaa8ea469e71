"""Motion of USD stages: against closed forms, and the same motion made in another way."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka
from usd_shapes import CORNERS, HELD, OPEN, TIMED, ZERO, alpha, exposure, instancer, mesh, same
from usd_stages import CAMERA, SUN, read, stage

GONE = "[(0.25, 0, 0.5), (0.75, 0, 0.5), (0.75, 0, -0.5), (0.25, 0, -0.5)]"
KEYED = f"point3f[] points.timeSamples = {{1: {CORNERS}}}"  # velocities start from samples
SLIDE = "\n".join(
    (
        "double3 xformOp:translate.timeSamples = {1: (0, 0, 0), 2: (1, 0, 0)}",
        'uniform token[] xformOpOrder = ["xformOp:translate"]',
    )
)
FOUR = "[" + ", ".join(["(4, 0, 0)"] * 4) + "]"


def native(at: str = "", inside: str = HELD) -> str:
    return f"""
class Xform "_proto" {{
    {mesh(inside)}
}}
def Xform "one" (instanceable = true
    inherits = </_proto>) {{
    {at}
}}
"""


ZERO_KEYED = "point3f[] positions.timeSamples = {1: [(0, 0, 0)]}"
WAYS = {
    "points": mesh(f"point3f[] points.timeSamples = {{1: {CORNERS}, 2: {GONE}}}"),
    "velocities": mesh(f"{KEYED}\nvector3f[] velocities.timeSamples = {{1: {FOUR}}}"),
    "velocities, other points next": mesh(
        f"point3f[] points.timeSamples = {{1: {CORNERS}, 2: [(0, 0, 0), (1, 0, 0), (1, 0, 1)]}}\n"
        f"vector3f[] velocities.timeSamples = {{1: {FOUR}, 2: [(0, 0, 0), (0, 0, 0), (0, 0, 0)]}}"
    ),
    "curve": """def BasisCurves "c" {
        uniform token type = "linear"
        int[] curveVertexCounts = [2]
        point3f[] points.timeSamples = {1: [(-0.5, 0, 0.5), (-0.5, 0, -0.5)]}
        vector3f[] velocities.timeSamples = {1: [(4, 0, 0), (4, 0, 0)]}
        float[] widths = [0.5] (interpolation = "constant")
        normal3f[] normals = [(0, 1, 0), (0, 1, 0)]
    }""",
    "point": """def Points "p" {
        point3f[] points.timeSamples = {1: [(-0.5, 0, 0)]}
        vector3f[] velocities.timeSamples = {1: [(4, 0, 0)]}
        float[] widths = [0.5]
    }""",
    "transform": f'def Xform "x" {{\n{SLIDE}\n{mesh()}}}',
    "positions": instancer("point3f[] positions.timeSamples = {1: [(0, 0, 0)], 2: [(1, 0, 0)]}"),
    "velocities of instances": instancer(f"{ZERO_KEYED}\nvector3f[] velocities.timeSamples = {{1: [(4, 0, 0)]}}"),
    "an instancer that moves": instancer(ZERO, more=SLIDE),
    "what holds it moves": f'def Xform "x" {{\n{SLIDE}\n{instancer(ZERO)}}}'.replace("</pi", "</x/pi"),
    "a prototype that moves": instancer(ZERO, protos=SLIDE),
    "inside of a prototype": instancer(ZERO, inside=HELD + "\n" + SLIDE),
    "points inside of a prototype": instancer(
        ZERO, inside=f"{KEYED}\nvector3f[] velocities.timeSamples = {{1: {FOUR}}}"
    ),
    "a native instance": native(SLIDE),
    "inside of a native instance": native(inside=HELD + "\n" + SLIDE),
    "half of it each": native(
        SLIDE.replace("(1, 0, 0)", "(0.5, 0, 0)"), HELD + "\n" + SLIDE.replace("(1, 0, 0)", "(0.5, 0, 0)")
    ),
}


@pytest.mark.parametrize("way", WAYS)
def test_what_moves_is_seen_for_as_long_as_it_is_there(tmp_path: Path, way: str):
    scene, told = read(stage(tmp_path, OPEN, SUN, WAYS[way], head=TIMED), frame=1)
    assert told == []
    seen = alpha(scene, samples=64)[15:17].mean(0)
    # 128 samples a column: a standard deviation of 0.044 at most, were they not stratified.
    assert np.abs(seen - exposure()).max() < 0.12
    assert np.abs(seen - exposure()).mean() < 0.02
    assert seen.sum() == pytest.approx(exposure().sum(), rel=0.02)


@pytest.mark.parametrize(("api", "ways"), [("", (0, 0.375, 0.5)), ("int motion:nonlinearSampleCount = 2", (0, 0.5))])
def test_accelerations_bend_the_way(tmp_path: Path, api: str, ways: tuple[float, ...]):
    """x = v t + a t² / 2 at the start, the middle and the end of a quarter of a second; or at fewer times."""
    back = FOUR.replace("4,", "-16,")
    text = mesh(
        f"{KEYED}\nvector3f[] velocities.timeSamples = {{1: {FOUR}}}\n"
        f"vector3f[] accelerations.timeSamples = {{1: {back}}}\n{api}"
    )
    if api:
        text = text.replace('"m"', '"m" (prepend apiSchemas = ["MotionAPI"])')
    scene, told = read(stage(tmp_path, OPEN, SUN, text, head=TIMED), frame=1)
    assert told == []
    own = kanuka.Scene()
    corners = np.array([(-0.75, 0, 0.5), (-0.25, 0, 0.5), (-0.25, 0, -0.5), (-0.75, 0, -0.5)])
    own.add_mesh([corners + np.array([x, 0, 0]) for x in ways], [[0, 1, 2, 3]])
    same(scene, own)


def test_instances_turn_by_their_angular_velocities(tmp_path: Path):
    """360 degrees a second about y, for a quarter of a second."""
    turned = "quath[] orientations.timeSamples = {1: [(1, 0, 0, 0)]}"
    turning = "vector3f[] angularVelocities.timeSamples = {1: [(0, 360, 0)]}"
    text = instancer(f"{ZERO}\n{turned}\n{turning}")
    scene, told = read(stage(tmp_path, OPEN, SUN, text, head=TIMED), frame=1)
    assert told == []
    own = kanuka.Scene()
    group = own.add_group()
    group.add_mesh([(-0.75, 0, 0.5), (-0.25, 0, 0.5), (-0.25, 0, -0.5), (-0.75, 0, -0.5)], [[0, 1, 2, 3]])
    c, s = np.cos(np.radians([0, 22.5, 45, 67.5, 90])), np.sin(np.radians([0, 22.5, 45, 67.5, 90]))
    places = np.zeros((5, 1, 3, 4))
    places[:, 0, 0, 0], places[:, 0, 0, 2], places[:, 0, 2, 0], places[:, 0, 2, 2] = c, s, -s, c
    places[:, 0, 1, 1] = 1
    own.add_instances(group, places)
    same(scene, own)


@pytest.mark.parametrize(
    ("values", "said"),
    [
        (FOUR, "/m: velocities start from time samples of points, and there are none; they have no effect"),
        ("[(4, 0, 0)]", "/m: 1 velocities for 4 points; they have no effect"),
        ("[" + ", ".join(["(nan, 0, 0)"] * 4) + "]", "/m: some of its velocities are no numbers; they have no effect"),
    ],
)
def test_velocities_that_make_no_sense_are_told(tmp_path: Path, values: str, said: str):
    scene, told = read(
        stage(tmp_path, OPEN, SUN, mesh(f"{HELD}\nvector3f[] velocities = {values}"), head=TIMED), frame=1
    )
    assert told == [said]
    assert alpha(scene)[15:17].mean() == pytest.approx(0.25, abs=0.02)


def test_places_that_are_no_numbers_are_told(tmp_path: Path):
    text = instancer("point3f[] positions = [(0, 0, 0), (nan, 0, 0), (inf, 0, 0)]")
    scene, told = read(stage(tmp_path, CAMERA, SUN, text.replace("[0]", "[0, 0, 0]")))
    assert told == ["/pi: 2 places are no numbers. Those are left out"]
    assert alpha(scene).mean() == pytest.approx(0.125, abs=0.01)


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ("point3f[] positions = [(0, 0, 0), (1, 0, 0)]", "/pi: 1 protoIndices, but 2 positions. It is left out"),
        ("", "/pi: 1 protoIndices, but no positions. It is left out"),
        (f"{ZERO}\nfloat3[] scales = [(2, 2, 2), (1, 1, 1)]", "/pi: 1 protoIndices, but 2 scales. They have no effect"),
    ],
)
def test_instancers_with_too_few_values_are_told(tmp_path: Path, values: str, said: str):
    scene, told = read(stage(tmp_path, CAMERA, SUN, instancer(values)))
    assert told == [said]
    assert alpha(scene).mean() == pytest.approx(0.125 if "scales" in said else 0, abs=0.01)


def test_places_are_usds_own(tmp_path: Path):
    """Prototype's matrix, scale, orientation, position: against UsdGeom's computation, at hundreds of places."""
    from pxr import Gf, Usd, UsdGeom, Vt

    from kanuka.usd.instances import Instancer
    from kanuka.usd.items import Above
    from kanuka.usd.motion import Shutter
    from kanuka.usd.transforms import Transforms

    made = Usd.Stage.CreateInMemory()
    schema = UsdGeom.PointInstancer.Define(made, "/pi")
    ball = UsdGeom.Sphere.Define(made, "/pi/ball")
    ball.AddTranslateOp().Set((1, 2, 3))
    ball.AddRotateXYZOp().Set((10, 20, 30))
    schema.CreatePrototypesRel().SetTargets([ball.GetPath()])
    random = np.random.default_rng(5)
    quaternions = random.normal(size=(300, 4)).astype(np.float32)
    quaternions /= np.linalg.norm(quaternions, axis=1, keepdims=True)
    schema.CreateProtoIndicesAttr([0] * 300)
    schema.CreatePositionsAttr(Vt.Vec3fArray.FromNumpy(random.normal(size=(300, 3)).astype(np.float32)))
    schema.CreateScalesAttr(Vt.Vec3fArray.FromNumpy(random.uniform(-2, 2, (300, 3)).astype(np.float32)))
    schema.CreateOrientationsfAttr(Vt.QuatfArray.FromNumpy(quaternions))
    schema.CreateOrientationsAttr([Gf.Quath(1, 0, 0, 0)] * 300)
    outer = Gf.Matrix4d().SetRotate(Gf.Rotation((1, 1, 0), 40)) * Gf.Matrix4d().SetTranslate((4, 5, 6))
    frame = Usd.TimeCode(1)
    shutter = Shutter(frame, (frame,))
    transforms = Transforms(frame, [frame])
    above = Above(matrices=(outer,))
    (placed,) = Instancer(schema.GetPrim(), above, (made.GetPseudoRoot(), Above()), shutter, transforms, print).placed()
    expected = np.array([np.array(m * outer).T[:3] for m in schema.ComputeInstanceTransformsAtTime(1, 1)])
    assert placed.matrices == pytest.approx(expected, abs=1e-5)


@pytest.mark.parametrize(
    ("values", "said"),
    [
        (
            f"{ZERO}\nvector3f[] velocities = [(4, 0, 0)]",
            "/pi: velocities start from time samples of positions, and there are none; they have no effect",
        ),
        (
            f"{ZERO_KEYED}\nvector3f[] velocities.timeSamples = {{1: [(4, 0, 0), (4, 0, 0)]}}",
            "/pi: 1 protoIndices, but 2 velocities. They have no effect",
        ),
        (
            f"{ZERO}\nvector3f[] angularVelocities = [(0, 90, 0)]\nquath[] orientations = [(1, 0, 0, 0)]",
            "/pi: angularVelocities start from time samples of orientations, and there are none; they have no effect",
        ),
    ],
)
def test_velocities_of_instances_that_make_no_sense_are_told(tmp_path: Path, values: str, said: str):
    scene, told = read(stage(tmp_path, OPEN, SUN, instancer(values), head=TIMED), frame=1)
    assert told == [said]
    assert alpha(scene)[15:17].mean() == pytest.approx(0.25, abs=0.02)
