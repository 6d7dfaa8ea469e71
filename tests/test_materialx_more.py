"""MaterialX's surfaces: coats, tangents, films on metals, normals."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("MaterialX")
from pxr import Gf, Sdf

from test_openpbr import furnace
from usd_graphs import Graph, N, coordinates, plain

STANDARD, OPEN, GLTF = (
    "ND_standard_surface_surfaceshader",
    "ND_open_pbr_surface_surfaceshader",
    "ND_gltf_pbr_surfaceshader",
)


def surface(identifier: str, graph: Graph | None = None, **inputs) -> Graph:
    graph = graph or Graph()
    graph.surface = graph.node("other", identifier, **inputs)
    graph.material.CreateSurfaceOutput("mtlx").ConnectToSource(
        graph.surface.CreateOutput("surface", Sdf.ValueTypeNames.Token)
    )
    return graph


def slots(graph: Graph, size: int = 2, **primvars) -> dict[str, np.ndarray]:
    made, shader = graph.made()
    return shader.run(size, size, plain(made) | primvars)["slots"]


def first(graph: Graph) -> dict[str, np.ndarray]:
    return {name: np.asarray(value)[0, 0] for name, value in slots(graph).items()}


# ---- surfaces


def test_a_coat_deepens_colours_below_as_far_as_it_says():
    """Raised to the power of 1 + coat * coat_affect_color."""
    inputs = dict(base=0.5, base_color=Gf.Vec3f(0.25, 0.5, 1), coat=0.5, subsurface_color=Gf.Vec3f(0.5, 0.25, 1))
    found = first(surface(STANDARD, coat_affect_color=1.0, **inputs))
    assert found["body.diffuseReflectance"] == pytest.approx([0.0625, 0.5**2.5, 0.5], abs=1e-3)
    found = first(surface(STANDARD, coat_affect_color=1.0, subsurface=1.0, **inputs))
    assert found["body.diffuseReflectance"] == pytest.approx([0.5**1.5, 0.125, 1], abs=1e-3)
    found = first(surface(STANDARD, coat_affect_color=1.0, **(inputs | {"coat": 0.0})))
    assert found["body.diffuseReflectance"] == pytest.approx([0.125, 0.25, 0.5], abs=1e-3)


def test_a_rough_coat_roughens_what_is_below_it():
    inputs = dict(specular_roughness=0.2, coat=0.8, coat_roughness=0.5, metalness=0.5, transmission=0.5)
    found = first(surface(STANDARD, coat_affect_roughness=0.5, transmission_extra_roughness=0.3, **inputs))
    assert found["gloss.roughness"] == pytest.approx(0.2 + 0.8 * 0.2, abs=1e-3)  # a fifth of the way to 1
    assert found["metal.roughness"] == pytest.approx(0.36, abs=1e-3)
    assert found["glass.roughness"] == pytest.approx([0.5 + 0.5 * 0.2] * 3, abs=1e-3)
    assert found["coat.roughness"] == pytest.approx(0.5, abs=1e-3)
    found = first(surface(OPEN, specular_roughness=0.3, coat_weight=0.5, coat_roughness=0.6))
    assert found["gloss.roughness"] == pytest.approx(0.15 + 0.5 * (0.3**4 + 2 * 0.6**4) ** 0.25, abs=1e-3)
    found = first(surface(OPEN, specular_roughness=0.3, coat_weight=1.0, coat_roughness=1.0))
    assert found["gloss.roughness"] == pytest.approx(1, abs=1e-3)


@pytest.mark.parametrize("more", [0.3, -0.5, 2.0])
def test_glass_has_its_extra_roughness_within_bounds(more: float):
    graph = surface(STANDARD, specular_roughness=0.4, transmission=1.0, transmission_extra_roughness=more)
    found = first(graph)
    assert found["glass.roughness"] == pytest.approx([min(max(0.4 + more, 0), 1)] * 3, abs=1e-3)
    assert found["gloss.roughness"] == pytest.approx(0.4, abs=1e-3)
    assert graph.told == []


@pytest.mark.parametrize(
    ("identifier", "inputs", "along", "across", "turns"),
    [
        (
            STANDARD,
            dict(coat=1.0, coat_roughness=0.5, coat_anisotropy=0.6, coat_rotation=0.1),
            0.46**-0.5,
            0.46**0.5,
            0.1,
        ),
        (
            OPEN,
            dict(coat_weight=1.0, coat_roughness=0.5, coat_roughness_anisotropy=0.6),
            math.sqrt(2 / 1.16),
            0.4 * math.sqrt(2 / 1.16),
            0,
        ),
    ],
)
def test_coats_are_stretched_by_themselves(identifier: str, inputs: dict, along: float, across: float, turns: float):
    graph = surface(identifier, **inputs)
    found = first(graph)
    wide = found["coat.roughness"] ** 2
    assert wide == pytest.approx(0.25 * along, rel=2e-3)
    assert wide * (1 - 0.95 * found["coat.anisotropy"]) == pytest.approx(0.25 * across, rel=2e-3)
    assert found["coat.rotation"] == pytest.approx(0.25 + turns, abs=1e-3)
    assert "gloss.anisotropy" not in found or found["gloss.anisotropy"] == 0
    assert graph.told == []


@pytest.mark.parametrize(
    ("identifier", "amount", "tangent", "slot"),
    [
        (STANDARD, dict(specular_anisotropy=0.5), "tangent", "gloss.rotation"),
        (STANDARD, dict(coat=1.0, coat_anisotropy=0.5), "tangent", "coat.rotation"),
        (OPEN, dict(specular_roughness_anisotropy=0.5), "geometry_tangent", "gloss.rotation"),
        (OPEN, dict(coat_weight=1.0, coat_roughness_anisotropy=0.5), "geometry_coat_tangent", "coat.rotation"),
        (GLTF, dict(anisotropy_strength=0.5), "tangent", "gloss.rotation"),
    ],
)
@pytest.mark.parametrize("degrees", [0, 40, -70])
def test_grooves_follow_a_tangent_that_is_connected(identifier, amount, tangent, slot, degrees):
    """In the plane x, y of the test's grid, whose u grows along x; what of it lies along the normal is nothing."""
    angle = math.radians(degrees)
    graph = Graph()
    node = graph.node("t", "ND_constant_vector3", value=Gf.Vec3f(3 * math.cos(angle), 3 * math.sin(angle), 0.7))
    found = slots(surface(identifier, graph, **amount, **{tangent: (node, "out")}))
    turns = (0.25 + degrees / 360) % 1
    assert found[slot] == pytest.approx(np.full((2, 2), turns), abs=1e-3)
    assert graph.told == []


def test_films_lie_on_metals_too():
    """By the metal's complex index, whose reflectance straight on is the base's colour (Fresnel's equations)."""
    color = np.array([0.9, 0.6, 0.3])
    graph = surface(
        STANDARD,
        base=1.0,
        base_color=Gf.Vec3f(*color),
        metalness=1.0,
        specular_color=Gf.Vec3f(0.5),
        thin_film_thickness=300.0,
        thin_film_IOR=1.4,
    )
    found = first(graph)
    n, k = found["filmed_metal.eta"].astype(float), found["filmed_metal.extinction"].astype(float)
    assert ((n - 1) ** 2 + k**2) / ((n + 1) ** 2 + k**2) == pytest.approx(color, abs=2e-3)
    root = np.sqrt(color)
    assert n == pytest.approx(0.5 * (1 + root) / (1 - root) + 0.5 * (1 - color) / (1 + color), rel=2e-3)
    assert (found["filmed_metal.filmThickness"], found["filmed_metal.filmIor"]) == (
        pytest.approx(300, rel=1e-3),
        pytest.approx(1.4, rel=1e-3),
    )
    assert "metal.reflectance" not in found
    assert graph.told == []


@pytest.mark.parametrize(("metalness", "film"), [(1.0, 0.25), (0.5, 0.5), (0.75, 1.0), (0.0, 1.0)])
def test_a_film_in_part_shares_the_metal(metalness: float, film: float):
    """Weights of the filmed metal, the bare metal and the rest, multiplied out, are m f, m (1 - f) and 1 - m."""
    graph = Graph()
    half = graph.node("half", "ND_constant_float", value=metalness)
    part = graph.node("part", "ND_constant_float", value=film)
    surface(OPEN, graph, base_metalness=(half, "out"), thin_film_weight=(part, "out"))
    found = first(graph)
    upper = found["filmed_base.weight"]
    lower = found["base.weight"] * (1 - upper)
    assert (upper, lower) == (
        pytest.approx(metalness * film, abs=2e-3),
        pytest.approx(metalness * (1 - film), abs=2e-3),
    )


def normals(graph: Graph) -> np.ndarray:
    made, shader = graph.made()
    u, v = coordinates()
    known = {p["name"] for p in shader.parameters}
    given = {k: x for k, x in {"usd_st_0": u, "usd_st_1": v}.items() if k in known}
    return shader.run(N, N, plain(made) | given)["N"]


@pytest.mark.parametrize(("identifier", "name"), [(STANDARD, "normal"), (OPEN, "geometry_normal"), (GLTF, "normal")])
def test_a_normal_without_a_normal_map_is_in_world_space(identifier: str, name: str):
    """The test's grid has the normal (0, 0, 1) and its tangents along x and y."""
    graph = Graph()
    node = graph.node("n", "ND_constant_vector3", value=Gf.Vec3f(3, 0, 4))
    found = normals(surface(identifier, graph, **{name: (node, "out")}))
    assert found == pytest.approx(np.broadcast_to([0.6, 0, 0.8], found.shape), abs=1e-5)
    graph = Graph()
    node = graph.node("n", "ND_normal_vector3", space="world")
    found = normals(surface(identifier, graph, **{name: (node, "out")}))
    assert found == pytest.approx(np.broadcast_to([0, 0, 1], found.shape), abs=1e-5)


def test_a_normal_map_is_in_tangent_space_also_where_others_change_it():
    graph = Graph()
    map_of = graph.node("n", "ND_normalmap_float", in_=Gf.Vec3f(0.5, 0.8, 0.9), scale=1.0)
    turned = graph.node("r", "ND_rotate3d_vector3", in_=(map_of, "out"), amount=90.0, axis=Gf.Vec3f(0, 0, 1))
    surface(STANDARD, graph, normal=(turned, "out"))
    expected = rodrigues(np.array([0, 0.6, 0.8]), 90, (0, 0, 1))
    found = normals(graph)
    assert found == pytest.approx(np.broadcast_to(expected, found.shape), abs=1e-5)


def rodrigues(v, angle, axis):
    """v turned about the axis the way of v' = v M."""
    a, c, s = np.array(axis) / np.linalg.norm(axis), math.cos(math.radians(angle)), math.sin(math.radians(angle))
    return v * c + np.cross(v, a) * s + a * (v @ a)[..., None] * (1 - c)


UP, BASE, ABOVE = [0, 0, 1], [0.6, 0, 0.8], [0, 0.6, 0.8]


@pytest.mark.parametrize(
    ("coat", "maps", "expected", "expected_of_coat"),
    [
        (0.0, ("above",), UP, None),  # no coat, so that its normal is nothing
        (1.0, ("above",), UP, ABOVE),
        (1.0, ("base", "above"), BASE, ABOVE),
        (1.0, ("base",), BASE, UP),  # smooth over what is below
        (1.0, (), UP, None),
    ],
)
@pytest.mark.parametrize(
    ("identifier", "names"),
    [
        (STANDARD, ("coat", "normal", "coat_normal")),
        (OPEN, ("coat_weight", "geometry_normal", "geometry_coat_normal")),
        (GLTF, ("clearcoat", "normal", "clearcoat_normal")),
    ],
)
def test_a_coat_has_its_own_normal(identifier, names, coat, maps, expected, expected_of_coat):
    graph = Graph()
    numbers = {"base": Gf.Vec3f(0.8, 0.5, 0.9), "above": Gf.Vec3f(0.5, 0.8, 0.9)}
    nodes = {name: (graph.node(name, "ND_normalmap_float", in_=numbers[name]), "out") for name in maps}
    given = {input_: nodes[name] for input_, name in zip(names[1:], ("base", "above"), strict=True) if name in nodes}
    surface(identifier, graph, **{names[0]: coat}, **given)
    found = normals(graph)
    assert found == pytest.approx(np.broadcast_to(expected, found.shape), abs=1e-5)
    own = slots(graph, 4, **dict(zip(("usd_st_0", "usd_st_1"), np.meshgrid(*[np.linspace(0, 1, 4)] * 2), strict=True)))
    assert ("coat.normal" in own) == (expected_of_coat is not None)
    if expected_of_coat:
        found = own["coat.normal"]
        assert found == pytest.approx(np.broadcast_to(expected_of_coat, found.shape), abs=1e-5)
    assert graph.told == []


def test_one_normal_map_for_coat_and_base_is_theirs():
    graph = Graph()
    node = graph.node("n", "ND_normalmap_float", in_=Gf.Vec3f(0.8, 0.5, 0.9))
    surface(STANDARD, graph, coat=1.0, normal=(node, "out"), coat_normal=(node, "out"))
    found = normals(graph)
    assert found == pytest.approx(np.broadcast_to(BASE, found.shape), abs=1e-5)
    assert "coat.normal" not in slots(graph) and graph.told == []


def test_thin_walls_scatter_forwards_as_far_as_the_cosine_says():
    graph = surface(
        OPEN, subsurface_weight=0.8, geometry_thin_walled=True, subsurface_scatter_anisotropy=0.5, specular_weight=0.0
    )
    assert first(graph)["thin.weight"] == pytest.approx(0.8 * 0.75, abs=2e-3)


def test_a_film_of_air_on_a_metal_is_none(tmp_path: Path):
    """In a white furnace; the complex index gives the colour that the bare metal has. A rough coat that is stretched
    loses nothing."""
    metal = {"base_color": (0.9, 0.6, 0.3), "base_metalness": 1.0, "specular_roughness": 0.2}
    white = {"base_color": (1.0, 1.0, 1.0), "coat_weight": 1.0, "coat_darkening": 0.0, "coat_roughness": 0.4}
    film = {"thin_film_weight": 1.0, "thin_film_thickness": 0.4}
    bare, air, oil, coated = furnace(
        tmp_path,
        [
            metal,
            metal | film | {"thin_film_ior": 1.0},
            metal | film | {"thin_film_ior": 1.8},
            white | {"coat_roughness_anisotropy": 0.7, "specular_roughness": 0.0},
        ],
        progressions=32,
    )
    assert air == pytest.approx(bare, abs=0.03)
    assert np.abs(oil - air).max() > 0.1
    assert coated == pytest.approx(np.ones(3), abs=0.02)
