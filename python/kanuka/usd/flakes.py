"""MaterialX's flakes: cubes in a lattice, some of its cells each with one, turned at random, of which the foremost is
seen. Cells, sizes and slopes are those of MaterialX, the numbers at random are others."""

from __future__ import annotations

from kanuka.looks.rsl import Stage, Value

from . import noise
from .network import Evaluate, Node, geometry

# The cell whose flake is seen, and how far in front it is; 0 = there is none. Half a cube's side is 1.5 / sqrt(3) of a
# cell's, so that it keeps within its neighbours however it is turned: by a quaternion, uniformly (Shoemake, "Uniform
# Random Rotations", Graphics Gems III).
FLAKE = """
point mx_flake(point at; float share; output float presence) {
    float i, j, k;
    point cell = point(floor(xcomp(at)), floor(ycomp(at)), floor(zcomp(at))), found = cell;
    presence = 0;
    for (k = -1; k <= 1; k += 1)
        for (j = -1; j <= 1; j += 1)
            for (i = -1; i <= 1; i += 1) {
                point corner = cell + vector(i, j, k);
                vector given = vector cellnoise(corner, 1);
                if (xcomp(given) < share && ycomp(given) > presence) {
                    vector turn = vector cellnoise(corner, 2);
                    float less = sqrt(1 - xcomp(turn)), more = sqrt(xcomp(turn));
                    float a = 2 * PI * ycomp(turn), b = 2 * PI * zcomp(turn);
                    vector axis = vector(less * sin(a), less * cos(a), more * sin(b));
                    vector from = vector(at - corner) - vector(0.5, 0.5, 0.5);
                    vector to = from + 2 * (axis ^ ((axis ^ from) + more * cos(b) * from));
                    if (max(abs(xcomp(to)), abs(ycomp(to)), abs(zcomp(to))) <= 0.8660254) {
                        presence = ycomp(given);
                        found = corner;
                    }
                }
            }
    return found;
}
"""


def flake(dimensions: int) -> Evaluate:
    def evaluate(node: Node, output: str, stage: Stage) -> Value | None:
        cell, presence = seen(node, stage, dimensions)
        if output == "presence":
            return Value("float", presence)
        if output in ("rand", "id"):
            scale = "floor(16777215 * {})" if output == "id" else "{}"  # whole numbers that floats have
            return Value("float", f"({presence} > 0 ? {scale.format(f'float cellnoise({cell}, 3)')} : 0)")
        return normal(node, stage, cell, presence)

    return evaluate


def seen(node: Node, stage: Stage, dimensions: int) -> tuple[str, str]:
    """Variables of the flake's cell and of its presence, once for all outputs."""
    key = ("flake", node.key)
    if key not in stage.known:
        writer = node.network.writer
        writer.functions["mx_flake"] = FLAKE
        at = noise.place(node, stage, dimensions)
        at = f"{at} - vector(0, 0, 0.5)" if dimensions == 2 else at
        size, coverage = noise.number(node, stage, "size", 0.01), noise.number(node, stage, "coverage", 0.5)
        cell, presence = writer.fresh(), writer.fresh()
        # Cubes that cover a place are 3 sqrt(3) cells on average, and do so independently.
        share = f"1 - pow(1 - clamp({coverage}, 0, 1), {27**-0.5:.9g})"
        stage.lines += [
            f"float {presence} = 0;",
            f"point {cell} = mx_flake(point(({at}) / max({size}, 1e-9)), {share}, {presence});",
        ]
        stage.known[key] = Value("float2", cell, presence)
    found = stage.known[key]
    return found.text, found.second


def normal(node: Node, stage: Stage, cell: str, presence: str) -> Value:
    """With GGX's slopes, as wide as the square of the roughness (Walter et al. 2007, equation 35)."""
    let = node.network.writer.let
    frame = []
    for name, default in (("normal", "Nworld"), ("tangent", "Tworld"), ("bitangent", "Bworld")):
        found = node.value(name, stage, "vector") or geometry(node.network, default, stage)
        assert found
        frame.append(let(stage, found).text)
    n, t, b = frame
    rough = noise.number(node, stage, "roughness", 0.1)
    x = let(stage, Value("vector", f"vector cellnoise({cell}, 4)")).text
    slope = let(stage, Value("float", f"{rough} * {rough} * sqrt(xcomp({x}) / max(1 - xcomp({x}), 1e-6))")).text
    around = f"cos(2 * PI * ycomp({x})) * {t} + sin(2 * PI * ycomp({x})) * {b}"
    return Value("vector", f"({presence} > 0 ? normalize({n} + {slope} * ({around})) : {n})")


NODES: dict[str, Evaluate] = {"ND_flake2d": flake(2), "ND_flake3d": flake(3)}
