"""UsdPreviewSurface and its nodes (USD's specification of UsdPreviewSurface, version 2.6)."""

from __future__ import annotations

from pxr import UsdShade

from .network import Network, texture
from .rsl import Stage, Value
from .surface import Surface

WRAPS = {"repeat": "periodic", "clamp": "clamp", "mirror": "mirror", "black": "black", "useMetadata": ""}
CHANNELS = {"r": 0, "g": 1, "b": 2, "a": 3}


def uv_texture(network: Network, shader: UsdShade.Shader, output: str, stage: Stage) -> Value | None:
    file = network.file(shader, "file")
    writer = network.writer
    if not file:
        fallback = network.constant(shader, "fallback", (0, 0, 0, 1))
        numbers = tuple(float(x) for x in fallback)
        if output in CHANNELS:
            return writer.constant("float", numbers[CHANNELS[output]])
        return writer.constant("color", numbers[:3])
    st = network.value(shader, "st", stage, "float2") or writer.primvar("st", "float2")
    s_wrap, t_wrap = (WRAPS.get(str(network.constant(shader, w, "useMetadata")), "") for w in ("wrapS", "wrapT"))
    wrap = f"{s_wrap or 'periodic'},{t_wrap or 'periodic'}" if s_wrap or t_wrap else ""
    named = str(network.constant(shader, "sourceColorSpace", "auto"))
    space = {"raw": "raw", "sRGB": "srgb"}.get(named, "auto")
    scale = [float(x) for x in network.constant(shader, "scale", (1, 1, 1, 1))]
    bias = [float(x) for x in network.constant(shader, "bias", (0, 0, 0, 0))]
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


def primvar_reader(kind: str):
    def read(network: Network, shader: UsdShade.Shader, output: str, stage: Stage) -> Value | None:
        name = str(network.constant(shader, "varname", "") or "")
        if not name:
            network.say("warning", f"{shader.GetPath()}: it names no primvar")
            return None
        return network.writer.primvar(name, kind, network.constant(shader, "fallback"))

    return read


def transform_2d(network: Network, shader: UsdShade.Shader, output: str, stage: Stage) -> Value | None:
    """Scaled, then turned counterclockwise by degrees, then moved."""
    where = network.value(shader, "in", stage, "float2", (0, 0))
    scale = network.value(shader, "scale", stage, "float2", (1, 1))
    angle = network.value(shader, "rotation", stage, "float", 0)
    moved = network.value(shader, "translation", stage, "float2", (0, 0))
    assert where and scale and angle and moved
    x = network.writer.let(stage, Value("float2", f"{where.text} * {scale.text}", f"{where.second} * {scale.second}"))
    turn = network.writer.let(stage, Value("float2", f"cos(radians({angle.text}))", f"sin(radians({angle.text}))"))
    return Value(
        "float2",
        f"{x.text} * {turn.text} - {x.second} * {turn.second} + {moved.text}",
        f"{x.text} * {turn.second} + {x.second} * {turn.text} + {moved.second}",
    )


NODES = {
    "UsdUVTexture": uv_texture,
    "UsdTransform2d": transform_2d,
    "UsdPrimvarReader_float": primvar_reader("float"),
    "UsdPrimvarReader_int": primvar_reader("float"),
    "UsdPrimvarReader_float2": primvar_reader("float2"),
    "UsdPrimvarReader_float3": primvar_reader("color"),
    "UsdPrimvarReader_float4": primvar_reader("color"),
    "UsdPrimvarReader_vector": primvar_reader("vector"),
    "UsdPrimvarReader_normal": primvar_reader("vector"),
    "UsdPrimvarReader_point": primvar_reader("vector"),
}


def preview_surface(network: Network, shader: UsdShade.Shader, shading: Stage, displacing: Stage) -> Surface:
    def used(name: str, default: float = 0) -> bool:
        """Whether an input differs from what needs no lobe."""
        return network.connected(shader, name) or network.constant(shader, name, default) != default

    made = Surface(base=network.value(shader, "diffuseColor", shading, "color", (0.18, 0.18, 0.18)))
    made.roughness = network.value(shader, "roughness", shading, "float", 0.5)
    if network.constant(shader, "useSpecularWorkflow", 0):
        made.f0 = network.value(shader, "specularColor", shading, "color", (0, 0, 0))
    else:
        made.ior = network.value(shader, "ior", shading, "float", 1.5)
        if used("metallic"):
            made.metalness = network.value(shader, "metallic", shading, "float")
    if used("clearcoat"):
        made.coat = network.value(shader, "clearcoat", shading, "float")
        made.coat_roughness = network.value(shader, "clearcoatRoughness", shading, "float", 0.01)
    emissive = network.constant(shader, "emissiveColor", (0, 0, 0))
    if network.connected(shader, "emissiveColor") or any(float(x) != 0 for x in emissive):
        made.emission = network.value(shader, "emissiveColor", shading, "color")
    if used("opacity", 1):
        opacity = network.value(shader, "opacity", shading, "float", 1)
        assert opacity
        if used("opacityThreshold"):
            limit = network.value(shader, "opacityThreshold", shading, "float")
            assert limit
            opacity = Value("float", f"{opacity.text} < {limit.text} ? 0 : 1")
        made.presence = opacity
    if network.connected(shader, "normal"):
        made.normal = network.value(shader, "normal", displacing, "vector")
    if used("displacement"):
        made.displacement = network.value(shader, "displacement", displacing, "float")
    return made
