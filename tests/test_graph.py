"""Shader networks: what they become, and what is said of broken ones."""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path

import pytest

import kanuka
from kanuka.graph import NODE_TYPES, GraphError, ShaderGraph
from kanuka.graph.nodes import SURFACE, manual

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "bench"))
from shader_graphs import random_graph  # noqa: E402

BEGIN = "<!-- made from python/kanuka/graph/nodes.py"


def rusty() -> ShaderGraph:
    graph = ShaderGraph("rust")
    grain = graph.add("fractal", "grain", scale=6)
    tint = graph.add("ramp", "tint", value=grain, low=(0.2, 0.05, 0.02), high=(0.6, 0.25, 0.1))
    graph.surface = graph.add("matte", "skin", color=tint)
    graph.displacement = graph.add("displace", "bumps", height=grain, amount=0.02)
    return graph


def compile_text(graph: ShaderGraph) -> kanuka.CompiledShader:
    journal = kanuka.Journal()
    shader = graph.compile(use_cache=False, opt_level=0, journal=journal)
    assert not list(journal), [str(m) for m in journal]
    return shader


def alone(name: str, kind: str = "") -> ShaderGraph:
    """A graph of one node of a type, and what it takes to be seen."""
    graph = ShaderGraph("alone")
    node = graph.add(name, "it")
    node.as_type = kind
    for declared in node.type.inputs:
        if declared.type == "material":
            graph.connect(graph.add("matte"), node, declared.name)
    output = kind if node.type.output == "T" else node.type.output
    if output in ("material", "displacement"):
        setattr(graph, "surface" if output == "material" else output, node)
    else:
        color = node if output in ("float", "color") else graph.add("vector_to_color", value=node)
        graph.surface = graph.add("matte", "seen", color=color)
    return graph


@pytest.mark.parametrize("name", NODE_TYPES)
def test_every_node_type_compiles(name: str) -> None:
    generic = any(i.type == "T" for i in NODE_TYPES[name].inputs)
    for kind in ("float", "color", "vector") if generic else ("",):
        shader = compile_text(alone(name, kind))
        names = {p["name"] for p in shader.parameters}
        expected = {f"it_{i.name}" for i in NODE_TYPES[name].inputs
                    if i.type != "material" and i.default not in SURFACE}  # fmt: skip
        assert expected - names <= {"it_bump", "it_bumpAmount"}


def test_table_is_sound() -> None:
    for node in NODE_TYPES.values():
        names = [i.name for i in node.inputs]
        assert len(set(names)) == len(names), node
        assert all(name.isalnum() for name in names), "an input with a _ could clash with another node's parameter"
        assert node.doc and all(i.doc for i in node.inputs)
        if node.lobe:
            assert len(node.lobe[1]) == len(names) - 1


def test_unconnected_inputs_are_parameters() -> None:
    shader = compile_text(rusty())
    parameters = {p["name"]: p for p in shader.parameters}
    assert shader.kind == "class" and shader.name == "rust"
    assert parameters["grain_scale"]["default"] == 6
    assert parameters["tint_low"]["type"] == "color"
    assert parameters["tint_low"]["default"] == pytest.approx([0.2, 0.05, 0.02])
    assert parameters["grain_octaves"]["doc"] == "levels of detail, at most 16"
    assert "tint_value" not in parameters and "grain_position" not in parameters
    assert "bumps_bump" not in parameters


def test_primvars_may_set_constants() -> None:
    graph = ShaderGraph("painted")
    graph.surface = graph.add("matte", "skin", color=graph.add("color", "paint", value=(1, 0, 0)))
    (paint, weight) = compile_text(graph).parameters
    assert (paint["name"], paint["varying"]) == ("paint_value", True)
    assert (weight["name"], weight["varying"]) == ("skin_weight", False)


def test_expose() -> None:
    graph = rusty()
    graph.expose = {"grain.scale"}
    assert [p["name"] for p in compile_text(graph).parameters] == ["grain_scale"]
    graph.expose = False
    assert compile_text(graph).parameters == []
    assert "graphFractal(surface_P, 6, 4, 0.5, 2.03)" in graph.to_rsl()


def test_text_reads_well() -> None:
    text = rusty().to_rsl()
    assert "        // grain: fractal\n        float grain_out = graphFractal(surface_P, grain_scale" in text
    assert text.count("float graphFractal(") == 1, "one function a type"
    assert text.count("graphFractal(surface_P") == 2, "called in both stages"
    assert max(map(len, text.splitlines())) < 200


def test_dead_nodes_are_left_out() -> None:
    graph = rusty()
    graph.add("voronoi", "unused")
    text = graph.to_rsl()
    assert "graphVoronoi" not in text and "4 nodes, 1 more that nothing depends on" in text


def test_json_keeps_everything(tmp_path: Path) -> None:
    graph = rusty()
    graph.nodes["grain"].comment = "coarse\nfirst"
    graph.expose = {"grain.scale", "tint.low"}
    graph.save(tmp_path / "a.json")
    again = ShaderGraph.load(tmp_path / "a.json")
    assert again.to_rsl() == graph.to_rsl()
    assert again.to_json() == graph.to_json()


def test_names_that_are_no_identifiers() -> None:
    graph = ShaderGraph("1 odd/name")
    a = graph.add("noise", "/mat/a b")
    b = graph.add("noise", "_mat_a_b")
    c = graph.add("noise", "7")
    evil = graph.add("value", "x */ \n } \\", value=1)
    total = graph.add("add", "class", a=graph.add("add", "float", a=a, b=b), b=graph.add("add", "P", a=c, b=evil))
    graph.surface = graph.add("matte", "material", color=total)
    shader = compile_text(graph)
    assert len({p["name"] for p in shader.parameters}) == len(shader.parameters)


def test_strings_are_quoted() -> None:
    graph = ShaderGraph("quoted")
    graph.surface = graph.add("matte", color=graph.add("texture", "picture", file='a"b\\c'))
    (default,) = [p["default"] for p in compile_text(graph).parameters if p["name"] == "picture_file"]
    assert default == 'a"b\\c'


# ---- what is wrong


def problems(graph: ShaderGraph) -> str:
    with pytest.raises(GraphError) as caught:
        graph.to_rsl()
    return str(caught.value)


def test_cycles_are_shown() -> None:
    graph = ShaderGraph()
    a, b, c = graph.add("add", "alpha"), graph.add("add", "beta"), graph.add("add", "gamma")
    for source, target in ((a, b), (b, c), (c, a)):
        graph.connect(source, target, "a")
    graph.surface = graph.add("matte", color=c)
    text = problems(graph)
    assert "depend on each other" in text and all(n in text for n in ("alpha", "beta", "gamma"))


def test_long_chains_and_long_cycles() -> None:
    graph = ShaderGraph()
    first = last = graph.add("add", "first")
    for _ in range(20000):
        last = graph.add("add", a=last)
    graph.surface = graph.add("matte", color=last)
    assert graph.to_rsl().count("graphAddFloat(") == 20002
    graph.connect(last, first, "a")
    assert len(problems(graph)) < 300


def test_types_that_do_not_fit() -> None:
    graph = ShaderGraph()
    tint = graph.add("noise_color", "tint")
    graph.connect(tint, graph.add("fractal", "grain"), "scale")
    graph.connect(tint, graph.add("warp", "moved"), "position")
    skin = graph.add("matte", "skin", color=graph.nodes["grain"], weight=graph.nodes["moved"])
    graph.surface = graph.add("layer_mix", "both", upper=skin, lower=graph.nodes["grain"])
    lines = problems(graph).splitlines()
    assert len(lines) == 4
    assert 'node "grain" (fractal), input "scale" takes a float, node "tint" (noise_color) gives a color' in lines[0]
    assert "luminance" in lines[0] and "color_to_vector" in lines[1] and "component" in lines[2]
    assert 'input "lower" takes a material' in lines[3]


def test_materials_are_trees() -> None:
    graph = ShaderGraph()
    skin = graph.add("matte", "skin")
    graph.surface = graph.add("layer_mix", "both", upper=skin, lower=skin)
    assert '"skin" is in "both" already' in problems(graph)
    graph = ShaderGraph()
    graph.surface = graph.add("layer_mix", "both", upper=graph.add("matte"))
    assert 'node "both" (layer_mix), input "lower": expected a connection: a material' in problems(graph)


def test_graphs_without_outputs() -> None:
    assert "has no output" in problems(ShaderGraph())
    graph = ShaderGraph()
    graph.presence = graph.add("noise", "holes")
    assert "presence, but no surface" in problems(graph)


def test_building_says_what_there_is() -> None:
    graph = ShaderGraph()
    with pytest.raises(GraphError, match="there is no node type"):
        graph.add("nois")
    with pytest.raises(GraphError, match='no input "size"; it has position, scale'):
        graph.add("noise", "grain", size=2)
    graph.add("noise", "grain")
    with pytest.raises(GraphError, match="there already"):
        graph.add("noise", "grain")
    for value in ("x", (1, 2), float("nan"), True, None, (1, 2, 3)):
        with pytest.raises(GraphError, match=r'node "grain", input "scale": expected'):
            graph.set(graph.nodes["grain"], "scale", value)


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"nodes": []}, 'expected an object with "nodes"'),
        ({"format": "other"}, "expected"),
        ({"version": 2}, "expected"),
        ({"extra": 1}, 'has no "extra"'),
        ({"outputs": {"surface": "nobody"}}, 'there is no node "nobody"'),
        ({"outputs": {"shading": "skin"}}, 'has no "shading"'),
        ({"outputs": 3}, "expected an object"),
        ({"expose": ["grain.nothing"]}, 'there is no input "grain.nothing"'),
        ({"expose": 1}, '"expose" is'),
        ({"nodes": {"a": 1}}, 'expected an object with a "type"'),
        ({"nodes": {"a": {"type": "nothing"}}}, "there is no node type"),
        ({"nodes": {"a": {"type": "add", "connections": {"a": ["b"]}}}}, "there is no node"),
        ({"nodes": {"a": {"type": "add", "connections": []}}}, "object of inputs"),
        ({"nodes": {"a": {"type": "add", "parameters": {"a": {}}}}}, "expected numbers"),
        ({"nodes": {"a": {"type": "add", "parameters": {"a": 1e999}}}}, "finite"),
        ({"nodes": {"a": {"type": "add", "input": {}}}}, 'has no "input"'),
    ],
)
def test_broken_json(tmp_path: Path, change: dict, expected: str) -> None:
    path = tmp_path / "graph.json"
    path.write_text(json.dumps({**rusty().to_json(), **change}))
    with pytest.raises(GraphError) as caught:
        ShaderGraph.load(path)
    assert expected in str(caught.value) and str(path) in str(caught.value)
    assert caught.value.exit_code == 4


@pytest.mark.parametrize("text", ["", "{", "[" * 100_000, '{"nodes": 1}', "null", "\xff"])
def test_what_is_no_json(tmp_path: Path, text: str) -> None:
    path = tmp_path / "graph.json"
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises(GraphError):
        ShaderGraph.load(path)
    with pytest.raises(GraphError, match="cannot read"):
        ShaderGraph.load(tmp_path / "nothing.json")


# ---- size


def test_random_graphs_are_the_same_everywhere() -> None:
    for count in (10, 37, 300):
        graph = random_graph(count)
        assert len(graph.nodes) == count
        assert "more that nothing depends on" not in graph.to_rsl()
        assert graph.to_rsl() == random_graph(count).to_rsl()
    assert random_graph(37, seed=2).to_rsl() != random_graph(37).to_rsl()
    compile_text(random_graph(60))


def test_ten_thousand_nodes_are_quick_to_write() -> None:
    started = time.monotonic()
    text = random_graph(10_000).to_rsl()
    assert time.monotonic() - started < 10
    assert text.count("_out = ") > 9900


def test_docs_are_up_to_date() -> None:
    page = ROOT / "docs" / "graph.md"
    head, _, rest = page.read_text().partition(BEGIN)
    marker = rest.split("\n", 1)[0]
    expected = f"{head}{BEGIN}{marker}\n\n{manual()}"
    if os.environ.get("KANUKA_WRITE_DOCS"):
        page.write_text(expected)
    assert page.read_text() == expected, "run it with KANUKA_WRITE_DOCS=1"
