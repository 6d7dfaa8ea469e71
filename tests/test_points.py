"""Points: small ones are balls, large ones spheres of triangles, and both look alike."""

from __future__ import annotations

import numpy as np
import pytest

import kanuka
from test_sessions import same

SIZE = 96


def spray(material: kanuka.Material, width: float, moving: bool = False) -> kanuka.Scene:
    """2000 points in a ball of radius 1, which fills the picture."""
    rng = np.random.default_rng(4)
    places = rng.normal(size=(2000, 3))
    places *= rng.random((2000, 1)) ** (1 / 3) / np.linalg.norm(places, axis=1, keepdims=True)
    points = np.stack([places, 0.7 * places + 0.2]) if moving else places
    scene = kanuka.Scene()
    scene.resolution = SIZE, SIZE
    scene.options.shutter = 0, 1
    scene.camera = kanuka.Camera((0, 0, 4), (0, 0, 0), fov=28)
    scene.add_points(points.astype(np.float32), widths=width, material=material)
    scene.add_light("distant", amount=3, direction=(-1, -1, -1))
    scene.add_light("environment", amount=0.4)
    return scene


def rendered(scene: kanuka.Scene, **options: object) -> kanuka.Picture:
    return kanuka.render(scene, **{"progressions": 32, "shading_rate": 1, **options})


FINE = {"shading_rate": 0.01, "geometry_tolerance": 0.01}  # by which points are spheres of some hundred triangles


def pixels(picture: kanuka.Picture) -> np.ndarray:
    return np.asarray(picture["rgb"], np.float64)


def expect_alike(a: kanuka.Picture, b: kanuka.Picture, within: float) -> None:
    x, y = pixels(a), pixels(b)
    assert x.mean() == pytest.approx(y.mean(), rel=within)
    blocks = [p.reshape(8, SIZE // 8, 8, SIZE // 8, 3).mean((1, 3)) for p in (x, y)]
    assert np.abs(blocks[0] - blocks[1]).max() < 0.1 * blocks[0].max()


@pytest.mark.parametrize("moving", [False, True])
@pytest.mark.parametrize(
    "material",
    [
        kanuka.Material("matte", color=(0.6, 0.5, 0.3)),
        kanuka.Material("matte", color=(0.6, 0.5, 0.3), opacity=0.5),
    ],
    ids=["opaque", "half there"],
)
def test_balls_look_as_spheres_of_triangles(material: kanuka.Material, moving: bool) -> None:
    scene = spray(material, 0.03, moving)
    balls, spheres = rendered(scene), rendered(scene, **FINE)
    count = [p.stats["count"]["traced_polygons"] for p in (balls, spheres)]
    assert count[0] == 2000
    assert count[1] > 50 * 2000
    expect_alike(balls, spheres, 0.01)
    # In pages, as in Embree.
    within = rendered(scene, memory="1G")
    expect_alike(balls, within, 0.002)
    assert same(within, rendered(scene, memory="1G", threads=1))


def test_their_colours_are_their_own() -> None:
    """A shader that reads a variable of each point has that of it."""
    scene = kanuka.Scene()
    scene.resolution = SIZE, SIZE
    scene.camera = kanuka.Camera((0, 0, 4), (0, 0, 0), fov=28)
    side = np.linspace(-0.9, 0.9, 40)
    x, y = (c.ravel() for c in np.meshgrid(side, side))
    colors = np.stack([x > 0, y > 0, np.ones_like(x)], 1).astype(np.float32)
    scene.add_points(
        np.stack([x, y, 0 * x], 1).astype(np.float32),
        widths=0.04,
        primvars={"vertex color Cs": colors},
        material="matte",
    )
    scene.add_light("distant", amount=3, direction=(0, 0, -1))
    p = pixels(rendered(scene))
    half = SIZE // 2
    assert p[:, half + 4 :, 0].mean() > 50 * p[:, : half - 4, 0].mean()
    assert p[: half - 4, :, 1].mean() > 50 * p[half + 4 :, :, 1].mean()


def test_what_shines_has_triangles_to_shine_from() -> None:
    scene = spray(kanuka.Material("constant", color=(1, 1, 1)), 0.03)
    assert rendered(scene).stats["count"]["traced_polygons"] >= 2000
