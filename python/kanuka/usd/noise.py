"""MaterialX's noises, by those of the shading language: the same statistics, other numbers. (MaterialX hashes whole
numbers, which RSL does not have.)"""

from __future__ import annotations

from kanuka.looks.rsl import SIZES, Stage, Value, of_numbers

from .network import Evaluate, Node

# Makes ours as strong as MaterialX's, whose standard deviations are 0.319 and 0.265 (by the gradients and scales of its
# mx_noise.glsl).
STRENGTH = {2: 1.057, 3: 1.0}
LOOKUP = {2: "vector noise(xcomp({at}), ycomp({at}))", 3: "vector noise({at})"}

FRACTAL = """
vector mx_fractal%d(point at; float octaves; float lacunarity; float diminish) {
    vector sum = 0;
    float strength = 1, i;
    point p = at;
    for (i = 0; i < octaves; i += 1) {
        sum += strength * (2 * %s - vector(1, 1, 1));
        strength *= diminish;
        p *= lacunarity;
    }
    return sum;
}
"""

# Distances to the nearest three of points that lie one in each cell: Worley 1996, as MaterialX jitters them; and the
# nearest itself.
WORLEY = """
vector mx_worley(point at; float depth; float jitter; output point nearest) {
    float i, j, k;
    float first = 1e6, second = 1e6, third = 1e6;
    point cell = point(floor(xcomp(at)), floor(ycomp(at)), floor(zcomp(at)));
    for (k = -depth; k <= depth; k += 1)
        for (j = -1; j <= 1; j += 1)
            for (i = -1; i <= 1; i += 1) {
                point corner = cell + vector(i, j, k);
                vector inside = vector(0.5, 0.5, 0.5) + jitter * (vector cellnoise(corner) - vector(0.5, 0.5, 0.5));
                vector away = corner + inside - at;
                float square = xcomp(away) * xcomp(away) + ycomp(away) * ycomp(away);
                if (depth > 0)
                    square += zcomp(away) * zcomp(away);
                if (square < first) {
                    third = second;
                    second = first;
                    first = square;
                    nearest = corner + inside;
                } else if (square < second) {
                    third = second;
                    second = square;
                } else if (square < third) {
                    third = square;
                }
            }
    return vector(sqrt(first), sqrt(second), sqrt(third));
}
"""


def place(node: Node, stage: Stage, dimensions: int) -> str:
    """Where the noise is looked up, as a point."""
    writer = node.network.writer
    if dimensions == 2:
        st = node.value("texcoord", stage, "float2") or writer.primvar("st", "float2")
        return writer.let(stage, Value("vector", f"vector({st.text}, {st.second}, 0.5)")).text
    found = node.value("position", stage, "vector") or Value("vector", 'vector(transform("object", P))')
    return writer.let(stage, found).text


def number(node: Node, stage: Stage, name: str, default: float) -> str:
    found = node.value(name, stage, "float", default)
    assert found
    return found.text


def scaled(node: Node, output: str, stage: Stage, kind: str, noise: str) -> Value:
    """By an amplitude, which may be of several numbers; the fourth is another place's."""
    size, writer = SIZES[kind], node.network.writer
    amplitude = node.value("amplitude", stage, kind, 1.0)
    assert amplitude
    pivot = number(node, stage, "pivot", 0.0) if "noise" in node.identifier else "0"
    amplitude = writer.let(stage, amplitude)
    parts = [writer.let(stage, Value("vector", noise.format(shift="")))]
    if size == 4:
        parts.append(writer.let(stage, Value("vector", noise.format(shift=" + vector(37.3, 17.1, 11.9)"))))
    numbers = [(parts[i // 3].number(i % 3)) for i in range(size)]
    return of_numbers(kind, [f"{amplitude.number(i)} * {numbers[i]} + {pivot}" for i in range(size)])


def perlin(dimensions: int) -> Evaluate:
    def evaluate(node: Node, output: str, stage: Stage) -> Value | None:
        at = place(node, stage, dimensions)
        lookup = LOOKUP[dimensions].format(at=f"point({at}{{shift}})")
        noise = f"{STRENGTH[dimensions]:g} * (2 * {lookup} - vector(1, 1, 1))"
        return scaled(node, output, stage, node.kind(output), noise)

    return evaluate


def fractal(dimensions: int) -> Evaluate:
    def evaluate(node: Node, output: str, stage: Stage) -> Value | None:
        name = f"mx_fractal{dimensions}"
        node.network.writer.functions[name] = FRACTAL % (dimensions, LOOKUP[dimensions].format(at="p"))
        at = place(node, stage, dimensions)
        defaults = {"octaves": 3.0, "lacunarity": 2.0, "diminish": 0.5}
        texts = ", ".join(number(node, stage, each, default) for each, default in defaults.items())
        noise = f"{STRENGTH[dimensions]:g} * {name}(point({at}{{shift}}), {texts})"
        return scaled(node, output, stage, node.kind(output), noise)

    return evaluate


def cells(dimensions: int) -> Evaluate:
    def evaluate(node: Node, output: str, stage: Stage) -> Value | None:
        return Value("float", f"float cellnoise(point({place(node, stage, dimensions)}))")

    return evaluate


def worley(dimensions: int) -> Evaluate:
    """The nearest distances; of style 1, numbers that are the same all around a point."""

    def evaluate(node: Node, output: str, stage: Stage) -> Value | None:
        writer = node.network.writer
        writer.functions["mx_worley"] = WORLEY
        at, jitter = place(node, stage, dimensions), number(node, stage, "jitter", 1.0)
        nearest = writer.fresh()
        stage.lines.append(f"point {nearest} = 0;")
        call = f"mx_worley(point({at}), {0 if dimensions == 2 else 1}, {jitter}, {nearest})"
        found = writer.let(stage, Value("vector", call))
        if int(node.number("style", 0)) == 1:
            found = writer.let(stage, Value("vector", f"vector cellnoise({nearest})"))
        return found.to(node.kind(output))

    return evaluate


NODES: dict[str, Evaluate] = {
    "ND_noise2d": perlin(2),
    "ND_noise3d": perlin(3),
    "ND_fractal2d": fractal(2),
    "ND_fractal3d": fractal(3),
    "ND_cellnoise2d": cells(2),
    "ND_cellnoise3d": cells(3),
    "ND_worleynoise2d": worley(2),
    "ND_worleynoise3d": worley(3),
}
