"""Instances of USD stages, skins in them, and what prims inherit."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import numpy as np
import pytest

import kanuka
from test_usd_schemas import SKIN
from usd_shapes import alpha, ball, from_above
from usd_stages import CAMERA, MATTE, SUN, read, stage

# ---- skins of what is instanced


def skinned(at: str, kind: str = "class") -> str:
    """A square that goes from the left to the right half between frames 1 and 2: below a prim that is not rendered."""
    return f'{kind} Scope "crowd" {{\n{SKIN.replace("</man", f"<{at}/man")}\n}}\n'


LITTLE = """
    float3 xformOp:scale = (0.5, 0.5, 0.5)
    double3 xformOp:translate = (0, 0, {})
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]
"""
TWO = "".join(
    f'def Xform "{name}" (instanceable = true\n inherits = </crowd>) {{\n{LITTLE.format(z)}\n}}\n'
    for name, z in (("up", -0.5), ("down", 0.5))
)
NESTED = f"""
class Xform "pair" {{
    {TWO}
}}
def Xform "all" (instanceable = true
    inherits = </pair>) {{
}}
"""
BY_POINTS = """
def PointInstancer "pi" {
    rel prototypes = </crowd>
    int[] protoIndices = [0, 0]
    point3f[] positions = [(0, 0, -0.5), (0, 0, 0.5)]
    float3[] scales = [(0.5, 0.5, 0.5), (0.5, 0.5, 0.5)]
}
"""


@pytest.mark.parametrize("text", [TWO, NESTED, BY_POINTS, BY_POINTS.replace("pi", "over")])
def test_skins_of_instances_follow_their_bones(tmp_path: Path, text: str):
    path = stage(tmp_path, CAMERA, SUN, skinned("/crowd", "over" if '"over"' in text else "class"), text)
    for frame, left in ((1, True), (2, False)):
        scene, told = read(path, frame=frame)
        assert told == (
            []
            if "PointInstancer" in text
            else [f"{3 if text is NESTED else 2} instances have skins; each is read by itself"]
        )
        seen = alpha(scene)
        here, gone = (np.s_[:, 9:15], np.s_[:, 17:]) if left else (np.s_[:, 17:23], np.s_[:, :15])
        assert seen[here][1:15].min() == 1 and seen[here][17:31].min() == 1 and seen[gone].max() == 0


# ---- what prims inherit, and what reading costs


PAINTS = "".join(
    MATTE.replace('"matte"', f'"{name}"').replace("</matte", f"</{name}").replace("(0.5, 0.5, 0.5)", color)
    for name, color in (("red", "(0.8, 0, 0)"), ("green", "(0, 0.8, 0)"), ("blue", "(0, 0, 0.8)"))
)
BOUND = '(prepend apiSchemas = ["MaterialBindingAPI"]) {\n rel material:binding = </'


def colors_at(scene: kanuka.Scene, *xs: float) -> list[str]:
    from_above(scene).resolution = 40, 40
    albedo = kanuka.render(scene, progressions=4, threads=1, journal=kanuka.Journal())["albedo"]
    found = (albedo[20, round(20 * (x + 1))] for x in xs)
    return [["red", "green", "blue"][int(np.argmax(c))] if c.max() > 0.3 else "grey" for c in found]


def test_materials_are_inherited(tmp_path: Path):
    """From the prim next above; from the farthest that is stronger; by a collection that names one of two."""
    own = ball("b", 0).replace('"b" {', f'"b" {BOUND}green>')
    text = f'def Xform "x" {BOUND}red>\n{ball("a", -0.6)}{own}\ndef Xform "y" {BOUND}blue>\n{ball("c", 0.6)}\n}}\n}}\n'
    scene, told = read(stage(tmp_path, CAMERA, SUN, PAINTS, text))
    assert told == [] and colors_at(scene, -0.6, 0, 0.6) == ["red", "green", "blue"]
    stronger = text.replace("</red>", '</red> (bindMaterialAs = "strongerThanDescendants")')
    scene, told = read(stage(tmp_path, CAMERA, SUN, PAINTS, stronger, name="b.usda"))
    assert told == [] and colors_at(scene, -0.6, 0, 0.6) == ["red", "red", "red"]
    some = '["MaterialBindingAPI", "CollectionAPI:some"]'
    named = f"""
def Xform "x" (prepend apiSchemas = {some}) {{
    rel material:binding:collection:some = [</x.collection:some>, </green>]
    rel collection:some:includes = </x/b>
    {ball("a", -0.6)}{ball("b", 0)}
}}
"""
    scene, told = read(stage(tmp_path, CAMERA, SUN, PAINTS, named, name="c.usda"))
    assert told == [] and colors_at(scene, -0.6, 0) == ["grey", "green"]


def test_instances_differ_by_what_they_inherit(tmp_path: Path):
    """Materials and primvars of instances and of what is above them: one group for each set of them."""
    color = "color3f[] primvars:displayColor = [{}]"
    one = f'class Xform "_ball" {{\n{ball("b", 0)}\n}}\n'

    def placed(name: str, x: float, more: str = "", bound: str = "") -> str:
        api = '\nprepend apiSchemas = ["MaterialBindingAPI"]' if bound else ""
        text = ball(name, x, more + (f"\nrel material:binding = </{bound}>" if bound else ""))
        text = text.replace("def Sphere", "def Xform").replace("double radius = 0.2\n", "")
        return text.replace(" {", f" (instanceable = true\ninherits = </_ball>{api}) {{", 1)

    text = (
        placed("i", -0.75, color.format("(0.8, 0, 0)"))
        + placed("j", -0.25, color.format("(0, 0.8, 0)"))
        + placed("k", 0.25, bound="blue")
        + f'def Xform "x" {{\n{color.format("(0.8, 0, 0)")}\n{placed("l", 0.75)}\n}}\n'
    )
    scene, told = read(stage(tmp_path, CAMERA, SUN, PAINTS, one, text))
    assert told == []
    assert colors_at(scene, -0.75, -0.25, 0.25, 0.75) == ["red", "green", "blue", "red"]
    assert scene.summary()["groups"] == 3 and scene.summary()["instances"] == 4


def test_purposes_are_inherited(tmp_path: Path):
    """A guide is not shown, what is below it neither; but for what says that it is something else."""
    other = ball("b", 0.6, 'uniform token purpose = "render"')
    text = f'def Xform "x" {{\nuniform token purpose = "guide"\n{ball("a", -0.6)}{other}\n}}\n'
    scene, told = read(stage(tmp_path, CAMERA, SUN, text))
    assert told == []
    seen = alpha(from_above(scene), 20)
    assert seen[:, :10].max() == 0 and seen[:, 10:].max() == 1


def test_instances_take_little_memory(tmp_path: Path):
    from pxr import Usd, UsdGeom, Vt

    count = 100_000
    made = Usd.Stage.CreateNew(str(tmp_path / "a.usdc"))
    UsdGeom.Camera.Define(made, "/cam")
    schema = UsdGeom.PointInstancer.Define(made, "/pi")
    schema.CreatePrototypesRel().SetTargets([UsdGeom.Sphere.Define(made, "/pi/ball").GetPath()])
    schema.CreateProtoIndicesAttr(Vt.IntArray.FromNumpy(np.zeros(count, dtype=np.int32)))
    values = np.random.default_rng(1).random((count, 4)).astype(np.float32)
    schema.CreatePositionsAttr(Vt.Vec3fArray.FromNumpy(values[:, :3].copy()))
    schema.CreateOrientationsfAttr(Vt.QuatfArray.FromNumpy(values))
    schema.CreateScalesAttr(Vt.Vec3fArray.FromNumpy(values[:, :3].copy()))
    made.GetRootLayer().Save()
    read(stage(tmp_path, CAMERA))  # what is loaded once
    tracemalloc.start()
    scene, told = read(tmp_path / "a.usdc")
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert scene.summary()["instances"] == count and len(told) == 1
    # 48 of the matrices, 8 of their numbers, a few of masks; and chunks of doubles. USD's matrices alone are 128.
    assert peak / count < 130
