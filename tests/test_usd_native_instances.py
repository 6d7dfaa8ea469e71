"""Native instances: what many of a prototype cost beside a PointInstancer, and how they differ by what they inherit.
They are compared with prims that have themselves what instances inherit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka
from kanuka.usd import reader
from test_usd_instance_primvars import WET
from test_usd_instances import PAINTS
from usd_shapes import ball, from_above
from usd_stages import CAMERA, SUN, read, stage

# Twelve places, and where pixels of a picture of 40 x 40 see them.
PLACES = [(x, z) for z in (-0.6, 0, 0.6) for x in (-0.75, -0.25, 0.25, 0.75)]
COLORS = np.random.default_rng(5).uniform(0.1, 0.8, (12, 3)).round(3)
ORDER = 'uniform token[] xformOpOrder = ["xformOp:translate"]'
API = '\nprepend apiSchemas = ["MaterialBindingAPI"]'
# Half a unit wide, but small: a picture's pixel in the middle sees nothing else.
MESH = """
def Mesh "m" {
    uniform token subdivisionScheme = "none"
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-0.2, 0, 0.2), (0.2, 0, 0.2), (0.2, 0, -0.2), (-0.2, 0, -0.2)]
    MORE
}
"""


def at(x: float, z: float) -> str:
    return f"double3 xformOp:translate = ({x}, 0, {z})\n{ORDER}"


def prototype(inside: str, name: str = "_it", bound: str = "") -> str:
    binding = f"rel material:binding = </{bound}>\n" if bound else ""
    return f'class Xform "{name}" ({API if bound else ""}) {{\n{binding}{inside}\n}}\n'


def native(name: str, more: str, place: tuple[float, float], of: str = "_it", bound: str = "") -> str:
    binding = f"\nrel material:binding = </{bound}>" if bound else ""
    return (
        f'def Xform "{name}" (instanceable = true\ninherits = </{of}>{API if bound else ""}) '
        f"{{\n{more}{binding}\n{at(*place)}\n}}\n"
    )


def color(value: object) -> str:
    r, g, b = value
    return f"color3f[] primvars:displayColor = [({r}, {g}, {b})]"


def albedo(scene: kanuka.Scene, places: list[tuple[float, float]] = PLACES) -> np.ndarray:
    from_above(scene).resolution = 40, 40
    scene.options.filter, scene.options.filter_width = "box", (1, 1)
    seen = kanuka.render(scene, progressions=4, threads=1, journal=kanuka.Journal())["albedo"]
    return np.stack([seen[round(20 * (z + 1)), round(20 * (x + 1))] for x, z in places]).astype(np.float64)


def loaded(folder: Path, *parts: str) -> kanuka.Scene:
    scene, told = read(stage(folder, CAMERA, SUN, *parts))
    assert told == []
    return scene


def groups(scene: kanuka.Scene) -> int:
    return scene.summary()["groups"]


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Prototypes are as if they were large: of more than eight sets of values instances have them as variables."""
    monkeypatch.setattr(reader, "EXACT_POINTS", 1)


def expected(folder: Path, shape: str, values: list[str], bound: list[str] | None = None) -> np.ndarray:
    """What prims show that have the values themselves, in the same places."""
    text = ""
    for k, (place, value) in enumerate(zip(PLACES, values, strict=True)):
        binding = f"\nrel material:binding = </{bound[k]}>" if bound else ""
        text += f'def Xform "own{k}" ({API if bound else ""}) {{\n{value}{binding}\n{at(*place)}\n{shape}\n}}\n'
    scene, told = read(stage(folder, CAMERA, SUN, WET, PAINTS, text, name="own.usda"))
    assert told == []
    return albedo(scene)


# ---- many that are alike


def test_they_cost_what_those_of_a_point_instancer_do(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    places = rng.uniform(-0.9, 0.9, (500, 2)).round(4)
    inside = MESH.replace("MORE", "").replace("0.2", "0.02")
    one = loaded(tmp_path, prototype(inside), *(native(f"i{k}", "", p) for k, p in enumerate(places)))
    positions = ", ".join(f"({x}, 0, {z})" for x, z in places)
    other = loaded(
        tmp_path,
        f'def PointInstancer "pi" {{\nrel prototypes = </pi/it>\nint[] protoIndices = [{", ".join("0" * 500)}]\n'
        f'point3f[] positions = [{positions}]\ndef Xform "it" {{\n{inside}\n}}\n}}\n',
    )
    assert groups(one) == groups(other) == 1
    assert one.summary()["instances"] == other.summary()["instances"] == 500
    stats = []
    for scene in (one, other):
        from_above(scene).resolution = 40, 40
        stats.append(kanuka.render(scene, progressions=1, threads=1).stats)
    for name in ("primitives", "vertices", "instances", "shader_evaluations"):
        assert stats[0]["count"][name] == stats[1]["count"][name], name
    for name in ("grids", "lobe_inputs", "bvh"):
        assert stats[0]["bytes"][name] == stats[1]["bytes"][name], name


def test_tinted_ones_and_plain_ones_are_kept_apart(tmp_path: Path) -> None:
    """As if each were of a prototype of its own."""
    tint = "color3f primvars:kanuka:tint = ({}, 1, 1)"
    more = ["", tint.format(0.5), tint.format(0.25), "", "", tint.format(0), *[""] * 6]
    inside = MESH.replace("MORE", "")
    scene = loaded(tmp_path, prototype(inside), *(native(f"i{k}", m, PLACES[k]) for k, m in enumerate(more)))
    assert groups(scene) == 1
    shown = albedo(scene)
    assert shown[5, 0] < shown[2, 0] < shown[1, 0] < shown[0, 0]
    of_its_own = (prototype(inside, f"_it{k}") + native(f"i{k}", m, PLACES[k], f"_it{k}") for k, m in enumerate(more))
    assert shown == pytest.approx(albedo(loaded(tmp_path, *of_its_own)), abs=1e-4)


# ---- values that differ


@pytest.mark.parametrize("shape", [MESH, ball("b", 0)], ids=["mesh", "solid"])
def test_few_values_are_groups_and_exact(tmp_path: Path, shape: str) -> None:
    inside = shape.replace("MORE", "")
    scene = loaded(tmp_path, prototype(inside), *(native(f"i{k}", color(c), PLACES[k]) for k, c in enumerate(COLORS)))
    assert groups(scene) == 12
    assert albedo(scene) == pytest.approx(expected(tmp_path, inside, [color(c) for c in COLORS]), abs=2e-3)


@pytest.mark.parametrize("shape", [MESH, ball("b", 0)], ids=["mesh", "solid"])
def test_many_are_variables_of_instances(few: None, tmp_path: Path, shape: str) -> None:
    """Of the prototype, nine groups: eight of a value each, and one whose four instances have theirs. What a shape
    elsewhere has itself is of no matter."""
    inside = shape.replace("MORE", "")
    scene = loaded(
        tmp_path,
        ball("first", 0, color((1, 1, 1))).replace("0.2", "0.01"),
        prototype(inside),
        *(native(f"i{k}", color(c), PLACES[k]) for k, c in enumerate(COLORS)),
    )
    assert groups(scene) == 9
    assert albedo(scene) == pytest.approx(expected(tmp_path, inside, [color(c) for c in COLORS]), abs=2e-3)


def test_they_come_from_above_and_go_into_nested_ones(few: None, tmp_path: Path) -> None:
    """A primvar of a prim above the instance, read by a mesh in an instance in it."""
    wetness = np.linspace(0, 1, 12).round(3)
    inner = prototype(MESH.replace("MORE", ""), "_leaf", "wet")
    outer = prototype(native("leaf", "", (0, 0), "_leaf"))
    text = "".join(
        f'def Xform "above{k}" {{\nfloat primvars:wetness = {w}\n{native("i", "", PLACES[k])}\n}}\n'
        for k, w in enumerate(wetness)
    )
    scene = loaded(tmp_path, WET, inner, outer, text)
    assert groups(scene) == 2 * 9
    values = [f"float primvars:wetness = {w}" for w in wetness]
    wanted = expected(tmp_path, MESH.replace("MORE", ""), values, ["wet"] * 12)
    assert albedo(scene) == pytest.approx(wanted, abs=2e-3)


def test_those_that_say_nothing_have_what_the_material_has(few: None, tmp_path: Path) -> None:
    wetness = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, None, 1.0, None]
    more = ["" if w is None else f"float primvars:wetness = {w}" for w in wetness]
    scene = loaded(
        tmp_path,
        WET,
        prototype(MESH.replace("MORE", ""), bound="wet"),
        *(native(f"i{k}", m, PLACES[k]) for k, m in enumerate(more)),
    )
    wanted = expected(tmp_path, MESH.replace("MORE", ""), more, ["wet"] * 12)
    assert albedo(scene) == pytest.approx(wanted, abs=2e-3)


@pytest.mark.parametrize("shape", [MESH, ball("b", 0)], ids=["mesh", "solid"])
def test_what_a_shape_has_itself_counts_more(few: None, tmp_path: Path, shape: str) -> None:
    has = shape.replace("MORE", color((0.3, 0.4, 0.5))) if "MORE" in shape else ball("b", 0, color((0.3, 0.4, 0.5)))
    scene = loaded(tmp_path, prototype(has), *(native(f"i{k}", color(c), PLACES[k]) for k, c in enumerate(COLORS)))
    assert albedo(scene) == pytest.approx(expected(tmp_path, has, [""] * 12), abs=2e-3)


def test_materials_are_groups_of_their_own(few: None, tmp_path: Path) -> None:
    """Bindings on the instances, and values: those of a binding are counted by themselves."""
    bound = ["red", "wet", "blue", "wet"] * 3
    wetness = np.linspace(0.2, 1, 12).round(3)
    scene = loaded(
        tmp_path,
        WET,
        PAINTS,
        prototype(MESH.replace("MORE", "")),
        *(native(f"i{k}", f"float primvars:wetness = {w}", PLACES[k], bound=bound[k]) for k, w in enumerate(wetness)),
    )
    wanted = expected(tmp_path, MESH.replace("MORE", ""), [f"float primvars:wetness = {w}" for w in wetness], bound)
    assert albedo(scene) == pytest.approx(wanted, abs=2e-3)
    assert groups(scene) == 6 + 2  # of six sets of values, and of two paints that read none


def test_in_prototypes_of_point_instancers(few: None, tmp_path: Path) -> None:
    """Native instances in a prototype that is placed twice: each shows its own colour in both places."""
    row = PLACES[:4] + PLACES[4:8]
    inside = "".join(native(f"i{k}", color(COLORS[k]), place) for k, place in enumerate(row)) + "".join(
        native(f"j{k}", color(COLORS[8 + k]), (place[0], place[1] - 0.3)) for k, place in enumerate(PLACES[:4])
    )
    text = f"""
def PointInstancer "pi" {{
    rel prototypes = </pi/all>
    int[] protoIndices = [0, 0]
    point3f[] positions = [(0, 0, 0), (0, 0, 0.6)]
    def Xform "all" {{
    {inside}
    }}
}}
"""
    small = MESH.replace("MORE", "").replace("0.2", "0.1")
    scene = loaded(tmp_path, prototype(small), text)
    assert groups(scene) == 9 + 1
    places = PLACES + [(x, -0.9) for x, _ in PLACES[:4]] + [(x, -0.3) for x, _ in PLACES[:4]]
    by_itself = "".join(
        f'def Xform "o{k}" {{\n{color(COLORS[of])}\n{at(*places[k])}\n{small}\n}}\n'
        for k, of in enumerate([*range(8), *range(4, 8), *range(8, 12), *range(8, 12)])
    )
    assert albedo(scene, places) == pytest.approx(albedo(loaded(tmp_path, by_itself), places), abs=2e-3)


def test_motion_and_values_go_together(few: None, tmp_path: Path) -> None:
    moving = "double3 xformOp:translate.timeSamples = {{ 0: ({x}, 0, {z}), 1: ({y}, 0, {z}) }}\n"
    text = ""
    for k, ((x, z), c) in enumerate(zip(PLACES, COLORS, strict=True)):
        one = native(f"i{k}", color(c), (x, z))
        text += one.replace(at(x, z), moving.format(x=x, y=x + 0.01, z=z) + ORDER) if k % 2 else one
    camera = CAMERA.replace("float focalLength", "double shutter:close = 1\n    float focalLength", 1)
    scene, told = read(stage(tmp_path, camera, SUN, prototype(MESH.replace("MORE", "")), text))
    assert told == []
    assert groups(scene) == 9
    wanted = expected(tmp_path, MESH.replace("MORE", ""), [color(c) for c in COLORS])
    assert albedo(scene) == pytest.approx(wanted, abs=3e-3)
