"""The node types: inputs, output, what they do, and the RSL function each of them calls. docs/graph.md is made from it.

An input's default is a value, or one of the surface's own quantities by name ("@P", "@N", "@st"). Type "T" stands for
float, color or vector, whichever the connections ask for; "T" in a function's text is replaced by it.
"""

# ruff: noqa: E501 - a table

from __future__ import annotations

from dataclasses import dataclass

Value = float | tuple[float, float, float] | str

# What unconnected inputs may stand for: name -> (type, RSL expression, what it is).
SURFACE = {
    "@P": ("point", 'transform("shader", P)', "the surface's point, in shader space"),
    "@N": ("normal", "normalize(N)", "the surface's unit normal"),
    "@st": ("point", "point(s, t, 0)", "the texture coordinates, as a point"),
}


@dataclass(frozen=True)
class Input:
    type: str
    name: str
    default: Value | None  # None: must be connected
    doc: str


@dataclass(frozen=True)
class NodeType:
    name: str
    category: str
    doc: str
    output: str  # a type, "T", "material" or "displacement"
    inputs: tuple[Input, ...]
    body: str = ""  # of the function; an input called "color" is "tint" there, since color is a word of RSL
    lobe: tuple[str, tuple[str, ...]] | None = None  # the lobe, and which of its inputs take ours, after the weight
    layer: str = ""  # AddLayer's operator
    varying: bool = False  # its parameters may be bound to primvars that vary

    def input(self, name: str) -> Input | None:
        return next((i for i in self.inputs if i.name == name), None)


def _inputs(text: str) -> tuple[Input, ...]:
    """Lines of `type name = default: what it is`."""
    inputs = []
    for line in filter(None, map(str.strip, text.splitlines())):
        head, _, doc = line.partition(": ")
        declared, _, given = head.partition(" = ")
        kind, name = declared.split()
        default: Value | None = None
        if given.startswith('"'):
            default = given.strip('"')
        elif given.startswith("@"):
            default = given
        elif given:
            numbers = tuple(map(float, given.split()))
            default = numbers[0] if kind in ("float", "T") else numbers * 3 if len(numbers) == 1 else numbers
        inputs.append(Input(kind, name, default, doc))
    return tuple(inputs)


_TABLE: list[NodeType] = []


def _node(category: str, output: str, name: str, doc: str, inputs: str = "", body: str = "", **keywords) -> None:
    _TABLE.append(NodeType(name, category, doc, output, _inputs(inputs), body.strip("\n"), **keywords))


_PLACED = "point position = @P: where\nfloat scale = 1: cells per unit\n"

# ---- constants -------------------------------------------------------------------------------------------------------

_node("Constants", "float", "value", "a number, which a primvar may set", "float value = 0: the number", "    return value;",
      varying=True)  # fmt: skip
_node("Constants", "color", "color", "a colour, which a primvar may set", "color value = 1: the colour", "    return value;",
      varying=True)  # fmt: skip

# ---- the surface -----------------------------------------------------------------------------------------------------

_node("Surface", "point", "position", "the surface's point in a space",
      'string space = "shader": shader, object, world, camera or a CoordinateSystem',
      "    return transform(space, P);")  # fmt: skip
_node("Surface", "normal", "normal", "the surface's unit normal in a space",
      'string space = "shader": as for position',
      "    return normalize(ntransform(space, N));")  # fmt: skip
_node("Surface", "point", "texcoord", "texture coordinates, turned, scaled and moved",
      """float scaleS = 1: times s
      float scaleT = 1: times t
      float offsetS = 0: added to s
      float offsetT = 0: added to t
      float angle = 0: degrees, about the middle""",
      """
    float c = cos(radians(angle)), d = sin(radians(angle));
    float x = s - 0.5, y = t - 0.5;
    return point(scaleS * (c * x - d * y + 0.5) + offsetS, scaleT * (d * x + c * y + 0.5) + offsetT, 0);
""")  # fmt: skip
_node("Surface", "color", "texture", "a picture",
      """string file = "": the picture; none is mid-grey
      point position = @st: where, by its first two components
      float blur = 0: part of the picture
      float width = 1: of the filter""",
      "    return color texture(file, xcomp(position), ycomp(position), \"blur\", blur, \"width\", width);")  # fmt: skip
_node("Surface", "float", "texture_float", "the first channel of a picture: heights, masks, roughness",
      """string file = "": the picture; none is mid-grey
      point position = @st: where, by its first two components
      float blur = 0: part of the picture
      float width = 1: of the filter""",
      "    return float texture(file, xcomp(position), ycomp(position), \"blur\", blur, \"width\", width);")  # fmt: skip

# ---- patterns --------------------------------------------------------------------------------------------------------

_node("Patterns", "float", "noise", "gradient noise in [0, 1]", _PLACED, "    return float noise(position * scale);")
_node(
    "Patterns", "color", "noise_color", "three independent noises", _PLACED, "    return color noise(position * scale);"
)
_FRACTAL = (
    _PLACED
    + """float octaves = 4: levels of detail, at most 16
    float gain = 0.5: amplitude of a level by that of the one before
    float lacunarity = 2.03: frequency of a level by that of the one before"""
)
_LEVELS = """
    point p = position * scale;
    float sum = 0, total = 0, amplitude = 1, i;
    for (i = 0; i < min(octaves, 16); i += 1) {
        sum += amplitude * LEVEL;
        total += amplitude;
        amplitude *= gain;
        p = p * lacunarity + vector(13.7, 5.1, 9.3);
    }
    return total > 0 ? sum / total : 0;
"""
_node(
    "Patterns", "float", "fractal", "a sum of noises, in [0, 1]", _FRACTAL, _LEVELS.replace("LEVEL", "float noise(p)")
)
_node("Patterns", "float", "turbulence", "a sum of folded noises, in [0, 1]: billows", _FRACTAL,
      _LEVELS.replace("LEVEL", "abs(2 * float noise(p) - 1)"))  # fmt: skip
_node("Patterns", "float", "ridges", "a sum of folded noises turned over, in [0, 1]: crests", _FRACTAL,
      _LEVELS.replace("LEVEL", "(1 - abs(2 * float noise(p) - 1))"))  # fmt: skip
_node("Patterns", "float", "cells", "a random number for each unit cube", _PLACED,
      "    return float cellnoise(position * scale);")  # fmt: skip
_node("Patterns", "color", "cells_color", "a random colour for each unit cube", _PLACED,
      "    return color cellnoise(position * scale);")  # fmt: skip
_VORONOI = _PLACED + "float jitter = 1: 0 = a regular lattice"
_NEIGHBOURS = """
    point p = position * scale;
    point middle = floor(p) + vector(0.5, 0.5, 0.5);
    FIRST
    float i, j, k;
    for (i = -1; i <= 1; i += 1)
        for (j = -1; j <= 1; j += 1)
            for (k = -1; k <= 1; k += 1) {
                point cell = middle + vector(i, j, k);
                vector away = cell + jitter * (vector cellnoise(cell) - vector(0.5, 0.5, 0.5)) - p;
                float d = away . away;
                STEP
            }
    return RESULT;
"""


def _voronoi(name: str, output: str, doc: str, first: str, step: str, result: str) -> None:
    body = _NEIGHBOURS.replace("FIRST", first).replace("STEP", step).replace("RESULT", result)
    _node("Patterns", output, name, doc, _VORONOI, body)


_voronoi("voronoi", "float", "distance to the nearest of scattered points", "float nearest = 1e6;",
         "nearest = min(nearest, d);", "sqrt(nearest)")  # fmt: skip
_voronoi("voronoi_border", "float", "0 on the borders between scattered points, rising inwards",
         "float nearest = 1e6, second = 1e6;",
         "second = min(second, max(nearest, d));\n                nearest = min(nearest, d);",
         "sqrt(second) - sqrt(nearest)")  # fmt: skip
_voronoi("voronoi_color", "color", "a random colour around each of scattered points",
         "float nearest = 1e6;\n    point owner = middle;",
         "if (d < nearest) {\n                    nearest = d;\n                    owner = cell;\n                }",
         "color cellnoise(owner + vector(57, 113, 271))")  # fmt: skip
_node("Patterns", "float", "checker", "0 and 1 by turns", _PLACED,
      """
    point p = position * scale;
    return mod(floor(xcomp(p) + 1e-4) + floor(ycomp(p) + 1e-4) + floor(zcomp(p) + 1e-4), 2);
""")  # fmt: skip
_node("Patterns", "float", "bricks", "1 on bricks, 0 in the joints, over the first two components",
      """point position = @st: where
      float width = 0.2: of a brick, with its joint
      float height = 0.1: likewise
      float joint = 0.01: width of the joints
      float shift = 0.5: of every second row, in bricks""",
      """
    float row = floor(ycomp(position) / height);
    float x = mod(xcomp(position) + shift * width * mod(row, 2), width);
    float y = mod(ycomp(position), height);
    float inside = min(min(x, width - x), min(y, height - y)) - 0.5 * joint;
    return smoothstep(0, 0.25 * joint, inside);
""")  # fmt: skip
_node("Patterns", "float", "wave", "a sine of the value, in [0, 1]",
      """float value = 0: what it is a sine of
      float frequency = 1: waves per unit of the value
      float phase = 0: in waves""",
      "    return 0.5 + 0.5 * sin(2 * PI * (value * frequency + phase));")  # fmt: skip
_node("Patterns", "point", "warp", "a point pushed about by noise",
      _PLACED + "float amount = 0.2: how far, in the point's units",
      "    return position + amount * (2 * vector noise(position * scale) - vector(1, 1, 1));")  # fmt: skip
_node("Patterns", "point", "place", "a point scaled, then moved",
      """point position = @P: what
      vector scale = 1: of each component
      vector offset = 0: added""",
      """
    return point(xcomp(position) * xcomp(scale), ycomp(position) * ycomp(scale), zcomp(position) * zcomp(scale)) + offset;
""")  # fmt: skip

# ---- mathematics -----------------------------------------------------------------------------------------------------

_TWO = "T a = {0}: first\nT b = {1}: second"


def _binary(name: str, doc: str, expression: str, a: float, b: float) -> None:
    _node("Mathematics", "T", name, doc, _TWO.format(a, b), f"    return {expression};")


_binary("add", "a + b", "a + b", 0, 0)
_binary("subtract", "a - b", "a - b", 0, 0)
_node("Mathematics", "T", "multiply", "a · b, each component by its own", _TWO.format(1, 1), "    return PRODUCT;")
_node("Mathematics", "T", "scale", "a times a number", "T a = 1: what\nfloat by = 1: the number", "    return a * by;")
_binary("minimum", "the smaller of a and b, in each component", "min(a, b)", 0, 0)
_binary("maximum", "the larger of a and b, in each component", "max(a, b)", 0, 0)
_node("Mathematics", "T", "mix", "a where the amount is 0, b where it is 1",
      _TWO.format(0, 1) + "\nfloat amount = 0.5: of b", "    return mix(a, b, amount);")  # fmt: skip
_node("Mathematics", "T", "clamp", "the value, held within bounds",
      "T value = 0: what\nT low = 0: lower bound\nT high = 1: upper bound", "    return clamp(value, low, high);")  # fmt: skip
_node("Mathematics", "T", "select", "one of two, by a comparison",
      """float a = 0: compared
      float b = 0: with this
      T less = 0: where a < b
      T otherwise = 1: elsewhere""",
      "    return a < b ? less : otherwise;")  # fmt: skip
_node("Mathematics", "float", "divide", "a / b; 0 where b is 0", "float a = 1: what\nfloat b = 1: by this",
      "    return b == 0 ? 0 : a / b;")  # fmt: skip
_node("Mathematics", "float", "power", "the value to an exponent; negative values count as 0",
      "float value = 1: what\nfloat exponent = 2: to this", "    return pow(max(value, 0), exponent);")  # fmt: skip
_node("Mathematics", "float", "modulo", "what division leaves, from 0 up to b",
      "float a = 0: what\nfloat b = 1: by this", "    return mod(a, b);")  # fmt: skip
_node(
    "Mathematics", "float", "absolute", "the value without its sign", "float value = 0: what", "    return abs(value);"
)
_node("Mathematics", "float", "invert", "1 - value", "float value = 0: what", "    return 1 - value;")
_node("Mathematics", "float", "remap", "one range to another, and on beyond it",
      """float value = 0: what
      float inLow = 0: becomes outLow
      float inHigh = 1: becomes outHigh
      float outLow = 0: from inLow
      float outHigh = 1: from inHigh""",
      """
    float span = inHigh - inLow;
    return outLow + (outHigh - outLow) * (span == 0 ? 0 : (value - inLow) / span);
""")  # fmt: skip
_node("Mathematics", "float", "smoothstep", "0 up to low, 1 from high on, smooth between them",
      "float value = 0: what\nfloat low = 0: lower end\nfloat high = 1: upper end",
      "    return smoothstep(low, high, value);")  # fmt: skip

# ---- colours and vectors ---------------------------------------------------------------------------------------------

_node("Colours and vectors", "color", "ramp", "through three colours",
      """float value = 0: 0 to 1
      color low = 0: at 0
      color middle = 0.5: between
      color high = 1: at 1
      float centre = 0.5: where the middle one is""",
      """
    float c = clamp(centre, 1e-3, 1 - 1e-3), x = clamp(value, 0, 1);
    return x < c ? mix(low, middle, x / c) : mix(middle, high, (x - c) / (1 - c));
""")  # fmt: skip
_node("Colours and vectors", "color", "hsv_adjust", "hue turned, saturation and value multiplied",
      """color color = 1: what
      float hue = 0: turns
      float saturation = 1: times
      float value = 1: times""",
      """
    color hsv = ctransform("hsv", tint);
    return ctransform("hsv", "rgb", color(mod(comp(hsv, 0) + hue, 1), clamp(comp(hsv, 1) * saturation, 0, 1),
                                          comp(hsv, 2) * value));
""")  # fmt: skip
_node("Colours and vectors", "color", "contrast", "away from a pivot",
      """color color = 1: what
      float amount = 1: 0 = all pivot, 1 = unchanged
      float pivot = 0.18: what stays""",
      "    return max(color(0), color(pivot) + amount * (tint - color(pivot)));")  # fmt: skip
_node(
    "Colours and vectors", "float", "luminance", "of a colour", "color color = 1: what", "    return luminance(tint);"
)
_node("Colours and vectors", "float", "component", "one component of a point, vector or colour",
      "vector value = 0: what\nfloat index = 0: 0, 1 or 2",
      "    return index < 0.5 ? xcomp(value) : index < 1.5 ? ycomp(value) : zcomp(value);")  # fmt: skip
_node("Colours and vectors", "color", "combine_color", "a colour of three numbers",
      "float red = 0: first\nfloat green = 0: second\nfloat blue = 0: third", "    return color(red, green, blue);")  # fmt: skip
_node("Colours and vectors", "vector", "combine_vector", "a vector of three numbers",
      "float x = 0: first\nfloat y = 0: second\nfloat z = 0: third", "    return vector(x, y, z);")  # fmt: skip
_node("Colours and vectors", "vector", "color_to_vector", "a colour's components as a vector", "color color = 0: what",
      "    return vector(comp(tint, 0), comp(tint, 1), comp(tint, 2));")  # fmt: skip
_node("Colours and vectors", "color", "vector_to_color", "a vector's components as a colour", "vector value = 0: what",
      "    return color(xcomp(value), ycomp(value), zcomp(value));")  # fmt: skip
_node("Colours and vectors", "float", "dot", "product of two vectors, a number", "vector a = 0: first\nvector b = 0: second",
      "    return a . b;")  # fmt: skip
_node("Colours and vectors", "vector", "cross", "product of two vectors, a vector upright on both",
      "vector a = 0: first\nvector b = 0: second", "    return a ^ b;")  # fmt: skip
_node("Colours and vectors", "vector", "normalize", "a vector of length 1", "vector value = @N: what",
      "    return normalize(value);")  # fmt: skip
_node("Colours and vectors", "float", "length", "of a vector", "vector value = 0: what", "    return length(value);")
_node("Colours and vectors", "float", "distance", "of two points", "point a = @P: first\npoint b = 0: second",
      "    return distance(a, b);")  # fmt: skip

# ---- materials -------------------------------------------------------------------------------------------------------

_WEIGHT = "float weight = 1: how much of it\n"


def _lobe(name: str, doc: str, lobe: str, inputs: str, takes: tuple[str, ...]) -> None:
    _node("Materials", "material", name, doc, _WEIGHT + inputs, lobe=(lobe, takes))


_lobe("matte", "light scattered alike in all directions", "LambertBrdf", "color color = 0.5: reflectance",
      ("diffuseReflectance",))  # fmt: skip
_lobe("translucent", "light let through and scattered", "LambertBtdf", "color color = 0.5: transmittance",
      ("diffuseTransmittance",))  # fmt: skip
_lobe("glossy", "reflection of a dielectric: polish, varnish, skin of plastics; under it goes a coat's lower",
      "MicrofacetDielectricBrdf",
      """color color = 1: tint of the reflection
      float ior = 1.5: index of refraction
      float roughness = 0.1: perceptual""",
      ("reflectance", "ior", "roughness"))  # fmt: skip
_lobe("varnish", "a clear or tinted layer of some thickness: the upper of layer_thick", "MicrofacetDielectricBrdf",
      """float ior = 1.5: index of refraction
      float roughness = 0: perceptual
      float thickness = 1: of the layer, mm
      color absorption = 0: of light on its way through the layer, 1/mm""",
      ("ior", "roughness", "thickness", "absorption"))  # fmt: skip
_lobe("metal", "reflection of a metal", "MicrofacetConductorBrdf",
      """color color = 0.9: reflectance seen straight on
      color edge = 1: reflectance at grazing angles
      float roughness = 0.2: perceptual""",
      ("reflectance", "edgeReflectance", "roughness"))  # fmt: skip
_lobe("glass", "a dielectric's surface that reflects and refracts", "MicrosurfaceDielectricBsdfRgb_v1",
      """color color = 1: tint of what passes
      color reflection = 1: tint of what is reflected
      color roughness = 0: perceptual
      float ior = 1.5: index of refraction
      float abbe = 0: Abbe number; 0 = no dispersion""",
      ("transmittance", "reflectance", "roughness", "ior", "abbe"))  # fmt: skip
_lobe("emission", "light given off, alike in all directions", "DiffuseEmission", "color color = 1: radiance, W/(sr m²)",
      ("radiance",))  # fmt: skip
_lobe("emission_cone", "light given off within a cone about the normal", "ConeEmission",
      """color color = 1: radiance within the cone, W/(sr m²)
      float angle = 45: from the normal to the cone's edge, degrees
      float softness = 0.2: of the edge""",
      ("radiance", "angle", "softness"))  # fmt: skip
_lobe("emission_profile", "light given off with a power of the cosine to the normal", "ProfileEmission",
      """color color = 1: radiance along the normal, W/(sr m²)
      float exponent = 1: more is narrower""",
      ("radiance", "exponent"))  # fmt: skip

_LAYER = "material upper: what lies on top\nmaterial lower: what lies below\nfloat weight = {0}: {1}"
_node("Layers", "material", "layer_mix", "weight of the upper, the rest of the lower", _LAYER.format(0.5, "of the upper"),
      layer="mix")  # fmt: skip
_node("Layers", "material", "layer_over", "the upper over the lower, which shows where the upper's lobes leave room",
      _LAYER.format(1, "of the upper"), layer="over")  # fmt: skip
_node("Layers", "material", "layer_coat", "the lower gets the light that the upper does not reflect",
      _LAYER.format(1, "of the upper"), layer="coat")  # fmt: skip
_node("Layers", "material", "layer_thick", "as coat, the lower seen along ways that a dielectric upper bends",
      _LAYER.format(1, "of the upper"), layer="thick")  # fmt: skip
_node("Layers", "material", "layer_add", "the sum of both: for emission",
      "material upper: one\nmaterial lower: the other", layer="add")  # fmt: skip

# ---- displacement ----------------------------------------------------------------------------------------------------

_node("Displacement", "displacement", "displace", "moves the surface along its normal, then bends the normal",
      """float height = 0: of the surface
      float amount = 1: times the height
      float bump = 0: height that only the normal follows
      float bumpAmount = 1: times the bump""")  # fmt: skip
_node("Displacement", "displacement", "displace_vector", "moves the surface by a vector of current space",
      "vector offset = 0: by which\nfloat amount = 1: times the offset")  # fmt: skip

NODE_TYPES: dict[str, NodeType] = {node.name: node for node in _TABLE}


def manual() -> str:
    """The table of docs/graph.md, in Markdown."""
    lines: list[str] = []
    for category in dict.fromkeys(node.category for node in _TABLE):
        lines += [f"### {category}", "", "| node | gives | inputs |", "|---|---|---|"]
        for node in _TABLE:
            if node.category != category:
                continue
            inputs = "<br>".join(f"`{i.type} {i.name}{_shown(i)}` {i.doc}" for i in node.inputs)
            lines.append(f"| **{node.name}**: {node.doc} | {node.output} | {inputs} |")
        lines.append("")
    return "\n".join(lines)


def _shown(declared: Input) -> str:
    value = declared.default
    if value is None:
        return ""
    if isinstance(value, str):
        return f" = {value}" if value.startswith("@") else f' = "{value}"'
    numbers = value if isinstance(value, tuple) else (value,)
    return " = " + " ".join(f"{n:g}" for n in (numbers if len(set(numbers)) > 1 else numbers[:1]))
