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


# ---- variables of primitives

VARIABLES = """
Format 72 48 1
Projection "perspective" "fov" 60
WorldBegin
Translate 0 0 3
AttributeBegin
  Attribute "identifier" "string name" "sheet"
  Translate -1 0 0
  Rotate 20 0 1 0
  Scale 1 2 1
  Patch "bilinear" "P" [-0.6 0.4 0  0.6 0.4 0  -0.6 -0.4 0  0.6 -0.4 0]
    "vertex point Pref" [0 0 5  4 0 5  0 8 5  4 8 5]
    "varying float heat" [0 1 0 1]  "uniform color paint" [0.25 0.5 0.75]
    "constant float part" [7]  "varying vector flow" [1 0 0  1 0 0  1 0 0  1 0 0]
AttributeEnd
AttributeBegin
  %s
  Translate 1.2 0.1 0.4
  Rotate 90 1 0 0
  Scale 0.7 0.7 0.9
  Sphere 1 -1 1 360
AttributeEnd
WorldEnd
"""


def variables(tmp_path: Path, aovs: list[str], surface: str = 'Surface "matte"', **options) -> kanuka.Picture:
    (tmp_path / "variables.rib").write_text(VARIABLES % surface)
    given = {"progressions": 16, "aovs": aovs, "filter": "box", "geometry_tolerance": 0} | options
    return kanuka.render(kanuka.load(tmp_path / "variables.rib"), **given)


def sides(picture: kanuka.Picture) -> tuple[np.ndarray, np.ndarray]:
    """Pixels that see nothing but the sheet, and nothing but the ball."""
    whole = picture["alpha"] > 0.999
    left, right = whole & (picture["P"][..., 0] < -0.1), whole & (picture["P"][..., 0] > 0.1)
    assert left.sum() > 20 and right.sum() > 20
    return left, right


def object_space(P: np.ndarray, world_from_object: np.ndarray) -> np.ndarray:
    return (P - world_from_object[:3, 3]) @ np.linalg.inv(world_from_object[:3, :3]).T


def test_variables_of_primitives_are_layers(tmp_path: Path) -> None:
    picture = variables(tmp_path, ["Pref", "heat", "paint", "part", "flow"])
    assert not picture.journal.messages, [e.message for e in picture.journal.messages]
    sheet, ball = sides(picture)
    a = np.radians(20)
    turn = np.array([[np.cos(a), 0, np.sin(a)], [0, 1, 0], [-np.sin(a), 0, np.cos(a)]])
    place = np.eye(4)
    place[:3, :3] = turn @ np.diag([1, 2, 1])
    place[:3, 3] = (-1, 0, 3)
    here = object_space(picture["P"].astype(np.float64), place)
    if np.abs(here[sheet][:, 2]).max() > 1e-3:  # RISpec's rotations are of the left hand
        place[:3, :3] = turn.T @ np.diag([1, 2, 1])
        here = object_space(picture["P"].astype(np.float64), place)
    assert np.abs(here[sheet][:, 2]).max() < 1e-4
    u, v = (here[..., 0] + 0.6) / 1.2, (0.4 - here[..., 1]) / 0.8
    reference = np.stack([4 * u, 8 * v, np.full_like(u, 5)], -1)
    assert np.abs(picture["Pref"] - reference)[sheet].max() < 1e-3
    assert np.abs(picture["heat"] - u)[sheet].max() < 1e-3
    assert np.allclose(picture["paint"][sheet], (0.25, 0.5, 0.75), atol=1e-3)
    assert (picture["part"][sheet] == 7).all()
    assert np.allclose(picture["flow"][sheet], (1, 0, 0), atol=1e-5)
    for name in ("heat", "paint", "part", "flow"):
        assert (picture[name][ball] == 0).all(), name


@pytest.mark.parametrize("surface", ["", 'Surface "matte"'])
def test_the_reference_position_of_what_has_none_is_in_object_space(tmp_path: Path, surface: str) -> None:
    # Traced vertices stand off a curved outline, by less the finer they are (dice/outline.h).
    picture = variables(tmp_path, ["__Pref"], surface, shading_rate=0.1)
    _, ball = sides(picture)
    away = np.linalg.norm(picture["__Pref"][ball], axis=-1)
    assert np.median(away) > 0.98  # means over pixels lie within the ball
    assert away.max() <= 1 + 1e-3
    P = picture["P"][ball] - (1.2, 0.1, 3.4)
    for turned in ([[0.7, 0, 0], [0, 0, -0.9], [0, 0.7, 0]], [[0.7, 0, 0], [0, 0, 0.9], [0, -0.7, 0]]):
        place = np.eye(4)
        place[:3, :3] = turned
        if np.abs(object_space(P, place) - picture["__Pref"][ball]).max() < 5e-3:
            return
    pytest.fail("the layer is not P in object space")


def test_what_the_surface_hands_out_comes_first(tmp_path: Path) -> None:
    (tmp_path / "own.sl").write_text("surface own(output varying float heat = 0;) { heat = 3; Ci = Cs; Oi = Os; }")
    rib = (VARIABLES % "").replace("Translate 0 0 3", 'Translate 0 0 3\nSurface "own"')
    (tmp_path / "own.rib").write_text(rib)
    scene = kanuka.load(tmp_path / "own.rib")
    picture = kanuka.render(scene, progressions=4, aovs=["heat", "Pref"])
    sheet, _ = sides(picture)
    assert (picture["heat"][sheet] == 3).all()


@pytest.mark.parametrize("lanes", [1, 16])
def test_variables_have_the_same_bits_for_any_lanes(tmp_path: Path, lanes: int) -> None:
    layers = ["Pref", "heat", "flow"]
    one = variables(tmp_path, layers, progressions=2, lanes=8, threads=1)
    other = variables(tmp_path, layers, progressions=2, lanes=lanes, threads=2)
    for name in layers:
        assert np.array_equal(one[name], other[name]), name
