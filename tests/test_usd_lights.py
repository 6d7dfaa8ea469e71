"""Shaping of USD's lights against closed forms, and what they ask for in vain."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import kanuka
from usd_lights import CONE, DOWN, FOCUS, INTENSITY, NOON, SOFT, TILE, TILES, lamp, pixels, places, shone, smooth
from usd_stages import CAMERA, read, stage


def photometric(folder: Path, candela: list[float], angles: str = "0 90", name: str = "a.ies") -> str:
    values = " ".join(str(x) for x in candela)
    head = f"IESNA:LM-63-2002\nTILT=NONE\n1 0 2 {len(angles.split())} 1 1 2 0 0 0\n0.5 1 0\n"  # 2 * 0.5 of all of it
    (folder / name).write_text(f"{head}{angles}\n0\n{values}\n")
    return f"asset inputs:shaping:ies:file = @./{name}@"


# ---- shaping. A small light of area A and radiance 1 sends the intensity A g(theta) w(theta): its outline and shaping

SHAPES = {
    "hard cone": (CONE % 30, lambda t: 1.0 * (t <= 30)),
    "soft cone": (f"{CONE % 40}\n{SOFT % 0.75}", lambda t: 1 - smooth(10, 40, t)),
    "focus": (FOCUS % 3, lambda t: np.cos(np.radians(t)) ** 3),
    "focus of no whole number": (FOCUS % 2.5, lambda t: np.cos(np.radians(t)) ** 2.5),
    "cone and focus": (f"{CONE % 30}\n{FOCUS % 4}", lambda t: (t <= 30) * np.cos(np.radians(t)) ** 4),
}


@pytest.mark.parametrize("kind", INTENSITY)
@pytest.mark.parametrize("shape", SHAPES)
def test_lights_shine_by_angle(tmp_path: Path, kind: str, shape: str) -> None:
    size, area = INTENSITY[kind]
    settings, weight = SHAPES[shape]
    found, told = shone(tmp_path, lamp(kind, f"{size}\n{settings}\nfloat inputs:intensity = 1000"))
    assert told == []
    x, z, theta = places()
    cosine = np.cos(np.radians(theta))
    outline = {"RectLight": cosine, "DiskLight": cosine, "SphereLight": 1.0}.get(
        kind, np.sqrt(1 - x**2 / (x**2 + z**2 + 4))
    )
    expected = pixels(1000 * area * outline * weight(theta) * cosine**3 / 4)
    grey = found.mean(-1)
    # Where the edge, which the light's size blurs a little, cuts a pixel is the noise.
    whole = pixels(1.0 * (weight(theta - 0.7) > 0)) == pixels(1.0 * (weight(theta + 0.7) > 0))
    assert grey[whole] == pytest.approx(expected[whole], rel=0.02, abs=0.01 * expected.max())
    assert grey.sum() == pytest.approx(expected.sum(), rel=0.01)


@pytest.mark.parametrize("shape", ["hard cone", "soft cone"])
@pytest.mark.parametrize(
    ("kind", "straight"), [("RectLight", 1), ("DiskLight", 1), ("SphereLight", 1 / 4), ("CylinderLight", 1 / math.pi)]
)
def test_normalized_lights_send_the_same_at_any_size(tmp_path: Path, kind: str, straight: float, shape: str) -> None:
    """Of their radiance over the area: that of a ball is four times its outline, that of a tube pi times."""
    place = DOWN.replace('"xformOp:rotateX"]', '"xformOp:rotateX", "xformOp:scale"]')
    place = "float3 xformOp:scale = (2, 2, 2)\n" + place
    body = f"{INTENSITY[kind][0]}\n{SHAPES[shape][0]}\nbool inputs:normalize = 1"
    for where in (DOWN, place):
        found, told = shone(tmp_path, lamp(kind, body, where), size=9, reach=0.1)
        assert told == []
        assert found[4, 4].mean() * 4 == pytest.approx(straight, rel=0.02)


def test_shaped_lights_are_linked_by_their_names(tmp_path: Path) -> None:
    for shape in SHAPES:
        link = "rel collection:lightLink:excludes = </floor>"
        found, told = shone(tmp_path, lamp("RectLight", f"{SHAPES[shape][0]}\n{link}"), size=4)
        assert told == [] and found.max() == 0


def test_the_tint_of_the_focus_is_what_its_falloff_fades_to(tmp_path: Path) -> None:
    size, area = INTENSITY["SphereLight"]
    tint = f"{FOCUS % 4}\ncolor3f inputs:shaping:focusTint = (0, 0.5, 1)\nfloat inputs:intensity = 1000"
    found, told = shone(tmp_path, lamp("SphereLight", f"{size}\n{tint}"))
    assert told == []
    cosine = np.cos(np.radians(places()[2]))
    for channel, shade in enumerate((0, 0.5, 1)):
        expected = pixels(1000 * area * cosine**3 / 4 * (shade + (1 - shade) * cosine**4))
        means = [values.reshape(4, 8, 4, 8).mean((1, 3)) for values in (found[..., channel], expected)]
        assert means[0] == pytest.approx(means[1], rel=0.02)  # two lights, of which each path sees one


@pytest.mark.parametrize("kind", INTENSITY)
def test_photometric_files_multiply_by_their_candela(tmp_path: Path, kind: str) -> None:
    """An intensity that falls linearly from 50 straight down to 5 at 90 degrees."""
    size, area = INTENSITY[kind]
    found, told = shone(tmp_path, lamp(kind, f"{size}\n{photometric(tmp_path, [50, 5])}\nfloat inputs:intensity = 2"))
    assert told == []
    x, z, theta = places()
    cosine = np.cos(np.radians(theta))
    outline = cosine if kind in ("RectLight", "DiskLight") else 1.0
    outline = np.sqrt(1 - x**2 / (x**2 + z**2 + 4)) if kind == "CylinderLight" else outline
    expected = pixels(2 * area * outline * (50 - theta / 2) * cosine**3 / 4)
    assert found.mean(-1) == pytest.approx(expected, rel=0.02)


def test_profiles_are_scaled_in_angle_and_normalized(tmp_path: Path) -> None:
    """A lamp that sends 7 to 60 degrees below it: stretched, and divided by its mean over a hemisphere, 7 / 2."""
    size, area = INTENSITY["SphereLight"]
    profile = photometric(tmp_path, [7, 7, 0, 0], "0 60 60.01 90")
    for scale, edge in ((0, 60), (0.5, 30), (0.7, 42)):
        settings = f"float inputs:shaping:ies:angleScale = {scale}\nbool inputs:shaping:ies:normalize = 1"
        found, told = shone(
            tmp_path, lamp("SphereLight", f"{size}\n{profile}\n{settings}\nfloat inputs:intensity = 1000")
        )
        assert told == []
        theta = places()[2]
        expected = pixels(1000 * area * 2.0 * (theta <= edge) * np.cos(np.radians(theta)) ** 3 / 4)
        clear = (pixels(theta) < edge - 3) | (pixels(theta) > edge + 3)
        assert found.mean(-1)[clear] == pytest.approx(expected[clear], rel=0.02, abs=0.005 * expected.max())


def test_profiles_that_are_scaled_from_above_and_not_round(tmp_path: Path) -> None:
    """By two horizontal angles: along x (0 and, mirrored, 180 degrees) 10, along y 30; the scale of -2 takes what the
    file has between 90 and 180 degrees, where it is 4 times as bright, to all directions."""
    file = tmp_path / "b.ies"
    file.write_text(
        "IESNA:LM-63-2002\nTILT=NONE\n1 0 1 4 2 1 2 0 0 0\n1 1 0\n0 89 91 180\n0 90\n10 10 40 40\n30 30 120 120\n"
    )
    size, area = INTENSITY["SphereLight"]
    profile = f"asset inputs:shaping:ies:file = @./{file.name}@\nfloat inputs:shaping:ies:angleScale = %g"
    for scale, gain in ((0, 1), (-2, 4)):
        found, told = shone(tmp_path, lamp("SphereLight", f"{size}\n{profile % scale}"))
        assert told == []
        x, z, theta = places()
        phi = np.degrees(np.arctan2(np.abs(z), np.abs(x)))
        expected = pixels(area * gain * (10 + 20 * phi / 90) * np.cos(np.radians(theta)) ** 3 / 4)
        assert found.mean(-1) == pytest.approx(expected, rel=0.04)  # in the middle all angles meet


def over_a_square(side: float, weight, x: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Irradiance at places of the floor of a square light two units above of radiance 1, by sums over its parts."""
    n = 64
    u, v = np.meshgrid(*[((np.arange(n) + 0.5) / n - 0.5) * side] * 2)
    d2 = (x[..., None, None] - u) ** 2 + (z[..., None, None] - v) ** 2 + 4
    cosine = 2 / np.sqrt(d2)
    return (weight(np.degrees(np.arccos(cosine))) * cosine**2 / d2).mean((-1, -2)) * side * side


@pytest.mark.parametrize("shape", ["hard cone", "soft cone", "focus"])
@pytest.mark.parametrize("kind", ["lobe", "cluster"])
def test_large_lights_shine_by_angle_from_near(tmp_path: Path, shape: str, kind: str) -> None:
    settings, weight = SHAPES[shape]
    size = "float inputs:width = 1.5\nfloat inputs:height = 1.5"
    # Who may have no shadow of a light is no geometry.
    unsolid = "" if kind == "lobe" else "bool inputs:shadow:enable = 0\n"
    found, told = shone(tmp_path, lamp("RectLight", f"{size}\n{settings}\n{unsolid}"), samples=256, size=8)
    assert told == []
    x, z = np.meshgrid((np.arange(64) + 0.5) / 16 - 2, (np.arange(8) + 0.5) / 8 - 0.5)
    expected = over_a_square(1.5, weight, x, z).reshape(8, 8, 8).mean((0, 2))
    along = found.mean(-1)[3:5].mean(0)
    assert along == pytest.approx(expected, rel=0.08, abs=0.02 * expected.max())
    assert along.sum() == pytest.approx(expected.sum(), rel=0.03)


def seen_from_below(path: Path) -> np.ndarray:
    scene, told = read(path)
    assert told == []
    scene.camera = kanuka.Camera((0, 0, 0), (0, 2, 0), up=(0, 0, 1), fov=50)
    scene.resolution = (16, 16)
    return kanuka.render(scene, progressions=16, threads=1)["rgb"]


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("kind", ["RectLight", "DiskLight"])
def test_a_light_that_is_shaped_looks_like_one_that_is_not(tmp_path: Path, kind: str, mirrored: bool) -> None:
    """Its picture the same way up, on the same side, and what lies behind it is seen through it from there."""
    rgb = np.zeros((32, 32, 3), np.float32)
    rgb[:16, :16, 0] = rgb[:16, 16:, 1] = rgb[16:, :16, 2] = 1
    kanuka.Picture({"rgb": rgb}).write(tmp_path / "quarters.png")
    place = DOWN
    if mirrored:
        place = DOWN.replace('"xformOp:rotateX"]', '"xformOp:rotateX", "xformOp:scale"]')
        place = "float3 xformOp:scale = (-1, 1, 1)\n" + place
    size = "float inputs:radius = 0.7"
    if kind == "RectLight":
        size = "float inputs:width = 1.4\nfloat inputs:height = 1\nasset inputs:texture:file = @./quarters.png@"
    found = []
    for name, shape in (("plain", ""), ("shaped", FOCUS % 0.001)):
        lamps = lamp(kind, f"{size}\n{shape}", place)
        found.append(seen_from_below(stage(tmp_path, CAMERA, lamps, name=f"{name}.usda")))
    assert found[0].max() > 0.9
    # The edges of a picture are as fine as the surface is diced.
    assert np.abs(found[0] - found[1]).mean() < 0.2 * found[0].mean()
    assert found[1].mean() == pytest.approx(found[0].mean(), rel=0.02)
    # From behind: it is not there, and stops no light.
    up = place.replace("rotateX = -90", "rotateX = 90")
    sun = 'def DistantLight "sun" {\nfloat inputs:intensity = 1\nbool inputs:normalize = 1\nfloat inputs:angle = 0\n'
    sun += DOWN + "}\n"
    below, told = shone(tmp_path, lamp(kind, f"{size}\n{FOCUS % 1}", up), sun, size=8)
    assert told == []
    assert below.mean() == pytest.approx(1, rel=0.01) and below.min() > 0.8


def test_distant_lights_are_cut_by_their_cone(tmp_path: Path) -> None:
    """A disk of 40 degrees across, of which a cone of 10 leaves (sin 10 / sin 20)^2, and a focus its mean."""
    body = "float inputs:intensity = 1\nbool inputs:normalize = 1\nfloat inputs:angle = 40\n"
    sine = math.sin(math.radians(20))
    # Of cos^2: what it leaves is the integral of 2 cos^3 sin / sin^2 20, up to 20 degrees.
    focused = (1 - math.cos(math.radians(20)) ** 4) / 2 / sine**2
    for shape, part in (("", 1), (CONE % 10, (math.sin(math.radians(10)) / sine) ** 2), (FOCUS % 2, focused)):
        found, told = shone(tmp_path, lamp("DistantLight", body + shape), size=8)
        assert told == []
        assert found.mean() == pytest.approx(part, rel=0.01)
    found, _ = shone(tmp_path, lamp("DistantLight", body.replace("40", "0") + CONE % 10), size=8)
    assert found.mean() == pytest.approx(1, rel=1e-3)


def test_a_sphere_shines_backwards_but_for_a_cone_that_is_written(tmp_path: Path) -> None:
    size, area = INTENSITY["SphereLight"]
    up = DOWN.replace("rotateX = -90", "rotateX = 90")
    for shape, expected in ((FOCUS % 2, 1), (f"{FOCUS % 2}\n{CONE % 90}", 0), (CONE % 180, 1), (CONE % 90, 0)):
        found, told = shone(tmp_path, lamp("SphereLight", f"{size}\n{shape}", up), size=9, reach=0.1)
        assert told == []
        assert found[4, 4, 0] * 4 / area == pytest.approx(expected, abs=0.02)


# ---- what Kanuka's lights have not


def test_lights_without_shadows_shine_through(tmp_path: Path) -> None:
    """Through a lid over the floor, in a native instance too; the sun beside it does not."""
    lid = TILE.replace(", 0, ", ", 1, ") + TILES
    for enable, expected in ((0, 1), (1, 0)):
        sun = NOON.replace("LINK", f"bool inputs:shadow:enable = {enable}")
        found, told = shone(tmp_path, lid, sun, samples=16, size=8)
        assert told == []
        assert found.mean() == pytest.approx(expected, abs=1e-3)


def test_multipliers_of_all_light_are_factors(tmp_path: Path) -> None:
    found, told = shone(
        tmp_path, NOON.replace("LINK", "float inputs:diffuse = 0.5\nfloat inputs:specular = 0.5"), size=4
    )
    assert told == [] and found.mean() == pytest.approx(0.5, rel=1e-3)


def test_multipliers_are_of_lobes(tmp_path: Path) -> None:
    """The floor is diffuse."""
    for body, expected in (("diffuse = 0.5", 0.5), ("specular = 0", 1), ("diffuse = 3\nfloat inputs:specular = 7", 3)):
        found, told = shone(tmp_path, NOON.replace("LINK", f"float inputs:{body}"), size=4)
        assert told == [] and found.mean() == pytest.approx(expected, rel=1e-3)


def test_what_lights_do_not_do_is_told_once_for_all(tmp_path: Path) -> None:
    odd = """
    color3f inputs:shadow:color = (1, 0, 0)
    float inputs:shadow:distance = 3
    color3f inputs:color.connect = </graph.outputs:out>
"""
    lights = [f'def SphereLight "{name}" {{\n{odd}\n}}\n' for name in "abc"]
    graph = 'def Shader "graph" {\ncolor3f outputs:out\n}\n'
    _, told = read(stage(tmp_path, CAMERA, *lights, graph))
    assert told == [
        "/a and 2 more: shadows have no colour but black",
        "/a and 2 more: shadows reach as far as light does: no distance or falloff of them is read",
        "/a and 2 more: what inputs of lights are connected to is not read: their own values stand",
    ]


def test_filters_are_told_by_name_and_kind(tmp_path: Path) -> None:
    text = """
def SphereLight "lamp" {
    rel light:filters = [</barn>, </own>, </missing>]
}
def PxrBarnLightFilter "barn" {
}
def PluginLightFilter "own" {
    uniform token lightFilter:shaderId = "StudioGobo"
}
"""
    _, told = read(stage(tmp_path, CAMERA, text))
    assert told == [
        "/lamp: it shines as without its filters, which are not read: /barn (PxrBarnLightFilter, barn doors), "
        "/own (StudioGobo, a picture in the beam), /missing (which is not there)"
    ]


# ---- what is wrong


@pytest.mark.parametrize(
    ("kind", "body", "expected"),
    [
        ("SphereLight", "float inputs:intensity = nan", "inputs:intensity is nan, which is no number"),
        ("SphereLight", "float inputs:exposure = inf", "inputs:exposure is inf, which is no number"),
        ("SphereLight", "float inputs:exposure = 4000", "its brightness is inf, inf, inf"),
        ("SphereLight", "color3f inputs:color = (1, -1, 1)", "its brightness is 1, -1, 1"),
        ("SphereLight", "float inputs:radius = -1", "inputs:radius is -1; it must be 0 or more"),
        ("DiskLight", "float inputs:radius = 0", "inputs:radius is 0; it must be above 0"),
        ("RectLight", "float inputs:width = 0", "inputs:width is 0; it must be above 0"),
        ("RectLight", "float inputs:height = nan", "inputs:height is nan, which is no number"),
        ("CylinderLight", "float inputs:length = -2", "inputs:length is -2; it must be above 0"),
        ("CylinderLight", "float inputs:radius = 0", "inputs:radius is 0: without inputs:normalize"),
        ("DistantLight", "float inputs:angle = -1", "inputs:angle is -1; it must be 0 or more"),
        ("RectLight", "color3f inputs:shaping:focusTint = (nan, 0, 0)", "inputs:shaping:focusTint is nan, 0, 0"),
        ("DiskLight", CONE % 0, "a cone of 0 degrees leaves no light"),
        ("RectLight", FOCUS % math.nan, "inputs:shaping:focus is nan, which is no number"),
        (
            "RectLight",
            'float3 xformOp:scale = (0, 1, 1)\nuniform token[] xformOpOrder = ["xformOp:scale"]',
            "its transformation leaves nothing of it",
        ),
    ],
)
def test_lights_that_cannot_shine_are_told_and_left_out(tmp_path: Path, kind: str, body: str, expected: str) -> None:
    found, told = shone(tmp_path, lamp(kind, body, ""), NOON.replace("LINK", ""), size=4)
    assert len(told) == 1
    assert told[0].startswith(f"/lamp: {expected}") and told[0].endswith(". It is left out")
    assert found.mean() == pytest.approx(1, rel=1e-3)  # by what is left


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (None, '/lamp.inputs:shaping:ies:file: the file "./a.ies" is not found'),
        ("nothing", "has no TILT=: it is no photometric file"),
        ("TILT=NONE\n1 0 1 2 1 1 2 0 0 0 1 1 0\n0 90\n0\n5", "has 4 numbers for 2 by 1 angles"),
        ("TILT=NONE\n1 0 1 2 1 1 2 0 0 0 1 1 0\n90 0\n0\n5 5", "its angles do not rise"),
        ("TILT=NONE\n1 0 1 2 1 2 2 0 0 0 1 1 0\n0 90\n0\n5 5", "photometric type 2 (B or A) is not read"),
        ("TILT=NONE\n1 0 1 2 1 1 2 0 0 0 1 1 0\n0 90\n0\n0 0", "no intensity is above 0"),
        ("TILT=NONE\n1 0 1 2 1 1 2 0 0 0 1 1 0\n0 90\n0\n5 x", "could not convert string to float: 'x'"),
        ("TILT=lamp.tlt\n1", "TILT=lamp.tlt: tilt files are not read"),
        ("TILT=NONE\n1 0", "ends too early"),
    ],
)
def test_bad_profiles_are_told_and_the_light_shines_without(tmp_path: Path, content: str | None, expected: str) -> None:
    if content is not None:
        (tmp_path / "a.ies").write_text(content)
    profile = "asset inputs:shaping:ies:file = @./a.ies@\nfloat inputs:intensity = 100\nfloat inputs:radius = 0.1"
    found, told = shone(tmp_path, lamp("SphereLight", profile), size=9, reach=0.1)
    assert len(told) == 1 and told[0].startswith("/lamp") and expected in told[0]
    assert found[4, 4].mean() == pytest.approx(100 * math.pi * 0.01 / 4, rel=0.02)


def test_lights_of_unknown_kinds_are_told(tmp_path: Path) -> None:
    text = 'def PluginLight "own" {\n}\ndef Sphere "ball" (prepend apiSchemas = ["MeshLightAPI"]) {\n}\n'
    _, told = read(stage(tmp_path, CAMERA, text, NOON.replace("LINK", "")))
    assert sorted(told) == [
        "/ball: of shapes only meshes are lights: it does not shine",
        "/own: prims of type PluginLight are not read yet",
    ]
