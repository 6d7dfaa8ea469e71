"""UsdPreviewSurface and its nodes (USD's specification of UsdPreviewSurface, version 2.6)."""

from __future__ import annotations

from kanuka.looks.rsl import Stage, Value
from kanuka.looks.surface import Normal, Surface

from .network import Evaluate, Node, texture

WRAPS = {"repeat": "periodic", "clamp": "clamp", "mirror": "mirror", "black": "black", "useMetadata": ""}
CHANNELS = {"r": 0, "g": 1, "b": 2, "a": 3}


def uv_texture(node: Node, output: str, stage: Stage) -> Value | None:
    network, file = node.network, node.picture("file", stage)
    writer = network.writer
    if not file:
        numbers = tuple(node.numbers("fallback", (0, 0, 0, 1)))
        if output in CHANNELS:
            return writer.constant("float", numbers[CHANNELS[output]])
        return writer.constant("color", numbers[:3])
    st = node.value("st", stage, "float2") or writer.primvar("st", "float2")
    s_wrap, t_wrap = (WRAPS.get(str(node.constant(w, "useMetadata")), "") for w in ("wrapS", "wrapT"))
    wrap = f"{s_wrap or 'periodic'},{t_wrap or 'periodic'}" if s_wrap or t_wrap else ""
    space = node.named_lookup("file", "sourceColorSpace", file)
    scale = node.numbers("scale", (1, 1, 1, 1))
    bias = node.numbers("bias", (0, 0, 0, 0))
    if output in CHANNELS:
        channel = CHANNELS[output]
        found = texture(network, stage, file, st, wrap, space, channel, fill=1 if channel == 3 else 0)
        if scale[channel] == 1 and bias[channel] == 0:
            return found
        factor, offset = writer.constant("float", scale[channel]), writer.constant("float", bias[channel])
    else:
        found = texture(network, stage, file, st, wrap, space, None)
        if scale[:3] == [1, 1, 1] and bias[:3] == [0, 0, 0]:
            return found
        factor, offset = writer.constant("color", tuple(scale[:3])), writer.constant("color", tuple(bias[:3]))
    return Value(found.kind, f"{found.text} * {factor.text} + {offset.text}")


def primvar_reader(kind: str) -> Evaluate:
    def read(node: Node, output: str, stage: Stage) -> Value | None:
        name = str(node.constant("varname", "") or "")
        if not name:
            node.network.say("warning", f"{node}: it names no primvar")
            return None
        given = node.text("fallback") if kind == "string" else node.fallback("fallback", kind)
        return node.network.writer.primvar(name, kind, given)

    return read


def transform_2d(node: Node, output: str, stage: Stage) -> Value | None:
    """Scaled, then turned counterclockwise by degrees, then moved."""
    where = node.value("in", stage, "float2", (0, 0))
    scale = node.value("scale", stage, "float2", (1, 1))
    angle = node.value("rotation", stage, "float", 0)
    moved = node.value("translation", stage, "float2", (0, 0))
    assert where and scale and angle and moved
    x = node.network.writer.let(
        stage, Value("float2", f"{where.text} * {scale.text}", f"{where.second} * {scale.second}")
    )
    turn = node.network.writer.let(stage, Value("float2", f"cos(radians({angle.text}))", f"sin(radians({angle.text}))"))
    return Value(
        "float2",
        f"{x.text} * {turn.text} - {x.second} * {turn.second} + {moved.text}",
        f"{x.text} * {turn.second} + {x.second} * {turn.text} + {moved.second}",
    )


NODES = {
    "UsdUVTexture": uv_texture,
    "ND_UsdUVTexture": uv_texture,  # MaterialX's names of the same
    "UsdTransform2d": transform_2d,
    "UsdPrimvarReader_float": primvar_reader("float"),
    "UsdPrimvarReader_int": primvar_reader("float"),
    "UsdPrimvarReader_float2": primvar_reader("float2"),
    "UsdPrimvarReader_float3": primvar_reader("color"),
    "UsdPrimvarReader_float4": primvar_reader("color"),
    "UsdPrimvarReader_vector": primvar_reader("vector"),
    "UsdPrimvarReader_normal": primvar_reader("vector"),
    "UsdPrimvarReader_point": primvar_reader("vector"),
    "UsdPrimvarReader_string": primvar_reader("string"),
    "UsdPrimvarReader_matrix": primvar_reader("matrix44"),
}


def preview_surface(node: Node, shading: Stage, displacing: Stage) -> Surface:
    def used(name: str, default: float = 0) -> bool:
        """Whether an input differs from what needs no lobe."""
        return node.connected(name) or node.constant(name, default) != default

    made = Surface(base=node.value("diffuseColor", shading, "color", (0.18, 0.18, 0.18)))
    made.roughness = node.value("roughness", shading, "float", 0.5)
    if node.number("useSpecularWorkflow", 0):
        made.f0 = node.value("specularColor", shading, "color", (0, 0, 0))
    else:
        made.ior = node.value("ior", shading, "float", 1.5)
        if used("metallic"):
            made.metalness = node.value("metallic", shading, "float")
    if used("clearcoat"):
        made.coat = node.value("clearcoat", shading, "float")
        made.coat_roughness = node.value("clearcoatRoughness", shading, "float", 0.01)
    emissive = node.numbers("emissiveColor", (0, 0, 0))
    if node.connected("emissiveColor") or any(emissive):
        made.emission = node.value("emissiveColor", shading, "color")
    if used("opacity", 1):
        opacity = node.value("opacity", shading, "float", 1)
        assert opacity
        if used("opacityThreshold"):
            limit = node.value("opacityThreshold", shading, "float")
            assert limit
            opacity = Value("float", f"{opacity.text} < {limit.text} ? 0 : 1")
        made.presence = opacity
    if node.connected("normal"):
        found = node.value("normal", displacing, "vector")
        assert found
        made.normal, made.coat_shares_normal = Normal(found), True
    if used("displacement"):
        made.displacement = node.value("displacement", displacing, "float")
    return made


SURFACES = {"UsdPreviewSurface": preview_surface, "ND_UsdPreviewSurface_surfaceshader": preview_surface}
