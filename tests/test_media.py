"""Interiors from a scene to the picture: fog, milk in a cup, overlapping boundaries, options."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka

BALL = """\
Format 12 12 1
PixelSamples 6 6
PixelFilter "box" 1 1
Projection "perspective" "fov" [20]
Translate 0 0 6
WorldBegin
LightSource "environmentlight" 1 "intensity" [1] "float visible" [1]
{shapes}
WorldEnd
"""
CLOSED = "Sphere 1 -1 1 360"


def render(tmp_path: Path, text: str, **options: object) -> tuple[np.ndarray, list[str]]:
    path = tmp_path / "scene.rib"
    path.write_text(text)
    picture = kanuka.render(kanuka.load(path), **options)
    return picture["rgb"], [entry.message for entry in picture.journal.messages]


@pytest.mark.parametrize(
    "surface",
    [
        'Surface "cloud" "color scattering" [2 2 2]',
        'Surface "cloud" "color scattering" [1 2 3] "float droplets" [10]',
        'Surface "cloud" "color scattering" [1 1 1] "float air" [1]',
        'Surface "glass" "float ior" [1.3] "color scattering" [2 2 2] "float meanCosine" [0.6]',
    ],
)
def test_what_absorbs_nothing_vanishes_under_an_even_sky(tmp_path: Path, surface: str) -> None:
    text = 'Option "kanuka" "integer maxdepth" 64\n' + BALL.format(shapes=f"{surface}\n{CLOSED}")
    rgb, journal = render(tmp_path, text)
    assert not journal
    assert rgb.mean() == pytest.approx(1, abs=0.015)


def test_a_cloud_that_absorbs_is_transparent_by_its_law(tmp_path: Path) -> None:
    rgb, _ = render(
        tmp_path,
        BALL.format(shapes='Surface "cloud" "color scattering" [0 0 0] "color absorption" [0.7 0.7 0.7]\n' + CLOSED),
    )
    assert rgb[5:7, 5:7].mean() == pytest.approx(np.exp(-1.4), rel=0.03)  # right through the middle


def test_priorities_cut_what_overlaps(tmp_path: Path) -> None:
    """Two clouds of absorption 0.2 and 1: which of them is there, where both are?"""
    two = """
    AttributeBegin
      Surface "cloud" "color scattering" [0 0 0] "color absorption" [0.2 0.2 0.2] "float priority" [{0}]
      {ball}
    AttributeEnd
    Surface "cloud" "color scattering" [0 0 0] "color absorption" [1 1 1] "float priority" [{1}]
    Scale 0.5 0.5 0.5
    {ball}
    """
    for priorities, depth in (((1, 0), 0.4), ((0, 1), 1.2)):
        middle = BALL.replace("[20]", "[2]")  # straight through, all over the picture
        rgb, _ = render(tmp_path, middle.format(shapes=two.format(*priorities, ball=CLOSED)))
        assert rgb[5:7, 5:7].mean() == pytest.approx(np.exp(-depth), rel=0.03)


def test_volume_depth_ends_paths(tmp_path: Path) -> None:
    shapes = 'Surface "cloud" "color scattering" [8 8 8]\n' + CLOSED
    few, _ = render(tmp_path, 'Option "kanuka" "integer volumedepth" 3\n' + BALL.format(shapes=shapes))
    many, _ = render(tmp_path, BALL.format(shapes=shapes))
    assert few[5:7, 5:7].mean() < 0.5 * many[5:7, 5:7].mean()


def test_an_open_sea_over_the_camera_is_reported(tmp_path: Path) -> None:
    shapes = """
    Surface "cloud" "color scattering" [1 1 1]
    Translate 0 0 -6
    ReverseOrientation
    Patch "bilinear" "P" [-9 1 -9  9 1 -9  -9 1 9  9 1 9]
    """
    _, journal = render(tmp_path, BALL.format(shapes=shapes))
    assert any("not closed" in text for text in journal)
