"""Levels of detail of instances that have variables, that are solids, and that procedurals make."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import kanuka
from test_instance_levels import FOLDER, at, expect_alike, seeds, shaders, stage  # noqa: F401

WET = """surface wet(uniform float wetness = 0; color leaf = color(0.5);) {
    Oi = Os;
    Ci = leaf * (1 - 0.8 * wetness) * diffuse(faceforward(normalize(N), I));
}"""
LEAVES = [(0.7, 0.2, 0.2), (0.2, 0.6, 0.3), (0.2, 0.3, 0.7)]


@pytest.fixture(autouse=True, scope="module")
def wet(shaders: None) -> None:  # noqa: F811
    (Path(FOLDER[0]) / "wet.sl").write_text(WET)


def clay(**values: object) -> kanuka.Material:
    return kanuka.Material("wet", **values, displacement=kanuka.Shader("dunes"), displacement_bound=0.1)


def floored(count: int = 300) -> tuple[kanuka.Scene, np.ndarray]:
    """A plain, and places on it from two units away to a hundred."""
    scene = stage(192, 96, 50, (0, 1.6, 0))
    corners = np.array([[-300, 0, -300], [-300, 0, 9], [300, 0, 9], [300, 0, -300]], np.float32)
    grey = kanuka.Material("matte", color=(0.3, 0.3, 0.3))
    scene.add_mesh(corners, np.array([[0, 1, 2, 3]], np.int32), material=grey)
    random = np.random.default_rng(1)
    depth = 1.5 * np.exp(random.uniform(0, 1, count) * math.log(60))
    across = random.uniform(-0.6, 0.6, count) * depth
    return scene, np.stack([at(x, 0.3, -z) for x, z in zip(across, depth, strict=True)])


def ball(scene: kanuka.Scene, **values: object) -> kanuka.Group:
    group = scene.add_group("ball")
    group.add_sphere(0.5, material=clay(**values), shading_rate=0.04)
    return group


def counts(scene: kanuka.Scene, levels: float = 1) -> dict[str, float]:
    return kanuka.render(scene, progressions=1, instance_levels=levels).stats["count"]


# ---- variables of instances


def test_variables_are_those_of_things_that_have_them() -> None:
    """Of groups without levels, each of one value."""
    scene, places = floored()
    kinds = np.arange(len(places)) % len(LEAVES)
    scene.add_instances(ball(scene), places, primvars={"leaf": np.array(LEAVES, np.float32)[kinds]})
    apart, _ = floored()
    for kind, leaf in enumerate(LEAVES):
        apart.add_instances(ball(apart, leaf=leaf), places[kinds == kind])
    assert counts(scene)["instance_levels"] == 2
    assert counts(apart, 0)["instance_levels"] == 0
    expect_alike(seeds(apart, 0, 0), seeds(scene, 1, 100))
    expect_alike(seeds(apart, 0, 200), seeds(scene, 1, 300, memory="1G"))


def seen_from(distance: float) -> tuple[kanuka.Scene, np.ndarray]:
    """And places: one in the picture, far away, and nine beside it, out of it."""
    scene = kanuka.Scene()
    scene.resolution = 16, 16
    scene.options.shader_path = FOLDER
    scene.camera = kanuka.Camera((0, 0, distance), (0, 0, 0), fov=5.7)
    scene.add_light("environment", amount=1)
    beside = [at(4 * k - 18, 3, distance + 3) for k in range(9)]
    return scene, np.stack([at(0, 0, 0), *beside])


def ahead(distance: float, primvars: dict, levels: float, **options: object) -> kanuka.Picture:
    """The values of the others are other ones."""
    scene, places = seen_from(distance)
    scene.add_instances(ball(scene), places, primvars=primvars)
    return kanuka.render(scene, progressions=4, instance_levels=levels, journal=kanuka.Journal(), **options)


def albedo(picture: kanuka.Picture) -> np.ndarray:
    return picture["albedo"][6:10, 6:10].astype(np.float64).mean((0, 1))


def by_itself(distance: float, **values: object) -> np.ndarray:
    """The albedo of the one in the picture where nothing else is, as a thing that has the values itself."""
    scene = kanuka.Scene()
    scene.resolution = 16, 16
    scene.options.shader_path = FOLDER
    scene.camera = kanuka.Camera((0, 0, distance), (0, 0, 0), fov=5.7)
    scene.add_light("environment", amount=1)
    scene.add_sphere(0.5, material=clay(**values), shading_rate=0.04)
    return albedo(kanuka.render(scene, progressions=4))


@pytest.mark.parametrize("memory", [None, "1G"])
@pytest.mark.parametrize("distance", [12, 16, 30])  # the finest, between two, and the coarser level
def test_each_level_has_the_value_of_its_instance(distance: float, memory: str | None) -> None:
    others = [LEAVES[k % 2] for k in range(9)]
    picture = ahead(distance, {"leaf": [LEAVES[2], *others]}, 0.25, memory=memory)
    assert picture.stats["count"]["instance_levels"] == 1
    assert albedo(picture) == pytest.approx(by_itself(distance, leaf=LEAVES[2]), abs=2e-3)
    wetness = ahead(distance, {"wetness": [0.7, *([0.1, 0.9] * 5)[:9]]}, 0.25, memory=memory)
    assert albedo(wetness) == pytest.approx(by_itself(distance, wetness=0.7), abs=2e-3)


def test_many_numbers_are_blended_in_each_level() -> None:
    """What depends on a number in a straight line is exact."""
    for distance in (12, 16, 30):
        picture = ahead(distance, {"wetness": np.linspace(0.37, 1, 10)}, 0.25, instance_variants=3)
        assert picture.stats["count"]["instance_levels"] == 1
        assert albedo(picture) == pytest.approx(by_itself(distance, wetness=0.37), abs=2e-3), distance


def test_tints_variants_and_variables_go_together() -> None:
    """Values of one, in two levels of detail, are those of an instance that is alone."""
    for distance in (12, 16, 30):
        scene, places = seen_from(distance)
        tint = [(1, 0.5, 0.25), *[(1, 1, 1)] * 9]
        primvars = {"wetness": [0.5, *[0] * 9]}
        scene.add_instances(ball(scene), places, tint=tint, primvars=primvars)
        picture = kanuka.render(scene, progressions=4, instance_levels=0.25)
        leaf = 0.5 * np.array(tint[0])
        assert albedo(picture) == pytest.approx(by_itself(distance, wetness=0.5, leaf=leaf), abs=5e-3)


# ---- solids


def solid(scene: kanuka.Scene) -> kanuka.Group:
    """A ball with a hole in it."""
    group = scene.add_group("bead")
    bead = group.add_solid("difference")
    whole, hole = bead.add("primitive"), bead.add("primitive")
    group.add_sphere(0.5, material=clay(), shading_rate=0.04, solid=whole)
    group.add_sphere(
        0.35, material=clay(), shading_rate=0.04, solid=hole, transform=np.vstack([at(0, 0.3, 0.2), [0, 0, 0, 1]])
    )
    return group


def test_solids_have_levels_and_look_alike() -> None:
    scene, places = floored(120)
    scene.add_instances(solid(scene), places)
    found = counts(scene)
    assert found["instance_levels"] == 2
    assert 0 < found["instances_coarser"] < 120
    expect_alike(seeds(scene, 0, 0), seeds(scene, 1, 100))
    expect_alike(seeds(scene, 0, 200, memory="1G"), seeds(scene, 1, 300, memory="1G"))


# ---- procedurals

WORLD = """Format 192 96 1
Option "searchpath" "shader" ["{folder}:@"]
Projection "perspective" "fov" 50
Option "kanuka" "string transport" "full"
Rotate -6.84 1 0 0 Translate 0 -1.6 0 Scale 1 1 -1
WorldBegin
LightSource "distantlight" 1 "from" [0.5 1 0.7] "to" [0 0 0] "intensity" 0.6
LightSource "environmentlight" 2 "intensity" 0.4
{body}
WorldEnd
"""
BALL = (
    'Displacement "dunes" Attribute "displacementbound" "sphere" [0.1] Surface "wet" '
    "ShadingRate 0.04 Sphere 0.5 -0.5 0.5 360"
)


def instances(handle: str, count: int = 40) -> str:
    depth = 2 * np.exp(np.linspace(0, math.log(50), count))
    across = np.sin(7 * np.arange(count)) * 0.5 * depth
    return "\n".join(
        f'TransformBegin Translate {x:.4f} 0.3 {-z:.4f} ObjectInstance "{handle}" TransformEnd'
        for x, z in zip(across, depth, strict=True)
    )


def loaded(folder: Path, body: str, **options: object) -> kanuka.Scene:
    file = folder / "a.rib"
    file.write_text(WORLD.format(folder=FOLDER[0], body=body))
    scene = kanuka.load(file, **options)
    assert not scene.journal.messages, str(scene.journal.messages[0])
    return scene


@pytest.mark.parametrize("on_demand", [False, True])
def test_what_procedurals_make_has_levels(tmp_path: Path, on_demand: bool) -> None:
    """In an object, which is read at once, and an object of their own, which waits for rays."""
    plain = loaded(tmp_path, f'ObjectBegin "o" {BALL} ObjectEnd ' + instances("o"))
    expected = seeds(plain, 0, 0)
    (tmp_path / "ball.rib").write_text(BALL)
    (tmp_path / "field.rib").write_text(f'ObjectBegin "o" {BALL} ObjectEnd ' + instances("o"))
    read = "[-0.6 0.6 -0.6 0.6 -0.6 0.6]"
    in_object = f'ObjectBegin "o" Procedural "DelayedReadArchive" ["ball.rib"] {read} ObjectEnd ' + instances("o")
    own = 'Procedural "DelayedReadArchive" ["field.rib"] [-200 200 -1 2 -200 1]'
    for k, body in enumerate((in_object, own)):
        made = []
        for seed in range(8):
            scene = loaded(tmp_path, body, on_demand=on_demand)
            made += [kanuka.render(scene, progressions=16, instance_levels=1, seed=100 * (k + 1) + seed)]
        found = made[0].stats["count"]
        assert found["instance_levels"] == 2, k
        assert found["instances_coarser"] > 0
        expect_alike(expected, made)


def test_objects_that_procedurals_place_have_the_levels_that_they_have(tmp_path: Path) -> None:
    """They were diced before anything was read: as fine as what was placed then asks for."""
    body = f'ObjectBegin "o" {BALL} ObjectEnd ' + instances("o")
    more = "\n".join(
        f'TransformBegin Translate {0.7 * z:.4f} 1 {-z:.4f} ObjectInstance "o" TransformEnd' for z in (3, 9, 30, 80)
    )
    expected = seeds(loaded(tmp_path, f"{body} {more}"), 0, 0)
    (tmp_path / "more.rib").write_text(more)
    made = []
    for seed in range(8):
        scene = loaded(
            tmp_path, f'{body} Procedural "DelayedReadArchive" ["more.rib"] [-200 200 -1 2 -200 1]', on_demand=True
        )
        made.append(kanuka.render(scene, progressions=16, instance_levels=1, seed=100 + seed))
    assert made[0].stats["count"]["procedurals_read"] == 1
    assert made[0].stats["count"]["instances"] == 44
    expect_alike(expected, made)
