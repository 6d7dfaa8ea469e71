"""Primvars of PointInstancers that materials read. They are compared with prims that have these themselves."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka
import kanuka.rib
from usd_shapes import ball, from_above, mesh
from usd_stages import CAMERA, SUN, read, stage

COLORS = np.array([(0.7, 0.2, 0.2), (0.2, 0.6, 0.3), (0.3, 0.3, 0.6)])
WET = """
def Material "wet" {
    token outputs:surface.connect = </wet/s.outputs:surface>
    def Shader "s" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor.connect = </wet/mul.outputs:out>
        int inputs:useSpecularWorkflow = 1
        color3f inputs:specularColor = (0, 0, 0)
        token outputs:surface
    }
    def Shader "mul" {
        uniform token info:id = "ND_multiply_color3FA"
        color3f inputs:in1 = (0.8, 0.4, 0.4)
        float inputs:in2.connect = </wet/r.outputs:result>
        color3f outputs:out
    }
    def Shader "r" {
        uniform token info:id = "UsdPrimvarReader_float"
        string inputs:varname = "wetness"
        float inputs:fallback = 0.5
        float outputs:result
    }
}
"""
BOUND = '(prepend apiSchemas = ["MaterialBindingAPI"]) {\n rel material:binding = </wet>'


SQUARE = "point3f[] points = [(-0.2, 0, 0.2), (0.2, 0, 0.2), (0.2, 0, -0.2), (-0.2, 0, -0.2)]\n"


def instancer(primvars: str, indices: str = "0, 0, 0", inside: bool = True, wet: bool = False) -> str:
    bound = BOUND if wet else "{"
    prototype = f'def Xform "it" {bound}\n{ball("b", 0)}\n}}\n'
    text = f"""
def PointInstancer "pi" {{
    rel prototypes = {"</pi/it>" if inside else "</lib/it>"}
    int[] protoIndices = [{indices}]
    point3f[] positions = [(-0.6, 0, 0), (0, 0, 0), (0.6, 0, 0)]
    {primvars}
    {prototype if inside else ""}
}}
"""
    return text if inside else f'class Scope "lib" {{\n{prototype}\n}}\n' + text


def shown(scene: kanuka.Scene) -> np.ndarray:
    from_above(scene).resolution = 40, 40
    albedo = kanuka.render(scene, progressions=4, threads=1, journal=kanuka.Journal())["albedo"]
    return np.stack([albedo[20, round(20 * (x + 1))] for x in (-0.6, 0, 0.6)]).astype(np.float64)


def apart(folder: Path, each: list[str], wet: bool = False) -> np.ndarray:
    text = ""
    for k, (x, more) in enumerate(zip((-0.6, 0, 0.6), each, strict=True)):
        one = ball(f"b{k}", x, more)
        text += one.replace(f'"b{k}" {{', f'"b{k}" {BOUND}') if wet else one
    scene, told = read(stage(folder, CAMERA, SUN, WET, text, name="apart.usda"))
    assert told == []
    return shown(scene)


def listed(colors: np.ndarray) -> str:
    return ", ".join(f"({r}, {g}, {b})" for r, g, b in colors)


@pytest.mark.parametrize("interpolation", ["vertex", "uniform", "constant"])  # that of files which say none is the last
@pytest.mark.parametrize("inside", [True, False])
def test_display_color_of_each_instance(tmp_path: Path, interpolation: str, inside: bool) -> None:
    primvar = f'color3f[] primvars:displayColor = [{listed(COLORS)}] (interpolation = "{interpolation}")'
    scene, told = read(stage(tmp_path, CAMERA, SUN, instancer(primvar, inside=inside)))
    assert told == []
    assert scene.summary()["groups"] == 1
    expected = apart(tmp_path, [f"color3f[] primvars:displayColor = [{listed(c[None])}]" for c in COLORS])
    assert shown(scene) == pytest.approx(expected, abs=2e-3)


@pytest.mark.parametrize("inside", [True, False])
def test_one_value_is_that_of_all(tmp_path: Path, inside: bool) -> None:
    scene, told = read(
        stage(tmp_path, CAMERA, SUN, WET, instancer("float primvars:wetness = 0.25", inside=inside, wet=True))
    )
    assert told == []
    assert shown(scene) == pytest.approx(apart(tmp_path, ["float primvars:wetness = 0.25"] * 3, wet=True), abs=2e-3)


def test_materials_read_indexed_ones_of_some_prototypes(tmp_path: Path) -> None:
    """Of two prototypes one reads it; the other's instance is between those."""
    primvar = """float[] primvars:wetness = [0.2, 0.9] (interpolation = "varying")
    int[] primvars:wetness:indices = [1, 0, 0]
    int[] primvars:id = [7, 8, 9] (interpolation = "varying")"""
    text = instancer(primvar, "0, 1, 0", wet=True).replace("</pi/it>", "[</pi/it>, </pi/other>]")
    text = text.replace('def Xform "it"', f'def Xform "other" {{\n{ball("c", 0)}\n}}\ndef Xform "it"')
    scene, told = read(stage(tmp_path, CAMERA, SUN, WET, text))
    assert told == []
    values = [f"float primvars:wetness = {w}" for w in (0.9, 0.2, 0.2)]
    assert shown(scene)[[0, 2]] == pytest.approx(apart(tmp_path, values, wet=True)[[0, 2]], abs=2e-3)


def test_what_a_mesh_has_itself_counts_more(tmp_path: Path) -> None:
    """Solids have theirs as parameters of their material, which those of instances go over."""
    square = mesh(SQUARE + "float primvars:wetness = 0.7")
    text = instancer('float[] primvars:wetness = [0.2, 0.9, 0.5] (interpolation = "varying")', wet=True)
    scene, told = read(stage(tmp_path, CAMERA, SUN, WET, text.replace(ball("b", 0), square)))
    assert told == []
    assert shown(scene) == pytest.approx(apart(tmp_path, ["float primvars:wetness = 0.7"] * 3, wet=True), abs=2e-3)


def test_values_that_do_not_fit_are_told(tmp_path: Path) -> None:
    text = instancer('float[] primvars:wetness = [0.2, 0.9] (interpolation = "varying")', wet=True)
    scene, told = read(stage(tmp_path, CAMERA, SUN, WET, text))
    assert told == ["/pi: primvar wetness: materials take a float, or one for each instance. It has no effect"]
    assert shown(scene) == pytest.approx(apart(tmp_path, [""] * 3, wet=True), abs=2e-3)


def test_a_rib_of_it_is_the_same_picture(tmp_path: Path) -> None:
    primvar = f'color3f[] primvars:displayColor = [{listed(COLORS)}] (interpolation = "varying")'
    path = stage(tmp_path, CAMERA, SUN, instancer(primvar))
    kanuka.usd.convert(path, tmp_path / "a.rib")
    expected, _ = read(path)
    assert shown(kanuka.load(tmp_path / "a.rib")) == pytest.approx(shown(expected), abs=2e-3)
