"""Walks a material's network: what stands behind an input, as RSL."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from pxr import Sdf, Usd, UsdShade

from kanuka.looks import colors
from kanuka.looks.colors import AUTO, RAW, Lookup
from kanuka.looks.files import Files
from kanuka.looks.rsl import MATRICES, SIZES, Corners, Stage, Value, Writer, numbers_of, of_numbers

from . import library, values
from .arrays import text_of
from .spaces import Spaces
from .stage import Say, one_line

_KINDS = {
    "float2": "float2",
    "texCoord2f": "float2",
    "float3": "vector",
    "vector3f": "vector",
    "normal3f": "vector",
    "point3f": "vector",
    "color3f": "color",
    "float4": "color4",
    "color4f": "color4",
    "matrix3d": "matrix33",
    "matrix4d": "matrix44",
    "asset": "string",
    "string": "string",
    "token": "string",
}
TEXT_READERS = ("UsdPrimvarReader_string", "ND_geompropvalue", "ND_geompropvalueuniform")
IDENTITY = tuple(float(i % 5 == 0) for i in range(16))
UV_TEXTURES = ("raw", "sRGB")  # words of UsdUVTexture's own, which no configuration changes

# A node's function: what one of its outputs gives, with the statements that it needs written to the stage; None where
# it has nothing to give, and the default of whoever reads it stands.
Evaluate: TypeAlias = "Callable[[Node, str, Stage], Value | None]"


@dataclass
class Network:
    """A material's nodes, evaluated into a writer's shader."""

    writer: Writer
    say: Say
    files: Files
    time: Usd.TimeCode
    nodes: dict[str, Evaluate]
    material: str
    spaces: Spaces
    turned: bool = False  # whether the stage's up axis is z, and its world lies in ours turned (transforms.py)
    rate: float = 24.0  # time codes of a second
    uv: Value | None = None  # the coordinates that textures were read by last
    blur: str = ""  # of the textures that are met, as a part of them
    normal_maps: int = 0  # how many were met
    tangential: set[str] = field(default_factory=set)  # normals that are in tangent space
    _on_the_way: set[tuple[object, ...]] = field(default_factory=set)
    _told: set[str] = field(default_factory=set)

    def in_stage(self, text: str) -> str:
        """A vector of our world in the stage's."""
        return self._turn("usd_in_stage", text, "xcomp(v), -zcomp(v), ycomp(v)")

    def in_world(self, text: str) -> str:
        """And back."""
        return self._turn("usd_in_world", text, "xcomp(v), zcomp(v), -ycomp(v)")

    def _turn(self, name: str, text: str, numbers: str) -> str:
        if not self.turned:
            return text
        self.writer.functions[name] = f"vector {name}(vector v) {{\n    return vector({numbers});\n}}"
        return f"{name}({text})"

    def tell(self, text: str) -> None:
        """A warning, once for the material."""
        if text not in self._told:
            self._told.add(text)
            self.say("warning", text)

    def node(self, shader: UsdShade.Shader) -> Node:
        return UsdNode(self, shader)

    def of_constant(self, value: object, kind: str) -> Value:
        """A value of USD as a parameter of the shader."""
        if isinstance(value, Sdf.AssetPath):
            value = value.resolvedPath or value.path
        if kind == "string":
            return self.writer.constant("string", str(value))
        size = SIZES[kind]
        if kind in MATRICES and not isinstance(value, (int, float, bool)):
            value = np.array(value, dtype=float).ravel()
        numbers = numbers_of(value)
        numbers = numbers * size if len(numbers) == 1 else (numbers + [1.0] * size)[:size]
        return self.writer.constant(kind, numbers[0] if kind == "float" else tuple(numbers))

    def output(self, node: Node, name: str, stage: Stage) -> Value | None:
        """What a node gives, in a variable; told and None where it is none that we know."""
        key = (node.key, name, self.blur)
        if key in stage.known:
            return stage.known[key]
        if key in self._on_the_way:
            self.tell(f"{self.material}: its network runs in a circle; it is cut at {node}")
            return None
        self._on_the_way.add(key)
        try:
            value = self._evaluated(node, name, stage)
        finally:
            self._on_the_way.discard(key)
        if value is not None:
            value = self.writer.let(stage, value)
            stage.known[key] = value
        return value

    def _evaluated(self, node: Node, name: str, stage: Stage) -> Value | None:
        known = self.nodes.get(node.identifier) or self.nodes.get(family(node.identifier))
        if known is not None:
            return known(node, name, stage)
        if (graph := library.graph_of(node.identifier)) is not None:
            inside = library.source_of(graph, name)
            if inside is not None:
                return self.output(LibraryNode(node, graph, inside[0]), inside[1], stage)
        why = "" if library.document() else "; without the package MaterialX few are known"
        self.tell(f'{self.material}: there is no node "{node.identifier}" ({node}); its default stands{why}')
        return None


def family(identifier: str) -> str:
    """ "ND_multiply" of "ND_multiply_color3FA": MaterialX has a node for each type."""
    return "_".join(identifier.split("_")[:2]) if identifier.startswith("ND_") else identifier


class Node:
    """A node of a network, by its inputs. `key` tells it from others of its material."""

    network: Network
    key: object
    identifier: str  # "UsdUVTexture", "ND_add_float"

    def kind(self, output: str) -> str:
        raise NotImplementedError

    def input_kind(self, name: str) -> str | None:
        """Of what is connected, or of the input itself; None = the node has none of that name."""
        raise NotImplementedError

    def number_kind(self, name: str, default: str) -> str:
        """The same, of what is read as numbers."""
        found = self.input_kind(name)
        return default if found in (None, "string") else found

    def connected(self, name: str) -> bool:
        raise NotImplementedError

    def source(self, name: str) -> Node | None:
        """The node that an input is connected to, where that is one of the material's own."""
        return None

    def constant(self, name: str, default=None):
        """An input's value, where it has one by itself."""
        raise NotImplementedError

    def number(self, name: str, default: float) -> float:
        """Of a constant; its first, where it has several."""
        return numbers_of(self.constant(name, default))[0]

    def numbers(self, name: str, default: tuple[float, ...]) -> list[float]:
        """As many as the default has."""
        found = numbers_of(self.constant(name, default))
        return (found * len(default) if len(found) == 1 else [*found, *default[len(found) :]])[: len(default)]

    def fallback(self, name: str, kind: str = "") -> list[float] | None:
        """Of a primvar: numbers, where there are any."""
        value = self.constant(name, IDENTITY if kind == "matrix44" else None)
        if value is None or isinstance(value, (str, Sdf.AssetPath)):
            return None
        return np.ravel(value).astype(float).tolist() if np.ndim(value) == 2 else numbers_of(value)

    def text(self, name: str) -> str:
        """Of a constant, where it is a text or a file."""
        value = self.constant(name, "")
        return text_of(value) if isinstance(value, (str, Sdf.AssetPath)) else ""

    def value(self, name: str, stage: Stage, kind: str, default=None) -> Value | None:
        """An input's value; None where it is neither connected nor set and there is no default."""
        raise NotImplementedError

    def file(self, name: str) -> str:
        raise NotImplementedError

    def picture(self, name: str, stage: Stage) -> str | Value:
        """A file, or what names one: a primvar."""
        return self.file(name)

    def named_lookup(self, name: str, by: str, file: str | Value) -> Lookup:
        """The same, of a colour whose space another input names."""
        raise NotImplementedError

    def lookup(self, name: str, file: str | Value, kind: str) -> Lookup:
        """How the file that an input names is read as values of a kind; all but colours are data."""
        raise NotImplementedError


class UsdNode(Node):
    def __init__(self, network: Network, shader: UsdShade.Shader) -> None:
        self.network, self._shader, self.key = network, shader, shader.GetPath()
        attribute = shader.GetIdAttr()
        self.identifier = (attribute.Get() if attribute else None) or ""

    def __str__(self) -> str:
        return str(self._shader.GetPath())

    def _source(self, name: str) -> Usd.Attribute | None:
        port = self._shader.GetInput(name)
        if not port:
            return None
        found = UsdShade.Utils.GetValueProducingAttributes(port)
        if not found:
            stage = self._shader.GetPrim().GetStage()
            for path in port.GetRawConnectedSourcePaths():
                if not stage.GetAttributeAtPath(path):
                    self.network.tell(f"{port.GetAttr().GetPath()}: it is connected to {path}, which is not there")
        return found[0] if found else None

    def _constant(self, attribute: Usd.Attribute, kind: str | None) -> object:
        """Its value, where it is of the sort that is read: a text, or finite numbers. None = either."""
        value = attribute.Get(self.network.time)
        if value is None:
            return None
        if isinstance(value, (str, Sdf.AssetPath)):
            if kind in ("string", None):
                return value
        elif kind != "string" and values.as_numbers(value, max(SIZES.get(kind or "", 4), 4)) is not None:
            return self.network.spaces.value(attribute, value)
        self.network.tell(f"{attribute.GetPath()}: {one_line(str(value))} is no value for it; its default stands")
        return None

    def kind(self, output: str) -> str:
        port = self._shader.GetOutput(output)
        return kind_of(port.GetAttr()) if port else "float"

    def input_kind(self, name: str) -> str | None:
        attribute = self._source(name)
        return kind_of(attribute) if attribute is not None else None

    def connected(self, name: str) -> bool:
        attribute = self._source(name)
        return attribute is not None and is_output(attribute)

    def source(self, name: str) -> Node | None:
        attribute = self._source(name)
        if attribute is None or not is_output(attribute):
            return None
        return UsdNode(self.network, UsdShade.Shader(attribute.GetPrim()))

    def constant(self, name: str, default=None):
        attribute = self._source(name)
        if attribute is None or is_output(attribute):
            return default
        kind = None if default is None else "string" if isinstance(default, str) else "numbers"
        kind = "matrix44" if default is IDENTITY else kind
        value = self._constant(attribute, kind)
        return default if value is None else value

    def value(self, name: str, stage: Stage, kind: str, default=None) -> Value | None:
        attribute = self._source(name)
        if attribute is not None and is_output(attribute):
            source = self.source(name)
            assert source
            found = self.network.output(source, attribute.GetBaseName(), stage)
            if found is not None and (found.kind == "string") == (kind == "string"):
                return found.to(kind)
            if found is not None:
                self.network.tell(f"{self}.inputs:{name}: {source} gives no value for it; its default stands")
        elif attribute is not None and (value := self._constant(attribute, kind)) is not None:
            return self.network.of_constant(value, kind)
        return None if default is None else self.network.of_constant(default, kind)

    def file(self, name: str) -> str:
        attribute, network = self._source(name), self.network
        if attribute is None:
            return ""
        if is_output(attribute):
            network.tell(f"{self}.inputs:{name}: a file that a node gives ({attribute.GetPath()}) is not read")
            return ""
        if not isinstance(value := attribute.Get(network.time), (Sdf.AssetPath, type(None))):
            network.tell(f"{attribute.GetPath()}: {value} is no file")
            return ""
        return values.resolved(attribute, network.time, network.files, network.say)

    def picture(self, name: str, stage: Stage) -> str | Value:
        source = self.source(name)
        if source is None or family(source.identifier) not in TEXT_READERS:
            return self.file(name)
        return self.value(name, stage, "string") or ""

    def named_lookup(self, name: str, by: str, file: str | Value) -> Lookup:
        attribute, spaces = self._source(name), self.network.spaces
        file = "" if isinstance(file, Value) else file  # it is not known yet
        said, named = self._source(by), str(self.constant(by, "auto") or "auto")
        if said and named in UV_TEXTURES:
            return spaces.lookup(file, colors.named(named))
        if said and named != "auto":
            return spaces.lookup(file, spaces.named(named, said))
        # What prims say of all their attributes is not meant for pictures that say "auto" themselves.
        return spaces.lookup(file, spaces.of_file(attribute, file, inherits=False)) if attribute else AUTO

    def lookup(self, name: str, file: str | Value, kind: str) -> Lookup:
        attribute, spaces = self._source(name), self.network.spaces
        file = "" if isinstance(file, Value) else file
        if kind not in ("color", "color4"):
            return RAW
        return spaces.lookup(file, spaces.of_file(attribute, file)) if attribute else AUTO


class LibraryNode(Node):
    """A node of a graph that MaterialX's library has for another node, `outer`, whose inputs are the graph's."""

    def __init__(self, outer: Node, graph: library.Graph, node: library.GraphNode) -> None:
        self.network, self._outer, self._graph, self._node = outer.network, outer, graph, node
        self.key, self.identifier = (outer.key, node.name), node.identifier

    def __str__(self) -> str:
        return str(self._outer)

    def kind(self, output: str) -> str:
        return library.kind_of_output(self.identifier, output)

    def _input(self, name: str) -> library.Input:
        return self._node.inputs.get(name) or library.default_of(self.identifier, name)

    def input_kind(self, name: str) -> str | None:
        return self._input(name).kind or None

    def connected(self, name: str) -> bool:
        given = self._input(name)
        return bool(given.node) or bool(given.interface and self._outer.connected(given.interface))

    def constant(self, name: str, default=None):
        given = self._input(name)
        if given.interface:
            inherited = library.default_of(self._outer.identifier, given.interface)
            return self._outer.constant(given.interface, default if inherited.value is None else inherited.value)
        return default if given.value is None else given.value

    def value(self, name: str, stage: Stage, kind: str, default=None) -> Value | None:
        given = self._input(name)
        if given.interface:
            found = self._outer.value(given.interface, stage, given.kind)
            if found is None:
                found = self._default(library.default_of(self._outer.identifier, given.interface), stage)
        elif given.node:
            inside = LibraryNode(self._outer, self._graph, self._graph.nodes[given.node])
            found = self.network.output(inside, given.output, stage)
        else:
            found = self._default(given, stage)
        if found is not None:
            return found.to(kind)
        return None if default is None else self.network.of_constant(default, kind)

    def _default(self, given: library.Input, stage: Stage) -> Value | None:
        if given.geometry:
            return geometry(self.network, given.geometry, stage)
        if given.value is None or given.value == "":
            return None
        if given.kind == "string":
            return self.network.of_constant(given.value, given.kind)
        numbers = numbers_of(given.value)  # the graph's own: no parameters of the shader
        return of_numbers(given.kind, [f"{x:.9g}" for x in numbers])

    def file(self, name: str) -> str:
        given = self._input(name)
        return self._outer.file(given.interface) if given.interface else ""

    def picture(self, name: str, stage: Stage) -> str | Value:
        given = self._input(name)
        return self._outer.picture(given.interface, stage) if given.interface else ""

    def named_lookup(self, name: str, by: str, file: str | Value) -> Lookup:
        return self.lookup(name, file, "color")

    def lookup(self, name: str, file: str | Value, kind: str) -> Lookup:
        given = self._input(name)
        if not given.interface or kind not in ("color", "color4"):
            return RAW
        return self._outer.lookup(given.interface, file, kind)


def is_output(attribute: Usd.Attribute) -> bool:
    return UsdShade.Utils.GetType(attribute.GetName()) == UsdShade.AttributeType.Output


def kind_of(attribute: Usd.Attribute) -> str:
    return _KINDS.get(str(attribute.GetTypeName()), "float")


def geometry(network: Network, name: str, stage: Stage) -> Value | None:
    """What MaterialX's geometric properties name: "Pobject", "UV0"."""
    kind, space = name.rstrip("0"), "world" if name.endswith("world") else "object"
    if kind == "UV":
        return network.writer.primvar("st", "float2")
    texts = {
        "P": f'vector(transform("{space}", P))',
        "N": f'normalize(vector(ntransform("{space}", N)))',
        "T": f'normalize(vtransform("{space}", vector(Du(P))))',
        "B": f'normalize(vtransform("{space}", vector(Dv(P))))',
        # From the camera: materials are shaded before anything is looked at, in mirrors too.
        "V": f'normalize(vtransform("{space}", P - point "camera" (0, 0, 0)))',
    }
    key = ("geometry", name)
    if key not in stage.known and kind[:1] in texts:
        text = texts[kind[:1]]
        text = network.in_stage(text) if space == "world" else text
        stage.known[key] = network.writer.let(stage, Value("vector", text))
    return stage.known.get(key)


def texture(
    network: Network,
    stage: Stage,
    file: str | Value,
    st: Value | Corners,
    wrap: str,
    look: Lookup,
    channel: int | None,
    fill: float = 0,
) -> Value:
    """A picture at st, whose t grows upwards: the colour, or one channel."""
    if isinstance(st, Value):
        network.uv = st
    writer, file = network.writer, look.file or file
    if not look.function or channel == 3:
        return writer.texture(stage, file, st, wrap, look.space, channel, fill, network.blur)
    writer.functions[look.function] = look.text
    coded = writer.texture(stage, file, st, wrap, look.space, None, fill, network.blur)
    key = ("light", coded.text, look.function)
    if key not in stage.known:
        stage.known[key] = writer.let(stage, Value("color", f"{look.function}({coded.text})"))
    found = stage.known[key]
    return found if channel is None else Value("float", found.number(channel))
