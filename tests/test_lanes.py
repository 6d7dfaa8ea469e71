"""A picture does not depend on how many paths go side by side."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import kanuka
import validation_scenes

LANES = (1, 8, 16)
LIGHTS = {
    "far": ("distant", {"amount": (2, 1.8, 1.5), "direction": (-1, -1, -0.5)}),
    "near": ("point", {"amount": 3, "position": (-1.5, 1, 1.5)}),
}


def ball(lights: tuple[str, ...], lanes: int) -> np.ndarray:
    """Light that comes straight from lamps without size: the same at every sample."""
    scene = validation_scenes.ball_on_floor(validation_scenes.matte(0.5, 0.6, 0.7), (0, 0, 0), 1, "")
    for name in lights:
        kind, given = LIGHTS[name]
        scene.add_light(kind, **given)
    return np.asarray(kanuka.render(scene, progressions=1, lanes=lanes)["rgb"]).astype(np.float64)


@pytest.mark.parametrize("lanes", LANES)
def test_light_of_two_lamps_is_that_of_one_and_of_the_other(lanes: int) -> None:
    """Far and near lamps are asked at one vertex, so a path has two shadow rays: neither may take the other's place."""
    both = ball(("far", "near"), lanes)
    np.testing.assert_allclose(both, ball(("far",), lanes) + ball(("near",), lanes), rtol=1e-5, atol=1e-6)
    assert (both > 1.01 * ball(("far",), lanes)).any(-1).mean() > 0.1


def expect_agreement(make: Callable[[], kanuka.Scene], lanes: int, **options: object) -> None:
    one, many = (np.asarray(kanuka.render(make(), lanes=n, **options)["rgb"]) for n in (1, lanes))
    np.testing.assert_array_equal(one, many)


@pytest.mark.parametrize("lanes", LANES[1:])
@pytest.mark.parametrize("name", validation_scenes.ALL)
def test_lane_counts_agree(name: str, lanes: int) -> None:
    expect_agreement(validation_scenes.ALL[name], lanes, progressions=1, resolution=(32, 32))


@pytest.mark.parametrize("lanes", LANES[1:])
@pytest.mark.parametrize("integrator", kanuka.integrators())
def test_lane_counts_agree_by_any_integrator(integrator: str, lanes: int) -> None:
    expect_agreement(validation_scenes.lacquer_over_paint, lanes, progressions=4, integrator=integrator)


FUNCTIONS = ("sin", "cos", "tan", "asin", "acos", "atan", "exp", "log")
WAVES = """displacement waves() {
    float x = 1 + xcomp(P) * xcomp(P), y = 0.3 + abs(sin(7 * ycomp(P)));
    float h = %s + pow(x, 1.7 * y) + 0.1 * pow(2.5, y) + atan(y, x);
    P += 0.02 * h * normalize(N);
    N = calculatenormal(P);
}
"""


@pytest.mark.parametrize("lanes", LANES[1:])
def test_shaders_give_the_same_bits_for_any_lanes(lanes: int, tmp_path: Path) -> None:
    text = " + ".join(f"{name}({'0.4 * y' if name in ('asin', 'acos') else 'x'})" for name in FUNCTIONS)
    (tmp_path / "waves.sl").write_text(WAVES % text)

    def make() -> kanuka.Scene:
        scene = kanuka.Scene()
        scene.resolution = 32, 32
        scene.options.shader_path = [str(tmp_path)]
        scene.camera = kanuka.Camera((0, 0, 5), (0, 0, 0), fov=30)
        waves = kanuka.Shader("waves")
        scene.add_sphere(material=kanuka.Material("matte", displacement=waves, displacement_bound=0.5))
        scene.add_light("distant", amount=3, direction=(-1, -1, -1))
        return scene

    expect_agreement(make, lanes, progressions=1)
