"""The shading language's own examples, rendered: scenes/listings.rib."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka

SCENES = Path(__file__).resolve().parent.parent / "scenes"


@pytest.fixture(scope="module")
def picture() -> kanuka.Picture:
    scene = kanuka.load(SCENES / "listings.rib")
    scene.resolution = 180, 90
    return kanuka.render(scene, progressions=16)


def at(picture: kanuka.Picture, layer: str, x: float, y: float) -> np.ndarray:
    """Mean of a few pixels about a place of the picture, in [0, 1]."""
    height, width = picture["A"].shape
    j, i = int(y * height), int(x * width)
    return picture[layer][j - 2 : j + 3, i - 2 : i + 3].mean((0, 1))


def test_nothing_is_amiss(picture: kanuka.Picture) -> None:
    assert not list(picture.journal)
    assert np.isfinite(picture["rgb"]).all()


def test_sheets_reflect_red_and_pass_green(picture: kanuka.Picture) -> None:
    assert at(picture, "albedo", 0.2, 0.5) == pytest.approx([0.25, 0.75, 0], abs=0.06)
    lit, behind = at(picture, "rgb", 0.2, 0.5), at(picture, "rgb", 0.29, 0.5)
    assert lit[0] > 0.5 * lit[1] and lit[2] < 0.1 * lit[1]
    assert behind[0] < 0.4 * behind[1]


def test_the_ball_is_displaced_and_bumped(picture: kanuka.Picture) -> None:
    normals = picture["N"][35:55, 82:98]
    steps = np.linalg.norm(np.diff(normals, axis=1), axis=2)
    assert steps.mean() > 0.1  # a plain ball of that size: 0.03
    assert at(picture, "albedo", 0.5, 0.5) == pytest.approx([0.65, 0.6, 0.5], abs=0.05)


def test_the_dielectric_passes_what_is_behind_it(picture: kanuka.Picture) -> None:
    assert at(picture, "rgb", 0.79, 0.5).min() > 0.2
