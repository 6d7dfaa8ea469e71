"""MaterialX's hexagonal tiles: a picture three times at each place, in tiles that are turned, scaled and moved at
random (Mikkelsen, "Practical Real-Time Hex-Tiling", JCGT 2022). The numbers at random are others than MaterialX's."""

from __future__ import annotations

from kanuka.looks.colors import RAW
from kanuka.looks.rsl import SIZES, Stage, Value, of_numbers

from . import noise
from .network import Evaluate, Node, texture

# Of one of the three tiles around a place, `which` of 0, 1, 2: its share (before it is sharpened), its centre, and
# numbers at random. Triangles of the skewed lattice have a tile at each corner; shares are barycentric.
TILE = """
float mx_hextile(float s; float t; float which; output vector center; output vector random) {
    float x = 2 * sqrt(3) * (s - t / sqrt(3)), y = 4 * t, left = 1;
    float column = floor(x), row = floor(y), upper = 0, share;
    x -= column;
    y -= row;
    if (x + y >= 1) {
        upper = 1;
        x = 1 - x;
        y = 1 - y;
    }
    if (which == 0) {
        share = 1 - x - y;
        column += upper;
        row += upper;
    } else if (which == 1) {
        share = y;
        column += upper;
        row += 1 - upper;
    } else {
        share = x;
        column += 1 - upper;
        row += upper;
    }
    center = vector((column + 0.5 * row) / (2 * sqrt(3)), row / 4, 0);
    random = vector cellnoise(column + 0.5, row + 0.5);
    return share;
}
"""

# Schlick's gain (Graphics Gems IV).
GAIN = """
float mx_gain(float x; float r) {
    float bend = (1 / clamp(r, 0.001, 0.999) - 2) * (1 - 2 * x);
    return x < 0.5 ? x / (bend + 1) : (bend - x) / (bend - 1);
}
"""


class Tiles:
    """The three tiles at each place, as variables of a stage."""

    def __init__(self, node: Node, stage: Stage) -> None:
        self.node, self.stage, self.writer = node, stage, node.network.writer
        self.writer.functions |= {"mx_hextile": TILE, "mx_gain": GAIN}
        st = node.value("texcoord", stage, "float2") or self.writer.primvar("st", "float2")
        if (by := node.value("tiling", stage, "float2")) is not None:
            st = self.let("float2", f"{st.text} * {by.text}", f"{st.second} * {by.second}")
        self.st = self.let("float2", st.text, st.second)
        self.angles, self.shares, self.places = [], [], []
        across = [self.let("float2", f"{d}({self.st.text}) * {e}", f"{d}({self.st.second}) * {e}") for d, e in STEPS]
        for which in range(3):
            self.add(which, across)

    def let(self, kind: str, *texts: str) -> Value:
        return self.writer.let(self.stage, Value(kind, *texts))

    def range(self, name: str, random: str, low: float, high: float) -> str:
        """From the low end of a range to what the amount of it takes of the way."""
        ends = self.node.value(f"{name}range", self.stage, "float2", (low, high))
        assert ends
        amount = noise.number(self.node, self.stage, name, 1.0)
        return f"mix({ends.text}, {ends.second}, {random} * {amount})"

    def add(self, which: int, across: list[Value]) -> None:
        center, random = self.writer.fresh(), self.writer.fresh()
        self.stage.lines.append(f"vector {center} = 0, {random} = 0;")
        s, t = self.st.text, self.st.second
        self.shares.append(self.let("float", f"mx_hextile({s}, {t}, {which}, {center}, {random})").text)
        x, y = f"xcomp({random})", f"ycomp({random})"
        angle = self.let("float", f"radians({self.range('rotation', x, 0, 360)})").text
        self.angles.append(angle)
        ends = self.node.value("scalerange", self.stage, "float2", (0.5, 2.0))
        assert ends
        scaled = f"mix({ends.text}, {ends.second}, {y})"
        scale = self.let("float", f"mix(1, {scaled}, {noise.number(self.node, self.stage, 'scale', 1.0)})").text
        c = self.let("float", f"cos({angle}) / max({scale}, 1e-6)").text
        d = self.let("float", f"sin({angle}) / max({scale}, 1e-6)").text

        def turned(a: str, b: str) -> Value:
            return self.let("float2", f"({a}) * {c} - ({b}) * {d}", f"({a}) * {d} + ({b}) * {c}")

        at = turned(f"{s} - xcomp({center})", f"{t} - ycomp({center})")
        moved = [self.range("offset", each, 0, 1) for each in (x, y)]
        at = self.let(
            "float2", f"{at.text} + xcomp({center}) + {moved[0]}", f"{at.second} + ycomp({center}) + {moved[1]}"
        )
        # How far it is to the next vertices is said by four corners: they may lie in another tile.
        a, b = (turned(each.text, each.second) for each in across)
        self.places.append(
            tuple(
                tuple(
                    f"{m} {i} 0.5 * {p} {j} 0.5 * {q}"
                    for m, p, q in ((at.text, a.text, b.text), (at.second, a.second, b.second))
                )
                for i, j in ("--", "+-", "-+", "++")
            )
        )

    def weights(self, lightness: list[str] | None) -> list[str]:
        """Shares, sharpened, and those of lighter tiles more."""
        raw = [f"pow({share}, 7)" for share in self.shares]
        if lightness:
            raw = [f"max({light}, 0) * {share}" for light, share in zip(lightness, raw, strict=True)]
        raw = self.divided(raw)
        falloff = noise.number(self.node, self.stage, "falloff", 0.5)
        return self.divided([f"mx_gain({each}, {falloff})" for each in raw])

    def divided(self, parts: list[str]) -> list[str]:
        names = [self.let("float", each).text for each in parts]
        total = self.let("float", f"max({' + '.join(names)}, 1e-20)").text
        return [self.let("float", f"{each} / {total}").text for each in names]


STEPS = (("Du", "du"), ("Dv", "dv"))


def image(node: Node, output: str, stage: Stage) -> Value | None:
    kind, file = node.kind(output), node.file("file")
    if not file:
        return node.value("default", stage, kind, 0.0)
    tiles = Tiles(node, stage)
    network, space = node.network, node.lookup("file", file, kind)
    looks = [texture(network, stage, file, each, "periodic", space, None) for each in tiles.places]
    coefficients = node.value("lumacoeffs", stage, "vector", (0.2722287, 0.6740818, 0.0536895))
    contrast = noise.number(node, stage, "falloffcontrast", 0.5)
    assert coefficients
    light = [f"mix(1, {each.to('vector').text} . {coefficients.text}, {contrast})" for each in looks]
    weights = tiles.weights(light)
    rgb = [
        " + ".join(f"{w} * {look.number(i)}" for w, look in zip(weights, looks, strict=True))
        for i in range(min(SIZES[kind], 3))
    ]
    if kind == "color4":
        alphas = [texture(network, stage, file, each, "periodic", space, 3, fill=1) for each in tiles.places]
        plain = tiles.weights(None)
        rgb.append(" + ".join(f"{w} * {a.text}" for w, a in zip(plain, alphas, strict=True)))
    return of_numbers(kind, rgb)


def normal_map(node: Node, output: str, stage: Stage) -> Value | None:
    """In tangent space as all normal maps are here (patterns.py). Slopes are turned back and added by their weights."""
    file = node.file("file")
    node.network.normal_maps += 1
    if not file:
        return Value("vector", "vector(0, 0, 1)")
    tiles, network = Tiles(node, stage), node.network
    strength = noise.number(node, stage, "strength", 1.0)
    flip = -1 if node.number("flip_g", 0) else 1
    slopes = []
    for angle, corners in zip(tiles.angles, tiles.places, strict=True):
        look = texture(network, stage, file, corners, "periodic", RAW, None).to("vector").text
        v = tiles.let("vector", f"2 * {look} - vector(1, 1, 1)").text
        x, y = f"{strength} * xcomp({v})", f"{flip} * {strength} * ycomp({v})"
        up = f"max(zcomp({v}), 1e-3)"
        slopes.append(
            tiles.let(
                "float2",
                f"(({x}) * cos({angle}) + ({y}) * sin({angle})) / {up}",
                f"(({y}) * cos({angle}) - ({x}) * sin({angle})) / {up}",
            )
        )
    weights = tiles.weights(None)
    sums = [" + ".join(f"{w} * {s.number(i)}" for w, s in zip(weights, slopes, strict=True)) for i in range(2)]
    return Value("vector", f"normalize(vector({sums[0]}, {sums[1]}, 1))")


NODES: dict[str, Evaluate] = {"ND_hextiledimage": image, "ND_hextilednormalmap": normal_map}
