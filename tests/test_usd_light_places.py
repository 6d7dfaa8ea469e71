"""Lights of USD stages in instances, and linking there, against closed forms."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from usd_lights import (
    FLOOR,
    GLOWING,
    NOON,
    TILE,
    TILES,
    from_points,
    irradiance,
    panel,
    pixels,
    places,
    same,
    shone,
)
from usd_stages import CAMERA, MATTE, read, stage

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


def test_places_that_are_no_numbers_have_no_lights(tmp_path: Path) -> None:
    """In an instancer of an instancer, beside a lamp that shines."""
    text = """
def PointInstancer "outer" {
    rel prototypes = </outer/inner>
    int[] protoIndices = [0]
    point3f[] positions = [(0, 1, 0)]
    def PointInstancer "inner" {
        rel prototypes = </outer/inner/post>
        int[] protoIndices = [0]
        point3f[] positions = [(nan, 0, 0)]
        def Xform "post" (instanceable = true
            inherits = </_post>) {
        }
    }
}
"""
    found, told = shone(tmp_path, LAMP.replace("BODY", ""), text, instance("a", ""), samples=256)
    assert told == ["/outer/inner: 1 places are no numbers. Those are left out"]
    same(found, from_points([(0, 2, 0)], 1000 * math.pi * 0.0004))


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


def test_normalized_meshes_in_instances_that_are_scaled_are_told(tmp_path: Path) -> None:
    post = f'class Xform "_post" {{\n{panel("bool inputs:normalize = 1")}\n}}\n'
    for scale, expected in ((1, 0), (3, 1)):
        large = instance("a", f"float3 xformOp:scale = ({scale}, {scale}, {scale})", 0, ', "xformOp:scale"')
        _, told = read(stage(tmp_path, CAMERA, post, large, instance("b", "")))
        assert len(told) == expected
        assert all("/panel: normalize divides by the area of its mesh in the prototype" in text for text in told)


LIGHTS_OF_NONE = ("sky of a scene without lights", "sun of a scene without lights")


# ---- linking in instances. A row of tiles, each an instance of one; which of them a sun leaves out is seen from above.

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
        (OF_TWO, EXCLUDED % "</first>", "cd", 2),
        (OF_TWO, INCLUDED % "</first>", "ab", 2),
        (OF_TWO, INCLUDED % "</second/tile>", "cd", 2),
        (OF_TWO, MATCHING % "/first//", "ab", 2),
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
