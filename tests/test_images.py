"""Small scenes against their stored pictures."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka
import scenes
from pictures import expect_same, load


def render(name: str, seed: int, **keywords: object) -> kanuka.Picture:
    return kanuka.render(scenes.ALL[name](), progressions=load(name).progressions, seed=seed, **keywords)


@pytest.mark.parametrize("name", scenes.ALL)
def test_each_pixel_is_the_references(name: str, tmp_path: Path) -> None:
    expect_same(load(name), render(name, seed=4242), tmp_path)


@pytest.mark.parametrize("name", scenes.ALL)
def test_mean_of_the_picture(name: str) -> None:
    """The mean over all pixels sees a bias that is too small for any one of them."""
    errors = load(name).mean_errors(render(name, seed=99))
    assert (np.abs(errors) < 4).all(), errors


@pytest.mark.parametrize(("factor", "pixel"), [(1.02, 0.0), (0.98, 0.0), (1.0, 0.5)])
def test_a_small_bias_and_a_wrong_pixel_are_found(factor: float, pixel: float) -> None:
    picture = render("box", seed=7)["rgb"] * np.float32(factor)
    picture[3, 5] += pixel
    reference = load("box")
    passed = reference.z_test(kanuka.Picture({"rgb": picture})).passed
    error = abs(picture.mean() - reference.mean.mean())
    sigma = np.sqrt(reference.variance.sum(dtype=np.float64)) / picture.size
    assert not passed or error > 4 * sigma


def test_other_routes_to_the_same_picture() -> None:
    """Finer shading and untouched micropolygons change the work, not the expectation."""
    reference = load("instances")
    for keywords in ({"shading_rate": 0.25}, {"geometry_tolerance": 0.0}):
        error = render("instances", seed=5, **keywords)["rgb"].mean() / reference.mean.mean() - 1
        assert abs(error) < 0.01, keywords
