"""Random shader networks for the benchmarks and the tests of size: the same number of nodes and the same seed give the
same network, everywhere.

    python bench/shader_graphs.py 1000 -o graph1000.json       the network
    python bench/shader_graphs.py 1000 -o graph1000.sl         the shader made from it

The mixture is that of a look-development network: of a hundred nodes, twenty or so are patterns (half of those noises
of one octave, a few fractals, one with scattered points), the others mathematics, ramps and colours. Every node has a
part in the result: two lobes under a coat.
"""

from __future__ import annotations

import argparse
import random
from pathlib import Path

import kanuka
from kanuka.graph import NODE_TYPES, Node, ShaderGraph

# How often each type comes up.
WEIGHTS = {
    "noise": 8, "noise_color": 2, "fractal": 2, "turbulence": 1, "cells": 2, "cells_color": 1, "checker": 2,
    "bricks": 1,
    "voronoi": 1, "wave": 4, "warp": 2, "place": 3,
    "add": 8, "subtract": 5, "multiply": 10, "scale": 5, "minimum": 3, "maximum": 3, "mix": 14, "clamp": 5, "select": 3,
    "divide": 2, "power": 3, "absolute": 2, "invert": 3, "remap": 5, "smoothstep": 4,
    "ramp": 6, "hsv_adjust": 3, "contrast": 3, "luminance": 4, "component": 3, "combine_color": 3, "color_to_vector": 2,
    "distance": 2,
}  # fmt: skip
KINDS = ("float", "color", "point")
OPEN = 10  # outputs that nothing takes yet; beyond it nodes with several inputs come first


class _Maker:
    def __init__(self, count: int, seed: int) -> None:
        self.graph = ShaderGraph(f"random{count}")
        self.random = random.Random(seed).random  # the one method that is the same in every version
        self.count = count
        self.made: dict[str, list[Node]] = {kind: [] for kind in KINDS}
        self.open: dict[str, list[Node]] = {kind: [] for kind in KINDS}
        self.names = list(WEIGHTS)
        self.total = sum(WEIGHTS.values())

    def pick_type(self) -> str:
        x = self.random() * self.total
        for name in self.names:
            x -= WEIGHTS[name]
            if x < 0:
                return name
        return self.names[-1]

    def source(self, kind: str) -> Node | None:
        """What an input takes: the output that has waited longest, else one of the last forty."""
        kind = "point" if kind in ("vector", "normal") else kind
        waiting = self.open[kind]
        if waiting:
            return waiting.pop(0)
        made = self.made[kind][-40:]
        return made[int(self.random() * len(made))] if made else None

    def add(self, name: str, kind: str = "") -> Node:
        node_type = NODE_TYPES[name]
        generic = kind or ("color" if self.random() < 0.4 else "float")
        node = self.graph.add(name, f"{name}_{len(self.graph.nodes) + 1}")
        if any(i.type == "T" for i in node_type.inputs):
            node.as_type = generic
        for declared in node_type.inputs:
            wanted = generic if declared.type == "T" else declared.type
            if wanted == "string":
                continue
            first = declared is node_type.inputs[0] and wanted != "point"
            if (first or self.random() < 0.45) and (source := self.source(wanted)):
                self.graph.connect(source, node, declared.name)
            elif wanted == "float" and declared.name == "scale":
                self.graph.set(node, "scale", round(0.5 + 6 * self.random(), 3))
            elif wanted in ("float", "color"):
                shown = [round(0.1 + 0.8 * self.random(), 3) for _ in range(3)]
                if declared.name in ("octaves", "width", "height", "joint", "shift", "index", "angle"):
                    continue
                self.graph.set(node, declared.name, shown[0] if wanted == "float" else shown)
        output = generic if node_type.output == "T" else node_type.output
        output = "point" if output in ("vector", "normal") else output
        self.made[output].append(node)
        self.open[output].append(node)
        return node

    def join(self, kind: str) -> Node:
        """One node that takes two open ones."""
        a, b = self.open[kind].pop(0), self.open[kind].pop(0)
        node = self.graph.add("mix", f"join_{len(self.graph.nodes) + 1}", a=a, b=b)
        node.as_type = kind
        self.made[kind].append(node)
        self.open[kind].append(node)
        return node

    def waiting(self) -> int:
        return sum(map(len, self.open.values()))

    def run(self) -> ShaderGraph:
        last = 4  # matte, metal, glossy, and the coat are made at the end; one more joins matte and metal
        while len(self.graph.nodes) + self.waiting() + len(self.open["point"]) + last + 2 < self.count:
            many = [k for k in ("float", "color") if len(self.open[k]) > OPEN]
            if many:
                self.join(many[0])
            else:
                self.add(self.pick_type())
        for point in list(self.open["point"]):
            self.open["point"].remove(point)
            self.open["float"].append(self.graph.add("noise", f"end_{len(self.graph.nodes) + 1}", position=point))
        for kind in ("float", "color"):
            if not self.open[kind]:
                self.open[kind].append(self.graph.add("noise" if kind == "float" else "noise_color"))
            while len(self.open[kind]) > 1:
                self.join(kind)
        amount, tint = self.open["float"][0], self.open["color"][0]
        while len(self.graph.nodes) < self.count - 5:
            amount = self.graph.add("clamp", f"fill_{len(self.graph.nodes) + 1}", value=amount)
        paint = self.graph.add("matte", "paint", color=tint)
        flakes = self.graph.add("metal", "flakes", color=tint, roughness=amount)
        base = self.graph.add("layer_mix", "base", upper=flakes, lower=paint, weight=amount)
        varnish = self.graph.add("glossy", "varnish", roughness=amount)
        self.graph.surface = self.graph.add("layer_coat", "coated", upper=varnish, lower=base)
        return self.graph


def random_graph(count: int, seed: int = 1) -> ShaderGraph:
    """A network of `count` nodes, 10 at least."""
    return _Maker(max(count, 10), seed).run()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("count", type=int, metavar="NODES")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="FILE.json|FILE.sl")
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    graph = random_graph(arguments.count, arguments.seed)
    if arguments.output.suffix == ".sl":
        graph.save_shader(arguments.output)
    else:
        graph.save(arguments.output)
    print(f"kanuka {kanuka.__version__}: {len(graph.nodes)} nodes in {arguments.output}")


if __name__ == "__main__":
    main()
