"""Walks a material's network: what stands behind an input, as RSL."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from pxr import Sdf, Usd, UsdShade

from . import lights
from .files import Files
from .rsl import Stage, Value, Writer
from .stage import Say

_KINDS = {
    "float": "float",
    "double": "float",
    "half": "float",
    "int": "float",
    "bool": "float",
    "float2": "float2",
    "texCoord2f": "float2",
    "float3": "vector",
    "vector3f": "vector",
    "normal3f": "vector",
    "point3f": "vector",
    "color3f": "color",
    "float4": "color",
    "color4f": "color",
    "asset": "string",
    "string": "string",
    "token": "string",
}


@dataclass
class Network:
    """A material's nodes, evaluated into a writer's shader."""

    writer: Writer
    say: Say
    files: Files
    time: Usd.TimeCode
    nodes: dict[str, Callable[[Network, UsdShade.Shader, str, Stage], Value | None]]
    material: str
    uv: Value | None = None  # the coordinates that textures were read by last
    _on_the_way: set[Sdf.Path] = field(default_factory=set)

    def source(self, shader: UsdShade.Shader, name: str) -> Usd.Attribute | None:
        """Where an input's value is: an output of another node, or an input that has it; None = nowhere."""
        port = shader.GetInput(name)
        if not port:
            return None
        found = UsdShade.Utils.GetValueProducingAttributes(port)
        return found[0] if found else None

    def constant(self, shader: UsdShade.Shader, name: str, default=None):
        """An input's value, where it has one by itself."""
        attribute = self.source(shader, name)
        if attribute is None or UsdShade.Utils.GetType(attribute.GetName()) == UsdShade.AttributeType.Output:
            return default
        value = attribute.Get(self.time)
        return default if value is None else value

    def connected(self, shader: UsdShade.Shader, name: str) -> bool:
        attribute = self.source(shader, name)
        return attribute is not None and UsdShade.Utils.GetType(attribute.GetName()) == UsdShade.AttributeType.Output

    def file(self, shader: UsdShade.Shader, name: str) -> str:
        attribute = self.source(shader, name)
        return lights.resolved(attribute, self.time, self.files, self.say) if attribute else ""

    def color_space(self, shader: UsdShade.Shader, name: str) -> str:
        """That a file's attribute names, in lower case."""
        attribute = self.source(shader, name)
        return (attribute.GetColorSpace() or "").lower() if attribute else ""

    def value(self, shader: UsdShade.Shader, name: str, stage: Stage, kind: str, default=None) -> Value | None:
        """An input's value; None where it is neither connected nor set and there is no default."""
        attribute = self.source(shader, name)
        if attribute is not None and UsdShade.Utils.GetType(attribute.GetName()) == UsdShade.AttributeType.Output:
            found = self.output(UsdShade.Shader(attribute.GetPrim()), attribute, stage)
            if found is not None:
                return found.to(kind)
        elif attribute is not None and (value := attribute.Get(self.time)) is not None:
            return self.of_constant(attribute.GetPath(), value, kind)
        return None if default is None else self.of_constant((shader.GetPath(), name), default, kind)

    def of_constant(self, key: object, value: object, kind: str) -> Value:
        if isinstance(value, Sdf.AssetPath):
            value = value.resolvedPath or value.path
        if kind == "string":
            return self.writer.constant("string", str(value))
        numbers = [float(value)] if isinstance(value, (int, float, bool)) else [float(x) for x in value]  # type: ignore
        size = {"float": 1, "float2": 2, "color": 3, "vector": 3}[kind]
        numbers = numbers * size if len(numbers) == 1 else (numbers + [0.0] * size)[:size]
        given = numbers[0] if kind == "float" else tuple(numbers)
        return self.writer.constant(kind, given)

    def output(self, shader: UsdShade.Shader, attribute: Usd.Attribute, stage: Stage) -> Value | None:
        """What a node gives, in a variable; told and None where it is none that we know."""
        path = attribute.GetPath()
        if path in stage.known:
            return stage.known[path]
        if path in self._on_the_way:
            self.say("warning", f"{path}: the network runs in a circle; it is cut here")
            return None
        identifier = shader.GetIdAttr().Get() if shader.GetIdAttr() else None
        node = self.nodes.get(identifier or "") or self.nodes.get(family(identifier or ""))
        if node is None:
            self.say(
                "warning", f'{self.material}: there is no node "{identifier}" ({shader.GetPath()}); its default stands'
            )
            return None
        self._on_the_way.add(path)
        try:
            value = node(self, shader, attribute.GetBaseName(), stage)
        finally:
            self._on_the_way.discard(path)
        if value is not None:
            value = self.writer.let(stage, value)
            stage.known[path] = value
        return value


def family(identifier: str) -> str:
    """ "ND_multiply" of "ND_multiply_color3FA": MaterialX has a node for each type."""
    return "_".join(identifier.split("_")[:2]) if identifier.startswith("ND_") else identifier


def kind_of(attribute: Usd.Attribute) -> str:
    return _KINDS.get(str(attribute.GetTypeName()), "float")


def texture(
    network: Network, stage: Stage, file: str, st: Value, wrap: str, space: str, channel: int | None, fill: float = 0
) -> Value:
    """A picture at st, whose t grows upwards: the colour, or one channel."""
    key = ("texture", file, st, wrap, space, channel)
    if key in stage.known:
        return stage.known[key]
    writer = network.writer
    strings = {"file": file, "wrap": wrap, "space": space}
    texts = [writer.shared("string", (file, *item), item[1]).text for item in strings.items()]
    options = f'"wrap", {texts[1]}, "colorspace", {texts[2]}, "fill", {fill:g}'
    where = f"{st.text}, 1 - ({st.second})"
    if channel is None:
        found = Value("color", f"color texture({texts[0]}, {where}, {options})")
    else:
        found = Value("float", f"float texture({texts[0]}[{channel}], {where}, {options})")
    stage.known[key] = writer.let(stage, found)
    network.uv = st
    return stage.known[key]
