"""Lights of USD stages: shaping, meshes that shine, portals, instances, linking; against closed forms."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import kanuka
from usd_stages import CAMERA, HEAD, MATTE, read, stage

# A floor that reflects half of the light, 6 by 6, and what lies two units above its middle and shines down.
FLOOR = """
def Mesh "floor" (prepend apiSchemas = ["MaterialBindingAPI"]) {
    rel material:binding = </matte>
    uniform token subdivisionScheme = "none"
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-3, 0, 3), (3, 0, 3), (3, 0, -3), (-3, 0, -3)]
}
"""
DOWN = """
double3 xformOp:translate = (0, 2, 0)
float xformOp:rotateX = -90
uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateX"]
"""


def lamp(kind: str, body: str, place: str = DOWN, name: str = "lamp") -> str:
    return f'def {kind} "{name}" (prepend apiSchemas = ["ShapingAPI"]) {{\n{body}\n{place}}}\n'


def irradiance(scene: kanuka.Scene, samples: int = 64, size: int = 32, reach: float = 2.0) -> np.ndarray:
    """Of the floor in a grid of (size, size) places from -reach to reach, the first row at +z: (size, size, 3)."""
    scene.camera = kanuka.Camera(
        (0, 0.5, 0), (0, 0, 0), up=(0, 0, -1), projection="orthographic", screen_window=(-reach, reach, -reach, reach)
    )
    scene.resolution = (size, size)
    scene.options.filter, scene.options.filter_width = "box", (1, 1)
    rgb = kanuka.render(scene, progressions=samples, threads=1, max_depth=1)["rgb"]
    return rgb[::-1] * math.pi / 0.5


FINER = 8  # of what is expected of a pixel's area


def places(size: int = 32, reach: float = 2.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """x, z and the angle to straight down, from two units above the floor, in degrees; for pixels()."""
    n = size * FINER
    x, z = np.meshgrid(*[((np.arange(n) + 0.5) / n - 0.5) * 2 * reach] * 2)
    return x, -z, np.degrees(np.arctan(np.hypot(x, z) / 2))


def pixels(values: np.ndarray) -> np.ndarray:
    n = len(values) // FINER
    return values.reshape(n, FINER, n, FINER).mean((1, 3))


def smooth(low: float, high: float, x: np.ndarray) -> np.ndarray:
    t = np.clip((x - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


def shone(tmp_path: Path, *parts: str, head: str = HEAD, **options) -> tuple[np.ndarray, list[str]]:
    scene, told = read(stage(tmp_path, CAMERA, MATTE, FLOOR, *parts, head=head))
    return irradiance(scene, **options), told


# ---- shaping. A small light of area A and radiance 1 sends the intensity A g(theta) w(theta): its outline and shaping

INTENSITY = {
    "RectLight": ("float inputs:width = 0.02\nfloat inputs:height = 0.03", 0.0006),
    "DiskLight": ("float inputs:radius = 0.02", math.pi * 0.0004),
    "SphereLight": ("float inputs:radius = 0.02", math.pi * 0.0004),
    "CylinderLight": ("float inputs:radius = 0.005\nfloat inputs:length = 0.05", 0.0005),
}
CONE, SOFT, FOCUS = (f"float inputs:shaping:{name} = %g" for name in ("cone:angle", "cone:softness", "focus"))
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


def photometric(folder: Path, candela: list[float], angles: str = "0 90", name: str = "a.ies") -> str:
    values = " ".join(str(x) for x in candela)
    head = f"IESNA:LM-63-2002\nTILT=NONE\n1 0 2 {len(angles.split())} 1 1 2 0 0 0\n0.5 1 0\n"  # 2 * 0.5 of all of it
    (folder / name).write_text(f"{head}{angles}\n0\n{values}\n")
    return f"asset inputs:shaping:ies:file = @./{name}@"


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


# ---- meshes that shine

# A square of side 0.04 that looks down from two units above the floor: 1.6e-3 / 4 of its radiance arrives below.
PANEL = """
def Mesh "panel" (prepend apiSchemas = ["MeshLightAPI", "MaterialBindingAPI"]) {
    uniform token subdivisionScheme = "none"
    int[] faceVertexCounts = [3, 3]
    int[] faceVertexIndices = [0, 1, 2, 0, 2, 3]
    point3f[] points = [(-0.02, 2, -0.02), (0.02, 2, -0.02), (0.02, 2, 0.02), (-0.02, 2, 0.02)]
    BODY
}
"""
GLOWING = """
def Material "glowing" {
    token outputs:surface.connect = </glowing/s.outputs:surface>
    def Shader "s" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (0.5, 0.5, 0.5)
        color3f inputs:emissiveColor = (0.5, 1, 2)
        int inputs:useSpecularWorkflow = 1
        color3f inputs:specularColor = (0, 0, 0)
        token outputs:surface
    }
}
"""


def panel(*body: str) -> str:
    return PANEL.replace("BODY", "\n    ".join(body))


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        (["float inputs:intensity = 3"], [3, 3, 3]),
        (["float inputs:exposure = 1", "color3f inputs:color = (1, 0.5, 0)"], [2, 1, 0]),
        (["bool inputs:normalize = 1"], [1 / 0.0016] * 3),
        (
            [
                "bool inputs:normalize = 1",
                "float3 xformOp:scale = (3, 1, 1)",
                'uniform token[] xformOpOrder = ["xformOp:scale"]',
            ],
            [1 / 0.0016] * 3,
        ),
        (['uniform token orientation = "leftHanded"'], [0, 0, 0]),
        (["rel material:binding = </glowing>", "float inputs:intensity = 6"], [3, 6, 12]),
        (
            [
                "rel material:binding = </glowing>",
                "float inputs:intensity = 6",
                'uniform token light:materialSyncMode = "independent"',
            ],
            [6, 6, 6],
        ),
        (
            ["rel material:binding = </glowing>", 'uniform token light:materialSyncMode = "noMaterialResponse"'],
            [1, 1, 1],
        ),
    ],
)
def test_meshes_shine_with_their_lights_emission(tmp_path: Path, body: list[str], expected: list[float]) -> None:
    found, told = shone(tmp_path, GLOWING, panel(*body), size=9, reach=0.1)
    assert told == []
    area = 0.0016 * (3 if "scale" in " ".join(body) else 1)
    light = found[4, 4] * 4 / area
    assert light * (3 if area > 0.002 else 1) == pytest.approx(np.array(expected), rel=0.02, abs=0.01)


def test_what_reflects_beside_its_glow_is_as_the_mode_says(tmp_path: Path) -> None:
    """Seen from below, lit by a sun from below: the body reflects half of its light but where it has no material."""
    sun = 'def DistantLight "sun" {\nfloat inputs:intensity = 1\nbool inputs:normalize = 1\nfloat inputs:angle = 0\n'
    sun += 'float xformOp:rotateX = 90\nuniform token[] xformOpOrder = ["xformOp:rotateX"]\n}\n'
    for mode, body, glow in (
        ("materialGlowTintsLight", 0.5, [0.5, 1, 2]),
        ("independent", 0.5, [1, 1, 1]),
        ("noMaterialResponse", 0, [1, 1, 1]),
    ):
        settings = ["rel material:binding = </glowing>", f'uniform token light:materialSyncMode = "{mode}"']
        scene, told = read(stage(tmp_path, CAMERA, GLOWING, panel(*settings), sun))
        assert told == []
        scene.camera = kanuka.Camera((0, 1, 0), (0, 2, 0), up=(0, 0, 1), fov=1)
        scene.resolution = (4, 4)
        rgb = kanuka.render(scene, progressions=64, threads=1)["rgb"].mean((0, 1))
        assert rgb == pytest.approx(np.array(glow) + body / math.pi, rel=0.03)


def test_geometry_lights_make_their_mesh_shine(tmp_path: Path) -> None:
    mesh = panel().replace('"MeshLightAPI", ', "")
    light = 'def GeometryLight "lamp" {\nrel geometry = GOAL\nfloat inputs:intensity = 5\nOFF\n}\n'
    off = "uniform bool collection:lightLink:includeRoot = 1\nrel collection:lightLink:excludes = </floor>"
    for more, expected in (("", 5), (off, 0)):
        lights = light.replace("GOAL", "</panel>").replace("OFF", more)
        found, told = shone(tmp_path, mesh, lights, size=9, reach=0.1)
        assert told == []
        assert found[4, 4].mean() * 4 / 0.0016 == pytest.approx(expected, rel=0.02)
    _, told = shone(tmp_path, mesh, light.replace("GOAL", "</none>").replace("OFF", ""), size=2)
    assert told[0] == "/lamp: its geometry is /none: only meshes shine"


def test_linking_of_meshes_that_shine(tmp_path: Path) -> None:
    off = "rel collection:lightLink:excludes = </floor>"
    found, told = shone(tmp_path, panel("float inputs:intensity = 5", off), size=9, reach=0.1)
    assert told == [] and found.max() == 0


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ("float inputs:intensity = nan", "/panel: inputs:intensity is nan"),
        ("float inputs:intensity = -1", "/panel: its brightness is -1, -1, -1"),
        ("float inputs:shaping:focus = 3", "/panel: shaping has no effect on meshes"),
        ("asset inputs:texture:file = @a.png@", "/panel: pictures of meshes that shine are not read"),
        (
            "bool inputs:normalize = 1\nfloat3 xformOp:scale = (0, 0, 0)\n"
            'uniform token[] xformOpOrder = ["xformOp:scale"]',
            "/panel: inputs:normalize is on, but its mesh has no area",
        ),
    ],
)
def test_what_meshes_that_shine_do_not_do_is_told(tmp_path: Path, body: str, expected: str) -> None:
    _, told = read(stage(tmp_path, CAMERA, panel(body)))
    assert len(told) == 1 and told[0].startswith(expected)


# ---- skies


def write_sky(folder: Path) -> None:
    """Red about the pole, blue about the other one, green in the middle, grey elsewhere."""
    rgb = np.full((32, 64, 3), 0.2, np.float32)
    rgb[:8], rgb[-8:] = (1, 0, 0), (0, 0, 1)
    rgb[12:20, 28:36] = (0, 1, 0)
    kanuka.Picture({"rgb": rgb}).write(folder / "sky.exr")


@pytest.mark.parametrize(
    ("kind", "axis", "pole", "up", "middle"),
    [
        ("DomeLight", "Y", "", (0, 1, 0), (0, 0, 1)),
        ("DomeLight", "Z", "", (0, 1, 0), (0, 0, 1)),
        ("DomeLight_1", "Y", "", (0, 1, 0), (0, 0, 1)),
        ("DomeLight_1", "Z", "", (0, 0, 1), (0, -1, 0)),
        ("DomeLight_1", "Y", "Z", (0, 0, 1), (0, -1, 0)),
        ("DomeLight_1", "Z", "Y", (0, 1, 0), (0, 0, 1)),
    ],
)
def test_domes_have_their_pole_where_they_say(
    tmp_path: Path, kind: str, axis: str, pole: str, up: tuple[int, ...], middle: tuple[int, ...]
) -> None:
    """`up` and `middle`: directions in the stage, which is turned where its up axis is z."""
    write_sky(tmp_path)
    body = f'asset inputs:texture:file = @./sky.exr@\nuniform token poleAxis = "{pole}"' if pole else ""
    body = body or "asset inputs:texture:file = @./sky.exr@"
    path = stage(tmp_path, CAMERA, f'def {kind} "sky" {{\n{body}\n}}\n', head=HEAD.replace('"Y"', f'"{axis}"'))
    scene, told = read(path)
    assert told == []
    scene.resolution = (4, 4)
    for to, color in ((up, (1, 0, 0)), (middle, (0, 1, 0)), (tuple(-x for x in up), (0, 0, 1))):
        x, y, z = to
        world = (x, z, -y) if axis == "Z" else to
        side = (world[1], world[2], world[0])
        scene.camera = kanuka.Camera((0, 0, 0), world, up=side, fov=4)
        rgb = kanuka.render(scene, progressions=4, threads=1)["rgb"].mean((0, 1))
        assert rgb == pytest.approx(color, abs=0.02)


def test_pictures_of_domes_in_other_layouts_are_told(tmp_path: Path) -> None:
    write_sky(tmp_path)
    dome = 'def DomeLight "sky" {\nasset inputs:texture:file = @./sky.exr@\ntoken inputs:texture:format = "%s"\n}\n'
    for layout, expected in (("latlong", 0), ("automatic", 0), ("mirroredBall", 1), ("cubeMapVerticalCross", 1)):
        _, told = read(stage(tmp_path, CAMERA, dome % layout))
        assert len(told) == expected and all(t.startswith(f"/sky: pictures of format {layout} are not") for t in told)


def test_portals_that_a_dome_names_lessen_the_noise_alone(tmp_path: Path) -> None:
    """A box over the floor with a small window in its lid, through which a sky shines: as much light, less noise."""
    hole = """
def Mesh "lid" {
    uniform token subdivisionScheme = "none"
    int[] faceVertexCounts = [4, 4, 4, 4, 4, 4, 4, 4]
    int[] faceVertexIndices = [0,1,5,4, 1,2,6,5, 2,3,7,6, 3,0,4,7, 0,1,9,8, 1,2,10,9, 2,3,11,10, 3,0,8,11]
    point3f[] points = [(-3,2,-3), (3,2,-3), (3,2,3), (-3,2,3), (-.2,2,-.2), (.2,2,-.2), (.2,2,.2), (-.2,2,.2),
                        (-3,0,-3), (3,0,-3), (3,0,3), (-3,0,3)]
}
"""
    portal = 'def PortalLight "window" {\nfloat inputs:width = 0.4\nfloat inputs:height = 0.4\n' + DOWN + "}\n"
    sky = 'def DomeLight "sky" {\nPORTALS\n}\n'
    found = []
    for names in ("", "rel portals = </window>"):
        rgb, told = shone(tmp_path, hole, portal, sky.replace("PORTALS", names), samples=256, size=8, reach=0.2)
        assert told == []
        found.append(rgb.mean(-1))
    noise = [values.std() for values in found]
    assert found[1].mean() == pytest.approx(0.16 / 4, rel=0.03)  # of radiance 1, as if it shone from there
    assert found[0].mean() == pytest.approx(found[1].mean(), abs=4 * float(noise[0]) / 8)
    assert noise[1] < 0.5 * noise[0]


# ---- instances

LAMP = """
class Xform "_post" {
    def Xform "arm" {
        double3 xformOp:translate = (0, 1, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
        def SphereLight "bulb" (prepend apiSchemas = ["ShapingAPI"]) {
            float inputs:radius = 0.02
            float inputs:intensity = 1000
            BODY
        }
    }
}
"""


def instance(name: str, place: str, x: float = 0, more: str = "") -> str:
    return f"""
def Xform "{name}" (instanceable = true
    inherits = </_post>) {{
    double3 xformOp:translate = ({x}, 1, 0)
    {place}
    uniform token[] xformOpOrder = ["xformOp:translate"{more}]
}}
"""


def from_points(points: list[tuple[float, float, float]], intensity: float) -> np.ndarray:
    x, z, _ = places()
    total = np.zeros(x.shape)
    for a, b, c in points:
        d2 = (x - a) ** 2 + b**2 + (z - c) ** 2
        total += intensity * b / d2**1.5
    return pixels(total)


def same(found: np.ndarray, expected: np.ndarray) -> None:
    """By means of 4 by 4 pixels: which light a path sees is by chance."""
    found, expected = (values.reshape(8, 4, 8, 4).mean((1, 3)) for values in (found.mean(-1), expected))
    assert found == pytest.approx(expected, rel=0.05)


def test_lights_in_native_instances_are_placed_with_them(tmp_path: Path) -> None:
    """Two posts, the second on its side, so that its lamp is beside and not above its foot."""
    side = instance("b", "float xformOp:rotateZ = -90", 0.2, ', "xformOp:rotateZ"')
    found, told = shone(tmp_path, LAMP.replace("BODY", ""), instance("a", "", -0.8), side, samples=256)
    assert told == []
    same(found, from_points([(-0.8, 2, 0), (1.2, 1, 0)], 1000 * math.pi * 0.0004))


def test_lights_in_prototypes_are_placed_by_their_instancers(tmp_path: Path) -> None:
    """An instancer of pairs, each an instancer of posts that are native instances; one pair is twice as large."""
    text = """
def PointInstancer "outer" {
    rel prototypes = </outer/pair>
    int[] protoIndices = [0, 0]
    point3f[] positions = [(-1, 1, -0.5), (1, 1, 0.5)]
    float3[] scales = [(1, 1, 1), (2, 2, 2)]
    def PointInstancer "pair" {
        rel prototypes = </outer/pair/post>
        int[] protoIndices = [0, 0]
        point3f[] positions = [(-0.3, 0, 0), (0.3, 0, 0)]
        def Xform "post" (instanceable = true
            inherits = </_post>) {
        }
    }
}
"""
    lamps = LAMP.replace("BODY", "bool inputs:normalize = 1").replace("1000", "4")
    found, told = shone(tmp_path, lamps, text, samples=256)
    assert told == []
    # Normalized, a sphere sends a quarter of its intensity whatever its size.
    same(found, from_points([(-1.3, 2, -0.5), (-0.7, 2, -0.5), (0.4, 3, 0.5), (1.6, 3, 0.5)], 1))


def test_no_more_lights_in_instances_than_are_bearable(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("kanuka.usd.instanced_lights.MOST", 3)
    text = """
def PointInstancer "many" {
    rel prototypes = </many/bulb>
    int[] protoIndices = [0, 0, 0, 0, 0, 0]
    point3f[] positions = [(-1, 2, 0), (0, 2, 0), (1, 2, 0), (0, 2, 1), (0, 2, 1), (0, 2, 1)]
    def SphereLight "bulb" {
        bool treatAsPoint = 1
        asset inputs:shaping:ies:file = @none.ies@
    }
}
"""
    found, told = shone(tmp_path, text, samples=256)
    assert sorted(told) == [
        '/many/bulb.inputs:shaping:ies:file: the file "none.ies" is not found',
        "/many/bulb: no more than 3 lights in instances are read; it and those after it are left out",
    ]
    same(found, from_points([(-1, 2, 0), (0, 2, 0), (1, 2, 0)], math.pi / 4))


def test_lights_that_are_hidden_in_instances_do_not_shine(tmp_path: Path) -> None:
    hidden = LAMP.replace('def Xform "arm" {', 'def Xform "arm" {\ntoken visibility = "invisible"')
    _, told = read(stage(tmp_path, CAMERA, hidden.replace("BODY", ""), instance("a", "")))
    assert told == ["the stage has no lights: it is lit by a white sky and a sun"]


@pytest.mark.parametrize("mode", ["MeshLightAPI", "material"])
def test_meshes_shine_in_instances(tmp_path: Path, mode: str) -> None:
    """By a light and by a material that glows: in two native instances, and in two of an instancer."""
    body = ["float inputs:intensity = 1000"] if mode == "MeshLightAPI" else ["rel material:binding = </glowing>"]
    mesh = panel(*body).replace('def Mesh "panel"', 'over "shape"').replace("MeshLightAPI", mode)
    if mode == "material":
        mesh = mesh.replace('"material", ', "")
    mesh = mesh.replace('over "shape"', 'def Mesh "panel"')
    post = f'class Xform "_post" {{\n{mesh}\n}}\n'
    text = """
def PointInstancer "two" {
    rel prototypes = </two/post>
    int[] protoIndices = [0, 0]
    point3f[] positions = [(0, 0, -1), (0, 0, 1)]
    def Xform "post" (inherits = </_post>) {
    }
}
"""
    glowing = GLOWING.replace("0.5, 1, 2", "1000, 1000, 1000")
    pair = [instance(name, "", x).replace(", 1, 0)", ", 0, 0)") for name, x in (("a", -1), ("b", 1))]
    found, told = shone(tmp_path, glowing, post, *pair, text, samples=256)
    assert told == ([] if mode == "MeshLightAPI" else ["the stage has no lights: it is lit by a white sky and a sun"])
    if mode == "material":
        scene, _ = read(stage(tmp_path, CAMERA, MATTE, FLOOR, glowing, post, *pair, text, name="b.usda"))
        scene.remove([scene.node(name, kind="light") for name in LIGHTS_OF_NONE])
        found = irradiance(scene, 256)
    x, z, _ = places()
    total = 0 * x
    for a, b in ((-1, 0), (1, 0), (0, -1), (0, 1)):
        d2 = (x - a) ** 2 + 4 + (z - b) ** 2
        total += 1.6 * 4 / d2**2
    same(found, pixels(total))


LIGHTS_OF_NONE = ("sky of a scene without lights", "sun of a scene without lights")


# ---- linking in instances. A row of tiles, each an instance of one; which of them a sun leaves out is seen from above.

TILE = """
class Xform "_tile" {
    def Mesh "top" (prepend apiSchemas = ["MaterialBindingAPI"]) {
        rel material:binding = </matte>
        uniform token subdivisionScheme = "none"
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        point3f[] points = [(-0.5, 0, 2), (0.5, 0, 2), (0.5, 0, -2), (-0.5, 0, -2)]
    }
}
"""
NOON = """
def DistantLight "sun" {
    float inputs:intensity = 1
    bool inputs:normalize = 1
    float inputs:angle = 0
    float xformOp:rotateX = -90
    uniform token[] xformOpOrder = ["xformOp:rotateX"]
    LINK
}
"""


def tile(name: str, x: float) -> str:
    return f"""
def Xform "{name}" (instanceable = true
    inherits = </_tile>) {{
    double3 xformOp:translate = ({x}, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}}
"""


TILES = "".join(tile(name, x) for name, x in (("a", -1.5), ("b", -0.5), ("c", 0.5), ("d", 1.5)))
OF_TWO = """
def PointInstancer "first" {
    rel prototypes = </protos/tile>
    int[] protoIndices = [0, 0]
    point3f[] positions = [(-1.5, 0, 0), (-0.5, 0, 0)]
}
def PointInstancer "second" {
    rel prototypes = </second/tile>
    int[] protoIndices = [0, 0]
    point3f[] positions = [(0.5, 0, 0), (1.5, 0, 0)]
    def Xform "tile" (instanceable = true
        inherits = </_tile>) {
    }
}
def Xform "protos" {
    double3 xformOp:translate = (0, -50, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def Xform "tile" (inherits = </_tile>) {
    }
}
"""
EXCLUDED = "rel collection:lightLink:excludes = %s"
INCLUDED = "uniform bool collection:lightLink:includeRoot = 0\nrel collection:lightLink:includes = %s"
EXPRESSION = 'uniform token collection:lightLink:mode = "expression"\n'
MATCHING = EXPRESSION + 'uniform pathExpression collection:lightLink:membershipExpression = "%s"'


@pytest.mark.parametrize(
    ("tiles", "link", "lit", "groups"),
    [
        (TILES, "", "abcd", 1),
        (TILES, EXCLUDED % "</c>", "abd", 2),
        (TILES, EXCLUDED % "[</a>, </c/top>]", "bd", 3),  # of as a whole and by the shape: told apart, if for nothing
        (TILES, INCLUDED % "</b/top>", "b", 2),
        (TILES, MATCHING % "/b// + /d//", "bd", 2),
        (OF_TWO, EXCLUDED % "</first>", "cd", 3),
        (OF_TWO, INCLUDED % "</first>", "ab", 3),
        (OF_TWO, INCLUDED % "</second/tile>", "cd", 3),
        (OF_TWO, MATCHING % "/first//", "ab", 3),
    ],
)
def test_what_is_instanced_is_linked_where_it_is_placed(
    tmp_path: Path, tiles: str, link: str, lit: str, groups: int
) -> None:
    scene, told = read(stage(tmp_path, CAMERA, MATTE, TILE, tiles, NOON.replace("LINK", link)))
    assert told == []
    along = irradiance(scene, 16, 16).mean((0, 2))
    assert along.reshape(4, 4).mean(1) == pytest.approx([1.0 * (name in lit) for name in "abcd"], abs=1e-3)
    assert scene.summary()["groups"] == groups


def test_shadows_in_instances_are_linked_too(tmp_path: Path) -> None:
    """The lids of two of four tiles stop a sun, of which the floor under the other two sees nothing."""
    lids = TILE.replace(", 0, ", ", 1, ")
    link = EXCLUDED.replace("lightLink", "shadowLink") % "[</b>, </c>]"
    found, told = shone(tmp_path, lids, TILES, NOON.replace("LINK", link), samples=16, size=16)
    assert told == []
    assert found.mean((0, 2)).reshape(4, 4).mean(1) == pytest.approx([0, 1, 1, 0], abs=1e-3)


def test_a_light_in_an_instance_is_linked_with_what_lies_beside_it(tmp_path: Path) -> None:
    """Two posts, each with a plate below its lamp that only this lamp shines on: the other one's light is missing."""
    plate = """
    def Mesh "plate" (prepend apiSchemas = ["MaterialBindingAPI"]) {
        rel material:binding = </matte>
        uniform token subdivisionScheme = "none"
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        point3f[] points = [(-0.5, -1, 0.5), (0.5, -1, 0.5), (0.5, -1, -0.5), (-0.5, -1, -0.5)]
    }
"""
    body = "bool treatAsPoint = 1\n" + INCLUDED % "</_post/plate>"
    post = LAMP.replace("BODY", body).replace('class Xform "_post" {', f'class Xform "_post" {{\n{plate}')
    posts = [instance("a", "", -1), instance("b", "", 1)]
    scene, told = read(stage(tmp_path, CAMERA, MATTE, post, *posts))
    assert told == []
    found = irradiance(scene, 64)[..., 0]
    lone = from_points([(-1, 2, 0)], 1000 * math.pi * 0.0004)
    assert found[13:19, 5:11] == pytest.approx(lone[13:19, 5:11], rel=0.03)
    assert found[:, 14:18].max() == 0


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


def test_what_lights_do_not_do_is_told_once_for_all(tmp_path: Path) -> None:
    odd = """
    float inputs:diffuse = 0.5
    color3f inputs:shadow:color = (1, 0, 0)
    float inputs:shadow:distance = 3
    color3f inputs:color.connect = </graph.outputs:out>
"""
    lights = [f'def SphereLight "{name}" {{\n{odd}\n}}\n' for name in "abc"]
    graph = 'def Shader "graph" {\ncolor3f outputs:out\n}\n'
    _, told = read(stage(tmp_path, CAMERA, *lights, graph))
    assert told == [
        "/a and 2 more: multipliers of diffuse or specular light alone are not read",
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
