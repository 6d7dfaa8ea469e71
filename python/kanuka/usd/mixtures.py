"""MaterialX's `mix` of surfaces: as its generated shaders have it, of what two surfaces send out, and of what they let
through:

    light     w a F + (1 - w) b B        w: the weight, F and B: the light of each; a and b: their opacities
    through   w (1 - a) + (1 - w) (1 - b)

So presence is w a + (1 - w) b, and of that w a is the foreground's.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TypeAlias

from kanuka.looks.rsl import Stage, Value
from kanuka.looks.surface import MOST_LOBES, Mixed, Surface, lobes_of

from .network import Node

Read: TypeAlias = "Callable[[Node, Stage, Stage], Surface | None]"

MIX = "ND_mix_surfaceshader"
DEEPEST = 8  # mixtures in one another: each has lobes of its own, of which there are not so many


def with_mixtures(surfaces: Mapping[str, Read]) -> dict[str, Read]:
    """With mixtures of these, and of mixtures."""
    known, on_the_way = dict(surfaces), list[object]()

    def mixture(node: Node, shading: Stage, displacing: Stage) -> Surface | None:
        if node.key in on_the_way or len(on_the_way) >= DEEPEST:
            why = "it runs in a circle" if node.key in on_the_way else "too many mixtures are in one another"
            node.network.tell(f"{node.network.material}: its network is cut at {node}: {why}")
            return None
        on_the_way.append(node.key)
        try:
            fg, bg = (part_of(node, name, known, shading, displacing) for name in ("fg", "bg"))
        finally:
            on_the_way.pop()
        return mixed(node, fg, bg, shading) if fg and bg else fg or bg

    known[MIX] = mixture
    return known


def part_of(node: Node, name: str, known: Mapping[str, Read], shading: Stage, displacing: Stage) -> Surface | None:
    """None: it is none that can be read, which is told."""
    network, source = node.network, node.source(name)
    if source is not None and source.identifier in known:
        return known[source.identifier](source, shading, displacing)
    what = f"{source} ({source.identifier}) is no surface that can be read" if source else "it has no surface"
    network.tell(f"{network.material}: {node}.inputs:{name}: {what}; the other one stands alone")
    return None


def mixed(node: Node, fg: Surface, bg: Surface, shading: Stage) -> Surface:
    network = node.network
    given = node.value("mix", shading, "float", 0.0)
    assert given
    weight = network.writer.let(shading, Value("float", f"clamp({given.text}, 0, 1)"))
    made = Surface(displacement=fg.displacement or bg.displacement, medium=fg.medium or bg.medium)
    if fg.medium and bg.medium and fg.medium != bg.medium:
        network.tell(f"{network.material}: {node}: a shape has one interior, that of the foreground")
    if fg.presence or bg.presence:
        a, b = (part.presence.to("float").text if part.presence else "1" for part in (fg, bg))
        front = network.writer.let(shading, Value("float", f"{weight.text} * {a}"))
        made.presence = network.writer.let(shading, Value("float", f"{front.text} + (1 - {weight.text}) * {b}"))
        weight = Value("float", f"({made.presence.text} > 0 ? {front.text} / {made.presence.text} : 0)")
    made.mixed = Mixed(fg, bg, network.writer.let(shading, weight))
    if fg.normal == bg.normal:
        made.normal = fg.normal
    elif any(part.normal and (part.transmission or part.translucence) for part in made.parts()):
        text = "what lets light through has the smooth normal: of parts that differ, lobes that reflect have their own"
        network.tell(f"{network.material}: {node}: {text}")
    if (count := lobes_of(made)) > MOST_LOBES:
        alone = fg if not node.connected("mix") and node.number("mix", 0.0) > 0.5 else bg
        name = "foreground" if alone is fg else "background"
        text = f"a mixture of {count} lobes is more than {MOST_LOBES}: its {name} stands alone"
        network.tell(f"{network.material}: {node}: {text}")
        return alone
    return made
