"""The surface that materials of other formats are taken for: one model, of which each material has what it uses.

    emission + coat over (metalness: metal | specular over (transmission: glass | diffuse)), or a mixture of such

UsdPreviewSurface, MaterialX's standard_surface and OpenPBR name its inputs in their own ways (usd/preview.py,
usd/materialx.py), and so do files of models (models.py).
"""

from __future__ import annotations

from copy import deepcopy
from dataclasses import astuple, dataclass, fields

from .rsl import Stage, Value, Writer, shader_text


@dataclass
class Medium:
    """What fills a shape; coefficients per unit of length."""

    ior: float
    absorption: tuple[float, ...]
    scattering: tuple[float, ...]
    mean_cosine: float


@dataclass
class Mixed:
    """Two surfaces: `weight` of the upper one, and the rest of the lower one."""

    upper: Surface
    lower: Surface
    weight: Value


@dataclass(frozen=True)
class Normal:
    """A vector of the displacing stage: in tangent space, from -1 to 1, or in world space."""

    value: Value
    is_world: bool = False

    def bent(self, writer: Writer, uv: Value | None) -> str:
        """From N."""
        text = self.value.to("vector").text
        if self.is_world:
            return f'normalize(ntransform("world", "current", normal({text})))'
        assert uv
        writer.functions["usd_bent"] = BENT
        return f"usd_bent({text}, {uv.text}, {uv.second}, P, N)"


@dataclass
class Surface:
    """Inputs: None = as if there were none of it. Colours are reflectances; roughness is perceptual. Of a mixture only
    what is not of lobes is its own: the interior, presence, displacement; the normal, where its parts share it."""

    mixed: Mixed | None = None
    base: Value | None = None  # color of the diffuse body
    diffuse_roughness: Value | None = None
    translucence: Value | None = None  # how much of a thin-walled body scatters to both sides
    translucence_cosine: Value | None = None  # forwards more of it, from -1 to 1; None = half of it
    metalness: Value | None = None
    metal: Value | None = None  # color of the metal; the base's, where it has none of its own
    metal_weight: Value | None = None
    specular: Value | None = None  # weight of the gloss
    specular_color: Value | None = None  # tint of the gloss
    roughness: Value | None = None
    anisotropy: Value | None = None  # of gloss, metal and glass, as lobes have it
    rotation: Value | None = None  # turns, from the tangent
    tangent: Value | None = None  # vector; None = the direction in which the first texture coordinate grows
    ior: Value | None = None
    f0: Value | None = None  # color: reflectance straight on, in place of ior and metalness
    transmission: Value | None = None
    transmission_color: Value | None = None
    transmission_roughness: Value | None = None  # of the glass, where it differs
    medium: Medium | None = None  # which has that colour in place of the surface
    abbe: Value | None = None
    thin_walled: bool = False
    sheen: Value | None = None
    sheen_color: Value | None = None
    sheen_roughness: Value | None = None
    sheen_is_outside: bool = False  # of the coat; else it lies below the gloss
    coat: Value | None = None
    coat_color: Value | None = None  # what lies below is seen through it
    coat_roughness: Value | None = None
    coat_anisotropy: Value | None = None
    coat_rotation: Value | None = None
    coat_tangent: Value | None = None
    coat_ior: Value | None = None
    film: Value | None = None  # nm
    film_ior: Value | None = None
    film_weight: Value | None = None
    emission: Value | None = None  # radiance
    presence: Value | None = None
    normal: Normal | None = None
    coat_normal: Normal | None = None  # None = the coat is smooth, whatever lies below it
    coat_shares_normal: bool = False
    displacement: Value | None = None  # along the normal, in object space

    def parts(self) -> list[Surface]:
        """Those that have lobes."""
        return [*self.mixed.upper.parts(), *self.mixed.lower.parts()] if self.mixed else [self]

    def has_tangents(self) -> bool:
        """Whether there is a normal in tangent space."""
        normals = (normal for part in self.parts() for normal in (part.normal, part.coat_normal))
        return any(normal and not normal.is_world for normal in normals)


MOST_LOBES = 16  # of a material in the core

# What is seen through a coat.
BELOW = ("base", "metal", "f0", "specular_color", "sheen_color", "transmission_color", "emission")
# Only where there is what they are colours of; the others are white where they are not set.
OF_THEIR_OWN = ("base", "metal", "f0", "emission")

# The angle from dPdu to a tangent, in turns: lobes' rotations are from dPdu.
TURN = """
float usd_turn(vector along; point at; normal n) {
    vector first = Du(at), upright = normalize(vector(n));
    return atan((first ^ along) . upright, first . along) / (2 * PI);
}
"""
# Where a texture coordinate grows.
ALONG = """
vector usd_along(float s; float t; point at) {
    vector along = Du(at) * Dv(t) - Dv(at) * Du(t);
    return Du(s) * Dv(t) - Dv(s) * Du(t) < 0 ? -along : along;
}
"""


SMOOTH = "normalize(N)"
# A normal in tangent space. Tangents along which the texture coordinates grow, from derivatives by the surface's own
# parameters; upright on the normal as Gram and Schmidt have it.
BENT = """
normal usd_bent(vector bent; float s; float t; point at; normal n) {
    float su = Du(s), sv = Dv(s), tu = Du(t), tv = Dv(t);
    float turn = su * tv - sv * tu;
    vector Pu = Du(at), Pv = Dv(at), upright = normalize(n);
    vector along = sign(turn) * (Pu * tv - Pv * tu);
    along -= upright * (along . upright);
    if (turn == 0 || along . along <= 0)
        return normal(upright);
    along = normalize(along);
    vector across = upright ^ along;
    if (across . (sign(turn) * (Pv * su - Pu * sv)) < 0)
        across = -across;
    return normal(normalize(xcomp(bent) * along + ycomp(bent) * across + zcomp(bent) * upright));
}
"""

# A metal's complex index by its reflectance straight on and its tint at the edge (Gulbrandsen, "Artist Friendly
# Metallic Fresnel", JCGT 2014; MaterialX's artistic_ior). OpenPBR's tint at 82 degrees is taken for the same. 20 is
# the most that the lobe has.
ETA = """
color usd_metal_eta(color reflectance; color tint) {
    color r = clamp(reflectance, color(0), color(0.99)), root = sqrt(r);
    return min(mix((color(1) + root) / (color(1) - root), (color(1) - r) / (color(1) + r), tint), color(20));
}
"""
EXTINCTION = """
color usd_metal_k(color reflectance; color n) {
    color r = clamp(reflectance, color(0), color(0.99)), up = n + color(1), down = n - color(1);
    return min(sqrt(max((up * up * r - down * down) / (color(1) - r), color(0))), color(20));
}
"""


# Lobes that have no normal of their own.
SHARING = ("LambertBtdf", "MicrosurfaceDielectricBsdfRgb_v1", "ThinWalledDielectricBsdf", "DiffuseEmission")


class Layers:
    """Lobes and layers of a surface, from the body outwards. `normal`: what N has been bent to. `prefix`: of names in a
    mixture."""

    def __init__(
        self,
        writer: Writer,
        surface: Surface,
        shading: Stage,
        uv: Value | None,
        normal: Normal | None = None,
        prefix: str = "",
    ) -> None:
        self.surface, self.shading, self.writer, self.uv, self.prefix = surface, shading, writer, uv, prefix
        self.bent_to = normal
        self.normals: dict[str, Normal | None] = {}  # members that hold normals of lobes
        self.lobes: list[tuple[str, str, str]] = []  # name, weight, lobe
        self.layers: list[tuple[str, str, str, str, str]] = []  # name, operator, upper, lower, weight
        self.top = ""

    def number(self, name: str, default: str) -> str:
        value = getattr(self.surface, name)
        return value.to("float").text if value else default

    def color(self, name: str, default: str) -> str:
        value = getattr(self.surface, name)
        return value.to("color").text if value else default

    def normal(self, of: str, wanted: Normal | None) -> str:
        """Of lobes that do not stand on N."""
        if wanted == self.bent_to:
            return ""
        self.normals[f"{self.prefix}{of}normal"] = wanted
        return f"{self.prefix}{of}normal"

    def lobe(self, name: str, kind: str, weight: str = "1.0", **inputs: str) -> str:
        s = self.surface
        if name == "coat":
            inputs["normal"] = self.normal("coat_", s.normal if s.coat_shares_normal else s.coat_normal)
        elif kind not in SHARING:
            inputs["normal"] = self.normal("", s.normal)
        given = ", ".join(f'"{key}", {text}' for key, text in inputs.items() if text)
        self.lobes.append((self.prefix + name, weight, f"{kind}({given})"))
        return self.prefix + name

    def layer(self, name: str, operator: str, upper: str, weight: str) -> None:
        self.layers.append((self.prefix + name, operator, upper, self.top, weight))
        self.top = self.prefix + name

    def mix(self, mixed: Mixed) -> None:
        tops = []
        for name, surface in (("fg_", mixed.upper), ("bg_", mixed.lower)):
            part = Layers(self.writer, surface, self.shading, self.uv, self.bent_to, self.prefix + name)
            part.build()
            self.normals |= part.normals
            self.lobes += part.lobes
            self.layers += part.layers
            tops.append(part.top)
        self.top = tops[1]
        self.layer("mixed", "mix", tops[0], mixed.weight.to("float").text)

    def build(self) -> None:
        s = self.surface
        if s.mixed:
            self.mix(s.mixed)
            return
        if s.coat and s.coat_color:
            self.tint()
        self.body()
        if s.sheen and not s.sheen_is_outside:
            self.sheen()
        if s.f0:
            lobe = self.lobe("gloss", "MicrofacetConductorBrdf", reflectance=s.f0.text, **self.facets())
            self.layer("dielectric", "coat", lobe, "1")
        else:
            self.gloss()
            if s.transmission:
                self.transmit()
            if s.metalness:
                self.metal()
        if s.coat:
            ior = self.number("coat_ior", "1.5")
            lobe = self.lobe("coat", "MicrofacetDielectricBrdf", ior=ior, **self.facets("coat_", "0.01"))
            self.layer("coated", "coat", lobe, self.number("coat", "0"))
        if s.sheen and s.sheen_is_outside:
            self.sheen()
        if s.emission:
            self.layer("all", "add", self.lobe("light", "DiffuseEmission", radiance=self.color("emission", "0")), "1")

    def tint(self) -> None:
        s = self.surface
        assert s.coat and s.coat_color
        text = f"mix(color(1), {s.coat_color.text}, {self.number('coat', '0')})"
        seen = self.writer.let(self.shading, Value("color", text)).text
        for name in BELOW:
            if name == "sheen_color" and s.sheen_is_outside:
                continue
            was = getattr(s, name) or (None if name in OF_THEIR_OWN else Value("color", "color(1)"))
            if was:
                below = Value("color", f"{was.to('color').text} * {seen}")
                setattr(s, name, self.writer.let(self.shading, below))

    def facets(self, of: str = "", roughness: str = "0.5") -> dict[str, str]:
        """Inputs of microfacets: of the coat, where `of` is "coat_"."""
        found = {"roughness": self.number(f"{of}roughness", roughness)}
        if getattr(self.surface, f"{of}anisotropy"):
            key = f"{self.prefix}{of}rotation"
            if key not in self.shading.known:
                self.writer.functions["usd_turn"] = TURN
                turn = f"mod({self.number(f'{of}rotation', '0')} + usd_turn({self.tangent(of)}, P, N), 1)"
                self.shading.known[key] = self.writer.let(self.shading, Value("float", turn))
            found |= {"anisotropy": self.number(f"{of}anisotropy", "0"), "rotation": self.shading.known[key].text}
        return found

    def tangent(self, of: str) -> str:
        if own := getattr(self.surface, f"{of}tangent"):
            return own.text
        st = self.uv or self.writer.primvar("st", "float2")
        self.writer.functions["usd_along"] = ALONG
        return f"usd_along({st.text}, {st.second}, P)"

    def body(self) -> None:
        s = self.surface
        inputs = {"diffuseReflectance": self.color("base", "color(0.18)")}
        if s.diffuse_roughness:
            self.top = self.lobe("body", "OrenNayarBrdf", roughness=self.number("diffuse_roughness", "0"), **inputs)
        else:
            self.top = self.lobe("body", "LambertBrdf", **inputs)
        if s.translucence:
            lobe = self.lobe("beyond", "LambertBtdf", diffuseTransmittance=self.color("base", "color(0.18)"))
            on = f"0.5 * (1 + {self.number('translucence_cosine', '0')})"
            self.layer("thin", "mix", lobe, f"{on} * {self.number('translucence', '0')}")

    def sheen(self) -> None:
        rough = self.number("sheen_roughness", "0.3")
        lobe = self.lobe("sheen", "SheenBrdf", reflectance=self.color("sheen_color", "color(1)"), roughness=rough)
        self.layer("fuzzy", "coat", lobe, self.number("sheen", "0"))

    def gloss(self) -> None:
        s = self.surface
        inputs = {"ior": self.number("ior", "1.5"), **self.facets()}
        if s.specular_color:
            inputs["reflectance"] = self.color("specular_color", "color(1)")
        weight = self.number("specular", "1")
        if s.film and s.film_weight:  # with a film in part: both, the lower one in what is left
            self.layer("dielectric", "coat", self.lobe("gloss", "MicrofacetDielectricBrdf", **inputs), weight)
            covered = f"{weight} * {self.number('film_weight', '1')}"
        else:
            covered = weight
        if s.film:
            film = {"filmThickness": self.number("film", "0"), "filmIor": self.number("film_ior", "1.5")}
            lobe = self.lobe("film", "MicrofacetDielectricBrdf", **inputs, **film)
            self.layer("filmed", "coat", lobe, covered)
        else:
            self.layer("dielectric", "coat", self.lobe("gloss", "MicrofacetDielectricBrdf", **inputs), weight)

    def transmit(self) -> None:
        s = self.surface
        tint = "color(1)" if s.medium else self.color("transmission_color", "color(1)")
        ior = self.number("ior", "1.5")
        rough = self.number("transmission_roughness", self.number("roughness", "0.5"))
        if s.thin_walled:
            lobe = self.lobe("glass", "ThinWalledDielectricBsdf", transmittance=tint, roughness=rough, ior=ior)
        else:
            facets = self.facets() | {"roughness": f"color({rough})"}
            abbe = self.number("abbe", "")
            lobe = self.lobe(
                "glass", "MicrosurfaceDielectricBsdfRgb_v1", transmittance=tint, ior=ior, abbe=abbe, **facets
            )
        self.layer("through", "mix", lobe, self.number("transmission", "0"))

    def metal(self) -> None:
        s = self.surface
        color = self.color("metal", self.color("base", "color(0.18)"))
        edge = self.color("specular_color", "") if s.metal else ""
        weight, metalness = self.number("metal_weight", "1.0"), self.number("metalness", "0")
        film = self.number("film_weight", "1")
        if not s.film or s.film_weight:
            bare = self.lobe(
                "metal", "MicrofacetConductorBrdf", weight, reflectance=color, edgeTint=edge, **self.facets()
            )
            # Of what the film's metal leaves, which comes over it.
            left = f"{metalness} * (1 - {film}) / max(1 - {metalness} * {film}, 1e-6)"
            self.layer("base", "mix", bare, left if s.film else metalness)
        if s.film:
            self.layer("filmed_base", "mix", self.filmed_metal(color, edge, weight), f"{metalness} * {film}")

    def filmed_metal(self, color: str, edge: str, weight: str) -> str:
        self.writer.functions |= {"usd_metal_eta": ETA, "usd_metal_k": EXTINCTION}
        eta = self.writer.let(self.shading, Value("color", f"usd_metal_eta({color}, {edge or 'color(1)'})")).text
        inputs = {"eta": eta, "extinction": f"usd_metal_k({color}, {eta})", **self.facets()}
        film = {"filmThickness": self.number("film", "0"), "filmIor": self.number("film_ior", "1.5")}
        return self.lobe("filmed_metal", "MetalBrdf", weight, **inputs, **film)


def lobes_of(surface: Surface) -> int:
    """How many there are."""
    made = Layers(Writer(), deepcopy(surface), Stage(), None)
    made.build()
    return len(made.lobes)


def text_of(writer: Writer, surface: Surface, shading: Stage, displacing: Stage, uv: Value | None) -> str:
    """RSL. `shading` and `displacing` hold the statements that the surface's values need; `uv` are the coordinates that
    the normal's tangents follow."""
    for part in (surface, *surface.parts()):
        for each in fields(part):
            value = getattr(part, each.name)
            if isinstance(value, Normal) and not (value.is_world or uv):
                setattr(part, each.name, None)  # there are no tangents
            if isinstance(value, Value) and each.name != "displacement":
                setattr(part, each.name, writer.let(shading, value))
    made = Layers(writer, surface, shading, uv, surface.normal)
    made.build()
    begin = ["MnkMaterialBoundary boundary = CreateBoundary(material);"]
    shade = list(shading.lines)
    for name, weight, lobe in made.lobes:
        begin.append(f'AddLobe(boundary, "{name}", {lobe.partition("(")[0]}());')
        shade.append(f'SetLobe(boundary, "{name}", {weight}, {lobe});')
    for name, operator, upper, lower, weight in made.layers:
        begin.append(f'AddLayer(boundary, "{name}", "{operator}", "{upper}", "{lower}");')
        shade.append(f'SetLayer(boundary, "{name}", {weight});')
    if surface.presence:
        shade.append(f"SetPresence(boundary, {surface.presence.to('float').text});")
    methods = {
        "mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)": begin,
        "mnk_prelighting(output MnkMaterialBoundary boundary)": shade,
    }
    if surface.medium:
        ior, absorbed, scattered, cosine = (
            writer.constant(kind, value).text
            for kind, value in zip(("float", "color", "color", "float"), astuple(surface.medium), strict=True)
        )
        begin.append(f'MnkMaterialInterior inside = CreateInterior(material, "homogeneous", {ior});')
        inside = [f"SetAbsorption(inside, {absorbed});", f"SetScattering(inside, {scattered});"]
        if any(surface.medium.scattering):
            begin.append('AddPhaseFunction(inside, "phase", HenyeyGreensteinPfrgb());')
            inside.append(f'SetPhaseFunction(inside, "phase", HenyeyGreensteinPfrgb("meanCosine", color({cosine})));')
        methods["mnk_interior(output MnkMaterialInterior inside)"] = inside
    if surface.displacement or surface.normal or made.normals:
        lines = displacement_lines(writer, surface, made.normals, displacing, uv)
        methods["mnk_displacement(output point P; output normal N)"] = lines
    return shader_text(writer, methods)


def displacement_lines(
    writer: Writer, s: Surface, of_lobes: dict[str, Normal | None], displacing: Stage, uv: Value | None
) -> list[str]:
    lines = list(displacing.lines)
    if s.displacement:
        lines += [
            f"P += {s.displacement.to('float').text} * normalize(N);",
            "N = normalize(calculatenormal(P));",
        ]
    for member, normal in of_lobes.items():
        writer.members.append(f"normal {member};")
        lines.append(f"{member} = {normal.bent(writer, uv) if normal else SMOOTH};")
    if s.normal:
        lines.append(f"N = {s.normal.bent(writer, uv)};")
    return lines
