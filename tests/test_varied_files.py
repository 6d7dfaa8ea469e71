"""Instances that differ, as RIB and USD say it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import kanuka
from test_instance_variation import banded, close, row, shaders, stage  # noqa: F401
from test_usd_convert import both
from usd_stages import CAMERA, SUN, read
from usd_stages import stage as usd_stage


def test_rib_says_it_by_attributes(tmp_path: Path) -> None:
    rib = """Attribute "identifier" "name" "x"
ObjectBegin "ball"
Attribute "instance" "int variants" [3]
Surface "banded" "float bands" [5]
Sphere 0.8 -0.8 0.8 360
ObjectEnd
"""
    variants, tints = [0.5, 2, 1], [(1, 1, 1), (0.5, 0.6, 0.7), (1, 1, 1)]
    for place, variant, tint in zip(row(3), variants, tints, strict=True):
        matrix = np.vstack([place, [0, 0, 0, 1]]).T.reshape(-1)
        rib += f'AttributeBegin\nAttribute "instance" "float variant" [{variant}]\n'
        if tint != (1, 1, 1):
            rib += f'Attribute "instance" "color tint" [{" ".join(map(str, tint))}]\n'
        rib += f'ConcatTransform [{" ".join(map(str, matrix))}]\nObjectInstance "ball"\nAttributeEnd\n'
    (tmp_path / "balls.rib").write_text(f"WorldBegin\n{rib}WorldEnd\n")
    read = kanuka.load(tmp_path / "balls.rib")
    assert read.summary()["groups"] == 1  # what they differ by makes no groups
    scene = stage()
    read.options.shader_path = scene.options.shader_path
    read.resolution, read.camera = scene.resolution, scene.camera
    read.add_light("environment", amount=1)
    other = kanuka.Scene()
    other.options.shader_path = scene.options.shader_path
    other.resolution, other.camera = scene.resolution, scene.camera
    group = other.add_group("ball")
    group.add_sphere(0.8, material=banded(bands=5), variants=3)
    other.add_instances(group, row(3), variant=variants, tint=tints)
    other.add_light("environment", amount=1)
    close(kanuka.render(read, progressions=4), kanuka.render(other, progressions=4))


def test_in_rib_a_sibling_that_says_nothing_takes_what_is_around_it(tmp_path: Path) -> None:
    (tmp_path / "two.rib").write_text("""Format 64 32 1
Projection "perspective" "fov" 20
Translate 0 0 9
WorldBegin
LightSource "environmentlight" 1 "intensity" 1
ObjectBegin "ball"
Surface "matte"
Sphere 0.8 -0.8 0.8 360
ObjectEnd
ObjectBegin "pair"
TransformBegin
Translate -1 0 0
ObjectInstance "ball"
TransformEnd
AttributeBegin
Translate 1 0 0
Attribute "instance" "color tint" [0.1 0.1 0.8]
ObjectInstance "ball"
AttributeEnd
ObjectEnd
AttributeBegin
Attribute "instance" "color tint" [0.8 0.1 0.1]
ObjectInstance "pair"
AttributeEnd
WorldEnd
""")
    rgb = np.asarray(kanuka.render(kanuka.load(tmp_path / "two.rib"), progressions=2)["rgb"], np.float64)
    left, right = rgb[14:18, 18:26].mean((0, 1)), rgb[14:18, 38:46].mean((0, 1))
    assert left[0] > 4 * left[2]
    assert right[2] > 4 * right[0]


PROTOTYPE = """
def Material "paint" {
    token outputs:surface.connect = </paint/s.outputs:surface>
    def Shader "s" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (0.9, 0.9, 0.9)
        float inputs:roughness.connect = </paint/r.outputs:result>
        token outputs:surface
    }
    def Shader "r" {
        uniform token info:id = "UsdPrimvarReader_float"
        string inputs:varname = "variant"
        float outputs:result
    }
}
"""
BALL = """
class Sphere "ball" (prepend apiSchemas = ["MaterialBindingAPI"]) {
    double radius = 0.45
    int primvars:kanuka:variants = 2
    rel material:binding = </paint>
}
"""
POINTS = """
def PointInstancer "pi" {
    rel prototypes = </ball>
    int[] protoIndices = [0, 0, 0]
    point3f[] positions = [(-0.6, 0, 0), (9, 9, 9), (0.6, 0, 0)]
    int64[] ids = [4, 5, 6]
    int64[] invisibleIds = [5]
    DIFFERENCES
}
"""
BY_INSTANCE = """
    color3f[] primvars:kanuka:tint = [(1, 0.1, 0.1), (1, 1, 1), (0.1, 0.1, 1)] (interpolation = "varying")
    float[] primvars:kanuka:variant = [0, 1, 1] (interpolation = "varying")
"""


def test_usd_says_it_by_primvars(tmp_path: Path) -> None:
    at = tmp_path / "a"
    at.mkdir()
    path = usd_stage(at, CAMERA, SUN, PROTOTYPE, BALL, POINTS.replace("DIFFERENCES", BY_INSTANCE))
    shown, rib, told = both(path)
    assert told == []
    assert np.abs(shown - rib).max(-1).mean() < 5e-3
    covered = shown[..., 3] > 0.9
    left, right = (shown[:, part][covered[:, part]][:, :3].mean(0) for part in (slice(0, 12), slice(12, 24)))
    assert left[0] > 3 * left[2]
    assert right[2] > 3 * right[0]


def test_usd_tells_of_lists_of_another_length(tmp_path: Path) -> None:
    wrong = "color3f[] primvars:kanuka:tint = [(1, 0, 0), (0, 1, 0)]"
    _, told = read(usd_stage(tmp_path, CAMERA, SUN, PROTOTYPE, BALL, POINTS.replace("DIFFERENCES", wrong)))
    assert any("primvars:kanuka:tint: expected a colour, or one for each of 3 instances" in text for text in told)


def test_what_usd_says_wrongly_has_no_effect(tmp_path: Path) -> None:
    wrong = (
        'string[] primvars:kanuka:tint = ["red"]\n    float[] primvars:kanuka:variant = [1e9, 0, 0]\n'
        "    bool primvars:kanuka:unique = 1\n"
        "    vector3f[] velocities.timeSamples = {1: [(9, 0, 0), (0, 0, 0), (9, 0, 0)]}\n"
        "    point3f[] positions.timeSamples = {1: [(-0.6, 0, 0), (9, 9, 9), (0.6, 0, 0)]}"
    )
    points = POINTS.replace("    point3f[] positions = [(-0.6, 0, 0), (9, 9, 9), (0.6, 0, 0)]\n", "")
    head = '#usda 1.0\n(\n    upAxis = "Y"\n    metersPerUnit = 1\n    timeCodesPerSecond = 24\n)\n'
    camera = CAMERA.replace("float focalLength", "double shutter:close = 0.5\n    float focalLength")
    parts = camera, SUN, PROTOTYPE, BALL, points.replace("DIFFERENCES", wrong)
    scene, told = read(usd_stage(tmp_path, *parts, head=head), frame=1)
    assert any("primvars:kanuka:tint: expected a colour" in text for text in told)
    assert any("primvars:kanuka:unique: what moves stays instances" in text for text in told)
    scene.resolution = 16, 16
    kanuka.render(scene, progressions=1)
