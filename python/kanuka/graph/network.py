"""Shader networks: nodes, their parameters and connections. rsl.py makes a shader of them."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from kanuka._native import Error

from .nodes import NODE_TYPES, Input, NodeType, Value

FORMAT = "kanuka shader graph"
VERSION = 1
OUTPUTS = {"surface": "material", "displacement": "displacement", "presence": "float"}
TRIPLES = ("color", "point", "vector", "normal")
EXIT_INPUT = 4


class GraphError(Error):
    """What is wrong with a network: all of it, one a line; `problems` is the list."""

    def __init__(self, problems: Iterable[str], file: str = "") -> None:
        self.problems = list(problems)
        self.file, self.line, self.column, self.exit_code = file, 0, 0, EXIT_INPUT
        super().__init__("\n".join(f"{file}: {p}" if file else p for p in self.problems))


class Node:
    """A node of a ShaderGraph. Its parameters and connections may be changed."""

    def __init__(self, name: str, node_type: NodeType) -> None:
        self.name = name
        self.type = node_type
        self.parameters: dict[str, Value] = {}
        self.connections: dict[str, Node] = {}
        self.as_type = ""  # float, color or vector: settles T
        self.comment = ""

    def __repr__(self) -> str:
        return f"<{self.type.name} {self.name}>"


def checked_value(value: object, declared: Input) -> Value:
    """A parameter's value as its type has it; raises ValueError with what was expected."""
    if declared.type == "string":
        if not isinstance(value, str) or "\n" in value:
            raise ValueError(f"expected a text of one line, found {value!r}")
        return value
    numbers = [value] if isinstance(value, (int, float)) else value
    if not isinstance(numbers, Sequence) or isinstance(numbers, str):
        raise ValueError(f"expected numbers, found {value!r}")
    if any(isinstance(n, bool) or not isinstance(n, (int, float)) or not math.isfinite(n) for n in numbers):
        raise ValueError(f"expected finite numbers, found {value!r}")
    if len(numbers) == 1 and (declared.type in ("float", "T") or declared.type in TRIPLES):
        return float(numbers[0]) if declared.type in ("float", "T") else (float(numbers[0]),) * 3
    if len(numbers) == 3 and declared.type in (*TRIPLES, "T"):
        return tuple(map(float, numbers))
    count = {"float": "one number", "T": "one or three numbers"}.get(declared.type, "one or three numbers")
    raise ValueError(f"expected {count}, found {len(numbers)}")


class ShaderGraph:
    """A shader network.

    graph = kanuka.ShaderGraph("rust")
    grain = graph.add("fractal", "grain", scale=6)
    tint = graph.add("ramp", "tint", value=grain, low=(0.2, 0.05, 0.02), high=(0.6, 0.25, 0.1))
    graph.surface = graph.add("matte", "skin", color=tint)
    print(graph.to_rsl())
    """

    def __init__(self, name: str = "graph") -> None:
        self.name = name
        self.file = ""  # where it was read from, for messages
        self.comment = ""
        self.nodes: dict[str, Node] = {}
        self.outputs: dict[str, Node] = {}
        # Which unconnected inputs become parameters of the shader: all, none, or those named "node.input".
        self.expose: bool | set[str] = True

    # ---- building

    def add(self, node_type: str, name: str | None = None, /, **inputs: object) -> Node:
        """Adds a node. Keywords are inputs: values, or nodes to connect."""
        if node_type not in NODE_TYPES:
            raise GraphError([f'there is no node type "{node_type}"; there are {", ".join(NODE_TYPES)}'], self.file)
        if name is None:
            number = len(self.nodes) + 1
            while (name := f"{node_type}{number}") in self.nodes:
                number += 1
        if not name or name in self.nodes:
            raise GraphError(
                [f'node "{name}": a node of this name is there already' if name else "a node needs a name"]
            )
        node = self.nodes[name] = Node(name, NODE_TYPES[node_type])
        try:
            for key, value in inputs.items():
                if isinstance(value, Node):
                    self.connect(value, node, key)
                else:
                    self.set(node, key, value)
        except GraphError:
            del self.nodes[name]
            raise
        return node

    def set(self, node: Node, name: str, value: object) -> None:
        """Gives an input that is not connected a value: the default of the shader's parameter."""
        declared = self._input(node, name)
        try:
            if declared.type in ("material", "displacement"):
                raise ValueError(f"expected a connection: it takes a {declared.type}")
            node.parameters[name] = checked_value(value, declared)
        except ValueError as error:
            raise GraphError([f'node "{node.name}", input "{name}": {error}'], self.file) from None

    def connect(self, source: Node, target: Node, name: str) -> None:
        """Connects a node's output to another one's input. Types are checked when the shader is made."""
        self._input(target, name)
        if self.nodes.get(source.name) is not source or self.nodes.get(target.name) is not target:
            raise GraphError([f'"{source.name}" and "{target.name}" are not nodes of this graph'], self.file)
        target.connections[name] = source

    def _input(self, node: Node, name: str) -> Input:
        declared = node.type.input(name)
        if declared is None:
            have = ", ".join(i.name for i in node.type.inputs)
            raise GraphError(
                [f'node "{node.name}": a {node.type.name} has no input "{name}"; it has {have}'], self.file
            )
        return declared

    def _output(name: str):
        def get(self: ShaderGraph) -> Node | None:
            return self.outputs.get(name)

        def put(self: ShaderGraph, node: Node | None) -> None:
            if node is None:
                self.outputs.pop(name, None)
            else:
                self.outputs[name] = node

        return property(get, put, doc=f"The node whose {OUTPUTS[name]} is the shader's {name}.")

    surface = _output("surface")
    displacement = _output("displacement")
    presence = _output("presence")
    del _output

    # ---- the shader

    def to_rsl(self) -> str:
        """The network as one class shader. Raises GraphError for cycles and types that do not fit."""
        from .rsl import shader_text

        return shader_text(self)

    def compile(self, **keywords):
        """Compiles the shader as kanuka.compile_shader does, whose keywords it takes."""
        from kanuka import compile_shader

        return compile_shader(self.file or f"{self.name}.json", source=self.to_rsl(), **keywords)

    def save_shader(self, path: str | os.PathLike) -> None:
        """Writes the shader's source, NAME.sl."""
        Path(path).write_text(self.to_rsl())

    # ---- JSON

    def to_json(self) -> dict:
        """The graph as JSON has it; docs/graph.md says how."""
        nodes = {}
        for node in self.nodes.values():
            entry: dict[str, object] = {"type": node.type.name}
            if node.comment:
                entry["comment"] = node.comment
            if node.as_type:
                entry["as"] = node.as_type
            if node.parameters:
                entry["parameters"] = {k: list(v) if isinstance(v, tuple) else v for k, v in node.parameters.items()}
            if node.connections:
                entry["connections"] = {k: source.name for k, source in node.connections.items()}
            nodes[node.name] = entry
        graph: dict[str, object] = {"format": FORMAT, "version": VERSION, "name": self.name}
        if self.comment:
            graph["comment"] = self.comment
        if self.expose is not True:
            graph["expose"] = sorted(self.expose) if isinstance(self.expose, set) else self.expose
        return {**graph, "nodes": nodes, "outputs": {k: node.name for k, node in self.outputs.items()}}

    def save(self, path: str | os.PathLike) -> None:
        """Writes the graph as JSON."""
        Path(path).write_text(json.dumps(self.to_json(), indent=1) + "\n")

    @classmethod
    def load(cls, path: str | os.PathLike) -> ShaderGraph:
        """Reads a graph from a JSON file."""
        try:
            text = Path(path).read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise GraphError(
                [f"cannot read the graph: {getattr(error, 'strerror', None) or error}"], str(path)
            ) from None
        try:
            data = json.loads(text)
        except (json.JSONDecodeError, RecursionError) as error:
            place = (
                f"line {error.lineno}, column {error.colno}: {error.msg}" if hasattr(error, "lineno") else str(error)
            )
            raise GraphError([f"this is not JSON: {place}"], str(path)) from None
        return cls.from_json(data, Path(path).stem, str(path))

    @classmethod
    def from_json(cls, data: object, name: str = "graph", file: str = "") -> ShaderGraph:
        """Makes a graph of what JSON has; raises GraphError with everything that is wrong with it."""
        return _Reader(cls, name, file).read(data)


class _Reader:
    """Reads the JSON form, going on after a problem so that all of them are told."""

    def __init__(self, cls: type[ShaderGraph], name: str, file: str) -> None:
        self.graph = cls(name)
        self.graph.file = file
        self.problems: list[str] = []

    def read(self, data: object) -> ShaderGraph:
        if not isinstance(data, Mapping) or not isinstance(data.get("nodes"), Mapping):
            raise GraphError(['expected an object with "nodes", an object of nodes by name'], self.graph.file)
        if data.get("format", FORMAT) != FORMAT or data.get("version", VERSION) != VERSION:
            raise GraphError([f'expected "format": "{FORMAT}", "version": {VERSION}; found '
                              f"{data.get('format')!r}, {data.get('version')!r}"], self.graph.file)  # fmt: skip
        self.keys("the graph", data, ("format", "version", "name", "comment", "expose", "nodes", "outputs", "ui"))
        graph = self.graph
        graph.name = str(data.get("name", graph.name))
        graph.comment = str(data.get("comment", ""))
        entries = {name: entry for name, entry in data["nodes"].items() if self.add(name, entry)}
        for name, entry in entries.items():
            self.fill(graph.nodes[name], entry)
        outputs = data.get("outputs", {})
        self.keys('"outputs"', outputs, OUTPUTS)
        for output, name in outputs.items() if isinstance(outputs, Mapping) else ():
            node = graph.nodes.get(name) if isinstance(name, str) else None
            if node is None:
                self.problems.append(f'output "{output}": there is no node "{name}"')
            elif output in OUTPUTS:
                graph.outputs[output] = node
        self.expose(data.get("expose", True))
        if self.problems:
            raise GraphError(self.problems, graph.file)
        return graph

    def keys(self, what: str, data: object, known: Iterable[str]) -> None:
        if not isinstance(data, Mapping):
            self.problems.append(f"{what}: expected an object, found {type(data).__name__}")
            return
        for key in data:
            if key not in known:
                self.problems.append(f'{what} has no "{key}"; it may have {", ".join(known)}')

    def add(self, name: str, entry: object) -> bool:
        if not isinstance(entry, Mapping) or not isinstance(entry.get("type"), str):
            self.problems.append(f'node "{name}": expected an object with a "type"')
            return False
        self.keys(f'node "{name}"', entry, ("type", "as", "comment", "parameters", "connections", "ui"))
        try:
            node = self.graph.add(entry["type"], name)
        except GraphError as error:
            self.problems += [f'node "{name}": {p}' for p in error.problems]
            return False
        node.comment = str(entry.get("comment", ""))
        node.as_type = str(entry.get("as", ""))
        return True

    def fill(self, node: Node, entry: Mapping) -> None:
        for key, put in (("parameters", self.parameter), ("connections", self.connection)):
            table = entry.get(key, {})
            if not isinstance(table, Mapping):
                self.problems.append(f'node "{node.name}": "{key}" is an object of inputs by name')
                continue
            for name, value in table.items():
                try:
                    put(node, name, value)
                except GraphError as error:
                    self.problems += error.problems

    def parameter(self, node: Node, name: str, value: object) -> None:
        self.graph.set(node, name, value)

    def connection(self, node: Node, name: str, value: object) -> None:
        source = self.graph.nodes.get(value) if isinstance(value, str) else None
        if source is None:
            raise GraphError([f'node "{node.name}", input "{name}": there is no node "{value}"'])
        self.graph.connect(source, node, name)

    def expose(self, value: object) -> None:
        if isinstance(value, bool):
            self.graph.expose = value
            return
        if not isinstance(value, list) or not all(isinstance(v, str) for v in value):
            self.problems.append('"expose" is true, false or a list of "node.input"')
            return
        for entry in value:
            name, _, key = entry.rpartition(".")
            node = self.graph.nodes.get(name)
            if node is None or node.type.input(key) is None:
                self.problems.append(f'"expose": there is no input "{entry}"; write "node.input"')
        self.graph.expose = set(value)
