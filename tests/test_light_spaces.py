"""Colour spaces of displayColor, lights and their pictures, and domes' pictures in other layouts: against the same
stage with converted numbers, and against directions worked out texel by texel."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import kanuka
import kanuka.usd
from test_color_config import BUILT_IN, acescct, between, configured, film, head
from test_texture_spaces import flat, srgb
from usd_lights import FLOOR, irradiance, lamp
from usd_stages import CAMERA, HEAD, MATTE, SUN, picture, read, stage
from usd_stages import FLOOR as SQUARE

PALE = (0.5, 0.4, 0.3)
LIGHT = between("ap1", "rec709") @ PALE  # of PALE in AP1
API = 'prepend apiSchemas = ["ColorSpaceAPI"]'
NAME = 'uniform token colorSpace:name = "lin_ap1_scene"'


def text(values) -> str:
    return f"({', '.join(repr(float(v)) for v in values)})"


# ---- displayColor


def shown(folder: Path, extra: str, around: str = "", head: str = HEAD) -> tuple[np.ndarray, list[str]]:
    floor = SQUARE.replace("rel material:binding = </matte>", "").replace("EXTRA", extra)
    scene, told = read(stage(folder, CAMERA, around % floor if around else floor, SUN, head=head))
    return picture(scene, 8, 4), told


DISPLAY = "color3f[] primvars:displayColor = [%s] ( %s )"
VARYING = [(0.5, 0.4, 0.3), (0.2, 0.4, 0.3), (0.5, 0.1, 0.3), (0.3, 0.3, 0.3)]


@pytest.mark.parametrize("where", ["own", "above", "inherited"])
def test_display_colors_have_a_space(tmp_path: Path, where: str):
    """As a stage whose numbers are converted: the same random numbers, and so the same picture but for rounding."""
    expected, _ = shown(tmp_path, DISPLAY % (text(LIGHT), "") if where != "none" else "")
    if where == "own":
        found, told = shown(tmp_path, DISPLAY % (text(PALE), 'colorSpace = "lin_ap1_scene"'))
    elif where == "above":
        found, told = shown(tmp_path, DISPLAY % (text(PALE), ""), f'def Xform "x" ( {API} ) {{\n{NAME}\n%s\n}}\n')
    else:
        color = f"color3f[] primvars:displayColor = [{text(PALE)}]"
        found, told = shown(tmp_path, "", f'def Xform "x" ( {API} ) {{\n{NAME}\n{color}\n%s\n}}\n')
    assert told == [] and found == pytest.approx(expected, abs=1e-4)
    as_they_are, _ = shown(tmp_path, DISPLAY % (text(PALE), ""))
    assert np.abs(as_they_are - expected).max() > 0.02


def test_display_colors_that_vary_are_converted_each(tmp_path: Path):
    def several(values, meta: str) -> str:
        return DISPLAY % (", ".join(map(text, values)), f'interpolation = "vertex"\n{meta}')

    light = [between("p3", "rec709") @ [srgb(v) for v in color] for color in VARYING]
    expected, _ = shown(tmp_path, several(light, ""))
    found, told = shown(tmp_path, several(VARYING, 'colorSpace = "srgb_p3d65_scene"'))
    assert told == [] and found == pytest.approx(expected, abs=1e-4)


def test_display_colors_of_a_configuration(tmp_path: Path):
    configured(tmp_path)
    expected, _ = shown(tmp_path, DISPLAY % (text(film(PALE)), ""), head=head("house.ocio"))
    found, told = shown(tmp_path, DISPLAY % (text(PALE), 'colorSpace = "film"'), head=head("house.ocio"))
    assert told == [] and found == pytest.approx(expected, abs=1e-4)


def test_a_display_color_of_an_unknown_space_is_told(tmp_path: Path):
    expected, _ = shown(tmp_path, DISPLAY % (text(PALE), ""))
    found, told = shown(tmp_path, DISPLAY % (text(PALE), 'colorSpace = "teapot"'))
    assert np.array_equal(found, expected)
    assert len(told) == 1 and "/floor.primvars:displayColor" in told[0] and "teapot" in told[0]


def test_what_many_prims_have_in_common_is_not_told_of_each(tmp_path: Path):
    ball = 'def Sphere "b%d" {\n' + DISPLAY % (text(PALE), 'colorSpace = "teapot"') + "\n}\n"
    _, told = read(stage(tmp_path, CAMERA, SUN, *(ball % k for k in range(40))))
    assert len(told) == 17 and all("teapot" in each for each in told)


# ---- lights


def lit(folder: Path, *parts: str, **options) -> tuple[np.ndarray, list[str]]:
    scene, told = read(stage(folder, CAMERA, MATTE, FLOOR, *parts), **options)
    return irradiance(scene, samples=16, size=8), told


@pytest.mark.parametrize("kind", ["DistantLight", "SphereLight", "RectLight", "DomeLight"])
def test_colors_of_lights_have_a_space(tmp_path: Path, kind: str):
    def of(color, meta: str = "") -> str:
        return lamp(kind, f"color3f inputs:color = {text(color)} {meta}")

    expected, _ = lit(tmp_path, of(LIGHT))
    found, told = lit(tmp_path, of(PALE, '( colorSpace = "lin_ap1_scene" )'))
    assert told == [] and found == pytest.approx(expected, rel=1e-4)
    found, told = lit(tmp_path, f'def Xform "x" ( {API} ) {{\n{NAME}\n{of(PALE)}\n}}\n')
    assert told == [] and found == pytest.approx(expected, rel=1e-4)


def test_a_light_purer_than_what_is_rendered_in_has_none_of_the_others(tmp_path: Path):
    given = between("ap1", "rec709") @ (1, 0, 0)
    assert (given[1:] < 0).all()
    expected, _ = lit(tmp_path, lamp("DistantLight", f"color3f inputs:color = {text(np.maximum(given, 0))}"))
    color = 'color3f inputs:color = (1, 0, 0) ( colorSpace = "lin_ap1_scene" )'
    found, told = lit(tmp_path, lamp("DistantLight", color))
    assert told == [] and found == pytest.approx(expected, rel=1e-4)
    _, told = read(stage(tmp_path, CAMERA, lamp("DistantLight", color.replace("(1, 0, 0)", "(1, -1, nan)"))))
    told = [each for each in told if each.startswith("/lamp")]
    assert len(told) == 1 and told[0].startswith("/lamp: its brightness is")


def test_temperatures_look_alike_whatever_is_rendered_in(tmp_path: Path):
    body = "bool inputs:enableColorTemperature = 1\nfloat inputs:colorTemperature = 4000"
    expected, _ = lit(tmp_path, lamp("DistantLight", body))
    for space, primaries in (("acescg", "ap1"), ("rec2020", "rec2020")):
        found, told = lit(tmp_path, lamp("DistantLight", body), color_space=space)
        back = found.mean((0, 1)) @ between(primaries, "rec709").T
        assert told == [] and back == pytest.approx(expected.mean((0, 1)), rel=0.03)


def test_tints_of_a_focus_have_a_space(tmp_path: Path):
    """A point's: spectra of lights apart, the same numbers are the same picture."""

    def of(color, meta: str = "") -> str:
        body = f"float inputs:shaping:focus = 3\ncolor3f inputs:shaping:focusTint = {text(color)} {meta}"
        return lamp("SphereLight", body)

    expected, _ = lit(tmp_path, of(LIGHT))
    found, told = lit(tmp_path, of(PALE, '( colorSpace = "lin_ap1_scene" )'))
    assert told == [] and found == pytest.approx(expected, rel=1e-4)


# ---- their pictures


def dome(meta: str = "", file: str = "flat.exr", body: str = "", kind: str = "DomeLight") -> str:
    return f'def {kind} "sky" {{\nasset inputs:texture:file = @./{file}@ {meta}\n{body}\n}}\n'


def looked_at(scene: kanuka.Scene, direction, samples: int = 16) -> np.ndarray:
    side = (0, 1, 0) if abs(direction[1]) < 0.9 else (1, 0, 0)
    scene.camera = kanuka.Camera((0, 0, 0), tuple(map(float, direction)), up=side, fov=2)
    scene.resolution = (4, 4)
    return kanuka.render(scene, progressions=samples, threads=1)["rgb"].mean((0, 1))


@pytest.mark.parametrize(
    ("suffix", "space", "light"),
    [
        ("exr", "lin_ap1_scene", LIGHT),
        ("exr", "srgb_texture", [srgb(v) for v in PALE]),
        ("exr", "lin_rec709", PALE),
        ("exr", "raw", PALE),
        ("png", "srgb_texture", [srgb(v) for v in PALE]),
        ("png", "", [srgb(v) for v in PALE]),
        ("png", "raw", PALE),
        ("png", "g22_rec709", [v**2.2 for v in PALE]),
    ],
)
@pytest.mark.parametrize("kind", ["DomeLight", "RectLight"])
def test_pictures_of_lights_have_a_space(tmp_path: Path, kind: str, suffix: str, space: str, light):
    """Seen by the camera itself: a dome, and a rectangle across its view."""
    flat(tmp_path, PALE, suffix)
    meta = f'( colorSpace = "{space}" )' if space else ""
    scene, told = read(stage(tmp_path, dome(meta, f"flat.{suffix}", FACING if kind == "RectLight" else "", kind)))
    told = [each for each in told if "no camera" not in each and "nothing to look at" not in each]
    assert told == []
    assert looked_at(scene, (0, 0, 1)) == pytest.approx(light, abs=6e-3)


FACING = """
float inputs:width = 2
float inputs:height = 2
double3 xformOp:translate = (0, 0, 3)
uniform token[] xformOpOrder = ["xformOp:translate"]
"""


def test_pictures_of_lights_are_converted_into_what_is_rendered_in(tmp_path: Path):
    code = tuple(round(v * 255) / 255 for v in (0.5, 0.45, 0.48))
    flat(tmp_path, code, "png")
    light = between("rec709", "ap1") @ [srgb(v) for v in code]
    for meta in ('( colorSpace = "srgb_texture" )', ""):
        scene, _ = read(stage(tmp_path, dome(meta, "flat.png")), color_space="acescg")
        assert looked_at(scene, (0, 0, 1)) == pytest.approx(light, abs=6e-3)
    scene, told = read(stage(tmp_path, dome('( colorSpace = "ACEScct" )', "flat.png"), head=head(BUILT_IN)))
    assert not [each for each in told if each.startswith("/sky")]
    assert looked_at(scene, (0, 0, 1)) == pytest.approx([acescct(v) for v in code], abs=6e-3)


def test_a_space_goes_before_what_the_head_of_a_picture_says(tmp_path: Path):
    """Kanuka's own pictures say in which space they are."""
    made = kanuka.Scene()
    made.options.color_space, made.resolution = "acescg", (16, 16)
    made.add_light("environment", amount=PALE)
    kanuka.render(made, progressions=4, threads=1).write(tmp_path / "flat.exr", layers=["rgb"])
    numbers = kanuka.read(tmp_path / "flat.exr")["rgb"].mean((0, 1))
    for meta, light in (
        ("", between("ap1", "rec709") @ numbers),
        ('( colorSpace = "lin_rec709_scene" )', numbers),
        ('( colorSpace = "lin_ap1_scene" )', between("ap1", "rec709") @ numbers),
    ):
        scene, _ = read(stage(tmp_path, dome(meta)))
        assert looked_at(scene, (0, 0, 1)) == pytest.approx(light, abs=0.012), meta


def test_a_sun_beyond_halfs_stays(tmp_path: Path):
    rgb = np.full((16, 32, 3), 0.1, np.float32)
    rgb[7:9, 15:17] = 4e5
    kanuka.Picture({"rgb": rgb}).write(tmp_path / "flat.exr")
    scene, _ = read(stage(tmp_path, dome('( colorSpace = "lin_ap1_scene" )')))
    expected = between("ap1", "rec709") @ (4e5, 4e5, 4e5)
    assert looked_at(scene, (0, 0, 1)) == pytest.approx(expected, rel=0.02)


def test_a_picture_that_cannot_be_converted_is_told_and_the_light_shines_as_without(tmp_path: Path):
    (tmp_path / "flat.exr").write_bytes(b"no picture")
    scene, told = read(
        stage(tmp_path, dome('( colorSpace = "lin_ap1_scene" )', body="color3f inputs:color = (1, 2, 3)"))
    )
    told = [each for each in told if each.startswith("/sky")]
    assert len(told) == 1 and "flat.exr" in told[0]
    assert looked_at(scene, (0, 0, 1)) == pytest.approx((1, 2, 3), rel=0.03)


# ---- layouts


def sky(d: np.ndarray) -> np.ndarray:
    """Of directions (…, 3): another colour everywhere."""
    return 0.5 + 0.4 * d


def across(width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    """From -1 to 1, to the right and upwards, of the middles of texels."""
    x = (np.arange(width) + 0.5) / width * 2 - 1
    y = 1 - (np.arange(height) + 0.5) / height * 2
    return np.meshgrid(x, y)


def mirror(size: int) -> np.ndarray:
    """A ball of chrome, photographed from far away at +z: the law of reflection."""
    x, y = across(size, size)
    z = np.sqrt(np.maximum(1 - x * x - y * y, 0))
    normal = np.stack([x, y, z], -1)
    seen = np.array([0, 0, -1.0])
    found = sky(seen - 2 * (normal @ seen)[..., None] * normal)
    return np.where((x * x + y * y < 1)[..., None], found, 0)


def probe(size: int) -> np.ndarray:
    """Debevec's light probes: straight on in the middle, straight back at the edge."""
    x, y = across(size, size)
    r = np.hypot(x, y)
    angle = np.pi * r
    d = np.stack([np.sin(angle) * x / r, np.sin(angle) * y / r, np.cos(angle)], -1)
    return np.where((r < 1)[..., None], sky(d), 0)


def cross(size: int) -> np.ndarray:
    """Walking up and down from +z in the middle: over the top to +y, below to -y and on to -z; +x at its left."""
    x, y = across(size, size)
    one = np.ones_like(x)
    squares = {
        (1, 1): (-x, y, one),
        (1, 0): (one, y, x),  # left of the middle: its right edge is at +z
        (1, 2): (-one, y, -x),
        (0, 1): (-x, one, -y),  # above: its lower edge is at +z
        (2, 1): (-x, -one, y),  # below: its upper edge is at +z
        (3, 1): (-x, -y, -one),  # below that: its upper edge is at -y
    }
    made = np.zeros((4 * size, 3 * size, 3))
    for (row, column), parts in squares.items():
        d = np.stack(parts, -1)
        d /= np.linalg.norm(d, axis=-1, keepdims=True)
        made[row * size : (row + 1) * size, column * size : (column + 1) * size] = sky(d)
    return made


DIRECTIONS = [(0, 0, 1), (1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0.6, 0.64, 0.48), (-0.48, -0.6, 0.64)]
DIRECTIONS += [(0.6, 0, -0.8), (-0.36, 0.48, -0.8), (0.05, 0.1, -0.99)]


@pytest.mark.parametrize(
    ("layout", "made"),
    [
        ("mirroredBall", lambda: mirror(256)),
        ("angular", lambda: probe(256)),
        ("cubeMapVerticalCross", lambda: cross(48)),
    ],
)
def test_domes_have_pictures_in_other_layouts(tmp_path: Path, layout: str, made: Callable[[], np.ndarray]):
    kanuka.Picture({"rgb": made().astype(np.float32)}).write(tmp_path / "flat.exr")
    scene, told = read(stage(tmp_path, dome(body=f'token inputs:texture:format = "{layout}"'), CAMERA))
    assert not [each for each in told if each.startswith("/sky")]
    for direction in DIRECTIONS[: -1 if layout == "mirroredBall" else None]:  # what is behind the ball it hardly shows
        d = np.array(direction) / np.linalg.norm(direction)
        assert looked_at(scene, d, 4) == pytest.approx(sky(d), abs=0.012), direction


def test_a_layout_and_a_space_go_together(tmp_path: Path):
    light = np.full((64, 64, 3), PALE, np.float32)
    kanuka.Picture({"rgb": light}).write(tmp_path / "flat.exr")
    body = 'token inputs:texture:format = "angular"\nuniform token poleAxis = "Z"'
    scene, _ = read(stage(tmp_path, dome('( colorSpace = "lin_ap1_scene" )', body=body, kind="DomeLight_1")))
    assert looked_at(scene, (0, 0, 1)) == pytest.approx(LIGHT, abs=6e-3)
    kanuka.Picture({"rgb": light}).write(tmp_path / "flat.png")  # of codes, which are decoded
    scene, _ = read(stage(tmp_path, dome("", "flat.png", body)))
    assert looked_at(scene, (0, 0, 1)) == pytest.approx(PALE, abs=6e-3)


@pytest.mark.parametrize(("layout", "why"), [("cubeMapVerticalCross", "3 squares wide"), ("square", "no format")])
def test_pictures_of_another_shape_than_their_layout_are_told(tmp_path: Path, layout: str, why: str):
    flat(tmp_path, PALE, "exr")
    scene, told = read(stage(tmp_path, dome(body=f'token inputs:texture:format = "{layout}"'), CAMERA))
    told = [each for each in told if each.startswith("/sky")]
    assert len(told) == 1 and why in told[0]
    expected = (1, 1, 1) if layout != "square" else PALE
    assert looked_at(scene, (0, 0, 1)) == pytest.approx(expected, rel=0.03)
