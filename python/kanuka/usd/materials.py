"""Materials of a stage: each becomes a shader with its values."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from pxr import Usd, UsdGeom, UsdShade

import kanuka
from kanuka.looks.colors import Lookup
from kanuka.looks.files import Files
from kanuka.looks.material import MadeMaterial
from kanuka.looks.rsl import Stage, Value, Writer, halves, primvar_name
from kanuka.looks.surface import Surface, text_of

from . import materialx, mixtures, patterns, preview
from .network import Network, texture
from .spaces import Spaces
from .stage import Say

NODES = preview.NODES | patterns.NODES
SURFACES = mixtures.with_mixtures(preview.SURFACES | materialx.SURFACES)
CONTEXTS = ("kanuka", "mtlx", "")  # of outputs, the best first


@dataclass
class Made:
    """A material, and what it reads of what it is on: primvars by USD's names, with Kanuka's and their kinds."""

    shader: str
    parameters: dict[str, object]
    primvars: dict[str, tuple[str, str]] = field(default_factory=dict)
    shines: bool = False

    def __post_init__(self) -> None:
        self.material = self.with_values({})

    def reads(self, name: str) -> bool:
        """Whether a primvar of that name, Kanuka's, is one of its parameters."""
        return any(name in ((ours,) if kind != "float2" else halves(ours)) for ours, kind in self.primvars.values())

    def with_values(self, values: dict[str, object]) -> kanuka.Material:
        """For what has no primvars of its own: with values in their place."""
        return MadeMaterial(self.shader, self.parameters | values)


@dataclass(frozen=True)
class Shine:
    """What a light makes of the material of its mesh: `factor` multiplies what it shines with (zeros: nothing is left).
    Where there is a picture, a file, that multiplies it too, or else the light's own radiance."""

    factor: tuple[float, float, float]
    radiance: tuple[float, float, float]
    picture: tuple[str, Lookup] | None = None

    def light(self, network: Network, surface: Surface, shading: Stage) -> None:
        for part in surface.parts():
            self._light(network, part, shading)

    def _light(self, network: Network, surface: Surface, shading: Stage) -> None:
        writer, own = network.writer, surface.emission if any(self.factor) else None
        if own:
            own = Value("color", f"({own.to('color').text}) * {writer.constant('color', self.factor).text}")
        if self.picture:
            file, look = self.picture
            found = texture(network, shading, file, writer.primvar("st", "float2"), "", look, None)
            own = Value("color", f"{(own or writer.constant('color', self.radiance)).text} * {found.text}")
        surface.emission = own


def surfaces_of(material: UsdShade.Material) -> list[UsdShade.Shader]:
    """Its surfaces in the contexts that are read, the best first. Asked for a context that it has none of, USD answers
    with the one that is for all."""
    found = []
    for context in CONTEXTS:
        output = material.GetSurfaceOutput(context)
        if output and output.HasConnectedSource():
            shader, _, _ = material.ComputeSurfaceSource(context)
            found += [shader] if shader else []
    return found


def identifier_of(shader: UsdShade.Shader) -> str:
    return str(shader.GetIdAttr().Get() if shader.GetIdAttr() else None)


class Materials:
    def __init__(self, say: Say, files: Files, time: Usd.TimeCode, spaces: Spaces | None = None) -> None:
        self._say, self._files, self._time = say, files, time
        self._made: dict[object, Made | None] = {}
        self._spaces = spaces or Spaces(say)

    def of(self, material: UsdShade.Material, shine: Shine | None = None) -> Made | None:
        """None: it has no surface that can be read, which was told."""
        key = (material.GetPath(), shine)
        try:
            return self._made[key]
        except KeyError:
            self._made[key] = made = self._make(material, shine)
            return made

    def plain(self, shine: Shine | None = None) -> Made:
        """Of what has no material: grey, or as displayColor has it."""

        def surface(writer: Writer) -> Surface:
            made = Surface(base=writer.primvar("displayColor", "color", (0.18, 0.18, 0.18)))
            made.roughness = writer.constant("float", 0.5)
            return made

        return self._simple("plain", surface, shine)

    def dark(self, shine: Shine | None = None) -> Made:
        """Reflects nothing."""

        def surface(writer: Writer) -> Surface:
            return Surface(base=writer.constant("color", (0, 0, 0)), specular=writer.constant("float", 0))

        return self._simple("dark", surface, shine)

    def _simple(self, name: str, of: Callable[[Writer], Surface], shine: Shine | None) -> Made:
        key = (name, shine if shine and shine.picture else None)
        if (made := self._made.get(key)) is None:
            writer, shading = Writer(), Stage()
            surface = of(writer)
            if shine:
                shine.light(self._network(writer, name), surface, shading)
            made = self._made[key] = self._finished(writer, surface, shading, Stage(), None)
        return made

    def _network(self, writer: Writer, path: str) -> Network:
        return Network(writer, self._say, self._files, self._time, NODES, path, self._spaces)

    def _make(self, material: UsdShade.Material, shine: Shine | None) -> Made | None:
        shader = self._surface(material)
        if shader is None:
            return None
        path = str(material.GetPath())
        identifier = shader.GetIdAttr().Get()
        writer, shading, displacing = Writer(), Stage(), Stage()
        network = self._network(writer, path)
        stage = material.GetPrim().GetStage()
        network.turned = UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z
        network.rate = stage.GetTimeCodesPerSecond() or network.rate
        try:
            surface = SURFACES[identifier](network.node(shader), shading, displacing)
            if surface is None:
                return None
        except RecursionError:
            self._say("warning", f"{path}: its network is too deep to be read. Grey stands in for it")
            return None
        uv = network.uv
        if shine:
            shine.light(network, surface, shading)
        if uv is None and surface.has_tangents():
            uv = writer.primvar("st", "float2")
        return self._finished(writer, surface, shading, displacing, uv)

    def _surface(self, material: UsdShade.Material) -> UsdShade.Shader | None:
        shaders = surfaces_of(material)
        for shader in shaders:
            if identifier_of(shader) in SURFACES:
                return shader
        named = ", ".join(dict.fromkeys(map(identifier_of, shaders))) or "none"
        self._say(
            "warning",
            f"{material.GetPath()}: no surface that can be read (it has {named}; there are {', '.join(SURFACES)}). "
            "Grey stands in for it",
        )
        return None

    def _finished(self, writer: Writer, surface: Surface, shading: Stage, displacing: Stage, uv) -> Made:
        name = self._files.shader(text_of(writer, surface, shading, displacing, uv))
        primvars = {usd: (primvar_name(usd), kind) for usd, kind in writer.primvars.items()}
        return Made(name, dict(writer.values), primvars, shines=any(part.emission for part in surface.parts()))
