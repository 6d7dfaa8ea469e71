"""A shader network as one RSL class: a function for each type of node, a commented block for each node.

    class NAME(parameters)                                     unconnected inputs, NODE_INPUT
      mnk_init           AddLobe, AddLayer                     the tree of materials
      mnk_displacement   what the displacement depends on
      mnk_prelighting    what lobes, weights and presence depend on

Nodes that nothing depends on are left out. A node that both stages need is computed in both, before and after the
surface moves. Names cannot clash: node types' functions and the shader's own names have no "_", inputs have none
either, and everything made from a node's name has one.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from .network import OUTPUTS, TRIPLES, GraphError, Node, ShaderGraph
from .nodes import SURFACE, Input, NodeType, Value

GENERIC = ("float", "color", "vector")
KINDS = ("material", "displacement")


def converts(source: str, target: str) -> bool:
    """Whether a value of one type may go where another is wanted."""
    if source == target:
        return True
    if target in TRIPLES and source == "float":
        return True
    return "color" not in (source, target) and source in TRIPLES and target in TRIPLES


def literal(value: Value, kind: str) -> str:
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    numbers = value if isinstance(value, tuple) else (value,)
    texts = [f"{n:.9g}" for n in numbers]
    if kind == "float":
        return texts[0]
    return f"{kind}({', '.join(texts if len(set(texts)) > 1 else texts[:1])})"


def function_name(node_type: NodeType, kind: str) -> str:
    words = node_type.name.split("_") + (
        [kind] if "T" in (node_type.output, *(i.type for i in node_type.inputs)) else []
    )
    return "graph" + "".join(word.capitalize() for word in words)


def argument_name(declared: Input) -> str:
    return "tint" if declared.name == "color" else declared.name


def walk(roots: list[Node], problems: list[str]) -> list[Node]:
    """What the roots depend on, each node after its sources. Loops are told once, as the way around."""
    order: list[Node] = []
    state: dict[str, int] = {}  # 1 = on the way here, 2 = done
    for root in roots:
        if root.name in state:
            continue
        state[root.name] = 1
        path: list[tuple[Node, Iterator[Node]]] = [(root, iter(root.connections.values()))]
        while path:
            node, sources = path[-1]
            source = next(sources, None)
            if source is None:
                state[node.name] = 2
                order.append(node)
                path.pop()
            elif state.get(source.name) == 1:
                names = [n.name for n, _ in path]
                around = [*names[names.index(source.name) :], source.name]
                shown = around if len(around) < 9 else [*around[:4], "…", *around[-4:]]
                problems.append("these nodes depend on each other: " + " ← ".join(shown))
            elif source.name not in state:
                state[source.name] = 1
                path.append((source, iter(source.connections.values())))
    return order


class _Writer:
    def __init__(self, graph: ShaderGraph) -> None:
        self.graph = graph
        self.problems: list[str] = []
        self.kinds: dict[str, str] = {}  # node -> what T is
        self.types: dict[str, str] = {}  # node -> type of its output
        self.names: dict[str, str] = {}  # node -> identifier
        self.parents: dict[str, str] = {}  # material -> the layer that holds it

    # ---- checking

    def text(self) -> str:
        roots = self.roots()
        order = walk(roots, self.problems)
        if not self.problems:
            for node in order:
                self.resolve(node)
            self.check_outputs()
        if self.problems:
            raise GraphError(self.problems, self.graph.file)
        self.name_nodes(order)
        displacement = self.graph.displacement
        moved = walk([displacement], []) if displacement else []
        shaded = walk([n for k, n in self.graph.outputs.items() if k != "displacement"], [])
        return self.write(order, moved, shaded)

    def roots(self) -> list[Node]:
        if not self.graph.outputs:
            self.problems.append("the graph has no output; set surface, displacement or presence to a node")
        elif self.graph.presence and not self.graph.surface:
            self.problems.append("the graph has presence, but no surface")
        return [self.graph.outputs[k] for k in OUTPUTS if k in self.graph.outputs]

    def resolve(self, node: Node) -> None:
        """Settles T from what is connected and given, and checks every connection."""
        kind = node.as_type
        generic = [i for i in node.type.inputs if i.type == "T"]
        if kind and (kind not in GENERIC or not generic):
            self.problems.append(
                f'node "{node.name}": "as" is {", ".join(GENERIC)} for a node whose inputs have no type of their own'
            )
            kind = ""
        if not kind:
            kind = "float"
            for declared in generic:
                source = node.connections.get(declared.name)
                found = self.types[source.name] if source else ""
                if not source and isinstance(node.parameters.get(declared.name), tuple):
                    found = "color" if kind == "float" else kind
                if found in TRIPLES and (kind == "float" or source):
                    kind = "color" if found == "color" else "vector"
        self.kinds[node.name] = kind
        self.types[node.name] = kind if node.type.output == "T" else node.type.output
        for declared in node.type.inputs:
            wanted = kind if declared.type == "T" else declared.type
            source = node.connections.get(declared.name)
            where = f'node "{node.name}" ({node.type.name}), input "{declared.name}"'
            if source is None:
                if declared.default is None:
                    self.problems.append(f"{where}: expected a connection: a {wanted}")
                elif wanted == "float" and isinstance(node.parameters.get(declared.name), tuple):
                    self.problems.append(f"{where}: expected one number, found three")
                continue
            found = self.types[source.name]
            if not converts(found, wanted):
                hint = self.hint(found, wanted)
                self.problems.append(
                    f'{where} takes a {wanted}, node "{source.name}" ({source.type.name}) gives a {found}{hint}'
                )
            elif wanted == "material":
                if source.name in self.parents:
                    self.problems.append(
                        f'{where}: "{source.name}" is in "{self.parents[source.name]}" already; '
                        "a material lies in one layer: add another node like it"
                    )
                self.parents[source.name] = node.name

    @staticmethod
    def hint(found: str, wanted: str) -> str:
        if found == "color":
            between = "luminance or component" if wanted == "float" else "color_to_vector"
        elif wanted == "color" and found in TRIPLES:
            between = "vector_to_color"
        elif wanted == "float" and found in TRIPLES:
            between = "component or length"
        else:
            return ""
        return f"; put a {between} between them"

    def check_outputs(self) -> None:
        for output, node in self.graph.outputs.items():
            found = self.types[node.name]
            if not converts(found, OUTPUTS[output]):
                gives = f'node "{node.name}" ({node.type.name}) gives a {found}'
                self.problems.append(f'output "{output}" takes a {OUTPUTS[output]}, {gives}')
        surface = self.graph.surface
        if surface and surface.name in self.parents:
            self.problems.append(f'output "surface": "{surface.name}" lies in a layer of its own below')

    # ---- names

    def name_nodes(self, order: list[Node]) -> None:
        """Identifiers: what is none in a name becomes "_"; the second of a kind gets a number."""
        taken: set[str] = set()
        wanted = {n.name: re.sub(r"[^A-Za-z0-9_]", "_", n.name) for n in order}
        for node in sorted(order, key=lambda n: wanted[n.name] != n.name):  # true names come first
            name = wanted[node.name]
            name = f"n{name}" if not name or not (name[0].isalpha()) else name
            number = 2
            unique = name
            while unique in taken:
                unique = f"{name}{number}"
                number += 1
            taken.add(unique)
            self.names[node.name] = unique

    def parameter(self, node: Node, declared: Input) -> str:
        return f"{self.names[node.name]}_{declared.name}"

    def exposed(self, node: Node, declared: Input) -> bool:
        expose = self.graph.expose
        return expose if isinstance(expose, bool) else f"{node.name}.{declared.name}" in expose

    def type_of(self, node: Node, declared: Input) -> str:
        return self.kinds[node.name] if declared.type == "T" else declared.type

    def default(self, node: Node, declared: Input) -> Value | None:
        return node.parameters.get(declared.name, declared.default)

    @staticmethod
    def idle(node: Node, declared: Input) -> bool:
        """A bump that nobody asked for: a second normal is not computed in case somebody does later."""
        asked = "bump" in node.connections or "bump" in node.parameters
        return node.type.name == "displace" and declared.name in ("bump", "bumpAmount") and not asked

    def from_surface(self, node: Node, declared: Input) -> str:
        """The surface's quantity that an input stands for, or nothing."""
        value = self.default(node, declared)
        return value if declared.type != "string" and isinstance(value, str) else ""

    # ---- writing

    def value(self, node: Node, name: str) -> str:
        """The expression that an input gets."""
        declared = node.type.input(name)
        wanted = self.type_of(node, declared)
        source = node.connections.get(name)
        if source is None:
            quantity = self.from_surface(node, declared)
            if quantity:
                found, text = SURFACE[quantity][0], f"surface_{quantity[1:]}"
            elif self.exposed(node, declared):
                return self.parameter(node, declared)
            else:
                return literal(self.default(node, declared), wanted)
        else:
            found, text = self.types[source.name], f"{self.names[source.name]}_out"
        return text if found == wanted else f"{wanted}({text})"

    def write(self, order: list[Node], moved: list[Node], shaded: list[Node]) -> str:
        graph = self.graph
        parts = [
            self.head(order),
            *self.functions(order),
            f"class {self.class_name()}(\n",
            *self.parameters(order),
            ")\n{\n",
        ]
        if graph.surface:
            parts += self.init(shaded)
        if moved:
            parts += self.stage("mnk_displacement(output point P; output normal N)", moved)
        if graph.surface:
            parts += self.stage("mnk_prelighting(output MnkMaterialBoundary boundary)", shaded)
        if parts[-1] == "\n":
            parts.pop()
        return "".join([*parts, "}\n"])

    def class_name(self) -> str:
        name = re.sub(r"[^A-Za-z0-9_]", "_", self.graph.name)
        return name if name and name[0].isalpha() else f"graph_{name}"

    def head(self, order: list[Node]) -> str:
        lines = [*self.graph.comment.splitlines()]
        left = len(self.graph.nodes) - len(order)
        used = f"{len(order)} nodes" + (f", {left} more that nothing depends on" if left else "")
        lines.append(f'Made from the shader graph "{self.one_line(self.graph.name)}": {used}.')
        return "".join(f"// {line}\n" for line in lines) + "\n"

    @staticmethod
    def one_line(text: str) -> str:
        """For a comment: no line ends, and no backslash that would join the next line."""
        return " ".join(text.split()).replace("\\", "/")

    def functions(self, order: list[Node]) -> list[str]:
        done: dict[str, str] = {}
        for node in order:
            node_type, kind = node.type, self.kinds[node.name]
            name = function_name(node_type, kind)
            if not node_type.body or name in done:
                continue
            result = kind if node_type.output == "T" else node_type.output
            arguments = ", ".join(f"{kind if i.type == 'T' else i.type} {argument_name(i)}" for i in node_type.inputs)
            product = (
                "vector(xcomp(a) * xcomp(b), ycomp(a) * ycomp(b), zcomp(a) * zcomp(b))" if kind == "vector" else "a * b"
            )
            body = node_type.body.replace("PRODUCT", product)
            done[name] = f"// {node_type.name}: {node_type.doc}\n{result} {name}({arguments})\n{{\n{body}\n}}\n\n"
        return list(done.values())

    def parameters(self, order: list[Node]) -> list[str]:
        lines = []
        for node in order:
            for declared in node.type.inputs:
                if declared.name in node.connections or declared.type in KINDS or self.from_surface(node, declared):
                    continue
                if not self.exposed(node, declared) or self.idle(node, declared):
                    continue
                kind = self.type_of(node, declared)
                detail = "varying " if node.type.varying else ""
                default = literal(self.default(node, declared), kind)
                lines.append(f"    {detail}{kind} {self.parameter(node, declared)} = {default}; // {declared.doc}\n")
        return lines

    def init(self, shaded: list[Node]) -> list[str]:
        lines = [
            "    public void mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)\n",
            "    {\n        MnkMaterialBoundary boundary = CreateBoundary(material);\n",
        ]
        for node in shaded:
            name = self.names[node.name]
            if node.type.lobe:
                lines.append(f'        AddLobe(boundary, "{name}", {node.type.lobe[0]}());\n')
            elif node.type.layer:
                upper, lower = (self.names[node.connections[k].name] for k in ("upper", "lower"))
                lines.append(f'        AddLayer(boundary, "{name}", "{node.type.layer}", "{upper}", "{lower}");\n')
        return [*lines, "    }\n", "\n"]

    def stage(self, header: str, nodes: list[Node]) -> list[str]:
        lines = [f"    public void {header}\n    {{\n"]
        quantities = sorted({q for n in nodes for i in n.type.inputs
                             if i.name not in n.connections and (q := self.from_surface(n, i))})  # fmt: skip
        for quantity in quantities:
            kind, expression, doc = SURFACE[quantity]
            lines.append(f"        {kind} surface_{quantity[1:]} = {expression}; // {doc}\n")
        for node in nodes:
            gap = "" if lines[-1].endswith("{\n") else "\n"
            comment = f"{self.one_line(node.name)}: {node.type.name}"
            if node.comment:
                comment += f" - {self.one_line(node.comment)}"
            lines.append(f"{gap}        // {comment}\n")
            lines += self.block(node)
        presence = self.graph.presence
        if presence and "prelighting" in header:
            lines += [f"\n        SetPresence(boundary, {self.names[presence.name]}_out);\n"]
        return [*lines, "    }\n", "\n"]

    def block(self, node: Node) -> list[str]:
        name = self.names[node.name]
        if node.type.lobe:
            lobe, takes = node.type.lobe
            inputs = [i.name for i in node.type.inputs if i.name != "weight"]
            pairs = ", ".join(f'"{k}", {self.value(node, i)}' for k, i in zip(takes, inputs, strict=True))
            weight = self.value(node, "weight")
            return [f'        SetLobe(boundary, "{name}", {weight},\n                {lobe}({pairs}));\n']
        if node.type.layer:
            if not node.type.input("weight"):
                return []
            return [f'        SetLayer(boundary, "{name}", {self.value(node, "weight")});\n']
        if node.type.name == "displace":
            lines = [
                f"        float {name}_out = {self.value(node, 'height')} * {self.value(node, 'amount')};\n",
                f"        P += normalize(N) * {name}_out;\n",
                "        N = normalize(calculatenormal(P));\n",
            ]
            if not self.idle(node, node.type.input("bump")):
                height = f"{self.value(node, 'bump')} * {self.value(node, 'bumpAmount')}"
                lines.append(f"        N = normalize(calculatenormal(P + N * ({height})));\n")
            return lines
        if node.type.name == "displace_vector":
            return [
                f"        vector {name}_out = {self.value(node, 'offset')} * {self.value(node, 'amount')};\n",
                f"        P += {name}_out;\n",
                "        N = normalize(calculatenormal(P));\n",
            ]
        arguments = ", ".join(self.value(node, i.name) for i in node.type.inputs)
        function = function_name(node.type, self.kinds[node.name])
        return [f"        {self.types[node.name]} {name}_out = {function}({arguments});\n"]


def shader_text(graph: ShaderGraph) -> str:
    return _Writer(graph).text()
