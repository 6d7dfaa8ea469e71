"""Output variables of surface shaders: asked for by Display, by Python, by the command; through to the EXR."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka

SHADER = """
surface shown(output varying float stripes = 0; output varying color tint = 0; output varying point place = 0;
              output varying color unasked = 0)
{
    stripes = -1000.5 * u;
    tint = color(u, 2 * v, 1);
    place = transform("world", P);
    unasked = 1;
    Oi = 1;
    Ci = Cs;
}
"""
SCENE = """
%s
Format 16 16 1
Projection "perspective" "fov" 90
WorldBegin
Surface "shown"
Translate 0 0 1
Patch "bilinear" "P" [-0.5 1 0  1 1 0  -0.5 -1 0  1 -1 0]
WorldEnd
"""


@pytest.fixture
def scene(tmp_path: Path):
    (tmp_path / "shown.sl").write_text(SHADER)

    def write(head: str = "") -> Path:
        path = tmp_path / "scene.rib"
        path.write_text(SCENE % head)
        return path

    return write


def check(picture: kanuka.Picture) -> None:
    inside = picture["alpha"] > 0.999
    outside = picture["alpha"] == 0
    assert inside.sum() > 100 and outside.sum() > 20
    u, v = (picture["P"][..., 0] + 0.5) / 1.5, (1 - picture["P"][..., 1]) / 2
    # One pixel is 1/8 wide; a mean over its samples is where the mean of P is.
    assert np.abs(picture["stripes"] + 1000.5 * u)[inside].max() < 0.1
    tint = np.stack([u, 2 * v, np.ones_like(u)], -1)
    assert np.abs(picture["tint"] - tint)[inside].max() < 0.04  # weighted by the filter, not by hits
    assert np.abs(picture["place"] - picture["P"])[inside].max() < 1e-4
    assert (picture["tint"][outside] == 0).all()


def test_displays_ask(scene, tmp_path: Path) -> None:
    head = """
DisplayChannel "varying color tint"
Display "scene.exr" "openexr" "rgba"
Display "+scene_more.exr" "openexr" "varying float stripes"
Display "+scene_tint.exr" "openexr" "tint,place"
"""
    picture = kanuka.render(kanuka.load(scene(head)), progressions=32)
    assert not picture.journal.messages, [e.message for e in picture.journal.messages]
    check(picture)
    layers = picture.keys()
    assert "unasked" not in layers
    picture.write(tmp_path / "out.exr")
    again = kanuka.read(tmp_path / "out.exr")
    check(again)
    assert again["place"].dtype == np.float32


def test_python_asks(scene) -> None:
    picture = kanuka.render(kanuka.load(scene()), progressions=32, aovs=["stripes", "tint", "place", "nothing"])
    check(picture)
    assert [e.message for e in picture.journal.messages if "nothing" in e.message]
    layers = picture.keys()
    assert "nothing" not in layers


def test_the_command_asks(scene, tmp_path: Path, kanuka_command) -> None:
    done = kanuka_command("render", scene(), "-o", "a.exr", "--aov", "stripes", "--aov", "place", "--aov", "tint")
    assert done.returncode == 0, done.stderr
    check(kanuka.read(tmp_path / "a.exr"))


def test_only_what_is_asked_for_is_kept(scene) -> None:
    def render(aovs: list[str]) -> kanuka.Picture:
        return kanuka.render(kanuka.load(scene()), progressions=1, aovs=aovs)

    none, one, three = (render(aovs).stats["bytes"]["lobe_inputs"] for aovs in ([], ["stripes"], ["stripes", "tint"]))
    # A float of each, and two of the tint's three, vary.
    assert none < one
    assert (three - none) == pytest.approx(3 * (one - none), rel=0.1)
    assert np.allclose(render([])["rgb"], render(["tint"])["rgb"], atol=1e-3)


@pytest.mark.parametrize("lanes", [1, 8, 16])
def test_same_bits_for_any_lanes(scene, lanes: int) -> None:
    reference = kanuka.render(kanuka.load(scene()), progressions=2, lanes=8, aovs=["tint"], threads=1)
    picture = kanuka.render(kanuka.load(scene()), progressions=2, lanes=lanes, aovs=["tint"], threads=2)
    assert np.array_equal(picture["tint"], reference["tint"])
