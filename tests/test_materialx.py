"""MaterialX's nodes, against what its specification says of them in numbers."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("MaterialX")
from pxr import Gf, UsdShade

from kanuka.usd import library
from usd_graphs import SHIFT, TYPES, Graph, N, coordinates, plain


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


def perlin_spread(dimensions: int) -> float:
    """The standard deviation of MaterialX's gradient noise: its gradients, weights and scales, a hash at random."""
    random, count = np.random.default_rng(3), 400_000
    place, total = random.random((count, dimensions)), np.zeros(count)
    fade = place**3 * (place * (place * 6 - 15) + 10)
    for corner in np.ndindex(*(2,) * dimensions):
        away, hashed = (place - corner).T, random.integers(0, 16, count)
        if dimensions == 2:
            u, v = np.where(hashed & 4, away[::-1], away)
            v = 2 * v
        else:
            u = np.where(hashed < 8, away[0], away[1])
            v = np.where(hashed < 4, away[1], np.where((hashed == 12) | (hashed == 14), away[0], away[2]))
        gradient = np.where(hashed & 1, -u, u) + np.where(hashed & 2, -v, v)
        total += np.where(corner, fade, 1 - fade).prod(1) * gradient
    return float((0.6616 if dimensions == 2 else 0.982) * total.std())


@pytest.mark.parametrize(
    ("identifier", "dimensions", "octaves"),
    [
        ("ND_noise2d_float", 2, 1),
        ("ND_noise3d_float", 3, 1),
        ("ND_fractal2d_float", 2, 3),
        ("ND_fractal3d_float", 3, 3),
    ],
)
def test_noises_are_as_strong_as_materialxs(identifier: str, dimensions: int, octaves: int) -> None:
    graph = Graph()
    st = graph.node("st", "ND_texcoord_vector2")
    if dimensions == 2:
        where = {"texcoord": (st, "out")}
    else:
        third = graph.node("third", "ND_dotproduct_vector2", in1=(st, "out"), in2=Gf.Vec2f(0.37, 0.61))
        first, second = (graph.node(f"e{i}", "ND_extract_vector2", in_=(st, "out"), index=i) for i in (0, 1))
        parts = {f"in{i + 1}": (part, "out") for i, part in enumerate((first, second, third))}
        where = {"position": (graph.node("p", "ND_combine3_vector3", **parts), "out")}
    noise = graph.node("n", identifier, **where)
    wide = graph.node("w", "ND_convert_float_color3", in_=(noise, "out"))
    graph.emit(graph.node("shifted", "ND_add_color3FA", in1=(wide, "out"), in2=SHIFT))
    made, shader = graph.made()
    s, t = np.meshgrid(*[np.linspace(0.013, 173.3, 512, dtype=np.float32)] * 2)
    found = (
        shader.run(512, 512, plain(made) | {"usd_st_0": s, "usd_st_1": t})["slots"]["light.radiance"][..., 0] - SHIFT
    )
    expected = perlin_spread(dimensions) * math.sqrt(sum(0.25**i for i in range(octaves)))
    assert found.mean() == pytest.approx(0, abs=0.01)
    assert found.std() == pytest.approx(expected, rel=0.03)


def test_graphs_that_run_in_circles_are_cut():
    graph = Graph()
    a = graph.node("a", "ND_add_color3", in2=Gf.Vec3f(1, 0, 0))
    b = graph.node("b", "ND_add_color3", in1=(a, "out"))
    a.CreateInput("in1", TYPES["color3"]).ConnectToSource(b.GetOutput("out"))
    graph.emit(b)
    graph.run()
    assert any("circle" in text for text in graph.told)


def test_nodes_that_nobody_knows_are_named():
    graph = Graph()
    odd = UsdShade.Shader.Define(graph.stage, "/m/odd")
    odd.CreateIdAttr("ND_teapot_color3")
    odd.CreateOutput("out", TYPES["color3"])
    graph.emit(odd)
    graph.run()
    assert graph.told == ['/m: there is no node "ND_teapot_color3" (/m/odd); its default stands']
