"""Meshes that shine and skies of USD stages, against closed forms."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import kanuka
from usd_lights import DOWN, GLOWING, panel, shone
from usd_stages import CAMERA, HEAD, read, stage

# ---- meshes that shine


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
        ("asset inputs:texture:file = @a.png@", '/panel.inputs:texture:file: the file "a.png" is not found'),
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


CUBE = """
def Mesh "cube" (prepend apiSchemas = ["MeshLightAPI"]) {
    bool inputs:normalize = 1
    int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]
    int[] faceVertexIndices = [0,1,3,2, 4,6,7,5, 0,2,6,4, 1,5,7,3, 0,4,5,1, 2,3,7,6]
    point3f[] points = [(-1,-1,-1), (-1,-1,1), (-1,1,-1), (-1,1,1), (1,-1,-1), (1,-1,1), (1,1,-1), (1,1,1)]
    EXTRA
}
"""
LOOPS = """int[] creaseIndices = [0,1,3,2,0, 4,5,7,6,4, 0,4, 1,5, 2,6, 3,7]
    int[] creaseLengths = [5, 5, 2, 2, 2, 2]
    float[] creaseSharpnesses = [10, 10, 10, 10, 10, 10]"""


def area_by_outlines(scene: kanuka.Scene) -> float:
    """Cauchy: the mean outline of a convex body, over all directions, is a quarter of its area. In one octant, as the
    cube is the same in all."""
    outlines = []
    for i in range(24):
        z, turn = 1 - (i + 0.5) / 24, (i * 0.618) % 1 * math.pi / 2
        away = (math.sqrt(1 - z * z) * math.cos(turn), math.sqrt(1 - z * z) * math.sin(turn), z)
        scene.camera = kanuka.Camera(
            tuple(4 * x for x in away), (0, 0, 0), projection="orthographic", screen_window=(-2, 2, -2, 2)
        )
        outlines.append(16 * float(kanuka.render(scene, progressions=4, threads=1)["alpha"].mean()))
    return 4 * float(np.mean(outlines))


@pytest.mark.parametrize("extra", ["", LOOPS, "int[] holeIndices = [0]"])
def test_subdivision_surfaces_are_normalized_by_their_own_area(tmp_path: Path, extra: str) -> None:
    """What the camera sees of a cube is 1 / area: of a smooth one, a sharp one, and one with a hole that is as much as
    its other faces."""
    scene, told = read(stage(tmp_path, CAMERA, CUBE.replace("EXTRA", extra)))
    assert told == []
    scene.resolution = (32, 32)
    solid, _ = read(stage(tmp_path, CAMERA, CUBE.replace("EXTRA", "" if "hole" in extra else extra), name="b.usda"))
    solid.resolution = (32, 32)
    area = area_by_outlines(solid) * (5 / 6 if "hole" in extra else 1)
    if extra == LOOPS:
        assert area == pytest.approx(24, rel=0.02)  # the cage's, which the others are far from
    else:
        assert area < 10
    scene.camera = kanuka.Camera((0, 0, 4), (0, 0, 0), fov=5)
    seen = kanuka.render(scene, progressions=64, threads=1)["rgb"].mean()
    assert seen == pytest.approx(1 / area, rel=0.02)


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
