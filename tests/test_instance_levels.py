"""Levels of detail of instances: what stands at many places is diced and shaded at a few rates."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import kanuka
from test_sessions import same

SHADERS = {
    "dunes": """displacement dunes(uniform float Km = 0.08;) {
        point Q = transform("object", P);
        P += Km * (noise(3 * Q) - 0.5) * normalize(N);
        N = calculatenormal(P);
    }""",
    "sizes": """surface sizes() {
        Oi = Os;
        Ci = min(10 * sqrt(area(P)), 1) * diffuse(faceforward(normalize(N), I));
    }""",
    "mapped": """surface mapped(uniform string map = "";) {
        normal Nf = faceforward(normalize(N), I);
        Oi = Os;
        Ci = Os * color texture(map, 6 * s, 3 * t) * diffuse(Nf);
    }""",
}
FOLDER: list[str] = []


@pytest.fixture(autouse=True, scope="module")
def shaders(tmp_path_factory: pytest.TempPathFactory) -> None:
    folder = tmp_path_factory.mktemp("levels")
    for name, text in SHADERS.items():
        (folder / f"{name}.sl").write_text(text)
    pattern = np.random.default_rng(2).choice([0.05, 0.8], (64, 64, 3)).astype(np.float32)
    kanuka.Picture({"rgb": pattern}).write(folder / "spots.exr")
    kanuka.make_texture([str(folder / "spots.exr")], str(folder / "spots.tx"), wrap=("periodic", "periodic"))
    FOLDER[:] = [str(folder)]


def material() -> kanuka.Material:
    return kanuka.Material(
        "mapped",
        map=f"{FOLDER[0]}/spots.tx",
        displacement=kanuka.Shader("dunes"),
        displacement_bound=0.1,
    )


def at(x: float, y: float, z: float, size: float = 1) -> np.ndarray:
    matrix = np.diag([size, size, size, 1.0])
    matrix[:3, 3] = x, y, z
    return matrix[:3].astype(np.float32)


def stage(width: int, height: int, fov: float, eye: tuple[float, float, float]) -> kanuka.Scene:
    scene = kanuka.Scene()
    scene.resolution = width, height
    scene.options.shader_path = FOLDER
    scene.camera = kanuka.Camera(eye, (eye[0], eye[1] - 0.12, eye[2] - 1), fov=fov)
    scene.add_light("distant", amount=2, direction=(-0.5, -1, -0.7), angle=3)
    scene.add_light("environment", amount=0.4)
    return scene


def field(rate: float = 0.04, **variation: object) -> kanuka.Scene:
    """Balls from two units away to a hundred and more."""
    scene = stage(192, 96, 50, (0, 1.6, 0))
    floor = np.array([[-300, 0, -300], [-300, 0, 9], [300, 0, 9], [300, 0, -300]], np.float32)
    scene.add_mesh(floor, np.array([[0, 1, 2, 3]], np.int32), material=kanuka.Material("matte", color=(0.3, 0.3, 0.3)))
    ball = scene.add_group("ball")
    ball.add_sphere(0.5, material=material(), shading_rate=rate)
    random = np.random.default_rng(1)
    depth = 1.5 * np.exp(random.uniform(0, 1, 300) * math.log(60))
    across = random.uniform(-0.6, 0.6, 300) * depth
    scene.add_instances(ball, np.stack([at(x, 0.3, -z) for x, z in zip(across, depth, strict=True)]), **variation)
    return scene


def render(scene: kanuka.Scene, levels: float, progressions: int = 16, **options: object) -> kanuka.Picture:
    picture = kanuka.render(scene, instance_levels=levels, progressions=progressions, **options)
    assert not scene.journal.error_count
    return picture


def squares(pictures: list[kanuka.Picture], size: int = 8) -> np.ndarray:
    """Of each picture the means of squares of pixels."""
    grey = np.stack([p["rgb"].astype(np.float64).mean(axis=2) for p in pictures])
    n, height, width = grey.shape
    return grey.reshape(n, height // size, size, width // size, size).mean(axis=(2, 4))


def expect_alike(one: list[kanuka.Picture], other: list[kanuka.Picture]) -> None:
    """Renders with seeds of their own: Student's t of each square of pixels is spread as chance has it."""
    a, b = squares(one), squares(other)
    n = len(one)
    t = (a.mean(axis=0) - b.mean(axis=0)) / np.sqrt((a.var(axis=0, ddof=1) + b.var(axis=0, ddof=1)) / n)
    f = 2 * n - 2  # degrees of freedom
    mean, variance = f / (f - 2), 2 * f**2 * (f - 1) / ((f - 2) ** 2 * (f - 4))  # of t squared
    assert np.mean(t**2) < mean + 4 * math.sqrt(variance / t.size), t.round(1)
    # Four in 100 000 means of pictures are off by more.
    whole = [x.mean(axis=(1, 2)) for x in (a, b)]
    assert abs(whole[0].mean() - whole[1].mean()) < 5.8 * math.sqrt(sum(x.var(ddof=1) for x in whole) / n)


def seeds(scene: kanuka.Scene, levels: float, first: int, **options: object) -> list[kanuka.Picture]:
    return [render(scene, levels, seed=first + k, **options) for k in range(8)]


def test_pictures_are_alike() -> None:
    scene = field()
    without, levels = seeds(scene, 0, 0), seeds(scene, 1, 100)
    count, plain = levels[0].stats["count"], without[0].stats["count"]
    assert count["instance_levels"] == 2 and plain["instance_levels"] == 0
    assert 100 < count["instances_coarser"] < count["instances"] == plain["instances"] == 300
    assert count["vertices"] == plain["vertices"] + count["level_vertices"]
    assert 0 < count["level_vertices"] < 0.07 * plain["vertices"]
    expect_alike(without, levels)
    # In pages of our own, which come and go, as by Embree's callbacks.
    expect_alike(levels, seeds(scene, 1, 200, memory="1G"))


def test_threads_and_lanes_find_the_same_bits() -> None:
    scene = field()
    for memory in (None, "1G"):
        pictures = [
            render(scene, 1, 2, memory=memory, **how) for how in ({}, {"threads": 1}, {"lanes": 1}, {"lanes": 16})
        ]
        for picture in pictures[1:]:
            assert same(picture, pictures[0])


# Nine stand beside the camera, out of the picture, wherever it goes, and one far ahead. There is a level of detail for
# what wants four micropolygons and less of a unit of length (each is 0.2 pixels wide).
def ahead(distance: float, made: kanuka.Material | str, fov: float = 5.7) -> kanuka.Scene:
    scene = kanuka.Scene()
    scene.resolution = 16, 16
    scene.options.shader_path = FOLDER
    scene.camera = kanuka.Camera((0, 0, distance), (0, 0, 0), fov=fov)
    scene.add_light("environment", amount=1)
    group = scene.add_group("ball")
    group.add_sphere(0.5, material=made, shading_rate=0.04)
    beside = [at(4 * k - 18, 3, distance + 3) for k in range(9)]
    scene.add_instances(group, np.stack([at(0, 0, 0), *beside]))
    return scene


def middle(picture: kanuka.Picture) -> float:
    return float(picture["rgb"][6:10, 6:10].astype(np.float64).mean())


def test_nothing_pops() -> None:
    """What shows how finely it is shaded goes from one level to the next little by little."""
    sizes = kanuka.Material("sizes", displacement=kanuka.Shader("dunes", Km=0), displacement_bound=0.01)
    distances = [float(d) for d in 7.5 * np.exp(np.linspace(0, math.log(2.8), 43))]
    shown = []
    for distance in distances:
        picture = render(ahead(distance, sizes), 0.25, 64)
        assert picture.stats["count"]["instance_levels"] == 1
        shown.append(middle(picture))
    # The transition is a factor of the root of two in distance: 14 steps.
    whole = shown[-1] - shown[0]
    assert whole > 4 * shown[0]
    assert np.abs(np.diff(shown)).max() < 2.5 / 14 * whole, shown
    assert sum(0.1 < (x - shown[0]) / whole < 0.9 for x in shown) >= 8
    # Without levels it looks the same from everywhere.
    plain = [middle(render(ahead(d, sizes), 0, 64)) for d in distances[::6]]
    assert plain == pytest.approx([shown[0]] * len(plain), rel=0.02)


def test_a_small_move_dices_no_level_again() -> None:
    scene = ahead(30, material())
    session = kanuka.Session(scene, instance_levels=0.25, progressions=1)
    session.advance()
    assert session.kept["primitives"] == 2
    scene.camera = kanuka.Camera((0.02, 0.01, 29.99), (0, 0, 0), fov=5.7)
    session.update()
    session.advance()
    assert session.kept["primitives"] == session.kept["primitives_kept"] == 2
    # So near that the closest one is diced anew: the level stays.
    scene.camera = kanuka.Camera((0, 2, 30), (0, 0, 0), fov=5.7)
    session.update()
    session.advance()
    assert session.kept["primitives"] == 2 and session.kept["primitives_kept"] == 1


def counts(scene: kanuka.Scene, levels: float = 1, **options: object) -> dict[str, float]:
    return render(scene, levels, 1, **options).stats["count"]


def test_levels_are_asked_for() -> None:
    assert kanuka.render(field(), progressions=1).stats["count"]["instance_levels"] == 0
    assert counts(field(), 1)["instances_coarser"] > counts(field(), 4)["instances_coarser"] > 0


Fill = Callable[[kanuka.Scene], kanuka.Group]


def spread(fill: Fill, count: int = 12, near: float = 1.5) -> kanuka.Scene:
    """Things of a group, from near to far."""
    scene = stage(192, 96, 50, (0, 1.6, 0))
    group = fill(scene)
    depth = near * np.exp(np.linspace(0, math.log(60), count))
    scene.add_instances(group, np.stack([at(0.2 * z, 0.3, -z) for z in depth]))
    return scene


def ball(scene: kanuka.Scene, **more: object) -> kanuka.Group:
    group = scene.add_group("ball")
    group.add_sphere(0.5, material=material(), shading_rate=0.04, **more)
    return group


def lamp(scene: kanuka.Scene) -> kanuka.Group:
    return ball(scene, area_light=(1, 1, 1))


def flat(scene: kanuka.Scene) -> kanuka.Group:
    group = scene.add_group("flat")
    corners = np.array([[-0.5, 0, 0], [0.5, 0, 0], [0.5, 1, 0], [-0.5, 1, 0]], np.float32)
    group.add_mesh(corners, np.array([[0, 1, 2, 3]], np.int32), material="matte", shading_rate=0.04)
    return group


def inside(scene: kanuka.Scene) -> kanuka.Group:
    """Nothing but instances of another group."""
    inner = ball(scene)
    group = scene.add_group("two")
    group.add_instances(inner, np.stack([at(0, 0, 0), at(0, 1, 0)]))
    return group


def crowd(scene: kanuka.Scene) -> kanuka.Group:
    """More instances than each level is to have again."""
    inner = ball(scene)
    group = scene.add_group("crowd")
    group.add_instances(inner, np.stack([at(0, 0.1 * k, 0, 0.1) for k in range(65)]))
    return group


@pytest.mark.parametrize(
    ("fill", "levels"),
    [
        (ball, 2),
        (flat, 0),
        (lamp, 0),
        (inside, 4),  # two of either group
        (crowd, 0),
    ],
)
def test_what_has_levels(fill: Fill, levels: int) -> None:
    scene = spread(fill)
    found, plain = counts(scene), counts(scene, 0)
    assert found["instance_levels"] == levels
    assert found["instances"] == plain["instances"]
    assert (found["level_vertices"] > 0) == (levels > 0)


def test_few_places_have_none() -> None:
    assert counts(spread(ball, 8))["instance_levels"] == 0


def test_models_and_oracles_have_none(tmp_path: Path) -> None:
    scene = spread(ball)
    assert len(kanuka.traced_surfaces(scene, instance_levels=1)) == len(kanuka.traced_surfaces(scene))
    kanuka.write_oracle(scene, tmp_path / "a.oracle", progressions=1, instance_levels=1)
    assert counts(scene, oracle=tmp_path / "a.oracle")["instance_levels"] == 0


def test_of_moving_and_nested_ones_pictures_are_alike() -> None:
    """Tinted, in groups, along paths."""
    scene = spread(inside, 16, 4)
    beads = ball(scene)
    depth = 2 * np.exp(np.linspace(0.1, math.log(60), 40))
    open_, close = (np.stack([at(x * z, 1, -z) for z in depth]) for x in (-0.3, -0.28))
    scene.add_instances(
        beads, np.stack([open_, close]), times=[0, 1], tint=[(1, 0.1 + 0.02 * k, 0.2) for k in range(40)]
    )
    scene.options.shutter = 0, 1
    assert counts(scene)["instance_levels"] >= 4
    for memory in (None, "1G"):
        expect_alike(seeds(scene, 0, 0, memory=memory), seeds(scene, 1, 100, memory=memory))


def test_sessions_shots_and_stores_know_them(tmp_path: Path) -> None:
    scene = field()
    session = kanuka.Session(scene, progressions=2, instance_levels=1)
    session.advance()
    first = session.picture()
    for levels, primitives in ((0, 2), (1, 4)):
        session.update(instance_levels=levels)
        session.advance()
        assert session.kept["primitives"] == session.kept["primitives_kept"] == primitives
    assert same(session.picture(), first)
    cameras = [kanuka.Camera((0, 1.6, -2 * k), (0, 1.48, -1 - 2 * k), fov=50) for k in range(2)]
    assert counts(scene, shot=cameras)["instances_coarser"] > 0
    made, found = (counts(scene, store=tmp_path / "pages") for _ in range(2))
    assert made["primitives_stored"] == 0 and found["primitives_stored"] == found["primitives"] == 4
