"""Surfaces of MaterialX and OpenPBR: what their inputs are to lobes."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("MaterialX")
from pxr import Gf, Sdf

from usd_graphs import Graph, N, coordinates, plain

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


@pytest.mark.parametrize(("degrees", "turns"), [(0, 0.25), (30, 0.25 + 1 / 12), (-45, 0.125)])
def test_grooves_turn_with_the_texture_coordinates(degrees: float, turns: float):
    """By the angle from dPdu to where s grows, counterclockwise; and by specular_rotation, in turns."""
    u, v = coordinates()
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    for more in (0.0, 0.1):
        graph = Graph()
        graph.surface = graph.node("other", STANDARD, specular_anisotropy=0.5, specular_rotation=more)
        graph.material.CreateSurfaceOutput("mtlx").ConnectToSource(
            graph.surface.CreateOutput("surface", Sdf.ValueTypeNames.Token)
        )
        made, shader = graph.made()
        found = shader.run(N, N, plain(made) | {"usd_st_0": c * u + s * v, "usd_st_1": c * v - s * u})["slots"]
        assert found["gloss.rotation"] == pytest.approx(np.full((N, N), turns + more), abs=1e-4)


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


def test_a_medium_has_the_colour_at_its_depth():
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
