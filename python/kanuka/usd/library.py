"""MaterialX's standard library: the graphs that stand for nodes which are no building blocks of their own.

Read when the first such node is met: it takes a third of a second.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache

_KINDS = {
    "vector2": "float2",
    "vector3": "vector",
    "vector4": "color4",
    "color3": "color",
    "color4": "color4",
    "matrix33": "matrix33",
    "matrix44": "matrix44",
    "string": "string",
    "filename": "string",
}


@dataclass(frozen=True)
class Input:
    """Where a value is: an input of the whole graph, an output of another node, what the geometry has, or here."""

    kind: str = ""
    interface: str = ""
    node: str = ""
    output: str = "out"
    geometry: str = ""
    value: object = None


@dataclass
class GraphNode:
    name: str
    identifier: str
    inputs: dict[str, Input] = field(default_factory=dict)


@dataclass
class Graph:
    nodes: dict[str, GraphNode]
    outputs: dict[str, tuple[str, str]]  # the node that gives it, and which of its outputs


@cache
def document():
    """Of all definitions and their graphs; None where MaterialX is not there."""
    try:
        import MaterialX as mx
    except ImportError:
        return None
    found = mx.createDocument()
    mx.loadLibraries(mx.getDefaultDataLibraryFolders(), mx.getDefaultDataSearchPath(), found)
    return found


def definition(identifier: str):
    found = document()
    return found.getNodeDef(identifier) if found is not None and identifier else None


@cache
def graph_of(identifier: str) -> Graph | None:
    """The graph that stands for a node; None = there is none."""
    node = definition(identifier)
    if node is None:
        return None
    import MaterialX as mx

    graph = node.getImplementation("genglsl")
    if graph is None or not graph.isA(mx.NodeGraph):
        return None
    nodes = {}
    for each in graph.getNodes():
        of = each.getNodeDef()
        made = GraphNode(each.getName(), of.getName() if of is not None else "")
        for port in each.getInputs():
            made.inputs[port.getName()] = Input(
                kind_of(port.getType()),
                port.getInterfaceName(),
                port.getNodeName(),
                port.getOutputString() or "out",
                value=_value(port),
            )
        nodes[made.name] = made
    outputs = {out.getName(): (out.getNodeName(), out.getOutputString() or "out") for out in graph.getOutputs()}
    return Graph(nodes, outputs)


def source_of(graph: Graph, output: str) -> tuple[GraphNode, str] | None:
    """The node inside that gives an output of the whole."""
    name, inside = graph.outputs.get(output) or next(iter(graph.outputs.values()), ("", ""))
    return (graph.nodes[name], inside) if name in graph.nodes else None


@cache
def default_of(identifier: str, name: str) -> Input:
    """What an input is where nobody sets it."""
    node = definition(identifier)
    port = node.getActiveInput(name) if node is not None else None
    if port is None:
        return Input()
    geometry = port.getDefaultGeomProp()
    return Input(
        kind_of(port.getType()), geometry=geometry.getName() if geometry is not None else "", value=_value(port)
    )


@cache
def kind_of_output(identifier: str, name: str) -> str:
    node = definition(identifier)
    port = node.getActiveOutput(name) if node is not None else None
    return kind_of(port.getType()) if port is not None else "float"


def kind_of(name: str) -> str:
    return _KINDS.get(name, "float")


def _value(port) -> object:
    """Numbers and texts as Python has them; None = it has none."""
    text = port.getValueString()
    if port.getType() in ("string", "filename"):
        return text
    if text in ("true", "false"):
        return text == "true"
    if not text:
        return None
    numbers = [float(x) for x in text.split(",")]
    return numbers[0] if len(numbers) == 1 else tuple(numbers)
