"""The surface that materials of USD are taken for: one model, of which each material has what it uses.

    emission + coat over (metalness: metal | specular over (transmission: glass | diffuse))

UsdPreviewSurface, MaterialX's standard_surface and OpenPBR name its inputs in their own ways: preview.py, materialx.py.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

from .rsl import Stage, Value, Writer, shader_text


@dataclass
class Surface:
    """Inputs: None = as if there were none of it. Colours are reflectances; roughness is perceptual."""

    base: Value | None = None  # color of the diffuse body, and of the metal
    metalness: Value | None = None
    specular: Value | None = None  # weight of the gloss
    specular_color: Value | None = None  # tint of the gloss
    roughness: Value | None = None
    ior: Value | None = None
    f0: Value | None = None  # color: reflectance straight on, in place of ior and metalness
    transmission: Value | None = None
    transmission_color: Value | None = None
    sheen: Value | None = None
    sheen_color: Value | None = None
    sheen_roughness: Value | None = None
    coat: Value | None = None
    coat_color: Value | None = None
    coat_roughness: Value | None = None
    coat_ior: Value | None = None
    emission: Value | None = None  # radiance
    presence: Value | None = None
    normal: Value | None = None  # in tangent space, from -1 to 1
    displacement: Value | None = None  # along the normal, in object space


def text_of(writer: Writer, surface: Surface, shading: Stage, displacing: Stage, uv: Value | None) -> str:
    """RSL. `shading` and `displacing` hold the statements that the surface's values need; `uv` are the coordinates that
    the normal's tangents follow."""
    for each in fields(surface):
        value = getattr(surface, each.name)
        if value is not None and each.name not in ("normal", "displacement"):
            setattr(surface, each.name, writer.let(shading, value))
    s = surface
    lobes: list[tuple[str, str]] = []
    layers: list[tuple[str, str, str, str, str]] = []  # name, operator, upper, lower, weight
    float_or = lambda value, default: value.to("float").text if value else default  # noqa: E731
    color_or = lambda value, default: value.to("color").text if value else default  # noqa: E731
    if s.coat and s.coat_color:  # what lies below is seen through it
        tint = writer.let(shading, Value("color", f"mix(color(1), {s.coat_color.text}, {s.coat.to('float').text})"))
        below = ("base", "f0", "specular_color", "sheen_color", "transmission_color")
        white = Value("color", "color(1)")
        for name in below:
            was = getattr(s, name) or (None if name in ("base", "f0") else white)
            if was:
                seen = Value("color", f"{was.to('color').text} * {tint.text}")
                setattr(s, name, writer.let(shading, seen))
    roughness = float_or(s.roughness, "0.5")
    body = "body"
    lobes.append(("body", f'LambertBrdf("diffuseReflectance", {color_or(s.base, "color(0.18)")})'))
    if s.transmission:
        tint = color_or(s.transmission_color, "color(1)")
        glass = f'"transmittance", {tint}, "roughness", color({roughness}), "ior", {float_or(s.ior, "1.5")}'
        lobes.append(("glass", f"MicrosurfaceDielectricBsdfRgb_v1({glass})"))
    top = body
    if s.sheen:
        color, rough = color_or(s.sheen_color, "color(1)"), float_or(s.sheen_roughness, "0.3")
        lobes.append(("sheen", f'SheenBrdf("reflectance", {color}, "roughness", {rough})'))
        layers.append(("fuzzy", "coat", "sheen", top, s.sheen.to("float").text))
        top = "fuzzy"
    if s.f0:
        lobes.append(("gloss", f'MicrofacetConductorBrdf("reflectance", {s.f0.text}, "roughness", {roughness})'))
        layers.append(("dielectric", "coat", "gloss", top, "1"))
        top = "dielectric"
    else:
        gloss = f'"ior", {float_or(s.ior, "1.5")}, "roughness", {roughness}'
        if s.specular_color:
            gloss = f'"reflectance", {s.specular_color.to("color").text}, ' + gloss
        lobes.append(("gloss", f"MicrofacetDielectricBrdf({gloss})"))
        layers.append(("dielectric", "coat", "gloss", top, float_or(s.specular, "1")))
        top = "dielectric"
        if s.transmission:
            layers.append(("through", "mix", "glass", top, s.transmission.to("float").text))
            top = "through"
        if s.metalness:
            metal = f'"reflectance", {color_or(s.base, "color(0.18)")}, "roughness", {roughness}'
            lobes.append(("metal", f"MicrofacetConductorBrdf({metal})"))
            layers.append(("base", "mix", "metal", top, s.metalness.to("float").text))
            top = "base"
    if s.coat:
        coat = f'"ior", {float_or(s.coat_ior, "1.5")}, "roughness", {float_or(s.coat_roughness, "0.01")}'
        lobes.append(("coat", f"MicrofacetDielectricBrdf({coat})"))
        layers.append(("coated", "coat", "coat", top, s.coat.to("float").text))
        top = "coated"
    if s.emission:
        lobes.append(("light", f'DiffuseEmission("radiance", {s.emission.to("color").text})'))
        layers.append(("all", "add", "light", top, "1"))
    begin = ["MnkMaterialBoundary boundary = CreateBoundary(material);"]
    shade = list(shading.lines)
    for name, lobe in lobes:
        begin.append(f'AddLobe(boundary, "{name}", {lobe.partition("(")[0]}());')
        shade.append(f'SetLobe(boundary, "{name}", 1.0, {lobe});')
    for name, operator, upper, lower, weight in layers:
        begin.append(f'AddLayer(boundary, "{name}", "{operator}", "{upper}", "{lower}");')
        shade.append(f'SetLayer(boundary, "{name}", {weight});')
    if s.presence:
        shade.append(f"SetPresence(boundary, {s.presence.to('float').text});")
    methods = {
        "mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)": begin,
        "mnk_prelighting(output MnkMaterialBoundary boundary)": shade,
    }
    if s.displacement or (s.normal and uv):
        methods["mnk_displacement(output point P; output normal N)"] = displacement_lines(s, displacing, uv)
    return shader_text(writer, methods)


def displacement_lines(s: Surface, displacing: Stage, uv: Value | None) -> list[str]:
    lines = list(displacing.lines)
    if s.displacement:
        lines += [
            f"P += {s.displacement.to('float').text} * normalize(N);",
            "N = normalize(calculatenormal(P));",
        ]
    if s.normal and uv:
        # Tangents along which the texture coordinates grow, from derivatives by the surface's own parameters; upright
        # on the normal as Gram and Schmidt have it.
        lines += [
            f"vector bent = {s.normal.to('vector').text};",
            f"float tangent_s = {uv.text}, tangent_t = {uv.second};",
            "float su = Du(tangent_s), sv = Dv(tangent_s), tu = Du(tangent_t), tv = Dv(tangent_t);",
            "float turn = su * tv - sv * tu;",
            "vector Pu = Du(P), Pv = Dv(P), upright = normalize(N);",
            "vector along = sign(turn) * (Pu * tv - Pv * tu);",
            "along -= upright * (along . upright);",
            "if (turn != 0 && along . along > 0) {",
            "    along = normalize(along);",
            "    vector across = upright ^ along;",
            "    if (across . (sign(turn) * (Pv * su - Pu * sv)) < 0)",
            "        across = -across;",
            "    N = normalize(xcomp(bent) * along + ycomp(bent) * across + zcomp(bent) * upright);",
            "}",
        ]
    return lines
