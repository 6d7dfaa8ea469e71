"""MaterialX's blackbody: the colour of a glowing body by its temperature, of luminance 1."""

from __future__ import annotations

import numpy as np

from kanuka.looks.colors import PRIMARIES, RENDERED, times, xyz_from
from kanuka.looks.rsl import Stage, Value

from .network import Node

# The chromaticity of the Planckian locus by cubics, from 1667 to 25000 K (Kang et al., "Design of advanced color
# temperature control system for HDTV applications", 2002); a little below too, as MaterialX has it.
LOCUS = """
color mx_blackbody(float kelvin) {
    float t = 1000 / clamp(kelvin, 800, 25000), x, y;
    if (t > 0.25)
        x = 0.179910 + t * (0.8776956 - t * (0.2343580 + t * 0.2661239));
    else
        x = 0.240390 + t * (0.2226347 + t * (2.1070379 - t * 3.0258469));
    if (t > 1000 / 2222)
        y = -0.20219683 + x * (2.18555832 - x * (1.34811020 + x * 1.1063814));
    else if (t > 0.25)
        y = -0.16748867 + x * (2.09137015 - x * (1.37418593 + x * 0.9549476));
    else
        y = -0.37001483 + x * (3.75112997 - x * (5.87338670 - x * 3.0817580));
    color c = color(x / y, 1, (1 - x - y) / y);
    return max(%s, color(0));
}
"""


def blackbody(node: Node, output: str, stage: Stage) -> Value | None:
    network = node.network
    space = PRIMARIES[RENDERED[network.spaces.rendered]]
    network.writer.functions["mx_blackbody"] = LOCUS % times(np.linalg.inv(xyz_from(space)))
    kelvin = node.value("temperature", stage, "float", 5000.0)
    assert kelvin
    return Value("color", f"mx_blackbody({kelvin.text})").to(node.kind(output))


NODES = {"ND_blackbody": blackbody}
