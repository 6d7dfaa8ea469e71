"""The nodes that patterns are made of, each of MaterialX's building blocks (specification 1.39, its standard library's
genglsl). All others are graphs of these: library.py."""

from __future__ import annotations

from kanuka.looks.rsl import SIZES, Stage, Value, of_numbers

from . import blackbody, flakes, hextiles, matrices, noise
from .network import Evaluate, Node, geometry, texture

WRAPS = {"periodic": "periodic", "clamp": "clamp", "mirror": "mirror", "constant": "black"}

# ---- number by number


def operation(expression: str, floats: tuple[str, ...] = (), **inputs: float) -> Evaluate:
    """A node whose output is an expression of its inputs, number by number: {in1} and so on, with their defaults.
    `floats`: inputs of one number for all."""

    def evaluate(node: Node, output: str, stage: Stage) -> Value | None:
        kind, let = node.kind(output), {}
        if kind == "string":  # which goes through dots alone
            return node.value("in", stage, kind)
        for name, default in inputs.items():
            value = node.value(name, stage, "float" if name in floats else kind, default)
            assert value is not None
            let[name] = node.network.writer.let(stage, value)
        numbers = range(SIZES[kind])
        return of_numbers(kind, [expression.format(**{n: v.number(i) for n, v in let.items()}) for i in numbers])

    return evaluate


def one(expression: str) -> Evaluate:
    return operation(expression, **{"in": 0.0})


def two(expression: str) -> Evaluate:
    return operation(expression, in1=0.0, in2=0.0)


def factor(expression: str) -> Evaluate:
    return operation(expression, in1=0.0, in2=1.0)


def choice(relation: str) -> Evaluate:
    test = f"{{value1}} {relation} {{value2}}"
    return operation(
        f"({test} ? {{in1}} : {{in2}})", floats=("value1", "value2"), value1=1.0, value2=0.0, in1=1.0, in2=0.0
    )


def blend(expression: str, alpha: str = "") -> Evaluate:
    """Of compositing, where `mix` says how much of it: {fg} over {bg}, and their alphas {fga} and {bga}. `alpha`: of
    the alpha, where it goes by another expression."""
    mixed = [f"{{mix}} * ({each}) + (1 - {{mix}}) * {{bg}}" for each in (expression, alpha or expression)]

    def evaluate(node: Node, output: str, stage: Stage) -> Value | None:
        kind, writer = node.kind(output), node.network.writer
        fg, bg = (writer.let(stage, node.value(name, stage, kind, 0.0) or Value(kind, "0")) for name in ("fg", "bg"))
        mix = writer.let(stage, node.value("mix", stage, "float", 1.0) or Value("float", "1"))
        last = SIZES[kind] - 1
        alphas = {"fga": fg.number(last), "bga": bg.number(last), "mix": mix.text}
        return of_numbers(
            kind, [mixed[i == 3].format(fg=fg.number(i), bg=bg.number(i), **alphas) for i in range(last + 1)]
        )

    return evaluate


# ---- vectors


def vectors(expression: str, kind: str = "", **inputs: tuple[float, ...]) -> Evaluate:
    """An expression of inputs that are vectors of three numbers: {in1} and so on. Vectors of two have a third of 0."""

    def evaluate(node: Node, output: str, stage: Stage) -> Value | None:
        writer, let = node.network.writer, {}
        for name, default in inputs.items():
            own = node.number_kind(name, "vector")
            value = writer.let(
                stage,
                node.value(name, stage, own if own in ("float2", "color4") else "vector", default)
                or Value("vector", "0"),
            )
            let[name] = writer.let(stage, value.to("vector")).text
        found = Value(kind or "vector", expression.format(**let))
        return writer.let(stage, found).to(node.kind(output))

    return evaluate


def rotate(node: Node, output: str, stage: Stage) -> Value | None:
    """By degrees, of two numbers clockwise, of three about an axis, left-handed: as MaterialX has them."""
    kind, let = node.kind(output), node.network.writer.let
    angle = node.value("amount", stage, "float", 0.0)
    v = node.value("in", stage, kind, 0.0)
    assert angle and v
    v, turn = let(stage, v), let(stage, Value("float2", f"cos(radians({angle.text}))", f"sin(radians({angle.text}))"))
    c, s = turn.text, turn.second
    if kind == "float2":
        return Value(kind, f"{c} * {v.text} + {s} * {v.second}", f"{c} * {v.second} - {s} * {v.text}")
    axis = node.value("axis", stage, "vector", (0.0, 1.0, 0.0))
    assert axis
    a = let(stage, Value("vector", f"normalize({axis.text})")).text
    return Value("vector", f"{v.text} * {c} + ({v.text} ^ {a}) * {s} + {a} * ({a} . {v.text}) * (1 - {c})")


# ---- channels


def convert(node: Node, output: str, stage: Stage) -> Value | None:
    found = node.value("in", stage, node.number_kind("in", "float"), 0.0)
    return found.to(node.kind(output)) if found else None


def extract(node: Node, output: str, stage: Stage) -> Value | None:
    kind = node.number_kind("in", "vector")
    found = node.value("in", stage, kind, 0.0)
    index = min(max(int(node.number("index", 0)), 0), SIZES[kind] - 1)
    return Value("float", found.number(index)) if found else None


def combine(node: Node, output: str, stage: Stage) -> Value | None:
    """Of numbers, or of two values whose numbers follow each other."""
    kind, texts = node.kind(output), []
    for name in ("in1", "in2", "in3", "in4"):
        own = node.number_kind(name, "float")
        if len(texts) < SIZES[kind]:
            found = node.value(name, stage, own, 0.0)
            assert found
            texts += [found.number(i) for i in range(SIZES[own])]
    return of_numbers(kind, texts)


def switch_alpha(expression: str) -> Evaluate:
    """Of a colour by its own alpha: {rgb}, {alpha}."""

    def evaluate(node: Node, output: str, stage: Stage) -> Value | None:
        found = node.value("in", stage, "color4", 0.0)
        assert found
        found = node.network.writer.let(stage, found)
        return Value("color4", expression.format(rgb=found.text, alpha=found.second), found.second)

    return evaluate


def luminance(node: Node, output: str, stage: Stage) -> Value | None:
    kind = node.kind(output)
    found = node.value("in", stage, kind if kind == "color4" else "color", 0.0)
    assert found
    grey = Value("float", f"luminance({found.text})").to(kind)
    return Value(kind, grey.text, found.second) if kind == "color4" else grey


def color_space(to: str) -> Evaluate:
    def evaluate(node: Node, output: str, stage: Stage) -> Value | None:
        kind = node.kind(output)
        found = node.value("in", stage, kind if kind == "color4" else "color", 0.0)
        assert found
        names = ('"hsv"', '"rgb"') if to == "rgb" else ('"rgb"', '"hsv"')
        return Value(kind, f"ctransform({', '.join(names)}, {found.text})", found.second)

    return evaluate


# ---- what the geometry has


def texture_coordinates(node: Node, name: str, stage: Stage) -> Value:
    return node.value(name, stage, "float2") or node.network.writer.primvar("st", "float2")


def texture_coordinate(node: Node, output: str, stage: Stage) -> Value | None:
    return node.network.writer.primvar("st", "float2").to(node.kind(output))


def geometry_property(node: Node, output: str, stage: Stage) -> Value | None:
    name = str(node.constant("geomprop", "") or "")
    name, kind = "st" if name in ("UV0", "uv") else name, node.kind(output)
    given = node.text("default") if kind == "string" else node.fallback("default")
    return node.network.writer.primvar(name, kind, given) if name else None


def geometry_color(node: Node, output: str, stage: Stage) -> Value | None:
    return node.network.writer.primvar("displayColor", "color", (1, 1, 1)).to(node.kind(output))


def space(letter: str, default: str = "object") -> Evaluate:
    def evaluate(node: Node, output: str, stage: Stage) -> Value | None:
        where = "world" if node.constant("space", default) == "world" else "object"
        return geometry(node.network, letter + where, stage)

    return evaluate


def transformed(call: str, kind: str) -> Evaluate:
    """From one space to another: object (or model), world."""

    def evaluate(node: Node, output: str, stage: Stage) -> Value | None:
        found = node.value("in", stage, "vector", 0.0)
        assert found
        network = node.network
        spaces = ["world" if node.constant(name, "") == "world" else "object" for name in ("fromspace", "tospace")]
        given = network.in_world(found.text) if spaces[0] == "world" else found.text
        text = f'vector({call}("{spaces[0]}", "{spaces[1]}", {kind}({given})))'
        return Value("vector", network.in_stage(text) if spaces[1] == "world" else text)

    return evaluate


# ---- pictures and procedures


def image(node: Node, output: str, stage: Stage) -> Value | None:
    """ND_image_* and ND_tiledimage_*."""
    kind, network = node.kind(output), node.network
    file = node.picture("file", stage)
    if not file:
        return node.value("default", stage, kind, 0.0)
    st = texture_coordinates(node, "texcoord", stage)
    for name, sign in (("uvtiling", "*"), ("uvoffset", "-")):
        if (by := node.value(name, stage, "float2")) is not None:
            st = network.writer.let(
                stage, Value("float2", f"{st.text} {sign} {by.text}", f"{st.second} {sign} {by.second}")
            )
    modes = [WRAPS.get(str(node.constant(m, "periodic")), "periodic") for m in ("uaddressmode", "vaddressmode")]
    lookup = node.lookup("file", file, kind)

    def look(channel: int | None, fill: float = 0) -> Value:
        return texture(network, stage, file, st, ",".join(modes), lookup, channel, fill)

    if kind == "float":
        return look(0)
    if kind == "float2":
        return Value(kind, look(0).text, look(1).text)
    return Value(kind, look(None).text, look(3, 1).text) if kind == "color4" else look(None).to(kind)


def blur(node: Node, output: str, stage: Stage) -> Value | None:
    """Of pictures behind it, by a wider filter; nothing else can be blurred. (The library's graph blurs nothing.)"""
    network, outer = node.network, node.network.blur
    if node.connected("size"):
        network.say("warning", f"{network.material}: a blur is the same everywhere; none is made ({node})")
    elif (size := node.value("size", stage, "float", 0.0)) is not None:
        network.blur = size.text
    try:
        return node.value("in", stage, node.kind(output), 0.0)
    finally:
        network.blur = outer


def normal_map(node: Node, output: str, stage: Stage) -> Value | None:
    """In tangent space, from -1 to 1; only surfaces' normals read it, and bend the normal by it."""
    found = node.value("in", stage, "vector", (0.5, 0.5, 1))
    scale = node.value("scale", stage, "float2", (1, 1))
    assert found and scale
    node.network.normal_maps += 1
    code = node.network.writer.let(stage, found).text
    upright = f"({code} . {code} == 0 ? vector(0, 0, 1) : 2 * {code} - vector(1, 1, 1))"
    v = node.network.writer.let(stage, Value("vector", upright))
    return Value("vector", f"vector(xcomp({v.text}) * {scale.text}, ycomp({v.text}) * {scale.second}, zcomp({v.text}))")


def height_to_normal(node: Node, output: str, stage: Stage) -> Value | None:
    """A normal map of heights, by their slopes along the texture coordinates."""
    height, scale = node.value("in", stage, "float", 0.0), node.value("scale", stage, "float", 1.0)
    st, writer = texture_coordinates(node, "texcoord", stage), node.network.writer
    assert height and scale
    h = writer.let(stage, Value("float", f"{height.text} * {scale.text} / 16"))
    st = writer.let(stage, st)
    across = (
        f"vector(Du({st.text}), Du({st.second}), Du({h.text})) ^ vector(Dv({st.text}), Dv({st.second}), Dv({h.text}))"
    )
    n = writer.let(stage, Value("vector", across)).text
    node.network.uv = node.network.uv or st
    upright = f"({n} . {n} > 0 ? (zcomp({n}) < 0 ? -1 : 1) * normalize({n}) : vector(0, 0, 1))"
    return Value("vector", f"0.5 * {upright} + vector(0.5, 0.5, 0.5)")


def ramp(first: str, second: str, axis: int, place: str) -> Evaluate:
    """From one value to another along a texture coordinate, {x}."""

    def evaluate(node: Node, output: str, stage: Stage) -> Value | None:
        kind, let = node.kind(output), node.network.writer.let
        a, b = (let(stage, node.value(name, stage, kind, 0.0) or Value(kind, "0")) for name in (first, second))
        center = node.value("center", stage, "float", 0.5)
        st = texture_coordinates(node, "texcoord", stage)
        assert center
        x = let(stage, Value("float", place.format(x=st.number(axis), center=center.text))).text
        return of_numbers(kind, [f"mix({a.number(i)}, {b.number(i)}, {x})" for i in range(SIZES[kind])])

    return evaluate


def constant(node: Node, output: str, stage: Stage) -> Value | None:
    return node.value("value", stage, node.kind(output), 0.0)


def frame_time(node: Node, output: str, stage: Stage) -> Value | None:
    """Frames are time codes; of times as many make a second as the stage says."""
    network = node.network
    frame = 0.0 if network.time.IsDefault() else network.time.GetValue()
    return Value("float", f"{frame / (network.rate if node.identifier.startswith('ND_time') else 1):.9g}")


def boolean(test: str) -> Evaluate:
    return operation(f"({test} ? 1 : 0)", in1=0.0, in2=0.0)


SIGN = "({in} > 0 ? 1 : ({in} < 0 ? -1 : 0))"
OVER = "({x} < {center} ? 0 : 1)"

NODES: dict[str, Evaluate] = {
    # textures and geometry
    "ND_image": image,
    "ND_tiledimage": image,
    "ND_blur": blur,
    "ND_normalmap": normal_map,
    "ND_heighttonormal": height_to_normal,
    "ND_texcoord": texture_coordinate,
    "ND_geompropvalue": geometry_property,
    "ND_geompropvalueuniform": geometry_property,
    "ND_geomcolor": geometry_color,
    "ND_position": space("P"),
    "ND_normal": space("N"),
    "ND_tangent": space("T"),
    "ND_bitangent": space("B"),
    "ND_viewdirection": space("V", "world"),
    "ND_transformpoint": transformed("transform", "point"),
    "ND_transformvector": transformed("vtransform", "vector"),
    "ND_transformnormal": transformed("ntransform", "normal"),
    "ND_constant": constant,
    "ND_time": frame_time,
    "ND_frame": frame_time,
    # channels
    "ND_convert": convert,
    "ND_extract": extract,
    "ND_combine2": combine,
    "ND_combine3": combine,
    "ND_combine4": combine,
    "ND_luminance": luminance,
    "ND_rgbtohsv": color_space("hsv"),
    "ND_hsvtorgb": color_space("rgb"),
    "ND_premult": switch_alpha("{rgb} * {alpha}"),
    "ND_unpremult": switch_alpha("{rgb} / ({alpha} == 0 ? 1 : {alpha})"),
    # numbers
    "ND_dot": one("{in}"),
    "ND_add": two("{in1} + {in2}"),
    "ND_subtract": two("{in1} - {in2}"),
    "ND_multiply": factor("{in1} * {in2}"),
    "ND_divide": factor("({in2} == 0 ? 0 : {in1} / {in2})"),
    "ND_power": factor("pow(max({in1}, 0), {in2})"),
    "ND_min": two("min({in1}, {in2})"),
    "ND_max": two("max({in1}, {in2})"),
    "ND_modulo": factor("({in2} == 0 ? 0 : mod({in1}, {in2}))"),
    "ND_invert": operation("{amount} - {in}", amount=1.0, **{"in": 0.0}),
    "ND_absval": one("abs({in})"),
    "ND_sign": one(SIGN),
    "ND_floor": one("floor({in})"),
    "ND_ceil": one("ceil({in})"),
    "ND_round": one("floor({in} + 0.5)"),
    "ND_fract": one("({in} - floor({in}))"),
    "ND_sqrt": one("sqrt(max({in}, 0))"),
    "ND_ln": operation("log(max({in}, 1e-30))", **{"in": 1.0}),
    "ND_exp": one("exp({in})"),
    "ND_sin": one("sin({in})"),
    "ND_cos": one("cos({in})"),
    "ND_tan": one("tan({in})"),
    "ND_asin": one("asin(clamp({in}, -1, 1))"),
    "ND_acos": one("acos(clamp({in}, -1, 1))"),
    "ND_atan2": operation("atan({iny}, {inx})", iny=0.0, inx=1.0),
    "ND_clamp": operation("clamp({in}, {low}, {high})", low=0.0, high=1.0, **{"in": 0.0}),
    "ND_smoothstep": operation("smoothstep({low}, {high}, {in})", low=0.0, high=1.0, **{"in": 0.0}),
    "ND_remap": operation(
        "({outlow} + ({in} - {inlow}) * ({outhigh} - {outlow}) / ({inhigh} == {inlow} ? 1 : {inhigh} - {inlow}))",
        inlow=0.0,
        inhigh=1.0,
        outlow=0.0,
        outhigh=1.0,
        **{"in": 0.0},
    ),
    # vectors
    "ND_dotproduct": vectors("{in1} . {in2}", "float", in1=(0.0,), in2=(0.0,)),
    "ND_crossproduct": vectors("{in1} ^ {in2}", in1=(0.0,), in2=(0.0,)),
    "ND_magnitude": vectors("length({in})", "float", **{"in": (0.0,)}),
    "ND_normalize": vectors("({in} . {in} > 0 ? normalize({in}) : {in})", **{"in": (0.0,)}),
    "ND_rotate2d": rotate,
    "ND_rotate3d": rotate,
    # choices
    "ND_ifgreater": choice(">"),
    "ND_ifgreatereq": choice(">="),
    "ND_ifequal": choice("=="),
    "ND_logical_and": boolean("{in1} != 0 && {in2} != 0"),
    "ND_logical_or": boolean("{in1} != 0 || {in2} != 0"),
    "ND_logical_not": one("({in} != 0 ? 0 : 1)"),
    # compositing
    "ND_mix": operation("mix({bg}, {fg}, {mix})", fg=0.0, bg=0.0, mix=0.0),
    "ND_plus": blend("{bg} + {fg}"),
    "ND_minus": blend("{bg} - {fg}"),
    "ND_difference": blend("abs({bg} - {fg})"),
    "ND_screen": blend("1 - (1 - {fg}) * (1 - {bg})"),
    "ND_burn": blend("(abs({fg}) < 1e-8 ? 0 : 1 - (1 - {bg}) / {fg})"),
    "ND_dodge": blend("(abs(1 - {fg}) < 1e-8 ? 0 : {bg} / (1 - {fg}))"),
    "ND_over": blend("{fg} + {bg} * (1 - {fga})"),
    "ND_in": blend("{fg} * {bga}"),
    "ND_out": blend("{fg} * (1 - {bga})"),
    "ND_mask": blend("{bg} * {fga}"),
    "ND_matte": blend("{fg} * {fga} + {bg} * (1 - {fga})", "{fga} + {bga} * (1 - {fga})"),
    "ND_disjointover": blend(
        "({fga} + {bga} <= 1 ? {fg} + {bg} : {fg} + {bg} * (1 - {fga}) / ({bga} == 0 ? 1 : {bga}))",
        "min({fga} + {bga}, 1)",
    ),
    "ND_inside": operation("{in} * {mask}", floats=("mask",), mask=1.0, **{"in": 0.0}),
    "ND_outside": operation("{in} * (1 - {mask})", floats=("mask",), mask=0.0, **{"in": 0.0}),
    # ramps
    "ND_ramplr": ramp("valuel", "valuer", 0, "clamp({x}, 0, 1)"),
    "ND_ramptb": ramp("valueb", "valuet", 1, "clamp({x}, 0, 1)"),
    "ND_splitlr": ramp("valuel", "valuer", 0, OVER),
    "ND_splittb": ramp("valueb", "valuet", 1, OVER),
}
NODES |= noise.NODES | matrices.NODES | flakes.NODES | hextiles.NODES | blackbody.NODES
