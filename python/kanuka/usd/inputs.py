"""A surface's inputs, and what MaterialX's dialects make of them alike: widths of slopes, films, interiors, normals."""

from __future__ import annotations

import math
from dataclasses import dataclass

from kanuka.looks.rsl import Stage, Value
from kanuka.looks.surface import Medium, Normal, Surface

from .network import Node


class Inputs:
    """A surface's inputs in one stage, with whether they are used."""

    def __init__(self, node: Node, stage: Stage) -> None:
        self.node, self.stage, self.writer = node, stage, node.network.writer

    def __call__(self, name: str, kind: str, default) -> Value:
        value = self.node.value(name, self.stage, kind, default)
        assert value is not None
        return value

    def used(self, name: str, unused: float = 0) -> bool:
        if self.node.connected(name):
            return True
        value = self.node.constant(name, unused)
        return any(float(x) != unused for x in (value if hasattr(value, "__len__") else (value,)))

    def let(self, kind: str, text: str) -> Value:
        return self.writer.let(self.stage, Value(kind, text))

    def product(self, weight: str, color: str, weights: float, colors: tuple[float, float, float]) -> Value:
        return self.let("color", f"{self(weight, 'float', weights).text} * {self(color, 'color', colors).text}")

    def mixed(self, made: Value, weight: str, color: str, colors: tuple[float, float, float]) -> Value:
        """`made`, or the colour, by its weight."""
        if not self.used(weight):
            return made
        return self.let(
            "color", f"mix({made.text}, {self(color, 'color', colors).text}, {self(weight, 'float', 0).text})"
        )

    def told(self, text: str) -> None:
        network = self.node.network
        network.say("warning", f"{network.material}: {text}")


@dataclass(frozen=True)
class Stretch:
    """How a dialect stretches slopes: `aspect` of its anisotropy {a} is the width across the tangent by that along it,
    `wide` the factor of the roughness whose square is the one along it."""

    aspect: str
    wide: str

    def of(self, get: Inputs, a: Value, roughness: Value) -> tuple[Value, Value]:
        """The roughness along the tangent, and the anisotropy as lobes have it (stretched_width() of bsdf/)."""
        narrow = get.let("float", self.aspect.format(a=a.text)).text
        along = get.let("float", f"min(1, {roughness.text} * {self.wide.format(aspect=narrow)})")
        return along, get.let("float", f"min(1, (1 - {narrow}) / 0.95)")


def turned(get: Inputs, turns: str) -> Value:
    """Our grooves run where slopes are few: across the tangent, a quarter of a turn from it."""
    return Value("float", f"0.25 + {get(turns, 'float', 0.0).text if turns else '0'}")


def stretched(get: Inputs, made: Surface, anisotropy: str, turns: str, tangent: str, stretch: Stretch) -> None:
    """Of gloss, metal and glass."""
    if not get.used(anisotropy):
        return
    a, base = get(anisotropy, "float", 0.0), made.roughness
    assert base
    made.roughness, made.anisotropy = stretch.of(get, a, base)
    if made.transmission_roughness:
        made.transmission_roughness, _ = stretch.of(get, a, made.transmission_roughness)
    made.rotation, made.tangent = turned(get, turns), tangent_of(get, tangent)


def stretched_coat(get: Inputs, made: Surface, anisotropy: str, turns: str, tangent: str, stretch: Stretch) -> None:
    if not get.used(anisotropy):
        return
    assert made.coat_roughness
    a = get(anisotropy, "float", 0.0)
    made.coat_roughness, made.coat_anisotropy = stretch.of(get, a, made.coat_roughness)
    made.coat_rotation, made.coat_tangent = turned(get, turns), tangent_of(get, tangent)


def tangent_of(get: Inputs, tangent: str) -> Value | None:
    """A tangent of the material's own, which is in world space; None = that of the texture coordinates."""
    if not get.node.connected(tangent):
        return None
    found = get.node.value(tangent, get.stage, "vector")
    if found is None:
        return None
    return get.let("vector", f'vtransform("world", "current", {get.node.network.in_world(found.text)})')


def medium(get: Inputs, ior: str) -> Medium | None:
    """Where there is a depth, the transmitted colour is that of a medium, at that depth (OpenPBR, section 3.6.3)."""
    node = get.node
    if not get.used("transmission_depth"):
        return None
    wanted = (
        "transmission_depth",
        "transmission_color",
        "transmission_scatter",
        "transmission_scatter_anisotropy",
        ior,
    )
    if varying := [name for name in wanted if node.connected(name)]:
        network = node.network
        network.say(
            "warning", f"{network.material}: {', '.join(varying)}: a medium is the same everywhere; none is made"
        )
        return None
    depth = node.number("transmission_depth", 0.0)
    if not depth > 0:
        return None
    color, scatter = (
        node.numbers(name, default)
        for name, default in (("transmission_color", (1, 1, 1)), ("transmission_scatter", (0, 0, 0)))
    )
    scattering = tuple(max(x, 0.0) / depth for x in scatter)
    absorption = [-math.log(min(max(c, 1e-6), 1.0)) / depth - s for c, s in zip(color, scattering, strict=True)]
    least = min(0.0, *absorption)
    cosine = node.number("transmission_scatter_anisotropy", 0.0)
    return Medium(node.number(ior, 1.5), tuple(a - least for a in absorption), scattering, cosine)


def bent(get: Inputs, made: Surface, normal: str, coat_normal: str, displacing: Stage) -> None:
    made.normal = normal_of(get.node, normal, displacing)
    made.coat_normal = normal_of(get.node, coat_normal, displacing) if made.coat and coat_normal else None


def normal_of(node: Node, name: str, displacing: Stage) -> Normal | None:
    """A network with a normal map in it is taken for one in tangent space."""
    if not node.connected(name):
        return None
    network = node.network
    before = network.normal_maps
    found = node.value(name, displacing, "vector")
    if found is None:
        return None
    if network.normal_maps > before:
        network.tangential.add(found.text)  # it may be asked for again, by another input
    if found.text in network.tangential:
        return Normal(found)
    return Normal(network.writer.let(displacing, Value("vector", network.in_world(found.text))), is_world=True)
