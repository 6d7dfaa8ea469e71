"""Stages of many meshes: what one costs, and that reading some at a time changes nothing."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import kanuka.usd
from usd_stages import CAMERA, FLOOR, MATTE, SUN, middle, picture, read, stage

TINTED = MATTE.replace(
    "color3f inputs:diffuseColor = (0.5, 0.5, 0.5)", "color3f inputs:diffuseColor.connect = </matte/p.outputs:result>"
).replace(
    'def Shader "s" {',
    """def Shader "p" {
        uniform token info:id = "UsdPrimvarReader_float3"
        string inputs:varname = "displayColor"
        float3 outputs:result
    }
    def Shader "s" {""",
)
COLOR = "color3f[] primvars:displayColor = "


def many(count: int) -> str:
    """Half of them subdivision surfaces, each in another place."""
    schemes = ("none", "catmullClark")
    return "".join(
        FLOOR.replace('"floor"', f'"m{i}"')
        .replace('"none"', f'"{schemes[i % 2]}"')
        .replace(
            "EXTRA", f'double3 xformOp:translate = ({i}, 0, 0)\ntoken[] xformOpOrder = ["xformOp:translate"]\nMORE'
        )
        .replace("MORE", COLOR + "[(0.5, 0.5, 0.5)]")
        for i in range(count)
    )


def calls(path: Path) -> int:
    """Of Python's functions, while a stage is read."""
    from kanuka.usd import scene  # noqa: F401  before it is counted

    count = 0

    def called(frame, event: str, argument) -> None:
        nonlocal count
        count += event in ("call", "c_call")

    before = sys.getprofile()
    sys.setprofile(called)
    try:
        kanuka.usd.load(path)
    finally:
        sys.setprofile(before)
    return count


def test_a_mesh_more_is_few_calls_more(tmp_path: Path):
    """With a colour of its own, that its material reads. They were 148, and are 109."""
    few, more = (stage(tmp_path, CAMERA, TINTED, SUN, many(count), name=f"{count}.usda") for count in (50, 100))
    kanuka.usd.load(few)
    assert (calls(more) - calls(few)) / 50 < 125


@pytest.mark.parametrize("most", [1, 5])
def test_what_is_read_some_at_a_time_is_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, most: int):
    from kanuka.usd import geometry

    whole, parts = tmp_path / "whole.rib", tmp_path / "parts.rib"
    path = stage(tmp_path, CAMERA, TINTED, SUN, many(7), 'def Sphere "s" {}', many(3).replace('"m', '"n'))
    kanuka.usd.convert(path, whole)
    monkeypatch.setattr(geometry, "MOST_POINTS", most)
    kanuka.usd.convert(path, parts)
    assert whole.read_text().replace("whole", "parts") == parts.read_text()


def test_a_primvar_that_is_blocked_gives_way_to_the_inherited_one(tmp_path: Path):
    def red(own: str) -> float:
        text = f'def Xform "x" {{\n{COLOR}[(0.5, 0, 0)]\n{FLOOR.replace("EXTRA", own)}\n}}'
        scene, told = read(stage(tmp_path, CAMERA, TINTED, SUN, text))
        assert not told
        return middle(picture(scene))

    assert red(COLOR + "None") == pytest.approx(red(""))
    assert red(COLOR + "[(0.25, 0, 0)]") < 0.6 * red("")


@pytest.mark.parametrize("kind", ["color3f", "float"])
def test_a_primvar_without_values_is_told_and_its_mesh_stays(tmp_path: Path, kind: str):
    empty = COLOR.replace("color3f", kind) + "[]"
    scene, told = read(stage(tmp_path, CAMERA, TINTED, SUN, FLOOR.replace("EXTRA", empty)))
    assert told == ["/floor: primvar displayColor is no color; it is not read"]
    assert scene.summary()["points"] == 4


def test_what_a_render_needs_not_is_not_imported():
    code = "import sys, kanuka; print(*sys.modules); kanuka.ShaderGraph, kanuka.procedural; print(*sys.modules)"
    made = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    before, after = (set(line.split()) for line in made.stdout.splitlines())
    late = {"numpy", "json", "kanuka.graph", "kanuka.procedurals"}
    assert not before & late
    assert late <= after
