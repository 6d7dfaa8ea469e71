"""MaterialX's nodes and surfaces, against what its specification says of them in numbers."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

mx = pytest.importorskip("MaterialX")
from pxr import Gf, Sdf, Usd, UsdShade  # noqa: E402

import kanuka  # noqa: E402
from kanuka.looks.files import Files  # noqa: E402
from kanuka.usd import library  # noqa: E402
from kanuka.usd.materials import Made, Materials  # noqa: E402

N = 8
SHIFT = 8.0
TYPES = {
    "float": Sdf.ValueTypeNames.Float,
    "integer": Sdf.ValueTypeNames.Int,
    "boolean": Sdf.ValueTypeNames.Bool,
    "color3": Sdf.ValueTypeNames.Color3f,
    "color4": Sdf.ValueTypeNames.Color4f,
    "vector2": Sdf.ValueTypeNames.Float2,
    "vector3": Sdf.ValueTypeNames.Float3,
    "vector4": Sdf.ValueTypeNames.Float4,
    "string": Sdf.ValueTypeNames.String,
    "filename": Sdf.ValueTypeNames.Asset,
}


class Graph:
    """A material whose emission is what a node gives."""

    def __init__(self) -> None:
        self.stage = Usd.Stage.CreateInMemory()
        self.material = UsdShade.Material.Define(self.stage, "/m")
        self.surface = self.node("surface", "ND_standard_surface_surfaceshader", emission=1.0)
        self.material.CreateSurfaceOutput("mtlx").ConnectToSource(
            self.surface.CreateOutput("surface", Sdf.ValueTypeNames.Token)
        )
        self.told: list[str] = []

    def node(self, name: str, identifier: str, **inputs) -> UsdShade.Shader:
        """Inputs are values, or (node, output)."""
        shader = UsdShade.Shader.Define(self.stage, f"/m/{name}")
        shader.CreateIdAttr(identifier)
        definition = library.definition(identifier)
        for key, value in inputs.items():
            key = key.rstrip("_")
            port = shader.CreateInput(key, TYPES[definition.getActiveInput(key).getType()])
            if isinstance(value, tuple) and isinstance(value[0], UsdShade.Shader):
                port.ConnectToSource(value[0].GetOutput(value[1]))
            else:
                port.Set(value)
        for output in definition.getActiveOutputs():
            if output.getType() in TYPES:
                shader.CreateOutput(output.getName(), TYPES[output.getType()])
        return shader

    def emit(self, shader: UsdShade.Shader, output: str = "out") -> None:
        port = self.surface.CreateInput("emission_color", Sdf.ValueTypeNames.Color3f)
        port.ConnectToSource(shader.GetOutput(output))

    def made(self) -> tuple[Made, kanuka.CompiledShader]:
        materials = Materials(lambda kind, text: self.told.append(text), Files(), Usd.TimeCode.Default())
        made = materials.of(self.material)
        assert made is not None
        return made, kanuka.compile_shader(materials._files.folder / f"{made.shader}.sl")

    def run(self, what: str = "light.radiance", **primvars) -> np.ndarray:
        """(N, N, 3) over the unit square, with s and t the texture coordinates."""
        made, shader = self.made()
        s, t = coordinates()
        known = {p["name"] for p in shader.parameters}
        values = {k: v for k, v in {"usd_st_0": s, "usd_st_1": t, **primvars}.items() if k in known}
        return shader.run(N, N, plain(made) | values)["slots"][what]


def plain(made: Made) -> dict[str, object]:
    """Its parameters by names without types."""
    return {name.split()[-1]: value for name, value in made.parameters.items()}


def coordinates() -> tuple[np.ndarray, np.ndarray]:
    u = np.linspace(0, 1, N, dtype=np.float32)
    return np.broadcast_to(u, (N, N)).copy(), np.broadcast_to(u[:, None], (N, N)).copy()


def evaluated(identifier: str, **inputs) -> np.ndarray:
    """What a node gives where `S`, `T` and `ST` stand for the texture coordinates. (N, N, 3)"""
    graph = Graph()
    st = graph.node("st", "ND_texcoord_vector2")
    s = graph.node("s", "ND_extract_vector2", in_=(st, "out"), index=0)
    t = graph.node("t", "ND_extract_vector2", in_=(st, "out"), index=1)
    known = {"S": (s, "out"), "T": (t, "out"), "ST": (st, "out")}
    given = {k: known.get(v, v) if isinstance(v, str) else v for k, v in inputs.items()}
    node = graph.node("tested", identifier, **given)
    kind = library.definition(identifier).getActiveOutputs()[0].getType()
    if kind != "color3":  # numbers of all kinds, the fourth in place of the third
        last = {"vector4": "vector4", "color4": "color4"}.get(kind)
        if last:
            parts = [graph.node(f"e{i}", f"ND_extract_{last}", in_=(node, "out"), index=i) for i in (0, 1, 3)]
        elif kind in ("vector2", "vector3"):
            parts = [
                graph.node(f"e{i}", f"ND_extract_{kind}", in_=(node, "out"), index=i)
                for i in range(2 if kind == "vector2" else 3)
            ]
        else:
            parts = [node] * 3
        node = graph.node("all", "ND_combine3_color3", **{f"in{i + 1}": (p, "out") for i, p in enumerate(parts)})
    graph.emit(graph.node("shifted", "ND_add_color3FA", in1=(node, "out"), in2=SHIFT))  # radiance is not negative
    found = graph.run()
    assert graph.told == []
    return found - SHIFT


S, T = coordinates()
ZERO = np.zeros_like(S)


def rgb(*numbers) -> np.ndarray:
    return np.stack(np.broadcast_arrays(*(numbers if len(numbers) > 1 else numbers * 3)), -1)


def rodrigues(v, angle, axis):
    """v turned about the axis: v' = v M, MaterialX's way round."""
    a, c, s = np.array(axis) / np.linalg.norm(axis), math.cos(math.radians(angle)), math.sin(math.radians(angle))
    return v * c + np.cross(v, a) * s + a * (v @ a)[..., None] * (1 - c)


P = rgb(S, T, ZERO)
C35, S35 = math.cos(math.radians(35)), math.sin(math.radians(35))

CASES = {
    # numbers
    "ND_add_color3FA": (dict(in1=Gf.Vec3f(1, 2, 3), in2="S"), rgb(1 + S, 2 + S, 3 + S)),
    "ND_subtract_vector2": (dict(in1="ST", in2=Gf.Vec2f(1, 0.5)), rgb(S - 1, T - 0.5, ZERO)),
    "ND_multiply_vector4FA": (dict(in1=Gf.Vec4f(1, 2, 3, 4), in2="S"), rgb(S, 2 * S, 4 * S)),
    "ND_divide_float": (dict(in1=1.0, in2="S"), rgb(np.divide(1, S, where=S > 0, out=np.zeros_like(S)))),
    "ND_power_color3FA": (dict(in1=Gf.Vec3f(0.5, 1, 2), in2="T"), rgb(0.5**T, T * 0 + 1, 2**T)),
    "ND_modulo_float": (dict(in1="S", in2=0.3), rgb(np.mod(S, np.float32(0.3)))),
    "ND_fract_float": (dict(in_="S"), rgb(np.mod(S, 1))),
    "ND_round_float": (dict(in_="S"), rgb(np.round(S))),
    "ND_sign_vector2": (dict(in_="ST"), rgb(np.sign(S), np.sign(T), ZERO)),
    "ND_ln_float": (dict(in_=2.5), rgb(math.log(2.5) + ZERO)),
    "ND_atan2_float": (dict(iny="S", inx="T"), rgb(np.arctan2(S, T))),
    "ND_asin_float": (dict(in_="S"), rgb(np.arcsin(S))),
    "ND_tan_float": (dict(in_="S"), rgb(np.tan(S))),
    "ND_remap_float": (dict(in_="S", inlow=0.2, inhigh=0.6, outlow=1.0, outhigh=3.0), rgb(1 + (S - 0.2) * 5)),
    "ND_range_float": (
        dict(in_="S", inlow=0.2, inhigh=0.6, gamma=2.0, outlow=1.0, outhigh=3.0, doclamp=True),
        rgb(1 + 2 * np.clip((S - 0.2) / 0.4, 0, 1) ** 0.5),
    ),
    "ND_smoothstep_float": (
        dict(in_="S", low=0.2, high=0.8),
        rgb((x := np.clip((S - 0.2) / 0.6, 0, 1)) ** 2 * (3 - 2 * x)),
    ),
    # channels
    "ND_combine4_color4": (dict(in1=1.0, in2="S", in3=0.0, in4="T"), rgb(ZERO + 1, S, T)),
    "ND_combine2_color4CF": (dict(in1=Gf.Vec3f(1, 2, 3), in2="T"), rgb(ZERO + 1, ZERO + 2, T)),
    "ND_convert_float_color4": (dict(in_="S"), rgb(S, S, S)),
    "ND_convert_color3_color4": (dict(in_=Gf.Vec3f(1, 2, 3)), rgb(ZERO + 1, ZERO + 2, ZERO + 1)),
    "ND_premult_color4": (dict(in_=Gf.Vec4f(1, 2, 3, 0.5)), rgb(ZERO + 0.5, ZERO + 1, ZERO + 0.5)),
    "ND_unpremult_color4": (dict(in_=Gf.Vec4f(1, 2, 3, 0.5)), rgb(ZERO + 2, ZERO + 4, ZERO + 0.5)),
    "ND_luminance_color3": (dict(in_=Gf.Vec3f(1, 0, 0)), rgb(ZERO + 0.2126)),
    "ND_rgbtohsv_color3": (dict(in_=Gf.Vec3f(0.2, 0.6, 0.4)), rgb(ZERO + 5 / 12, ZERO + 2 / 3, ZERO + 0.6)),
    "ND_hsvtorgb_color3": (dict(in_=Gf.Vec3f(5 / 12, 2 / 3, 0.6)), rgb(ZERO + 0.2, ZERO + 0.6, ZERO + 0.4)),
    "ND_contrast_float": (dict(in_="S", amount=2.0, pivot=0.25), rgb((S - 0.25) * 2 + 0.25)),
    "ND_saturate_color3": (dict(in_=Gf.Vec3f(1, 0, 0), amount=0.5), rgb(ZERO + 0.6063, ZERO + 0.1063, ZERO + 0.1063)),
    "ND_hsvadjust_color3": (
        dict(in_=Gf.Vec3f(0.2, 0.6, 0.4), amount=Gf.Vec3f(0.5, 1, 0.5)),
        rgb(ZERO + 0.3, ZERO + 0.1, ZERO + 0.2),
    ),
    # vectors
    "ND_dotproduct_vector2": (dict(in1="ST", in2=Gf.Vec2f(2, 3)), rgb(2 * S + 3 * T)),
    "ND_crossproduct_vector3": (dict(in1=Gf.Vec3f(1, 2, 3), in2=Gf.Vec3f(0, 1, 0)), rgb(ZERO - 3, ZERO, ZERO + 1)),
    "ND_magnitude_vector2": (dict(in_="ST"), rgb(np.hypot(S, T))),
    "ND_normalize_vector3": (dict(in_=Gf.Vec3f(3, 0, 4)), rgb(ZERO + 0.6, ZERO, ZERO + 0.8)),
    "ND_distance_vector2": (dict(in1="ST", in2=Gf.Vec2f(0, 1)), rgb(np.hypot(S, T - 1))),
    "ND_rotate2d_vector2": (dict(in_="ST", amount=35.0), rgb(C35 * S + S35 * T, C35 * T - S35 * S, ZERO)),
    "ND_rotate3d_vector3": (
        dict(in_=Gf.Vec3f(1, 2, 3), amount=35.0, axis=Gf.Vec3f(1, 1, 0)),
        rodrigues(np.broadcast_to(np.array([1.0, 2, 3]), (N, N, 3)), 35, (1, 1, 0)),
    ),
    "ND_place2d_vector2": (
        dict(texcoord="ST", scale=Gf.Vec2f(2, 4), offset=Gf.Vec2f(0.5, 0.25)),
        rgb(S / 2 - 0.5, T / 4 - 0.25, ZERO),
    ),
    "ND_reflect_vector3": (dict(in_=Gf.Vec3f(1, -1, 0), normal=Gf.Vec3f(0, 1, 0)), rgb(ZERO + 1, ZERO + 1, ZERO)),
    # choices
    "ND_ifgreater_color3": (
        dict(value1="S", value2=0.5, in1=Gf.Vec3f(1, 2, 3), in2=Gf.Vec3f(0)),
        np.where((S > 0.5)[..., None], [1, 2, 3], 0),
    ),
    "ND_ifgreatereq_float": (dict(value1="S", value2=1.0, in1="T", in2=0.0), rgb(np.where(S >= 1, T, 0))),
    "ND_ifequal_float": (dict(value1="S", value2=0.0, in1=1.0, in2=2.0), rgb(np.where(S == 0, 1.0, 2))),
    "ND_switch_float": (dict(in1=5.0, in2=6.0, in3="S", which=2.0), rgb(S)),
    # compositing
    "ND_mix_color3": (dict(fg=Gf.Vec3f(1, 2, 3), bg=Gf.Vec3f(0), mix="S"), rgb(S, 2 * S, 3 * S)),
    "ND_plus_float": (dict(fg="S", bg="T", mix=0.5), rgb(0.5 * (S + T) + 0.5 * T)),
    "ND_minus_float": (dict(fg="S", bg="T"), rgb(T - S)),
    "ND_difference_float": (dict(fg="S", bg="T"), rgb(np.abs(T - S))),
    "ND_screen_float": (dict(fg="S", bg="T"), rgb(1 - (1 - S) * (1 - T))),
    "ND_burn_float": (dict(fg="S", bg="T"), rgb(np.where(S == 0, 0, 1 - (1 - T) / np.where(S == 0, 1, S)))),
    "ND_dodge_float": (dict(fg=0.25, bg="T"), rgb(T / 0.75)),
    "ND_overlay_float": (dict(fg="S", bg="T"), rgb(np.where(T < 0.5, 2 * S * T, 1 - 2 * (1 - S) * (1 - T)))),
    "ND_over_color4": (
        dict(fg=Gf.Vec4f(0.5, 0.25, 0, 0.5), bg=Gf.Vec4f(1, 1, 0, 0.5)),
        rgb(ZERO + 1, ZERO + 0.75, ZERO + 0.75),
    ),
    "ND_in_color4": (dict(fg=Gf.Vec4f(1, 2, 3, 1), bg=Gf.Vec4f(0, 0, 0, 0.5)), rgb(ZERO + 0.5, ZERO + 1, ZERO + 0.5)),
    "ND_out_color4": (
        dict(fg=Gf.Vec4f(1, 2, 3, 1), bg=Gf.Vec4f(0, 0, 0, 0.75)),
        rgb(ZERO + 0.25, ZERO + 0.5, ZERO + 0.25),
    ),
    "ND_mask_color4": (dict(fg=Gf.Vec4f(0, 0, 0, 0.5), bg=Gf.Vec4f(1, 2, 3, 1)), rgb(ZERO + 0.5, ZERO + 1, ZERO + 0.5)),
    "ND_matte_color4": (
        dict(fg=Gf.Vec4f(1, 2, 0, 0.5), bg=Gf.Vec4f(0, 1, 0, 0.5)),
        rgb(ZERO + 0.5, ZERO + 1.5, ZERO + 0.75),
    ),
    "ND_disjointover_color4": (
        dict(fg=Gf.Vec4f(1, 0, 0, 0.75), bg=Gf.Vec4f(0, 1, 0, 0.5)),
        rgb(ZERO + 1, ZERO + 0.5, ZERO + 1),
    ),
    "ND_inside_color3": (dict(in_=Gf.Vec3f(1, 2, 3), mask="S"), rgb(S, 2 * S, 3 * S)),
    "ND_outside_float": (dict(in_="S", mask=0.25), rgb(0.75 * S)),
    # patterns
    "ND_ramplr_float": (dict(valuel=1.0, valuer=3.0), rgb(1 + 2 * S)),
    "ND_ramptb_float": (dict(valuet=1.0, valueb=3.0), rgb(3 - 2 * T)),
    "ND_splitlr_float": (dict(valuel=1.0, valuer=3.0, center=0.4), rgb(np.where(S < 0.4, 1.0, 3))),
    "ND_splittb_float": (dict(valuet=1.0, valueb=3.0, center=0.4), rgb(np.where(T < 0.4, 3.0, 1))),
    "ND_ramp4_float": (
        dict(valuetl=1.0, valuetr=2.0, valuebl=3.0, valuebr=4.0),
        rgb((1 - T) * (3 + S) + T * (1 + S)),
    ),
}


@pytest.mark.parametrize("identifier", list(CASES))
def test_nodes_have_the_values_of_the_specification(identifier: str):
    inputs, expected = CASES[identifier]
    assert evaluated(identifier, **inputs) == pytest.approx(expected, abs=2e-5, rel=2e-5)


NOT_KNOWN = {
    *(f"ND_transformmatrix_{kind}" for kind in ("vector2M3", "vector3", "vector3M4", "vector4")),
    *(f"ND_determinant_{kind}" for kind in ("matrix33", "matrix44")),
    *("ND_flake2d", "ND_flake3d", "ND_viewdirection_vector3"),
}


def test_every_pattern_node_of_the_library_is_known():
    """All are evaluated, many in one shader: nothing is told, and no value is out of bounds."""
    groups = ("adjustment", "application", "channel", "colortransform", "compositing", "conditional", "geometric")
    groups += ("math", "procedural", "procedural2d", "procedural3d", "texture2d", "texture3d", "convolution2d", "npr")
    unknown, tested = [], 0
    definitions = [d for d in library.document().getNodeDefs() if d.getNodeGroup() in groups]
    assert len(definitions) > 500
    for begin in range(0, len(definitions), 60):
        graph, last = Graph(), None
        for i, definition in enumerate(definitions[begin : begin + 60]):
            output = definition.getActiveOutputs()[0]
            if output.getType() not in TYPES or output.getType() in ("string", "filename"):
                continue
            node = graph.node(f"n{i}", definition.getName())
            kind = {"integer": "float", "boolean": "float"}.get(output.getType(), output.getType())
            if kind != "color3":
                node.GetOutput(output.getName())
                add = graph.node(f"c{i}", "ND_convert_float_color3")
                add.CreateInput("in", TYPES[output.getType()]).ConnectToSource(node.GetOutput(output.getName()))
                node, name = add, "out"
            else:
                name = output.getName()
            last = graph.node(f"a{i}", "ND_add_color3", in1=(node, name), in2=(last, "out") if last else Gf.Vec3f(0))
            tested += 1
        graph.emit(last)
        assert np.isfinite(graph.run()).all()
        unknown += graph.told
    missing = {text.split('"')[1] for text in unknown if "there is no node" in text}
    assert tested > 400
    assert missing == NOT_KNOWN


def test_graphs_that_run_in_circles_are_cut(tmp_path: Path):
    graph = Graph()
    a = graph.node("a", "ND_add_color3", in2=Gf.Vec3f(1, 0, 0))
    b = graph.node("b", "ND_add_color3", in1=(a, "out"))
    a.CreateInput("in1", TYPES["color3"]).ConnectToSource(b.GetOutput("out"))
    graph.emit(b)
    graph.run()
    assert any("circle" in text for text in graph.told)


def test_nodes_that_nobody_knows_are_named(tmp_path: Path):
    graph = Graph()
    odd = UsdShade.Shader.Define(graph.stage, "/m/odd")
    odd.CreateIdAttr("ND_teapot_color3")
    odd.CreateOutput("out", TYPES["color3"])
    graph.emit(odd)
    graph.run()
    assert graph.told == ['/m: there is no node "ND_teapot_color3" (/m/odd); its default stands']


# ---- surfaces


def slots(identifier: str, **inputs) -> tuple[dict[str, np.ndarray], list[str], list]:
    graph = Graph()
    graph.surface = graph.node("other", identifier, **inputs)
    graph.material.CreateSurfaceOutput("mtlx").ConnectToSource(
        graph.surface.CreateOutput("surface", Sdf.ValueTypeNames.Token)
    )
    made, shader = graph.made()
    result = shader.run(2, 2, plain(made))
    return {k: np.asarray(v)[0, 0] for k, v in result["slots"].items()}, graph.told, result["program"]


STANDARD, OPEN, GLTF = (
    "ND_standard_surface_surfaceshader",
    "ND_open_pbr_surface_surfaceshader",
    "ND_gltf_pbr_surfaceshader",
)


WIDE = 0.25 * math.sqrt(2 / 1.16)


def test_subsurface_is_a_colour_of_the_body():
    found, told, _ = slots(
        STANDARD, base_color=Gf.Vec3f(1, 0, 0), base=0.5, subsurface=0.5, subsurface_color=Gf.Vec3f(0, 1, 0)
    )
    assert found["body.diffuseReflectance"] == pytest.approx([0.25, 0.5, 0])
    assert told == []


@pytest.mark.parametrize(
    ("identifier", "inputs", "along", "across"),
    [  # widths of slopes along the tangent, and across it
        (STANDARD, dict(specular_roughness=0.5, specular_anisotropy=0.6), 0.25 / 0.46**0.5, 0.25 * 0.46**0.5),
        (OPEN, dict(specular_roughness=0.5, specular_roughness_anisotropy=0.6), WIDE, 0.4 * WIDE),
        (GLTF, dict(roughness=0.5, anisotropy_strength=0.6, metallic=0.0), 0.25 + 0.75 * 0.36, 0.25),
    ],
)
def test_anisotropy_has_the_widths_of_each_dialect(identifier: str, inputs: dict, along: float, across: float):
    found, told, _ = slots(identifier, **inputs)
    wide = found["gloss.roughness"] ** 2
    assert told == []
    assert wide == pytest.approx(along, rel=1e-3)
    assert wide * (1 - 0.95 * found["gloss.anisotropy"]) == pytest.approx(across, rel=1e-3)
    assert found["gloss.rotation"] == pytest.approx(0.25, abs=1e-3)  # grooves lie across the tangent


def test_the_specular_weight_of_open_pbr_scales_the_reflectance_straight_on():
    found, _, _ = slots(OPEN, specular_weight=0.5, specular_ior=1.8)
    f0 = lambda n: ((n - 1) / (n + 1)) ** 2  # noqa: E731
    assert f0(found["gloss.ior"]) == pytest.approx(0.5 * f0(1.8), rel=1e-3)


def test_coats_darken_and_tint_what_lies_below():
    found, _, _ = slots(OPEN, base_color=Gf.Vec3f(0.5), coat_weight=1.0, coat_ior=1.6, coat_color=Gf.Vec3f(1, 0.5, 1))
    k = 1 - (1 - (0.6 / 2.6) ** 2) / 1.6**2
    dark = 0.5 * (1 - k) / (1 - 0.5 * k)
    assert found["body.diffuseReflectance"] == pytest.approx([dark, dark / 2, dark], rel=1e-3)
    found, _, _ = slots(OPEN, base_color=Gf.Vec3f(0.5), coat_weight=1.0, coat_darkening=0.0)
    assert found["body.diffuseReflectance"] == pytest.approx([0.5] * 3)


def test_films_have_their_thickness_in_nanometres():
    found, told, _ = slots(OPEN, thin_film_weight=1.0, thin_film_thickness=0.4, thin_film_ior=1.3)
    assert (found["film.filmThickness"], found["film.filmIor"]) == (pytest.approx(400), pytest.approx(1.3))
    found, told, _ = slots(STANDARD, thin_film_thickness=300.0)
    assert found["film.filmThickness"] == pytest.approx(300)
    assert told == []


def test_transmission_disperses_and_may_be_thin():
    found, _, _ = slots(OPEN, transmission_weight=1.0, transmission_dispersion_scale=0.5)
    assert found["glass.abbe"] == pytest.approx(40)
    found, told, _ = slots(STANDARD, transmission=1.0, thin_walled=True, transmission_color=Gf.Vec3f(1, 0.5, 0.25))
    assert found["glass.transmittance"] == pytest.approx([1, 0.5, 0.25])
    assert told == []


def test_a_medium_has_the_colour_at_its_depth(tmp_path: Path):
    graph = Graph()
    graph.surface = graph.node(
        "other", STANDARD, transmission=1.0, transmission_color=Gf.Vec3f(0.5, 1, 0.25), transmission_depth=2.0
    )
    graph.material.CreateSurfaceOutput("mtlx").ConnectToSource(
        graph.surface.CreateOutput("surface", Sdf.ValueTypeNames.Token)
    )
    made, _ = graph.made()
    absorbed = [value for name, value in made.parameters.items() if name.startswith("color") and max(value) < 0.7]
    assert any(np.exp(-2 * np.array(value)) == pytest.approx([0.5, 1, 0.25], abs=1e-4) for value in absorbed)


def test_the_preview_surface_is_the_same_by_materialx() -> None:
    inputs = dict(diffuseColor=Gf.Vec3f(0.1, 0.2, 0.3), roughness=0.7, ior=1.4)
    found, told, _ = slots("ND_UsdPreviewSurface_surfaceshader", **inputs)
    assert found["body.diffuseReflectance"] == pytest.approx([0.1, 0.2, 0.3])
    assert (found["gloss.roughness"], found["gloss.ior"]) == (pytest.approx(0.7), pytest.approx(1.4))
    assert told == []


def test_translation_of_gltf_and_unlit():
    found, told, _ = slots(GLTF, base_color=Gf.Vec3f(0.5, 0.25, 1), metallic=1.0, roughness=0.4)
    assert found["metal.reflectance"] == pytest.approx([0.5, 0.25, 1])
    assert found["metal.roughness"] == pytest.approx(0.4)
    found, more, _ = slots("ND_surface_unlit", emission=2.0, emission_color=Gf.Vec3f(1, 0.5, 0))
    assert found["light.radiance"] == pytest.approx([2, 1, 0])
    assert told == more == []
