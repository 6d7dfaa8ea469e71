"""MaterialX's surfaces: what the inputs of each are to the model that all are taken for (surface.py)."""

from __future__ import annotations

from kanuka.looks.rsl import Stage, Value
from kanuka.looks.surface import Surface

from .inputs import Inputs, Stretch, bent, medium, stretched, stretched_coat, tangent_of
from .network import Node

STANDARD = Stretch("(1 - 0.9 * {a})", "pow({aspect}, -0.25)")
OPEN = Stretch("(1 - {a})", "pow(2 / (1 + {aspect} * {aspect}), 0.25)")


def standard_surface(node: Node, shading: Stage, displacing: Stage) -> Surface:
    """Autodesk Standard Surface 1.0.1, Georgiev et al. 2019."""
    get = Inputs(node, shading)
    base, below = get.product("base", "base_color", 1.0, (0.8, 0.8, 0.8)), "{color}"
    if get.used("coat") and get.used("coat_affect_color"):
        gamma = f"1 + clamp({get('coat', 'float', 0.0).text}, 0, 1) * {get('coat_affect_color', 'float', 0.0).text}"
        below = f"pow(max({{color}}, color(0)), color({get.let('float', gamma).text}))"
    made = Surface(base=standard_body(get, below))
    if get.used("diffuse_roughness"):
        made.diffuse_roughness = get("diffuse_roughness", "float", 0.0)
    made.specular = get("specular", "float", 1.0)
    made.specular_color = get("specular_color", "color", (1, 1, 1))
    made.ior = get("specular_IOR", "float", 1.5)
    standard_roughness(get, made)
    stretched(get, made, "specular_anisotropy", "specular_rotation", "tangent", STANDARD)
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
        stretched_coat(get, made, "coat_anisotropy", "coat_rotation", "tangent", STANDARD)
        if get.used("coat_color", 1):
            made.coat_color = get("coat_color", "color", (1, 1, 1))
    if get.used("thin_film_thickness"):
        made.film = get("thin_film_thickness", "float", 0.0)
        made.film_ior = get("thin_film_IOR", "float", 1.5)
    if get.used("emission"):
        made.emission = get.product("emission", "emission_color", 0.0, (1, 1, 1))
    presence(get, made, "opacity")
    bent(get, made, "normal", "coat_normal", displacing)
    return made


def standard_body(get: Inputs, below: str) -> Value:
    """The body's colour, and that of what scatters below it; `below` is what a coat makes of {color}."""
    color = below.format(color=get("base_color", "color", (0.8, 0.8, 0.8)).text)
    base = get.let("color", f"{get('base', 'float', 1.0).text} * {color}")
    if not get.used("subsurface"):
        return base
    inside = below.format(color=get("subsurface_color", "color", (1, 1, 1)).text)
    return get.let("color", f"mix({base.text}, {inside}, {get('subsurface', 'float', 0.0).text})")


def standard_roughness(get: Inputs, made: Surface) -> None:
    """A rough coat roughens what is below it, as far as `coat_affect_roughness` says. The extra roughness is that of
    the glass: its reflection has it too, which in MaterialX has that of the gloss."""
    rough = {"roughness": get("specular_roughness", "float", 0.2)}
    if get.used("transmission_extra_roughness"):
        more = get("transmission_extra_roughness", "float", 0.0).text
        rough["transmission_roughness"] = get.let("float", f"clamp({rough['roughness'].text} + {more}, 0, 1)")
    if get.used("coat") and get.used("coat_affect_roughness"):
        inputs = (("coat_affect_roughness", 0.0), ("coat", 0.0), ("coat_roughness", 0.1))
        part = get.let("float", " * ".join(get(name, "float", default).text for name, default in inputs)).text
        rough = {name: get.let("float", f"mix({value.text}, 1, {part})") for name, value in rough.items()}
    made.roughness, made.transmission_roughness = rough["roughness"], rough.get("transmission_roughness")


def open_pbr(node: Node, shading: Stage, displacing: Stage) -> Surface:
    """OpenPBR Surface 1.1."""
    get = Inputs(node, shading)
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
    if get.used("coat_weight"):  # a rough coat roughens what is below it: OpenPBR, "Coat roughening"
        inputs = (("coat_roughness", 0.0), ("coat_weight", 0.0))
        above, weight = (get(name, "float", default).text for name, default in inputs)
        rough = made.roughness.text
        both = f"pow(min(1, pow({rough}, 4) + 2 * pow({above}, 4)), 0.25)"
        made.roughness = get.let("float", f"mix({rough}, {both}, {weight})")
    stretched(get, made, "specular_roughness_anisotropy", "", "geometry_tangent", OPEN)
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
        stretched_coat(get, made, "coat_roughness_anisotropy", "", "geometry_coat_tangent", OPEN)
    if get.used("thin_film_weight"):
        made.film = get.let("float", f"1000 * {get('thin_film_thickness', 'float', 0.5).text}")
        made.film_ior = get("thin_film_ior", "float", 1.4)
        if get.used("thin_film_weight", 1):
            made.film_weight = get("thin_film_weight", "float", 0.0)
    if get.used("emission_luminance"):
        made.emission = get.product("emission_luminance", "emission_color", 0.0, (1, 1, 1))
    presence(get, made, "geometry_opacity")
    bent(get, made, "geometry_normal", "geometry_coat_normal", displacing)
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
    made.thin_walled = bool(get.node.number(thin, 0))
    if made.thin_walled and get.used(subsurface):
        made.translucence = get(subsurface, "float", 0.0)
        if get.used("subsurface_scatter_anisotropy"):  # OpenPBR's alone: "Thin-walled case"
            made.translucence_cosine = get("subsurface_scatter_anisotropy", "float", 0.0)
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
        made.tangent = tangent_of(get, "tangent")
    if get.node.connected("metallic") or get.node.number("metallic", 1.0) != 0:
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
    mode = int(node.number("alpha_mode", 0))
    if mode:
        made.presence = get("alpha", "float", 1.0)
    if mode == 1:
        made.presence = get.let("float", f"({made.presence.text} < {get('alpha_cutoff', 'float', 0.5).text} ? 0 : 1)")
    bent(get, made, "normal", "clearcoat_normal", displacing)
    return made


def unlit(node: Node, shading: Stage, displacing: Stage) -> Surface:
    get = Inputs(node, shading)
    made = Surface(base=node.network.of_constant((0.0, 0.0, 0.0), "color"))
    made.specular = node.network.of_constant(0.0, "float")
    made.emission = get.product("emission", "emission_color", 1.0, (1, 1, 1))
    if get.used("opacity", 1):
        made.presence = get("opacity", "float", 1.0)
    return made


def presence(get: Inputs, made: Surface, opacity: str) -> None:
    node = get.node
    if node.connected(opacity):
        made.presence = get(opacity, "color", (1, 1, 1)).to("float")
    else:
        value = node.constant(opacity, 1.0)
        mean = sum(value) / 3 if hasattr(value, "__len__") else float(value)
        if mean != 1:
            made.presence = node.network.of_constant(mean, "float")


SURFACES = {
    "ND_standard_surface_surfaceshader": standard_surface,
    "ND_open_pbr_surface_surfaceshader": open_pbr,
    "ND_gltf_pbr_surfaceshader": gltf_pbr,
    "ND_surface_unlit": unlit,
}
