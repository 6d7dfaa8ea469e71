"""Networks that are wrong: each fault is told once, with its place, and the rest is rendered."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("MaterialX")
from pxr import Gf, Sdf, Usd, UsdShade

from kanuka.looks.files import Files
from kanuka.usd import library
from kanuka.usd.materials import Materials
from test_materialx_more import STANDARD, first, surface
from usd_graphs import TYPES, Graph
from usd_stages import CAMERA, FLOOR, MATTE, SUN, picture, read, stage

NUMBER, COLOR, TEXT, FILE = (
    Sdf.ValueTypeNames.Float,
    Sdf.ValueTypeNames.Color3f,
    Sdf.ValueTypeNames.String,
    Sdf.ValueTypeNames.Asset,
)


def with_input(graph: Graph, node: UsdShade.Shader, name: str, kind: Sdf.ValueTypeName, value: object) -> None:
    """An input of any type, whatever the node has it for."""
    node.GetPrim().CreateAttribute(f"inputs:{name}", kind).Set(value)


@pytest.mark.parametrize(
    ("name", "kind", "value"),
    [
        ("base_color", TEXT, "red"),
        ("base_color", FILE, Sdf.AssetPath("red.png")),
        ("base_color", COLOR, Gf.Vec3f(0.5, float("nan"), 0.5)),
        ("base_color", COLOR, Gf.Vec3f(0.5, float("inf"), 0.5)),
        ("base_color", Sdf.ValueTypeNames.FloatArray, [0.1] * 20),
        ("base_color", Sdf.ValueTypeNames.Color3fArray, []),
        ("base_color", Sdf.ValueTypeNames.Matrix4d, Gf.Matrix4d(2)),
        ("base_color", Sdf.ValueTypeNames.Quatf, Gf.Quatf(1)),
        ("specular_roughness", TEXT, "rough"),
        ("specular_roughness", NUMBER, float("nan")),
        ("coat", NUMBER, float("-inf")),
        ("metalness", TEXT, "yes"),
        ("thin_walled", TEXT, "true"),
        ("emission", TEXT, "bright"),
        ("opacity", COLOR, Gf.Vec3f(float("nan"))),
    ],
)
def test_a_value_of_the_wrong_sort_is_told_and_the_default_stands(name: str, kind, value):
    graph = surface(STANDARD)
    expected = first(graph)
    with_input(graph, graph.surface, name, kind, value)
    found = first(graph)
    assert found.keys() == expected.keys()
    assert all(found[key] == pytest.approx(expected[key]) for key in found)
    assert len(graph.told) == 1
    assert graph.told[0].startswith(f"/m/other.inputs:{name}: ") and graph.told[0].endswith("its default stands")


@pytest.mark.parametrize(
    ("name", "kind", "value", "slot", "expected"),
    [
        ("base_color", NUMBER, 0.5, "body.diffuseReflectance", [0.5] * 3),
        (
            "base_color",
            Sdf.ValueTypeNames.Color4f,
            Gf.Vec4f(0.1, 0.2, 0.3, 1),
            "body.diffuseReflectance",
            [0.1, 0.2, 0.3],
        ),
        ("base_color", Sdf.ValueTypeNames.Int, 1, "body.diffuseReflectance", [1] * 3),
        ("specular_roughness", COLOR, Gf.Vec3f(0.5, 0.6, 0.7), "gloss.roughness", 0.5),
        ("specular_roughness", Sdf.ValueTypeNames.Double, 0.25, "gloss.roughness", 0.25),
    ],
)
def test_numbers_of_another_count_are_converted(name, kind, value, slot, expected):
    graph = surface(STANDARD)
    with_input(graph, graph.surface, name, kind, value)
    assert first(graph)[slot] == pytest.approx(expected, abs=1e-3)
    assert graph.told == []


def test_an_input_without_a_value_has_its_default():
    graph = surface(STANDARD)
    expected = first(graph)["body.diffuseReflectance"]
    graph.surface.CreateInput("base_color", COLOR)
    assert first(graph)["body.diffuseReflectance"] == pytest.approx(expected)
    assert graph.told == []


def test_a_text_that_is_connected_to_a_colour_is_told():
    graph = surface(STANDARD)
    text = graph.node("text", "ND_constant_string", value="red")
    graph.surface.CreateInput("base_color", COLOR).ConnectToSource(text.GetOutput("out"))
    assert first(graph)["body.diffuseReflectance"] == pytest.approx([0.8] * 3, abs=1e-3)
    assert len(graph.told) == 1 and "/m/other.inputs:base_color" in graph.told[0] and "/m/text" in graph.told[0]


def test_a_connection_to_nothing_is_told():
    graph = surface(STANDARD)
    port = graph.surface.CreateInput("base_color", COLOR)
    port.GetAttr().AddConnection("/m/gone.outputs:out")
    assert first(graph)["body.diffuseReflectance"] == pytest.approx([0.8] * 3, abs=1e-3)
    assert graph.told == ["/m/other.inputs:base_color: it is connected to /m/gone.outputs:out, which is not there"]


@pytest.mark.parametrize("identifier", ["ND_add_color3", "ND_contrast_color3", "ND_ramp4_color3"])
def test_a_node_that_feeds_itself_is_cut(identifier: str):
    """A building block, and graphs that are expanded."""
    graph = surface(STANDARD)
    node = graph.node("n", identifier)
    name = library.definition(identifier).getActiveInputs()[0].getName()
    node.CreateInput(name, COLOR).ConnectToSource(node.GetOutput("out"))
    graph.surface.CreateInput("base_color", COLOR).ConnectToSource(node.GetOutput("out"))
    assert np.isfinite(first(graph)["body.diffuseReflectance"]).all()
    assert graph.told == ["/m: its network runs in a circle; it is cut at /m/n"]


def test_inputs_that_are_connected_in_a_circle_have_no_value():
    graph = surface(STANDARD)
    a, b = (graph.material.CreateInput(name, COLOR) for name in "ab")
    a.ConnectToSource(b)
    b.ConnectToSource(a)
    graph.surface.CreateInput("base_color", COLOR).ConnectToSource(a)
    assert first(graph)["body.diffuseReflectance"] == pytest.approx([0.8] * 3, abs=1e-3)


def test_a_network_without_end_is_grey_and_told():
    graph = surface(STANDARD)
    last = graph.node("n0", "ND_constant_color3")
    for i in range(1, 1500):
        node = graph.node(f"n{i}", "ND_add_color3", in1=(last, "out"))
        last = node
    graph.surface.CreateInput("base_color", COLOR).ConnectToSource(last.GetOutput("out"))
    graph.told.clear()

    assert (
        Materials(lambda _, text: graph.told.append(text), Files(), Usd.TimeCode.Default()).of(graph.material) is None
    )
    assert graph.told == ["/m: its network is too deep to be read. Grey stands in for it"]


@pytest.mark.parametrize(
    ("kind", "value", "message"),
    [(TEXT, "a.png", "a.png is no file"), (FILE, Sdf.AssetPath("gone.png"), "is not found")],
)
def test_a_picture_that_is_none_is_told_and_its_default_stands(kind, value, message: str):
    graph = surface(STANDARD)
    image = graph.node("i", "ND_image_color3", default=Gf.Vec3f(0.25, 0.5, 0.75))
    with_input(graph, image, "file", kind, value)
    graph.surface.CreateInput("base_color", COLOR).ConnectToSource(image.GetOutput("out"))
    assert first(graph)["body.diffuseReflectance"] == pytest.approx([0.25, 0.5, 0.75], abs=1e-3)
    assert len(graph.told) == 1 and message in graph.told[0] and "/m/i" in graph.told[0]


@pytest.fixture
def without_the_library(monkeypatch: pytest.MonkeyPatch):
    cached = (library.document, library.graph_of, library.default_of, library.kind_of_output)
    for each in cached:
        each.cache_clear()
    monkeypatch.setitem(sys.modules, "MaterialX", None)
    yield
    for each in cached:
        each.cache_clear()


def test_without_the_library_building_blocks_are_known_and_others_told(request: pytest.FixtureRequest):
    graph = surface(STANDARD, specular_roughness=0.5)
    block = graph.node("block", "ND_multiply_color3", in1=Gf.Vec3f(0.5), in2=Gf.Vec3f(0.5, 1, 1))
    expanded = graph.node("expanded", "ND_contrast_float", in_=0.5)
    graph.surface.CreateInput("base_color", COLOR).ConnectToSource(block.GetOutput("out"))
    graph.surface.CreateInput("specular_roughness", NUMBER).ConnectToSource(expanded.GetOutput("out"))
    request.getfixturevalue("without_the_library")
    found = first(graph)
    assert found["body.diffuseReflectance"] == pytest.approx([0.25, 0.5, 0.5], abs=1e-3)
    assert found["gloss.roughness"] == pytest.approx(0.2, abs=1e-3)
    assert len(graph.told) == 1
    assert graph.told[0].startswith('/m: there is no node "ND_contrast_float" (/m/expanded)')
    assert "MaterialX" in graph.told[0].partition("stands")[2]


def test_an_unknown_node_is_told_once_however_often_it_is_read():
    graph = surface(STANDARD)
    odd = UsdShade.Shader.Define(graph.stage, "/m/odd")
    odd.CreateIdAttr("ND_teapot_color3")
    odd.CreateOutput("out", TYPES["color3"])
    for name in ("base_color", "specular_color", "coat_color", "subsurface_color", "normal"):
        graph.surface.CreateInput(name, COLOR).ConnectToSource(odd.GetOutput("out"))
    first(graph)
    assert graph.told == ['/m: there is no node "ND_teapot_color3" (/m/odd); its default stands']


def test_what_is_beside_a_broken_material_is_rendered(tmp_path: Path):
    """A floor that reflects half of the light lies under a small one whose network has every fault at once."""
    broken = """
def Material "broken" {
    token outputs:mtlx:surface.connect = </broken/s.outputs:out>
    def Shader "s" {
        uniform token info:id = "ND_standard_surface_surfaceshader"
        color3f inputs:base_color.connect = </broken/a.outputs:out>
        float inputs:specular = nan
        string inputs:coat = "yes"
        float inputs:opacity.connect = </broken/gone.outputs:out>
        token outputs:out
    }
    def Shader "a" {
        uniform token info:id = "ND_add_color3"
        color3f inputs:in1.connect = </broken/a.outputs:out>
        color3f inputs:in2.connect = </broken/t.outputs:out>
        color3f outputs:out
    }
    def Shader "t" {
        uniform token info:id = "ND_teapot_color3"
        color3f outputs:out
    }
}
"""
    small = FLOOR.replace('"floor"', '"small"').replace("</matte>", "</broken>").replace("EXTRA", "")
    small = small.replace("(-1, 0, 1), (1, 0, 1)", "(-1, 0.01, 1), (0, 0.01, 1)")
    small = small.replace("(1, 0, -1), (-1, 0, -1)", "(0, 0.01, -1), (-1, 0.01, -1)")
    scene, told = read(stage(tmp_path, CAMERA, MATTE, broken, FLOOR.replace("EXTRA", ""), small, SUN))
    rgb = picture(scene, 8, 16)
    assert rgb[:, 5:7].mean((0, 1)) == pytest.approx([1 / np.pi] * 3, rel=0.02)
    assert np.isfinite(rgb).all()
    assert len(told) == 5 and all("/broken" in text for text in told)
