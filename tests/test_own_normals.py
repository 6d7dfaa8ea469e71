"""Lobes on normals of their own, in pictures: which way they reflect, and that no light is lost."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka
import kanuka.usd
from usd_stages import CAMERA, FLOOR, picture, read, stage

# In texture space, leaning by as much as takes the view from above to 30 degrees from it.
LEAN = np.array([np.sin(np.radians(15)), 0, np.cos(np.radians(15))])
COATED = """
def Material "matte" {
    token outputs:mtlx:surface.connect = </matte/s.outputs:out>
    def Shader "s" {
        uniform token info:id = "ND_standard_surface_surfaceshader"
        float inputs:base = BASE
        color3f inputs:base_color = (1, 1, 1)
        float inputs:specular = 0
        float inputs:coat = 1
        float inputs:coat_roughness = ROUGHNESS
        NORMAL
        token outputs:out
    }
    def Shader "bump" {
        uniform token info:id = "ND_normalmap_float"
        float3 inputs:in = (X, 0.5, Z)
        float3 outputs:out
    }
}
"""
ST = 'texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] (interpolation = "vertex")'
# A small disk in the sky, `AWAY` degrees from above towards +x.
SUN = """
def DistantLight "sun" {
    float inputs:intensity = 1000
    float inputs:angle = 4
    float3 xformOp:rotateXYZ = (-90, 0, AWAY)
    uniform token[] xformOpOrder = ["xformOp:rotateXYZ"]
}
"""
SKY = 'def DomeLight "sky" {\n    float inputs:intensity = 1\n}\n'
BOTH = "normal3f inputs:normal.connect = </matte/bump.outputs:out>"
COATS = "normal3f inputs:coat_normal.connect = </matte/bump.outputs:out>"


def floor(folder: Path, light: str, normal: str, base: float = 0, roughness: float = 0) -> kanuka.Scene:
    x, _, z = LEAN / 2 + 0.5
    text = COATED.replace("X", f"{x:.6f}", 1).replace("NORMAL", normal).replace("ROUGHNESS", str(roughness))
    text = text.replace("BASE", str(base)).replace("(X,", f"({x:.6f},").replace("Z)", f"{z:.6f})")
    scene, told = read(stage(folder, CAMERA, text, FLOOR.replace("EXTRA", ST), light))
    assert told == []
    return scene


def straight_down(scene: kanuka.Scene) -> float:
    """What the camera sees in the middle."""
    rgb = picture(scene, 9, 64)
    return float(rgb[4, 4].mean())


@pytest.mark.parametrize(("normal", "away"), [("", 0), (BOTH, 0), (COATS, 30), (COATS + "\n" + BOTH, 30)])
def test_a_mirror_shows_the_sun_where_its_own_normal_says(tmp_path: Path, normal: str, away: float) -> None:
    """A coat over black: 4 % of the sun straight on, and next to that at 15 degrees, and nothing of it elsewhere."""
    seen = straight_down(floor(tmp_path, SUN.replace("AWAY", str(-away)), normal))
    assert seen == pytest.approx(40, rel=0.03)
    other = 30 - away
    assert straight_down(floor(tmp_path, SUN.replace("AWAY", str(-other)), normal)) < 1e-20


@pytest.mark.parametrize("roughness", [0.0, 0.4])
@pytest.mark.parametrize("normal", ["", BOTH, COATS, COATS + "\n" + BOTH])
def test_no_light_is_lost_whatever_the_normals(tmp_path: Path, normal: str, roughness: float) -> None:
    """White paint below a clear coat, in a white furnace."""
    rgb = picture(floor(tmp_path, SKY, normal, base=1, roughness=roughness), 8, 256)
    inner = rgb[2:6, 2:6]
    assert inner.mean() == pytest.approx(1, abs=0.01)


def test_instances_turn_them(tmp_path: Path) -> None:
    """The floor on its side, seen by a camera that lies there too: nothing changes."""
    turn = '\n    float3 xformOp:rotateXYZ = (0, 0, 90)\n    uniform token[] xformOpOrder = ["xformOp:rotateXYZ"]\n'
    plain = straight_down(floor(tmp_path, SUN.replace("AWAY", "-30"), COATS))
    x, _, z = LEAN / 2 + 0.5
    text = COATED.replace("NORMAL", COATS).replace("ROUGHNESS", "0").replace("BASE", "0")
    text = text.replace("(X,", f"({x:.6f},").replace("Z)", f"{z:.6f})")
    things = text + FLOOR.replace("EXTRA", ST) + SUN.replace("AWAY", "-30") + CAMERA
    body = things.replace("</", "</proto/").replace('def Camera "cam"', 'def Camera "cam"')
    root = f'def Xform "world" (\n    instanceable = true\n    prepend references = </proto>\n) {{{turn}}}\n'
    shapes = body.replace(CAMERA, "").replace(SUN.replace("AWAY", "-30"), "")
    outside = f'def Xform "eye" {{{turn}\n{CAMERA}\n{SUN.replace("AWAY", "-30")}}}\n'
    path = stage(tmp_path, f'class Xform "proto" {{\n{shapes}\n}}\n', root, outside, name="b.usda")
    scene, told = read(path)
    assert told == []
    assert straight_down(scene) == pytest.approx(plain, rel=0.02) and plain > 30


def test_any_number_of_lanes_shows_the_same(tmp_path: Path) -> None:
    scene = floor(tmp_path, SKY, COATS + "\n" + BOTH, base=1, roughness=0.3)
    scene.resolution = (16, 16)
    one, eight = (kanuka.render(scene, progressions=4, lanes=lanes)["rgb"] for lanes in (1, 8))
    np.testing.assert_array_equal(one, eight)
