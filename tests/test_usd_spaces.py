"""Where a stage says the colour space of its values, and what it is rendered in."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("MaterialX")
from pxr import Usd, UsdRender

import kanuka
import kanuka.usd
from test_texture_spaces import CODE, compiled, flat, of_stage, rec709_from, srgb, xyz_from
from usd_stages import CAMERA, FLOOR, ST, SUN, picture, read, stage

# ---- where a space is said

PALE = (0.5, 0.4, 0.3)  # which no space makes more than white
BODY = """
def Scope "set" ( SETAPI ) {
    SETATTRIBUTES
    def Material "m" ( MAPI ) {
        MATTRIBUTES
        token outputs:surface.connect = </set/m/s.outputs:surface>
        def Shader "s" {
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor = (0.5, 0.4, 0.3) META
            token outputs:surface
        }
    }
}
"""


def body(meta: str = "", **parts: str) -> tuple[np.ndarray, list[str]]:
    text = BODY.replace("META", meta)
    for word in ("SETAPI", "SETATTRIBUTES", "MAPI", "MATTRIBUTES"):
        text = text.replace(word, parts.get(word, ""), 1)
    text = text.replace("(  )", "")
    found, told = compiled(text, "/set/m")
    return found["body.diffuseReflectance"], told


API = 'prepend apiSchemas = ["ColorSpaceAPI"]'


def name(space: str) -> str:
    return f'uniform token colorSpace:name = "{space}"'


def test_prims_say_the_space_of_what_is_below_them():
    light = rec709_from("lin_ap1", PALE)
    found, told = body(SETAPI=API, SETATTRIBUTES=name("lin_ap1_scene"))
    assert found == pytest.approx(light, abs=1e-3) and told == []
    nearer, _ = body(SETAPI=API, SETATTRIBUTES=name("lin_ap1_scene"), MAPI=API, MATTRIBUTES=name("srgb_rec709_scene"))
    assert nearer == pytest.approx([srgb(v) for v in PALE], abs=1e-3)
    own, _ = body('( colorSpace = "g22_rec709" )', SETAPI=API, SETATTRIBUTES=name("lin_ap1_scene"))
    assert own == pytest.approx([v**2.2 for v in PALE], abs=1e-3)


DEFINITION = """
    uniform token colorSpaceDefinition:a:name = "mine"
    float2 colorSpaceDefinition:a:redChroma = (0.68, 0.32)
    float2 colorSpaceDefinition:a:greenChroma = (0.265, 0.69)
    float2 colorSpaceDefinition:a:blueChroma = (0.15, 0.06)
    float2 colorSpaceDefinition:a:whitePoint = WHITE
    float colorSpaceDefinition:a:gamma = GAMMA
    float colorSpaceDefinition:a:linearBias = BIAS
"""


def definition(white: str = "(0.3127, 0.329)", gamma: str = "1", bias: str = "0") -> dict[str, str]:
    text = DEFINITION.replace("WHITE", white).replace("GAMMA", gamma).replace("BIAS", bias)
    return {"SETAPI": 'prepend apiSchemas = ["ColorSpaceDefinitionAPI:a"]', "SETATTRIBUTES": text}


def test_prims_define_spaces_of_their_own():
    """P3's primaries: linear, by a power, and by sRGB's curve as USD has it."""
    for given, like in (({}, "lin_displayp3"), ({"gamma": "2.4", "bias": "0.055"}, "srgb_displayp3")):
        found, told = body('( colorSpace = "mine" )', **definition(**given))
        assert found == pytest.approx(rec709_from(like, PALE), abs=1e-3) and told == []
    found, told = body('( colorSpace = "mine" )', **definition(gamma="2.2"))
    light = np.linalg.inv(xyz_from("rec709")) @ xyz_from("p3") @ np.array(PALE) ** 2.2
    assert found == pytest.approx(light, abs=1e-3) and told == []


@pytest.mark.parametrize(
    "given", [{"white": "(0.3, 0)"}, {"white": "(nan, 0.3)"}, {"gamma": "nan"}, {"gamma": "0"}, {"gamma": "-2"}]
)
def test_a_definition_that_is_none_is_told_and_the_value_stays(given: dict[str, str]):
    found, told = body('( colorSpace = "mine" )', **definition(**given))
    assert found == pytest.approx(np.array(PALE), abs=1e-3)
    assert len([text for text in told if "/set" in text and "mine" in text]) == len(told) >= 1


def test_an_unknown_space_is_told_once_for_each_attribute_and_the_value_stays():
    found, told = body('( colorSpace = "teapot" )')
    assert found == pytest.approx(np.array(PALE), abs=1e-3)
    assert told == ['/set/m/s.inputs:diffuseColor: there is no colour space "teapot"; it is taken for none']


def test_documents_of_materialx_say_the_space_of_their_values(tmp_path: Path):
    """Of values and files that say none, in this document and not in the stage that refers to it."""
    code = tuple(round(v * 255) / 255 for v in CODE)
    flat(tmp_path, code)
    (tmp_path / "look.mtlx").write_text("""<?xml version="1.0"?>
<materialx version="1.39" colorspace="acescg">
  <standard_surface name="ss" type="surfaceshader">
    <input name="base" type="float" value="1"/>
    <input name="base_color" type="color3" value="0.5, 0.4, 0.3"/>
    <input name="specular_color" type="color3" value="0.5, 0.4, 0.3" colorspace="srgb_texture"/>
    <input name="coat" type="float" value="1"/>
    <input name="emission" type="float" value="1"/>
    <input name="emission_color" type="color3" nodename="im"/>
  </standard_surface>
  <image name="im" type="color3">
    <input name="file" type="filename" value="flat.png" colorspace="srgb_displayp3"/>
  </image>
  <surfacematerial name="m" type="material">
    <input name="surfaceshader" type="surfaceshader" nodename="ss"/>
  </surfacematerial>
</materialx>
""")
    (tmp_path / "a.usda").write_text('#usda 1.0\ndef "looks" ( references = @look.mtlx@</MaterialX> ) {}\n')
    found, told = of_stage(Usd.Stage.Open(str(tmp_path / "a.usda")), "/looks/Materials/m")
    assert found["body.diffuseReflectance"] == pytest.approx(rec709_from("acescg", PALE), abs=1e-3)
    assert found["gloss.reflectance"] == pytest.approx([srgb(v) for v in PALE], abs=1e-3)
    assert found["light.radiance"] == pytest.approx(rec709_from("srgb_displayp3", code), abs=4e-3)
    assert told == []


# ---- where it is rendered in

GLOWING = """
def Material "matte" {
    token outputs:mtlx:surface.connect = </matte/s.outputs:out>
    def Shader "s" {
        uniform token info:id = "ND_surface_unlit"
        color3f inputs:emission_color.connect = </matte/i.outputs:out>
        token outputs:out
    }
    def Shader "i" {
        uniform token info:id = "ND_image_color3"
        asset inputs:file = @./flat.png@ ( colorSpace = "SPACE" )
        color3f outputs:out
    }
}
"""


@pytest.mark.parametrize("space", ["srgb_texture", "lin_ap1", "srgb_displayp3", "g22_rec709"])
@pytest.mark.parametrize("rendered", ["rec709", "acescg", "rec2020"])
def test_a_texture_looks_the_same_in_whatever_it_is_rendered(tmp_path: Path, space: str, rendered: str):
    """The picture's colours, back in Rec. 709 by published primaries."""
    code = (0.6, 0.4, 0.5)
    code = tuple(round(v * 255) / 255 for v in code)
    flat(tmp_path, code)
    parts = (CAMERA, GLOWING.replace("SPACE", space), FLOOR.replace("EXTRA", ST.replace("map", "st")), SUN)
    scene, told = read(stage(tmp_path, *parts), color_space=rendered)
    assert told == [] and scene.options.color_space == rendered
    rgb = picture(scene, 4, 64)[1:3, 1:3].mean((0, 1))
    back = np.linalg.inv(xyz_from("rec709")) @ xyz_from({"acescg": "ap1"}.get(rendered, rendered)) @ rgb
    assert back == pytest.approx(rec709_from(space, code), abs=0.012)


def test_settings_say_what_to_render_in(tmp_path: Path):
    def loaded(name: str, **options) -> tuple[str, list[str]]:
        path = stage(tmp_path, CAMERA, FLOOR.replace("EXTRA", ""), SUN)
        opened = Usd.Stage.Open(str(path))
        opened.Reload()
        settings = UsdRender.Settings.Define(opened, "/Render/s")
        settings.CreateRenderingColorSpaceAttr().Set(name)
        opened.SetMetadata("renderSettingsPrimPath", "/Render/s")
        opened.GetRootLayer().Save()
        scene, told = read(path, **options)
        return scene.options.color_space, [text for text in told if "Render" in text]

    assert loaded("lin_ap1_scene") == ("acescg", [])
    assert loaded("ACEScg") == ("acescg", [])
    assert loaded("lin_rec2020_scene") == ("rec2020", [])
    assert loaded("lin_ap1_scene", color_space="rec2020") == ("rec2020", [])
    space, told = loaded("lin_adobergb_scene")
    assert space == "rec709" and len(told) == 1 and "/Render/s" in told[0]


def test_a_space_that_nothing_is_rendered_in_is_an_error(tmp_path: Path):
    with pytest.raises((ValueError, kanuka.Error), match="teapot"):
        read(stage(tmp_path, CAMERA, FLOOR.replace("EXTRA", "")), color_space="teapot")


def test_configurations_of_opencolorio_are_told(tmp_path: Path):
    head = '#usda 1.0\n(\n    colorConfiguration = @aces.ocio@\n    upAxis = "Y"\n)\n'
    _, told = read(stage(tmp_path, CAMERA, FLOOR.replace("EXTRA", ""), SUN, head=head))
    assert any("aces.ocio" in text and "not read" in text for text in told)
