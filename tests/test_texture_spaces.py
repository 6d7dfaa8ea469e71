"""Colour spaces of values and textures, against published primaries and curves, and against USD's own conversions."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("MaterialX")
from pxr import Gf, Sdf, Usd, UsdShade

import kanuka
import kanuka.usd
from kanuka.looks import colors
from kanuka.looks.files import Files
from kanuka.usd.materials import Materials
from kanuka.usd.spaces import Spaces
from usd_graphs import Graph, plain

kanuka.usd.stage.prepare()

# x, y of red, green, blue, white. ITU-R BT.709-6, BT.2020-2; SMPTE EG 432-1 (P3 with D65); Adobe RGB (1998), 4.3.1;
# SMPTE ST 2065-1; Academy S-2014-004.
PUBLISHED = {
    "rec709": (0.640, 0.330, 0.300, 0.600, 0.150, 0.060, 0.3127, 0.3290),
    "rec2020": (0.708, 0.292, 0.170, 0.797, 0.131, 0.046, 0.3127, 0.3290),
    "p3": (0.680, 0.320, 0.265, 0.690, 0.150, 0.060, 0.3127, 0.3290),
    "adobe": (0.640, 0.330, 0.210, 0.710, 0.150, 0.060, 0.3127, 0.3290),
    "ap0": (0.7347, 0.2653, 0.0000, 1.0000, 0.0001, -0.0770, 0.32168, 0.33767),
    "ap1": (0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767),
    "xyz": (1, 0, 0, 1, 0, 0, 0.3127, 0.3290),
}
# Bradford's, from AP1's white to D65, to four digits: Academy TB-2018-001's AP1 to Rec. 709 has it multiplied out.
D65_FROM_D60 = np.array([[0.98722, -0.00611, 0.01595], [-0.00760, 1.00186, 0.00533], [0.00307, -0.00510, 1.08168]])


def srgb(v: float) -> float:
    return v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4  # IEC 61966-2-1


def power(gamma: float):
    return lambda v: v**gamma


def line(v: float) -> float:
    return v


SPACES = {  # MaterialX's and USD's names, names of OpenColorIO's configurations of ACES
    "srgb_texture": (srgb, "rec709"),
    "sRGB - Texture": (srgb, "rec709"),
    "Utility - sRGB - Texture": (srgb, "rec709"),
    "srgb_rec709_scene": (srgb, "rec709"),
    "sRGB Encoded Rec.709 (sRGB)": (srgb, "rec709"),
    "lin_rec709": (line, "rec709"),
    "lin_rec709_scene": (line, "rec709"),
    "Linear Rec.709 (sRGB)": (line, "rec709"),
    "Utility - Linear - sRGB": (line, "rec709"),
    "lin_srgb": (line, "rec709"),
    "g18_rec709": (power(1.8), "rec709"),
    "Gamma 1.8 Rec.709 - Texture": (power(1.8), "rec709"),
    "g22_rec709": (power(2.2), "rec709"),
    "g22_rec709_scene": (power(2.2), "rec709"),
    "rec709_display": (power(2.4), "rec709"),
    "g24_rec709_scene": (power(2.4), "rec709"),
    "Rec.1886 Rec.709 - Display": (power(2.4), "rec709"),
    "acescg": (line, "ap1"),
    "ACEScg": (line, "ap1"),
    "ACES - ACEScg": (line, "ap1"),
    "lin_ap1": (line, "ap1"),
    "lin_ap1_scene": (line, "ap1"),
    "g22_ap1": (power(2.2), "ap1"),
    "g22_ap1_scene": (power(2.2), "ap1"),
    "srgb_ap1_scene": (srgb, "ap1"),
    "sRGB Encoded AP1 - Texture": (srgb, "ap1"),
    "aces2065_1": (line, "ap0"),
    "ACES2065-1": (line, "ap0"),
    "lin_ap0": (line, "ap0"),
    "lin_ap0_scene": (line, "ap0"),
    "srgb_displayp3": (srgb, "p3"),
    "srgb_p3d65_scene": (srgb, "p3"),
    "lin_displayp3": (line, "p3"),
    "lin_p3d65_scene": (line, "p3"),
    "Linear P3-D65": (line, "p3"),
    "adobergb": (power(563 / 256), "adobe"),
    "g22_adobergb_scene": (power(2.2), "adobe"),
    "lin_adobergb": (line, "adobe"),
    "lin_adobergb_scene": (line, "adobe"),
    "lin_rec2020": (line, "rec2020"),
    "lin_rec2020_scene": (line, "rec2020"),
    "Linear Rec.2020": (line, "rec2020"),
    "lin_ciexyzd65_scene": (line, "xyz"),
    "CIE XYZ-D65 - Scene-referred": (line, "xyz"),
}


def xyz_from(name: str) -> np.ndarray:
    """SMPTE RP 177: scaled so that the primaries add up to white."""
    numbers = np.array(PUBLISHED[name]).reshape(4, 2)
    columns = np.array([[x, y, 1 - x - y] for x, y in numbers]).T
    white = columns[:, 3] / columns[1, 3]
    found = columns[:, :3] @ np.diag(np.linalg.inv(columns[:, :3]) @ white)
    return D65_FROM_D60 @ found if name in ("ap0", "ap1") else found


def rec709_from(name: str, rgb) -> np.ndarray:
    curve, primaries = SPACES[name]
    return np.linalg.inv(xyz_from("rec709")) @ xyz_from(primaries) @ np.array([curve(float(v)) for v in rgb])


CODE = (0.8, 0.4, 0.2)


@pytest.mark.parametrize("name", list(SPACES))
def test_values_are_converted_from_spaces_by_name(name: str):
    """A constant whose attribute names its space, and one that says none."""
    graph = Graph()
    node = graph.node("c", "ND_constant_color3", value=Gf.Vec3f(*CODE))
    graph.emit(graph.node("shifted", "ND_add_color3FA", in1=(node, "out"), in2=1.0))
    assert graph.run()[0, 0] - 1 == pytest.approx(np.array(CODE), abs=1e-5)
    node.GetInput("value").GetAttr().SetColorSpace(name)
    assert graph.run()[0, 0] - 1 == pytest.approx(rec709_from(name, CODE), abs=3e-4)
    assert graph.told == []


def test_values_are_as_usd_converts_them():
    """Gf.ColorSpace, of all the names that it has."""
    to = Gf.ColorSpace(Gf.ColorSpaceNames.LinearRec709)
    names = {getattr(Gf.ColorSpaceNames, k) for k in dir(Gf.ColorSpaceNames) if not k.startswith("_")}
    names -= {"data", "raw", "identity", "unknown"}
    assert len(names) > 12
    for name in names:
        expected = to.Convert(Gf.ColorSpace(name), Gf.Vec3f(*CODE)).GetRGB()
        found = colors.named(name).converted(np.array(CODE), "rec709")
        assert found == pytest.approx(np.array(expected), abs=1e-3), name


@pytest.mark.parametrize("name", ["raw", "Raw", "data", "Utility - Raw", "Non-Color"])
def test_data_stay_as_they_are(name: str):
    assert colors.named(name).converted(np.array(CODE), "acescg") == pytest.approx(np.array(CODE))


@pytest.mark.parametrize("name", ["", "teapot", "lin_teapot", "rec709_lin", "logc3", "srgb_texture_2"])
def test_other_names_are_none(name: str):
    assert colors.named(name) is None


def test_white_is_white_in_every_space():
    for name in SPACES:
        for rendered in colors.RENDERED:
            white = colors.named(name).converted(np.ones(3), rendered)
            if SPACES[name][1] != "xyz":
                assert white == pytest.approx(np.ones(3), abs=1e-6), (name, rendered)


# ---- textures


def flat(folder: Path, rgb, suffix: str = "png") -> str:
    """A picture of one colour whose file has these numbers."""
    path = folder / f"flat.{suffix}"
    value = np.array(rgb, np.float32)
    if suffix == "png":  # written as sRGB's code
        value = np.array([srgb(v) for v in rgb], np.float32)
    kanuka.Picture({"rgb": np.broadcast_to(value, (16, 16, 3)).copy()}).write(path)
    return str(path)


def textured(file: str, space: str) -> tuple[np.ndarray, list[str]]:
    """The radiance that an image makes, plus 1."""
    graph = Graph()
    image = graph.node("i", "ND_image_color3", file=file)
    if space:
        image.GetInput("file").GetAttr().SetColorSpace(space)
    graph.emit(graph.node("shifted", "ND_add_color3FA", in1=(image, "out"), in2=1.0))
    return graph.run()[3, 3] - 1, graph.told


@pytest.mark.parametrize("name", list(SPACES))
def test_textures_are_converted_from_spaces_by_name(tmp_path: Path, name: str):
    code = tuple(round(v * 255) / 255 for v in CODE)
    found, told = textured(flat(tmp_path, code), name)
    assert found == pytest.approx(rec709_from(name, code), abs=3e-3)  # 8 bits, decoded to halfs
    assert told == []


@pytest.mark.parametrize("name", ["lin_ap1", "g22_rec709", "srgb_displayp3", "lin_rec709"])
def test_textures_of_light_are_converted_too(tmp_path: Path, name: str):
    rgb = (0.5, 0.25, 0.75)
    found, told = textured(flat(tmp_path, rgb, "exr"), name)
    assert found == pytest.approx(rec709_from(name, rgb), abs=2e-3)
    assert told == []


def test_data_are_not_converted(tmp_path: Path):
    code = tuple(round(v * 255) / 255 for v in CODE)
    file = flat(tmp_path, code)
    assert textured(file, "raw")[0] == pytest.approx(code, abs=1e-3)
    assert textured(file, "")[0] == pytest.approx([srgb(v) for v in code], abs=2e-3)  # as the picture says
    graph = Graph()
    image = graph.node("i", "ND_image_vector3", file=file)
    image.GetInput("file").GetAttr().SetColorSpace("acescg")
    graph.emit(graph.node("c", "ND_convert_vector3_color3", in_=(image, "out")))
    assert graph.run()[3, 3] == pytest.approx(code, abs=1e-3)


@pytest.mark.parametrize(
    ("name", "gamma", "part"), [("g22_rec709", 2.2, 0.2), ("g18_rec709", 1.8, 0.6), ("rec709_display", 2.4, 0.2)]
)
def test_filters_average_light(tmp_path: Path, name: str, gamma: float, part: float):
    """Squares of the codes 0.25 and 0.75, far away: the mean is that of what they stand for, and not what their mean
    stands for. Curves that are not sRGB's are off by a part of that difference."""
    codes = np.indices((64, 64)).sum(0) % 2 * 0.5 + 0.25
    light = np.vectorize(srgb)(codes).astype(np.float32)
    kanuka.Picture({"rgb": np.repeat(light[..., None], 3, -1)}).write(tmp_path / "checks.png")
    graph = Graph()
    scale = graph.node("s", "ND_multiply_vector2FA", in1=(graph.node("st", "ND_texcoord_vector2"), "out"), in2=40.0)
    image = graph.node("i", "ND_image_color3", file=str(tmp_path / "checks.png"), texcoord=(scale, "out"))
    image.GetInput("file").GetAttr().SetColorSpace(name)
    graph.emit(image)
    right, wrong = (0.25**gamma + 0.75**gamma) / 2, 0.5**gamma
    assert graph.run()[3, 3] == pytest.approx([right] * 3, abs=part * (right - wrong))


PREVIEW = """
def Material "m" {
    token outputs:surface.connect = </m/s.outputs:surface>
    def Shader "s" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:emissiveColor.connect = </m/t.outputs:rgb>
        float inputs:roughness.connect = </m/t.outputs:g>
        token outputs:surface
    }
    def Shader "t" {
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @FILE@ ( META )
        SOURCE
        float4 inputs:scale = (1, 1, 1, 1)
        color3f outputs:rgb
        float outputs:g
    }
}
"""


@pytest.mark.parametrize(
    ("source", "meta", "expected"),
    [
        ("", "", "srgb_texture"),
        ("auto", "", "srgb_texture"),
        ("sRGB", "", "srgb_texture"),
        ("raw", "", ""),
        ("raw", "acescg", ""),  # the node's input goes before what is said of the file
        ("lin_ap1_scene", "", "acescg"),
        ("", "srgb_displayp3", "srgb_displayp3"),
        ("auto", "g22_rec709", "g22_rec709"),
    ],
)
def test_uv_textures_have_the_space_of_their_input_or_their_file(tmp_path: Path, source: str, meta: str, expected: str):
    code = tuple(round(v * 255) / 255 for v in CODE)
    text = PREVIEW.replace("FILE", flat(tmp_path, code))
    text = text.replace("SOURCE", f'token inputs:sourceColorSpace = "{source}"' if source else "")
    text = text.replace("( META )", f'( colorSpace = "{meta}" )' if meta else "")
    found, told = compiled(text)
    light = rec709_from(expected, code) if expected else np.array(code)
    assert found["light.radiance"] == pytest.approx(light, abs=4e-3)
    assert found["gloss.roughness"] == pytest.approx(light[1], abs=4e-3)
    assert told == []


def compiled(text: str, path: str = "/m", rendered: str = "rec709") -> tuple[dict[str, np.ndarray], list[str]]:
    """What a material's shader gives at a vertex, and what reading it told."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.ImportFromString("#usda 1.0\n" + text)
    return of_stage(Usd.Stage.Open(layer), path, rendered)


def of_stage(opened: Usd.Stage, path: str, rendered: str = "rec709") -> tuple[dict[str, np.ndarray], list[str]]:
    told: list[str] = []

    def say(kind: str, text: str) -> None:
        told.append(text)

    materials = Materials(say, Files(), Usd.TimeCode.Default(), Spaces(say, rendered))
    made = materials.of(UsdShade.Material.Get(opened, path))
    shader = kanuka.compile_shader(materials._files.folder / f"{made.shader}.sl")
    return {k: np.asarray(v)[2, 2] for k, v in shader.run(4, 4, plain(made))["slots"].items()}, told


def test_spaces_are_those_of_opencolorio():
    """By its own configuration of ACES."""
    ocio = pytest.importorskip("PyOpenColorIO", reason="PyOpenColorIO is not installed")
    config = ocio.Config.CreateFromFile("ocio://cg-config-latest")
    for each in config.getColorSpaceNames():
        space = colors.named(each)
        if space is None or not space.primaries:
            continue
        cpu = config.getProcessor(each, "Linear Rec.709 (sRGB)").getDefaultCPUProcessor()
        assert space.converted(np.array(CODE), "rec709") == pytest.approx(cpu.applyRGB(list(CODE)), abs=2e-3), each
