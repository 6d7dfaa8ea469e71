"""MaterialX: its surfaces, and the nodes that patterns are made of (MaterialX specification 1.39)."""

from __future__ import annotations

from collections.abc import Callable

from pxr import UsdShade

from .network import Network, kind_of, texture
from .rsl import Stage, Value
from .surface import Surface

WRAPS = {"periodic": "periodic", "clamp": "clamp", "mirror": "mirror", "constant": "black"}
Node = Callable[[Network, UsdShade.Shader, str, Stage], "Value | None"]


def kind_by(shader: UsdShade.Shader, output: str) -> str:
    """That a node gives, by its output's type."""
    port = shader.GetOutput(output)
    return kind_of(port.GetAttr()) if port else "float"


def texture_coordinates(network: Network, shader: UsdShade.Shader, name: str, stage: Stage) -> Value:
    return network.value(shader, name, stage, "float2") or network.writer.primvar("st", "float2")


def image(network: Network, shader: UsdShade.Shader, output: str, stage: Stage) -> Value | None:
    """ND_image_* and ND_tiledimage_*."""
    kind = kind_by(shader, output)
    file = network.file(shader, "file")
    if not file:
        return network.of_constant((shader.GetPath(), "default"), network.constant(shader, "default", 0.0), kind)
    st = texture_coordinates(network, shader, "texcoord", stage)
    for name, sign in (("uvtiling", "*"), ("uvoffset", "-")):
        if (by := network.value(shader, name, stage, "float2")) is not None:
            st = network.writer.let(
                stage, Value("float2", f"{st.text} {sign} {by.text}", f"{st.second} {sign} {by.second}")
            )
    modes = [
        WRAPS.get(str(network.constant(shader, m, "periodic")), "periodic") for m in ("uaddressmode", "vaddressmode")
    ]
    named = network.color_space(shader, "file")
    coded = kind == "color" and ("srgb" in named or named == "auto")
    space = "srgb" if coded else "raw" if kind != "color" or named in ("raw", "lin_rec709", "linear") else "auto"
    channel = 0 if kind == "float" else None
    return texture(network, stage, file, st, ",".join(modes), space, channel).to(kind)


def normal_map(network: Network, shader: UsdShade.Shader, output: str, stage: Stage) -> Value | None:
    """In tangent space, from -1 to 1; only surfaces' normals read it, and bend the normal by it."""
    found = network.value(shader, "in", stage, "vector", (0.5, 0.5, 1))
    scale = network.value(shader, "scale", stage, "float2", (1, 1))
    assert found and scale
    v = network.writer.let(stage, Value("vector", f"2 * {found.text} - vector(1, 1, 1)"))
    return Value("vector", f"vector(xcomp({v.text}) * {scale.text}, ycomp({v.text}) * {scale.second}, zcomp({v.text}))")


def texture_coordinate(network: Network, shader: UsdShade.Shader, output: str, stage: Stage) -> Value | None:
    return network.writer.primvar("st", "float2").to(kind_by(shader, output))


def geometry_property(network: Network, shader: UsdShade.Shader, output: str, stage: Stage) -> Value | None:
    name = str(network.constant(shader, "geomprop", "") or "")
    kind = kind_by(shader, output)
    name = "st" if name in ("UV0", "uv") else name
    return network.writer.primvar(name, kind, network.constant(shader, "default")) if name else None


def constant(network: Network, shader: UsdShade.Shader, output: str, stage: Stage) -> Value | None:
    return network.value(shader, "value", stage, kind_by(shader, output), 0.0)


def position(network: Network, shader: UsdShade.Shader, output: str, stage: Stage) -> Value | None:
    space = str(network.constant(shader, "space", "object"))
    return Value("vector", f'vector(transform("{"world" if space == "world" else "object"}", P))')


def operation(**inputs: float) -> Callable[[str], Node]:
    """A node whose output is an expression of its inputs, number by number: {in1} and so on."""

    def of(expression: str) -> Node:
        def node(network: Network, shader: UsdShade.Shader, output: str, stage: Stage) -> Value | None:
            kind = kind_by(shader, output)
            values = {name: network.value(shader, name, stage, kind, default) for name, default in inputs.items()}
            let = {name: network.writer.let(stage, value) for name, value in values.items() if value is not None}
            size = {"float": 1, "float2": 2}.get(kind, 3)
            texts = [expression.format(**{name: v.number(i) for name, v in let.items()}) for i in range(size)]
            if kind == "float2":
                return Value(kind, texts[0], texts[1])
            return Value(kind, texts[0] if size == 1 else f"{kind}({', '.join(texts)})")

        return node

    return of


def convert(network: Network, shader: UsdShade.Shader, output: str, stage: Stage) -> Value | None:
    attribute = network.source(shader, "in")
    kind = kind_of(attribute) if attribute is not None else "float"
    found = network.value(shader, "in", stage, kind, 0.0)
    return found.to(kind_by(shader, output)) if found else None


def extract(network: Network, shader: UsdShade.Shader, output: str, stage: Stage) -> Value | None:
    attribute = network.source(shader, "in")
    found = network.value(shader, "in", stage, kind_of(attribute) if attribute is not None else "vector", 0.0)
    index = int(network.constant(shader, "index", 0))
    return Value("float", found.number(index)) if found else None


def combine(network: Network, shader: UsdShade.Shader, output: str, stage: Stage) -> Value | None:
    kind = kind_by(shader, output)
    values = [network.value(shader, f"in{i}", stage, "float", 0.0) for i in (1, 2, 3)]
    texts = [v.text for v in values if v]
    return Value(kind, texts[0], texts[1]) if kind == "float2" else Value(kind, f"{kind}({', '.join(texts)})")


def mix(network: Network, shader: UsdShade.Shader, output: str, stage: Stage) -> Value | None:
    kind = kind_by(shader, output)
    fg, bg = (network.value(shader, n, stage, kind, 0.0) for n in ("fg", "bg"))
    amount = network.value(shader, "mix", stage, kind, 0.0)
    assert fg and bg and amount
    size = {"float": 1, "float2": 2}.get(kind, 3)
    texts = [f"mix({bg.number(i)}, {fg.number(i)}, {amount.number(i)})" for i in range(size)]
    if kind == "float2":
        return Value(kind, texts[0], texts[1])
    return Value(kind, texts[0] if size == 1 else f"{kind}({', '.join(texts)})")


def luminance(network: Network, shader: UsdShade.Shader, output: str, stage: Stage) -> Value | None:
    found = network.value(shader, "in", stage, "color", 0.0)
    return Value("float", f"luminance({found.text})").to(kind_by(shader, output)) if found else None


TWO = operation(in1=0.0, in2=0.0)
ONE = operation(**{"in": 0.0})

NODES: dict[str, Node] = {
    "ND_image": image,
    "ND_tiledimage": image,
    "ND_normalmap": normal_map,
    "ND_texcoord": texture_coordinate,
    "ND_geompropvalue": geometry_property,
    "ND_constant": constant,
    "ND_position": position,
    "ND_convert": convert,
    "ND_extract": extract,
    "ND_combine2": combine,
    "ND_combine3": combine,
    "ND_mix": mix,
    "ND_luminance": luminance,
    "ND_dot": ONE("{in}"),
    "ND_add": TWO("{in1} + {in2}"),
    "ND_subtract": TWO("{in1} - {in2}"),
    "ND_multiply": operation(in1=0.0, in2=1.0)("{in1} * {in2}"),
    "ND_divide": operation(in1=0.0, in2=1.0)("({in2} == 0 ? 0 : {in1} / {in2})"),
    "ND_power": operation(in1=0.0, in2=1.0)("pow(max({in1}, 0), {in2})"),
    "ND_min": TWO("min({in1}, {in2})"),
    "ND_max": TWO("max({in1}, {in2})"),
    "ND_modulo": operation(in1=0.0, in2=1.0)("mod({in1}, {in2})"),
    "ND_invert": operation(amount=1.0, **{"in": 0.0})("{amount} - {in}"),
    "ND_absval": ONE("abs({in})"),
    "ND_floor": ONE("floor({in})"),
    "ND_ceil": ONE("ceil({in})"),
    "ND_sqrt": ONE("sqrt(max({in}, 0))"),
    "ND_sin": ONE("sin({in})"),
    "ND_cos": ONE("cos({in})"),
    "ND_exp": ONE("exp({in})"),
    "ND_clamp": operation(low=0.0, high=1.0, **{"in": 0.0})("clamp({in}, {low}, {high})"),
    "ND_smoothstep": operation(low=0.0, high=1.0, **{"in": 0.0})("smoothstep({low}, {high}, {in})"),
    "ND_remap": operation(inlow=0.0, inhigh=1.0, outlow=0.0, outhigh=1.0, **{"in": 0.0})(
        "({outlow} + ({in} - {inlow}) * ({outhigh} - {outlow}) / ({inhigh} - {inlow}))"
    ),
}


class Inputs:
    """A surface's inputs in one stage, with whether they are used."""

    def __init__(self, network: Network, shader: UsdShade.Shader, stage: Stage) -> None:
        self.network, self.shader, self.stage = network, shader, stage

    def __call__(self, name: str, kind: str, default) -> Value:
        value = self.network.value(self.shader, name, self.stage, kind, default)
        assert value is not None
        return value

    def used(self, name: str, unused: float = 0) -> bool:
        if self.network.connected(self.shader, name):
            return True
        value = self.network.constant(self.shader, name, unused)
        return any(float(x) != unused for x in (value if hasattr(value, "__len__") else (value,)))

    def product(self, weight: str, color: str, weights: float, colors: tuple[float, float, float]) -> Value:
        return Value("color", f"{self(weight, 'float', weights).text} * {self(color, 'color', colors).text}")


def ignored(network: Network, shader: UsdShade.Shader, names: dict[str, float]) -> None:
    used = [n for n, unused in names.items() if Inputs(network, shader, Stage()).used(n, unused)]
    if used:
        network.say("warning", f"{network.material}: without effect yet: {', '.join(used)}")


def standard_surface(network: Network, shader: UsdShade.Shader, shading: Stage, displacing: Stage) -> Surface:
    """Autodesk Standard Surface 1.0.1, Georgiev et al. 2019."""
    get = Inputs(network, shader, shading)
    ignored(
        network, shader, {"specular_anisotropy": 0, "thin_film_thickness": 0, "subsurface": 0, "diffuse_roughness": 0}
    )
    made = Surface(base=get.product("base", "base_color", 1.0, (0.8, 0.8, 0.8)))
    made.specular = get("specular", "float", 1.0)
    made.specular_color = get("specular_color", "color", (1, 1, 1))
    made.roughness = get("specular_roughness", "float", 0.2)
    made.ior = get("specular_IOR", "float", 1.5)
    if get.used("metalness"):
        made.metalness = get("metalness", "float", 0.0)
    if get.used("transmission"):
        made.transmission = get("transmission", "float", 0.0)
        made.transmission_color = get("transmission_color", "color", (1, 1, 1))
    if get.used("sheen"):
        made.sheen = get("sheen", "float", 0.0)
        made.sheen_color = get("sheen_color", "color", (1, 1, 1))
        made.sheen_roughness = get("sheen_roughness", "float", 0.3)
    if get.used("coat"):
        made.coat = get("coat", "float", 0.0)
        made.coat_roughness = get("coat_roughness", "float", 0.1)
        made.coat_ior = get("coat_IOR", "float", 1.5)
        if get.used("coat_color", 1):
            made.coat_color = get("coat_color", "color", (1, 1, 1))
    if get.used("emission"):
        made.emission = get.product("emission", "emission_color", 0.0, (1, 1, 1))
    finish(network, shader, made, get, "opacity", "normal", displacing)
    return made


def open_pbr(network: Network, shader: UsdShade.Shader, shading: Stage, displacing: Stage) -> Surface:
    """OpenPBR Surface 1.1."""
    get = Inputs(network, shader, shading)
    ignored(
        network,
        shader,
        {
            "specular_roughness_anisotropy": 0,
            "thin_film_weight": 0,
            "subsurface_weight": 0,
            "base_diffuse_roughness": 0,
        },
    )
    made = Surface(base=get.product("base_weight", "base_color", 1.0, (0.8, 0.8, 0.8)))
    made.specular = get("specular_weight", "float", 1.0)
    made.specular_color = get("specular_color", "color", (1, 1, 1))
    made.roughness = get("specular_roughness", "float", 0.3)
    made.ior = get("specular_ior", "float", 1.5)
    if get.used("base_metalness"):
        made.metalness = get("base_metalness", "float", 0.0)
    if get.used("transmission_weight"):
        made.transmission = get("transmission_weight", "float", 0.0)
        made.transmission_color = get("transmission_color", "color", (1, 1, 1))
    if get.used("fuzz_weight"):
        made.sheen = get("fuzz_weight", "float", 0.0)
        made.sheen_color = get("fuzz_color", "color", (1, 1, 1))
        made.sheen_roughness = get("fuzz_roughness", "float", 0.5)
    if get.used("coat_weight"):
        made.coat = get("coat_weight", "float", 0.0)
        made.coat_roughness = get("coat_roughness", "float", 0.0)
        made.coat_ior = get("coat_ior", "float", 1.6)
        if get.used("coat_color", 1):
            made.coat_color = get("coat_color", "color", (1, 1, 1))
    if get.used("emission_luminance"):
        made.emission = get.product("emission_luminance", "emission_color", 0.0, (1, 1, 1))
    finish(network, shader, made, get, "geometry_opacity", "geometry_normal", displacing)
    return made


def finish(
    network: Network, shader: UsdShade.Shader, made: Surface, get: Inputs, opacity: str, normal: str, displacing: Stage
) -> None:
    if network.connected(shader, opacity):
        made.presence = get(opacity, "color", (1, 1, 1)).to("float")
    else:
        value = network.constant(shader, opacity, 1.0)
        mean = sum(value) / 3 if hasattr(value, "__len__") else float(value)
        if mean != 1:
            made.presence = network.of_constant((shader.GetPath(), opacity), mean, "float")
    if network.connected(shader, normal):
        made.normal = network.value(shader, normal, displacing, "vector")


SURFACES = {
    "ND_standard_surface_surfaceshader": standard_surface,
    "ND_open_pbr_surface_surfaceshader": open_pbr,
}
