"""Settings, skins and linking of USD stages."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka
from usd_stages import CAMERA, FLOOR, MATTE, SUN, middle, picture, read, stage

# ---- settings


SETTINGS = """
def Scope "Render" {
    def RenderSettings "settings" {
        uniform int2 resolution = (120, 40)
        uniform float pixelAspectRatio = 2
        uniform float4 dataWindowNDC = (0.25, 0, 1, 0.5)
        rel camera = </second>
        uniform bool disableMotionBlur = 1
    }
}
def Camera "second" {
    float2 clippingRange = (0.1, 1000)
    float fStop = 2
    float focusDistance = 5
}
"""


def settings(tmp_path: Path, text: str = SETTINGS) -> tuple[kanuka.Scene, list[str]]:
    path = stage(tmp_path, CAMERA, FLOOR.replace("EXTRA", ""), MATTE, SUN, text)
    path.write_text(path.read_text().replace("(\n", '(\n    renderSettingsPrimPath = "/Render/settings"\n', 1))
    return read(path)


def test_the_stages_settings_make_the_picture(tmp_path: Path) -> None:
    scene, told = settings(tmp_path)
    assert told == []
    assert (scene.resolution, scene.options.pixel_aspect) == ((120, 40), 2)
    assert scene.options.crop == pytest.approx((0.25, 1, 0.5, 1))
    assert kanuka.render(scene, progressions=1)["rgb"].shape == (20, 90, 3)


def test_all_of_the_aperture_is_seen_at_any_resolution(kanuka_command, tmp_path: Path) -> None:
    """A floor that fills a square aperture: wide pictures have room beside it, high ones above."""
    path = stage(tmp_path, CAMERA, FLOOR.replace("EXTRA", ""), MATTE, SUN)
    for size, beside in (("48x24", np.s_[12, 6]), ("24x48", np.s_[6, 12])):
        out = tmp_path / f"{size}.exr"
        result = kanuka_command("render", path, "-o", out, "--resolution", size, "--progressions", "4", "-q")
        assert result.returncode == 0, result.stderr
        rgb = kanuka.read(out)["rgb"]
        middle_of = rgb[rgb.shape[0] // 2, rgb.shape[1] // 2]
        assert middle_of.min() > 0.2 and rgb[beside].max() == 0
        assert rgb.any(-1).sum() == pytest.approx(24 * 24, abs=60)


def test_settings_that_make_no_picture_are_told(tmp_path: Path) -> None:
    scene, told = settings(tmp_path, SETTINGS.replace("120, 40", "0, 40").replace("0.25, 0, 1, 0.5", "1, 0, 1, 1"))
    assert ["makes no picture" in text or "data window of nothing" in text for text in told] == [True, True]
    assert scene.resolution[0] == 960


# ---- skins


SKIN = """
def SkelRoot "man" {
    def Skeleton "bones" (prepend apiSchemas = ["SkelBindingAPI"]) {
        uniform token[] joints = ["a"]
        uniform matrix4d[] bindTransforms = [((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1))]
        uniform matrix4d[] restTransforms = [((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1))]
        rel skel:animationSource = </man/walk>
    }
    def SkelAnimation "walk" {
        uniform token[] joints = ["a"]
        float3[] translations.timeSamples = {1: [(0, 0, 0)], 2: [(1, 0, 0)]}
        quatf[] rotations = [(1, 0, 0, 0)]
        half3[] scales = [(1, 1, 1)]
    }
    def Mesh "skin" (prepend apiSchemas = ["SkelBindingAPI"]) {
        rel skel:skeleton = </man/bones>
        int[] primvars:skel:jointIndices = [0, 0, 0, 0] (
            elementSize = 1
            interpolation = "vertex"
        )
        float[] primvars:skel:jointWeights = [1, 1, 1, 1] (
            elementSize = 1
            interpolation = "vertex"
        )
        uniform token subdivisionScheme = "none"
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        point3f[] points = [(-1, 0, 1), (0, 0, 1), (0, 0, -1), (-1, 0, -1)]
    }
}
"""


def test_skins_follow_their_bones(tmp_path: Path) -> None:
    path = stage(tmp_path, CAMERA, SKIN, SUN)
    left, right = np.s_[6:10, 3], np.s_[6:10, 12]
    for frame, here, gone in ((1, left, right), (2, right, left)):
        scene, told = read(path, frame=frame)
        assert told == []
        rgb = picture(scene)
        assert rgb[here].min() > 0.05 and rgb[gone].max() == 0


# ---- linking


def test_lights_shine_on_what_they_are_linked_with(tmp_path: Path) -> None:
    """The floor is lit by a sun that leaves it out, and by none; a lid stops the light of a sun, and of none."""
    link = """{
    uniform bool collection:lightLink:includeRoot = 1
    rel collection:lightLink:excludes = </floor>"""
    floor = FLOOR.replace("EXTRA", "")
    lid = floor.replace('"floor"', '"lid"').replace(", 0, ", ", 5, ")  # above the camera
    shadow = link.replace("lightLink", "shadowLink").replace("/floor", "/lid")
    found = {}
    for name, pieces in {
        "lit": (floor, SUN),
        "unlinked": (floor, SUN.replace("{", link, 1)),
        "shaded": (floor, lid, SUN),
        "through": (floor, lid, SUN.replace("{", shadow, 1)),
    }.items():
        scene, told = read(stage(tmp_path, CAMERA, MATTE, *pieces, name=f"{name}.usda"))
        assert told == []
        found[name] = middle(picture(scene))
    assert found["lit"] > 0.2
    assert found["unlinked"] == 0
    assert found["shaded"] < 0.01
    assert found["through"] == pytest.approx(found["lit"], rel=0.01)
