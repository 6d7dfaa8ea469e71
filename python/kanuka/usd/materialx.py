"""MaterialX's surfaces: what the inputs of each are to the model that all are taken for (surface.py)."""

from __future__ import annotations

import math

from kanuka.looks.rsl import Stage, Value
from kanuka.looks.surface import Medium, Surface

from .network import Node


class Inputs:
    """A surface's inputs in one stage, with whether they are used."""

    def __init__(self, node: Node, stage: Stage) -> None:
        self.node, self.stage, self.writer = node, stage, node.network.writer

    def __call__(self, name: str, kind: str, default) -> Value:
        value = self.node.value(name, self.stage, kind, default)
        assert value is not None
        return value

    def used(self, name: str, unused: float = 0) -> bool:
        if self.node.connected(name):
            return True
        value = self.node.constant(name, unused)
        return any(float(x) != unused for x in (value if hasattr(value, "__len__") else (value,)))

    def let(self, kind: str, text: str) -> Value:
        return self.writer.let(self.stage, Value(kind, text))

    def product(self, weight: str, color: str, weights: float, colors: tuple[float, float, float]) -> Value:
        return self.let("color", f"{self(weight, 'float', weights).text} * {self(color, 'color', colors).text}")

    def mixed(self, made: Value, weight: str, color: str, colors: tuple[float, float, float]) -> Value:
        """`made`, or the colour, by its weight."""
        if not self.used(weight):
            return made
        return self.let(
            "color", f"mix({made.text}, {self(color, 'color', colors).text}, {self(weight, 'float', 0).text})"
        )

    def ignored(self, names: dict[str, float]) -> None:
        used = [n for n, unused in names.items() if self.used(n, unused)]
        if used:
            network = self.node.network
            network.say("warning", f"{network.material}: without effect yet: {', '.join(used)}")


def stretched(get: Inputs, made: Surface, anisotropy: str, turns: str, aspect: str, wide: str) -> None:
    """Anisotropy: `aspect` of its {a} is that of the widths of slopes across the tangent and along it, `wide` the
    factor of the roughness whose square is the one along it. Our grooves run where slopes are few: across the
    tangent, a quarter of a turn from it."""
    if not get.used(anisotropy):
        return
    a = get(anisotropy, "float", 0.0).text
    narrow = get.let("float", aspect.format(a=a)).text
    assert made.roughness
    made.roughness = get.let("float", f"min(1, {made.roughness.text} * {wide.format(a=a, aspect=narrow)})")
    made.anisotropy = get.let("float", f"min(1, (1 - {narrow}) / 0.95)")  # bsdf/microfacet.h, stretched_width()
    turn = get(turns, "float", 0.0).text if turns else "0"
    made.rotation = Value("float", f"0.25 + {turn}")


def medium(get: Inputs, ior: str) -> Medium | None:
    """Where there is a depth, the transmitted colour is that of a medium, at that depth (OpenPBR, section 3.6.3)."""
    node = get.node
    if not get.used("transmission_depth"):
        return None
    wanted = (
        "transmission_depth",
        "transmission_color",
        "transmission_scatter",
        "transmission_scatter_anisotropy",
        ior,
    )
    if varying := [name for name in wanted if node.connected(name)]:
        network = node.network
        network.say(
            "warning", f"{network.material}: {', '.join(varying)}: a medium is the same everywhere; none is made"
        )
        return None
    depth = float(node.constant("transmission_depth", 0.0))
    if not depth > 0:
        return None
    color, scatter = (
        [float(x) for x in node.constant(name, default)]
        for name, default in (("transmission_color", (1, 1, 1)), ("transmission_scatter", (0, 0, 0)))
    )
    scattering = tuple(max(x, 0.0) / depth for x in scatter)
    absorption = [-math.log(min(max(c, 1e-6), 1.0)) / depth - s for c, s in zip(color, scattering, strict=True)]
    least = min(0.0, *absorption)
    cosine = float(node.constant("transmission_scatter_anisotropy", 0.0))
    return Medium(float(node.constant(ior, 1.5)), tuple(a - least for a in absorption), scattering, cosine)


def standard_surface(node: Node, shading: Stage, displacing: Stage) -> Surface:
    """Autodesk Standard Surface 1.0.1, Georgiev et al. 2019."""
    get = Inputs(node, shading)
    get.ignored(
        {"coat_anisotropy": 0, "coat_affect_color": 0, "coat_affect_roughness": 0, "transmission_extra_roughness": 0}
    )
    base = get.product("base", "base_color", 1.0, (0.8, 0.8, 0.8))
    made = Surface(base=get.mixed(base, "subsurface", "subsurface_color", (1, 1, 1)))
    if get.used("diffuse_roughness"):
        made.diffuse_roughness = get("diffuse_roughness", "float", 0.0)
    made.specular = get("specular", "float", 1.0)
    made.specular_color = get("specular_color", "color", (1, 1, 1))
    made.roughness = get("specular_roughness", "float", 0.2)
    made.ior = get("specular_IOR", "float", 1.5)
    stretched(get, made, "specular_anisotropy", "specular_rotation", "(1 - 0.9 * {a})", "pow({aspect}, -0.25)")
    if get.used("metalness"):
        made.metalness = get("metalness", "float", 0.0)
        made.metal = base
    transmitted(get, made, "transmission", "thin_walled", "subsurface", "specular_IOR")
    if made.transmission and get.used("transmission_dispersion"):
        made.abbe = get("transmission_dispersion", "float", 0.0)
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
    if get.used("thin_film_thickness"):
        made.film = get("thin_film_thickness", "float", 0.0)
        made.film_ior = get("thin_film_IOR", "float", 1.5)
    if get.used("emission"):
        made.emission = get.product("emission", "emission_color", 0.0, (1, 1, 1))
    finish(get, made, "opacity", "normal", displacing)
    return made


def open_pbr(node: Node, shading: Stage, displacing: Stage) -> Surface:
    """OpenPBR Surface 1.1."""
    get = Inputs(node, shading)
    get.ignored({"coat_roughness_anisotropy": 0})
    base = get.product("base_weight", "base_color", 1.0, (0.8, 0.8, 0.8))
    made = Surface(base=get.mixed(base, "subsurface_weight", "subsurface_color", (0.8, 0.8, 0.8)))
    if get.used("base_diffuse_roughness"):
        made.diffuse_roughness = get("base_diffuse_roughness", "float", 0.0)
    made.specular_color = get("specular_color", "color", (1, 1, 1))
    made.roughness = get("specular_roughness", "float", 0.3)
    made.ior = get("specular_ior", "float", 1.5)
    if get.used("specular_weight", 1):  # of the reflectance straight on: section 3.6.2, "Dielectric base"
        made.metal_weight = get("specular_weight", "float", 1.0)
        step = f"({made.ior.text} - 1) / ({made.ior.text} + 1)"
        e = get.let("float", f"sqrt(clamp({made.metal_weight.text} * {step} * {step}, 0, 0.99999))").text
        made.ior = get.let("float", f"(1 + {e}) / (1 - {e})")
    widest = "pow(2 / (1 + {aspect} * {aspect}), 0.25)"
    stretched(get, made, "specular_roughness_anisotropy", "", "(1 - {a})", widest)
    if get.used("base_metalness"):
        made.metalness = get("base_metalness", "float", 0.0)
        made.metal = base
    transmitted(get, made, "transmission_weight", "geometry_thin_walled", "subsurface_weight", "specular_ior")
    if made.transmission and get.used("transmission_dispersion_scale"):
        scale = get("transmission_dispersion_scale", "float", 0.0).text
        abbe = get("transmission_dispersion_abbe_number", "float", 20.0).text
        made.abbe = get.let("float", f"({scale} > 0 ? {abbe} / {scale} : 0)")
    if get.used("fuzz_weight"):
        made.sheen_is_outside = True
        made.sheen = get("fuzz_weight", "float", 0.0)
        made.sheen_color = get("fuzz_color", "color", (1, 1, 1))
        made.sheen_roughness = get("fuzz_roughness", "float", 0.5)
    if get.used("coat_weight"):
        made.coat = get("coat_weight", "float", 0.0)
        made.coat_roughness = get("coat_roughness", "float", 0.0)
        made.coat_ior = get("coat_ior", "float", 1.6)
        made.coat_color = darkened(get, made)
    if get.used("thin_film_weight"):
        made.film = get.let("float", f"1000 * {get('thin_film_thickness', 'float', 0.5).text}")
        made.film_ior = get("thin_film_ior", "float", 1.4)
        if get.used("thin_film_weight", 1):
            made.film_weight = get("thin_film_weight", "float", 0.0)
    if get.used("emission_luminance"):
        made.emission = get.product("emission_luminance", "emission_color", 0.0, (1, 1, 1))
    finish(get, made, "geometry_opacity", "geometry_normal", displacing)
    return made


def darkened(get: Inputs, made: Surface) -> Value:
    """What is seen through a coat: its tint, and what the light loses that is reflected back down inside of it (section
    3.6.4, "Coat darkening": K of a diffuse base, as MaterialX's graph has it)."""
    assert made.coat_ior and made.base
    n = made.coat_ior.text
    k = get.let("float", f"1 - (1 - (({n} - 1) / ({n} + 1)) * (({n} - 1) / ({n} + 1))) / ({n} * {n})").text
    albedo = made.base.text
    if made.metalness and made.metal:
        albedo = get.let("color", f"mix({albedo}, {made.metal.text}, {made.metalness.text})").text
    numbers = ", ".join(f"(1 - {k}) / (1 - {k} * comp({albedo}, {i}))" for i in range(3))
    lost = get.let("color", f"color({numbers})").text
    amount = get("coat_darkening", "float", 1.0).text
    return get.let("color", f"{get('coat_color', 'color', (1, 1, 1)).text} * mix(color(1), {lost}, {amount})")


def transmitted(get: Inputs, made: Surface, weight: str, thin: str, subsurface: str, ior: str) -> None:
    """Both dialects name the rest alike."""
    made.thin_walled = bool(get.node.constant(thin, False))
    if made.thin_walled and get.used(subsurface):
        made.translucence = get(subsurface, "float", 0.0)
    if get.used(weight):
        made.transmission = get(weight, "float", 0.0)
        made.transmission_color = get("transmission_color", "color", (1, 1, 1))
        if not made.thin_walled:
            made.medium = medium(get, ior)


def gltf_pbr(node: Node, shading: Stage, displacing: Stage) -> Surface:
    """glTF 2.0's material with its extensions, as MaterialX's gltf_pbr 2.0.1 has it."""
    get = Inputs(node, shading)
    made = Surface(base=get("base_color", "color", (1, 1, 1)))
    made.roughness = get("roughness", "float", 1.0)
    made.ior = get("ior", "float", 1.5)
    made.specular = get("specular", "float", 1.0)
    made.specular_color = get("specular_color", "color", (1, 1, 1))
    if get.used("anisotropy_strength"):
        # Slopes along the tangent are mix(r^2, 1, a^2) wide, across it r^2 (KHR_materials_anisotropy).
        a, r = get("anisotropy_strength", "float", 0.0).text, made.roughness.text
        along = get.let("float", f"mix({r} * {r}, 1, {a} * {a})").text
        made.anisotropy = get.let("float", f"min(1, (1 - {r} * {r} / max({along}, 1e-6)) / 0.95)")
        made.roughness = get.let("float", f"sqrt({along})")
        made.rotation = Value("float", f"0.25 + {get('anisotropy_rotation', 'float', 0.0).text} / (2 * PI)")
    if get.node.connected("metallic") or get.node.constant("metallic", 1.0) != 0:
        made.metalness = get("metallic", "float", 1.0)
    if get.used("transmission"):
        made.transmission = get("transmission", "float", 0.0)
        made.transmission_color = made.base
        made.thin_walled = not get.used("thickness")
        if get.used("dispersion"):
            scale = get("dispersion", "float", 0.0).text
            made.abbe = get.let("float", f"({scale} > 0 ? 20 / {scale} : 0)")
    if get.used("sheen_color"):
        made.sheen_is_outside = True
        made.sheen = node.network.of_constant(1.0, "float")
        made.sheen_color = get("sheen_color", "color", (0, 0, 0))
        made.sheen_roughness = get("sheen_roughness", "float", 0.0)
    if get.used("clearcoat"):
        made.coat = get("clearcoat", "float", 0.0)
        made.coat_roughness = get("clearcoat_roughness", "float", 0.0)
    if get.used("iridescence"):
        made.film = get("iridescence_thickness", "float", 100.0)
        made.film_ior = get("iridescence_ior", "float", 1.3)
        if get.used("iridescence", 1):
            made.film_weight = get("iridescence", "float", 0.0)
    if get.used("emissive"):
        made.emission = get.product("emissive_strength", "emissive", 1.0, (0, 0, 0))
    mode = int(node.constant("alpha_mode", 0))
    if mode:
        made.presence = get("alpha", "float", 1.0)
    if mode == 1:
        made.presence = get.let("float", f"({made.presence.text} < {get('alpha_cutoff', 'float', 0.5).text} ? 0 : 1)")
    if node.connected("normal"):
        made.normal = node.value("normal", displacing, "vector")
    return made


def unlit(node: Node, shading: Stage, displacing: Stage) -> Surface:
    get = Inputs(node, shading)
    made = Surface(base=node.network.of_constant((0.0, 0.0, 0.0), "color"))
    made.specular = node.network.of_constant(0.0, "float")
    made.emission = get.product("emission", "emission_color", 1.0, (1, 1, 1))
    if get.used("opacity", 1):
        made.presence = get("opacity", "float", 1.0)
    return made


def finish(get: Inputs, made: Surface, opacity: str, normal: str, displacing: Stage) -> None:
    node = get.node
    if node.connected(opacity):
        made.presence = get(opacity, "color", (1, 1, 1)).to("float")
    else:
        value = node.constant(opacity, 1.0)
        mean = sum(value) / 3 if hasattr(value, "__len__") else float(value)
        if mean != 1:
            made.presence = node.network.of_constant(mean, "float")
    if node.connected(normal):
        made.normal = node.value(normal, displacing, "vector")


SURFACES = {
    "ND_standard_surface_surfaceshader": standard_surface,
    "ND_open_pbr_surface_surfaceshader": open_pbr,
    "ND_gltf_pbr_surfaceshader": gltf_pbr,
    "ND_surface_unlit": unlit,
}
