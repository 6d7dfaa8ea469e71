"""Lights and materials of USD stages, against closed forms."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from pxr import UsdUtils

import kanuka
import kanuka.usd
from usd_stages import CAMERA, FLOOR, MATTE, ST, STANDARD, SUN, TEXTURED, middle, picture, read, stage

# ---- lights: irradiance at the origin, from closed forms

BELOW = "float xformOp:rotateX = -90\nuniform token[] xformOpOrder = ["
UP = """double3 xformOp:translate = (0, 2, 0)
float xformOp:rotateX = -90
uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateX"]
"""


@pytest.mark.parametrize(
    ("kind", "body", "expected"),
    [
        ("DistantLight", "bool inputs:normalize = 1\nfloat inputs:angle = 2", 1),
        (
            "DistantLight",
            "float inputs:angle = 2\nfloat inputs:exposure = 3",
            8 * math.pi * math.sin(math.radians(1)) ** 2,
        ),
        ("RectLight", "float inputs:width = 0.1\nfloat inputs:height = 0.2", 0.02 / 4),
        ("RectLight", "bool inputs:normalize = 1\nfloat inputs:width = 0.1\nfloat inputs:height = 0.2", 1 / 4),
        ("DiskLight", "float inputs:radius = 0.5", math.pi * 0.25 / 4.25),
        ("DiskLight", "bool inputs:normalize = 1\nfloat inputs:radius = 0.5", 1 / 4.25),
        ("SphereLight", "float inputs:radius = 0.5", math.pi * (0.5 / 2) ** 2),
        ("SphereLight", "bool inputs:normalize = 1\nfloat inputs:radius = 0.5", (0.5 / 2) ** 2 / (4 * 0.25)),
        ("SphereLight", "float inputs:radius = 0.1\nbool treatAsPoint = 1", math.pi * 0.01 / 4),
        ("CylinderLight", "float inputs:radius = 0.01\nfloat inputs:length = 0.1", 2 * 0.01 * 0.1 / 4),
        ("DomeLight", "", math.pi),
    ],
)
def test_lights_have_the_irradiance_of_the_specification(tmp_path: Path, kind: str, body: str, expected: float):
    light = f'def {kind} "l" {{\nfloat inputs:intensity = 1\n{body}\n{UP}}}\n'
    scene, told = read(
        stage(tmp_path, CAMERA.replace("(0, 4, 0, 1)", "(0, 1.2, 0, 1)"), MATTE, FLOOR.replace("EXTRA", ""), light)
    )
    scene.camera = kanuka.Camera((0, 1.2, 0), (0, 0, 0), up=(0, 0, -1), fov=2)
    assert told == []
    assert middle(picture(scene, 8, 256)) == pytest.approx(0.5 / math.pi * expected, rel=0.02)


def test_colour_temperature_keeps_the_luminance(tmp_path: Path):
    warm = "bool inputs:enableColorTemperature = 1\nfloat inputs:colorTemperature = 3000\n"
    light = f'def DistantLight "l" {{\nfloat inputs:intensity = 1\nbool inputs:normalize = 1\n{warm}{UP}}}\n'
    scene, _ = read(stage(tmp_path, CAMERA, MATTE, FLOOR.replace("EXTRA", ""), light))
    rgb = picture(scene, 8, 64)[2:6, 2:6].mean((0, 1))
    assert rgb[0] > 1.3 * rgb[1] > 1.5 * rgb[2]
    assert float(rgb @ (0.2126, 0.7152, 0.0722)) == pytest.approx(0.5 / math.pi, rel=0.05)


# ---- materials


def write_quarters(folder: Path) -> None:
    """Top left red, top right green, bottom left blue, bottom right half grey."""
    rgb = np.zeros((32, 32, 3), np.float32)
    rgb[:16, :16, 0] = rgb[:16, 16:, 1] = rgb[16:, :16, 2] = 1
    rgb[16:, 16:] = 0.5
    kanuka.Picture({"rgb": rgb}).write(folder / "quarters.png")


def test_textures_are_upright_and_in_their_colour_space(tmp_path: Path):
    write_quarters(tmp_path)
    found = {}
    for space, scale in (("auto", 1), ("raw", 1), ("sRGB", 0.5)):
        material = TEXTURED.replace("SPACE", space).replace("SCALE", str(scale))
        scene, told = read(stage(tmp_path, CAMERA, material, FLOOR.replace("EXTRA", ST), SUN, name=f"{space}.usda"))
        assert told == []
        found[space] = picture(scene) * math.pi / 2 / scale
    for rgb in (found["auto"], found["sRGB"]):
        assert rgb[3, 3] == pytest.approx([1, 0, 0], abs=0.05)  # -z is up in the picture, where t is 1
        assert rgb[3, 12] == pytest.approx([0, 1, 0], abs=0.05)
        assert rgb[12, 3] == pytest.approx([0, 0, 1], abs=0.05)
        assert rgb[12, 12] == pytest.approx(np.full(3, 0.5), abs=0.02)
    code = 1.055 * 0.5 ** (1 / 2.4) - 0.055
    assert found["raw"][12, 12] == pytest.approx(np.full(3, code), abs=0.02)


def test_udim_tiles_are_files_of_their_own(tmp_path: Path):
    for number, rgb in ((1001, (1, 0, 0)), (1002, (0, 1, 0)), (1011, (0, 0, 1))):
        picture_of = np.broadcast_to(np.array(rgb, np.float32), (32, 32, 3)).copy()
        kanuka.Picture({"rgb": picture_of}).write(tmp_path / f"tile.{number}.png")
    material = TEXTURED.replace("SPACE", "auto").replace("SCALE", "1").replace("quarters.png", "tile.<UDIM>.png")
    wide = ST.replace("1", "2")
    scene, told = read(stage(tmp_path, CAMERA, material, FLOOR.replace("EXTRA", wide), SUN))
    assert told == []
    with pytest.warns(kanuka.Warning, match="tile.1012.png"):
        rgb = picture(scene) * math.pi / 2
    assert rgb[12, 3] == pytest.approx([1, 0, 0], abs=0.05)  # the first tile is below on the left
    assert rgb[12, 12] == pytest.approx([0, 1, 0], abs=0.05)
    assert rgb[3, 3] == pytest.approx([0, 0, 1], abs=0.05)
    assert rgb[3, 12] == pytest.approx([0.5, 0.5, 0.5], abs=0.05)  # is missing, and told


def test_pictures_in_packages_are_read(tmp_path: Path):
    write_quarters(tmp_path)
    material = TEXTURED.replace("SPACE", "auto").replace("SCALE", "1")
    path = stage(tmp_path, CAMERA, material, FLOOR.replace("EXTRA", ST), SUN)
    package = tmp_path / "a.usdz"
    assert UsdUtils.CreateNewUsdzPackage(str(path), str(package))
    (tmp_path / "quarters.png").unlink()
    scene, told = read(package)
    assert told == []
    assert picture(scene)[3, 3] == pytest.approx([2 / math.pi, 0, 0], abs=0.05)


def test_primvars_of_every_class_are_read(tmp_path: Path):
    found = []
    for interpolation, values in (
        ("constant", "(0.2, 0.4, 0.6)"),
        ("uniform", "(0.2, 0.4, 0.6)"),
        ("vertex", ", ".join(["(0.2, 0.4, 0.6)"] * 4)),
        ("faceVarying", ", ".join(["(0.2, 0.4, 0.6)"] * 4)),
    ):
        color = f'color3f[] primvars:displayColor = [{values}] (interpolation = "{interpolation}")'
        floor = FLOOR.replace("rel material:binding = </matte>", "").replace("EXTRA", color)
        scene, told = read(stage(tmp_path, CAMERA, floor, SUN, name=f"{interpolation}.usda"))
        assert told == []
        found.append(picture(scene)[8, 8])
    assert found[0][0] < 0.7 * found[0][1] < 0.6 * found[0][2]
    for rgb in found[1:]:
        assert rgb == pytest.approx(found[0], rel=1e-3)


def test_normal_maps_bend_the_normal_towards_the_coordinates(tmp_path: Path):
    """A normal 45 degrees towards +s; the sun from there lights a floor whose s grows along x, and not if it falls."""
    slanted = """
def Material "matte" {
    token outputs:surface.connect = </matte/s.outputs:surface>
    def Shader "s" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (0.5, 0.5, 0.5)
        int inputs:useSpecularWorkflow = 1
        color3f inputs:specularColor = (0, 0, 0)
        normal3f inputs:normal.connect = </matte/n.outputs:result>
        token outputs:surface
    }
    def Shader "n" {
        uniform token info:id = "UsdPrimvarReader_normal"
        string inputs:varname = "bend"
        normal3f inputs:fallback = (0.70710678, 0, 0.70710678)
        normal3f outputs:result
    }
}
"""
    light = """
def DistantLight "sun" {
    float inputs:intensity = 2
    bool inputs:normalize = 1
    float inputs:angle = 0
    float3 xformOp:rotateXYZ = (-45, 90, 0)
    uniform token[] xformOpOrder = ["xformOp:rotateXYZ"]
}
"""
    found = []
    for values in ("(0, 0), (1, 0), (1, 1), (0, 1)", "(1, 0), (0, 0), (0, 1), (1, 1)"):
        st = f'texCoord2f[] primvars:st = [{values}] (interpolation = "faceVarying")'
        scene, told = read(
            stage(tmp_path, CAMERA, slanted, FLOOR.replace("EXTRA", st), light, name=f"{len(found)}.usda")
        )
        assert told == []
        found.append(middle(picture(scene)))
    assert found[0] == pytest.approx(0.5 / math.pi * 2, rel=0.02)
    assert found[1] < 0.02


def test_materialx_graphs_are_evaluated(tmp_path: Path):
    scene, told = read(stage(tmp_path, CAMERA, STANDARD, FLOOR.replace("EXTRA", ""), SUN))
    rgb = picture(scene)[8, 8] * math.pi / 2
    assert told == []
    assert rgb == pytest.approx([0.375, 0.25, 0.125], abs=0.02)


def test_the_surface_of_the_best_context_is_read(tmp_path: Path):
    """A material with a MaterialX surface and a preview for everyone else: one is blue, the other red."""
    both = """
def Material "matte" {
    token outputs:surface.connect = </matte/preview.outputs:surface>
    token outputs:mtlx:surface.connect = </matte/best.outputs:out>
    def Shader "preview" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (1, 0, 0)
        token outputs:surface
    }
    def Shader "best" {
        uniform token info:id = "ND_standard_surface_surfaceshader"
        color3f inputs:base_color = (0, 0, 1)
        float inputs:specular = 0
        token outputs:out
    }
}
"""
    shown = picture(read(stage(tmp_path, CAMERA, both, SUN, FLOOR.replace("EXTRA", "")))[0]).mean((0, 1))
    assert shown[2] > 0.1 and shown[2] > 3 * shown[0]
    unreadable = both.replace("ND_standard_surface_surfaceshader", "ND_nobody_has_it")  # then the other is
    shown = picture(read(stage(tmp_path, CAMERA, unreadable, SUN, FLOOR.replace("EXTRA", "")))[0]).mean((0, 1))
    assert shown[0] > 0.1 and shown[0] > 3 * shown[2]


def test_a_standard_surfaces_base_is_whole_where_it_is_not_set(tmp_path: Path):
    """MaterialX's nodedef 1.0.1: base is 1, base_color 0.8."""
    connected = "color3f inputs:base_color.connect = </matte/mix.outputs:out>"
    text = STANDARD.replace("float inputs:base = 0.5", "")
    for name, material, expected in (("a", text, [0.75, 0.5, 0.25]), ("b", text.replace(connected, ""), [0.8] * 3)):
        scene, told = read(stage(tmp_path, CAMERA, material, FLOOR.replace("EXTRA", ""), SUN, name=f"{name}.usda"))
        assert told == []
        assert picture(scene)[8, 8] * math.pi / 2 == pytest.approx(expected, abs=0.02)


def test_coats_tint_what_lies_below(tmp_path: Path):
    coat = "float inputs:coat = 0.5\ncolor3f inputs:coat_color = (1, 0, 0.5)\nfloat inputs:coat_IOR = 1.001"
    tinted = STANDARD.replace("float inputs:specular = 0", f"float inputs:specular = 0\n        {coat}")
    scene, told = read(stage(tmp_path, CAMERA, tinted, FLOOR.replace("EXTRA", ""), SUN))
    rgb = picture(scene)[8, 8] * math.pi / 2
    assert told == []
    assert rgb == pytest.approx([0.375, 0.125, 0.09375], abs=0.02)


def test_materials_of_one_structure_share_a_shader(tmp_path: Path):
    other = MATTE.replace('"matte"', '"other"').replace("</matte", "</other").replace("0.5, 0.5, 0.5", "0.1, 0.2, 0.3")
    second = FLOOR.replace('"floor"', '"floor2"').replace("</matte>", "</other>").replace("EXTRA", "")
    scene, _ = read(stage(tmp_path, CAMERA, MATTE, other, FLOOR.replace("EXTRA", ""), second, SUN))
    assert len(scene.summary()["shaders"]["surface"]) == 1
