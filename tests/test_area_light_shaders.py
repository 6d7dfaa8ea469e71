"""Area lights by shaders of a user's own: what they send is the radiance of the surface."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka

PANEL = """
Format 24 24 1
Projection "perspective" "fov" 90
WorldBegin
AreaLightSource "%s" 1 %s
Translate 0 0 1
Patch "bilinear" "P" [-1 1 0  1 1 0  -1 -1 0  1 -1 0]
WorldEnd
"""


def render(folder: Path, text: str, shader: str, progressions: int = 64) -> kanuka.Picture:
    (folder / "own.sl").write_text(shader)
    path = folder / "scene.rib"
    path.write_text(text)
    picture = kanuka.render(kanuka.load(path), progressions=progressions, max_depth=1)
    assert not picture.journal.messages, [e.message for e in picture.journal.messages]
    return picture


def test_plain_radiance(tmp_path: Path) -> None:
    shader = (
        "light own(float intensity = 1; color lightcolor = 1) { illuminate(P, N, PI / 2) Cl = intensity * lightcolor; }"
    )
    text = PANEL % ("own", '"intensity" 3 "lightcolor" [0.5 0.25 0.1]')
    picture = render(tmp_path, text, shader)
    assert picture["rgb"][2:-2, 2:-2].mean((0, 1)) == pytest.approx([1.5, 0.75, 0.3], rel=0.01)


def test_radiance_that_varies_over_the_light(tmp_path: Path) -> None:
    shader = "light own(float gain = 1) { illuminate(P, N, PI / 2) Cl = gain * color(u, v, 0.5) / (L . L); }"
    picture = render(tmp_path, PANEL % ("own", '"uniform float gain" 2'), shader)
    u, v = (picture["P"][..., 0] + 1) / 2, (1 - picture["P"][..., 1]) / 2
    error = picture["rgb"] - 2 * np.stack([u, v, np.full_like(u, 0.5)], -1)
    error = error[2:-2, 2:-2]  # the filter sees beyond the edge
    assert np.abs(error.mean((0, 1))).max() < 0.01
    assert np.abs(error.mean(0)).max() < 0.06
    assert np.abs(error.mean(1)).max() < 0.06


CARD = """
Format 24 24 1
Projection "orthographic"
ScreenWindow -3 3 -3 3
WorldBegin
AttributeBegin
AreaLightSource "own" 1
Translate 0 0 4
%s
Disk 0 0.1 360
AttributeEnd
Surface "matte"
Translate 0 0 6
Polygon "P" [-3 -3 0  3 -3 0  3 3 0  -3 3 0]
WorldEnd
"""


@pytest.mark.parametrize("degrees", [30, 45])
def test_a_cone_is_dark_outside(tmp_path: Path, degrees: float) -> None:
    """A small disk two units above a card lights it within a cone; inside it, as if there were no cone."""
    shader = "light own() { illuminate(P, N, %s) Cl = 100; }"
    cone = render(tmp_path, CARD % "", shader % f"radians({degrees})")
    whole = render(tmp_path, CARD % "", shader % "PI / 2")
    r = np.hypot(*cone["P"][..., :2].transpose(2, 0, 1))
    edge = 2 * np.tan(np.radians(degrees))
    off_disk = r > 0.4
    reach = 0.1 + 0.25 * np.sqrt(2)  # the disk, and the filter of two pixels
    inside, outside = (r < edge - reach) & off_disk, r > edge + reach
    assert inside.any() and outside.any()
    assert (cone["rgb"][outside] == 0).all()
    assert whole["rgb"][outside].min() > 0
    a, b = cone["rgb"][inside].mean(), whole["rgb"][inside].mean()
    assert a > 0.05
    assert a == pytest.approx(b, rel=0.03)


@pytest.mark.parametrize("radius", [0.1, 0.3])
def test_a_light_with_a_place_of_its_own_arrives_as_it_says(tmp_path: Path, radius: float) -> None:
    """A point light's shader spread over a disk (BMRT's uberlight): the size changes softness, not brightness."""
    (tmp_path / "own.sl").write_text('light own(float intensity = 1) { illuminate(point "shader" 0) Cl = intensity; }')
    path = tmp_path / "scene.rib"
    pictures = []
    # An irradiance of 2 pi from two units away; the disk itself is traced as a polygon.
    for light in ('"own" 1 "intensity" 2', f'"arealight" 1 "intensity" {2 * 2**2 / radius**2}'):
        path.write_text((CARD % "").replace('"own" 1', light).replace("0.1 360", f"{radius} 360"))
        pictures.append(kanuka.render(kanuka.load(path), progressions=64, max_depth=1))
    own, plain = pictures
    assert ["shines from a place of its own" in m.message for m in own.journal.messages] == [True]
    r = np.hypot(*own["P"][..., :2].transpose(2, 0, 1))
    ring = (r > radius + 0.3) & (r < 1.2)
    assert own["rgb"][ring].mean() == pytest.approx(plain["rgb"][ring].mean(), rel=0.04)


def test_bmrt_s_arealight_falls_off_whatever_its_area(tmp_path: Path) -> None:
    path = tmp_path / "scene.rib"
    means = []
    light = '"arealight" 1 "intensity"'
    for text in (
        (CARD % "")
        .replace("AreaLight", 'Attribute "light" "nsamples" [4]\nAreaLight')
        .replace('"own" 1', f"{light} 8"),
        (CARD % "").replace('"own" 1', f"{light} {8 / 0.5**2}"),
    ):
        path.write_text(text.replace("0.1 360", "0.5 360"))
        picture = kanuka.render(kanuka.load(path), progressions=64, max_depth=1)
        r = np.hypot(*picture["P"][..., :2].transpose(2, 0, 1))
        means.append(picture["rgb"][(r > 0.8) & (r < 1.5)].mean())
    assert means[0] == pytest.approx(means[1], rel=0.04)
