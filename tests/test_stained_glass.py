"""Oi stops each colour by itself: what is seen of a surface, what is seen through it, and its shadows."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka

OPACITY = np.array([0.9, 0.5, 0.1])
PANE = 'Surface "constant" Color [0.3 0.6 0.2] Opacity [0.9 0.5 0.1]'


def render(tmp_path: Path, body: str, head: str = "", progressions: int = 512) -> kanuka.Picture:
    (tmp_path / "scene.rib").write_text(
        f'Format 16 16 1\nPixelFilter "box" 1 1\nProjection "orthographic"\n{head}WorldBegin\n{body}\nWorldEnd\n'
    )
    picture = kanuka.render(kanuka.load(tmp_path / "scene.rib"), progressions=progressions)
    assert not picture.journal.error_count, list(picture.journal)
    return picture


def mean(picture: kanuka.Picture) -> np.ndarray:
    return picture["rgb"].mean((0, 1))


def sheet(z: float, attributes: str) -> str:
    return f'AttributeBegin {attributes} Polygon "P" [-9 -9 {z} -9 9 {z} 9 9 {z} 9 -9 {z}] AttributeEnd\n'


def test_what_lies_behind_is_seen_through_each_colour(tmp_path: Path) -> None:
    """RISpec: Ci + (1 - Oi) times what lies behind. That is grey: products of coloured spectra are not those of RGB."""
    seen = mean(render(tmp_path, sheet(2, PANE) + sheet(4, 'Surface "constant" Color [0.6 0.6 0.6]')))
    expected = OPACITY * np.array([0.3, 0.6, 0.2]) + (1 - OPACITY) * 0.6
    assert seen == pytest.approx(expected, rel=0.01)


def test_two_panes_dim_by_both(tmp_path: Path) -> None:
    black = 'Surface "constant" Color [0 0 0] Opacity [0.9 0.5 0.1]'
    other = 'Surface "constant" Color [0 0 0] Opacity [0.4 0.4 0.4]'
    body = sheet(2, black) + sheet(3, other) + sheet(4, 'Surface "constant" Color [0.6 0.6 0.6]')
    expected = (1 - OPACITY) * 0.6 * 0.6
    assert mean(render(tmp_path, body)) == pytest.approx(expected, rel=0.015)


LAMPS = {
    "distant": 'LightSource "distantlight" 1 "intensity" 1 "from" [0 0 0] "to" [0 0 1]',
    "point": 'LightSource "pointlight" 1 "intensity" 1e6 "from" [0 0 -1000]',
}


@pytest.mark.parametrize("lamp", LAMPS)
@pytest.mark.parametrize("transport", ["classic", "full"])
def test_shadows_have_the_colour_of_what_is_let_through(tmp_path: Path, lamp: str, transport: str) -> None:
    """A white wall behind a black pane that the camera does not see."""
    glass = 'Surface "constant" Color [0 0 0] Opacity [0.9 0.5 0.1] Attribute "visibility" "integer camera" 0'
    body = f'Attribute "light" "string shadows" "on"\n{LAMPS[lamp]}\n' + sheet(2, glass)
    body += sheet(4, 'Surface "matte" "Ka" 0 Color [0.5 0.5 0.5]')
    picture = render(tmp_path, body, f'Option "kanuka" "string transport" ["{transport}"]\n')
    assert mean(picture) == pytest.approx(0.5 * (1 - OPACITY), rel=0.015)


def test_a_window_by_a_texture_of_its_own(tmp_path: Path) -> None:
    """Oi that varies over the pane: its colours lie on the wall."""
    (tmp_path / "stripes.sl").write_text(
        "surface stripes() { Oi = mod(10 * u, 2) < 1 ? color(1, 0, 0.5) : color(0, 1, 0.5); Ci = 0; }"
    )
    glass = 'Surface "stripes" ShadingRate 0.25 Attribute "visibility" "integer camera" 0'
    body = f'Attribute "light" "string shadows" "on"\n{LAMPS["distant"]}\n'
    body += f'AttributeBegin {glass} Polygon "P" [-1 -1 2 1 -1 2 1 1 2 -1 1 2] "st" [0 0 1 0 1 1 0 1] AttributeEnd\n'
    body += sheet(4, 'Surface "matte" "Ka" 0 Color [0.5 0.5 0.5]')
    seen = render(tmp_path, body)["rgb"]
    assert seen.mean((0, 1)) == pytest.approx([0.25, 0.25, 0.25], abs=0.02)
    assert (np.abs(seen[..., 0] - seen[..., 1]) > 0.2).mean() > 0.5


def test_grey_opacity_is_presence_alone(tmp_path: Path) -> None:
    """What is the same for all colours takes no room beside it."""
    body = sheet(2, 'Surface "constant" Color [0.3 0.6 0.2] Opacity [0.5 0.5 0.5]')
    picture = render(tmp_path, body + sheet(4, 'Surface "constant" Color [0.7 0.4 0.9]'))
    assert mean(picture) == pytest.approx(0.5 * np.array([0.3, 0.6, 0.2]) + 0.5 * np.array([0.7, 0.4, 0.9]), rel=0.01)
