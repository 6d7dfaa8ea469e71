"""Atmospheres: what the camera, mirrors and panes see through a volume shader, against closed forms."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka

BACKGROUND = np.array([0.2, 0.4, 0.8])
COLOR = np.array([0.8, 0.5, 0.1])

PLANE = """
Format 32 32 1
Projection "perspective" "fov" 60
WorldBegin
%s
Surface "constant"
Color 0.8 0.5 0.1
TransformBegin
Translate 0 0 4
Rotate 50 1 0 0
ReverseOrientation
Polygon "P" [-20 -20 0  20 -20 0  20 20 0  -20 20 0]
TransformEnd
WorldEnd
"""
FOG = 'Atmosphere "fog" "distance" 5 "background" [0.2 0.4 0.8]'


def render(tmp_path: Path, text: str, progressions: int = 64, **keywords: object) -> kanuka.Picture:
    path = tmp_path / "scene.rib"
    path.write_text(text)
    return kanuka.render(kanuka.load(path), progressions=progressions, **keywords)


def messages(picture: kanuka.Picture) -> list[str]:
    return [entry.message for entry in picture.journal.messages]


def distance(picture: kanuka.Picture) -> np.ndarray:
    return np.linalg.norm(picture["P"].astype(np.float64), axis=-1)  # the eye is the world's origin


def check(picture: kanuka.Picture, filtered: np.ndarray, glow: np.ndarray) -> None:
    """Each row's and the picture's mean: Ci' = filtered * Ci + glow."""
    error = picture["rgb"] - (filtered[..., None] * COLOR + glow)
    assert np.abs(error.mean((0, 1))).max() < 1e-3
    assert np.abs(error.mean(1)).max() < 0.02


def test_fog_on_a_plane(tmp_path: Path) -> None:
    picture = render(tmp_path, PLANE % FOG)
    assert not messages(picture)
    faded = 1 - np.exp(-distance(picture) / 5)
    assert faded.max() - faded.min() > 0.3
    check(picture, 1 - faded, faded[..., None] * BACKGROUND)
    assert picture["alpha"].min() == 1


def test_the_background_stays_clear(tmp_path: Path) -> None:
    text = f'Format 8 8 1\nProjection "perspective"\nWorldBegin\n{FOG}\nTranslate 0 0 50\nSphere 1 -1 1 360\nWorldEnd'
    picture = render(tmp_path, text, 4)
    assert (picture["rgb"][0] == 0).all()
    assert (picture["alpha"][0] == 0).all()


def test_other_rays_see_clear_air(tmp_path: Path) -> None:
    """Air lights nothing: what is lit by a fogged emitter is lit by all of it."""
    lamp = """
Format 8 8 1
Projection "perspective" "fov" 10
WorldBegin
AttributeBegin
%s
AreaLightSource "arealight" 1 "intensity" 3
Translate 0 0 -3
Sphere 1 -1 1 360
AttributeEnd
Surface "matte" "Kd" 0.5
Translate 0 0 5
ReverseOrientation
Polygon "P" [-9 -9 0  9 -9 0  9 9 0  -9 9 0]
WorldEnd
"""
    clear, fogged = (render(tmp_path, lamp % air, 128)["rgb"] for air in ("", FOG))
    assert clear.mean() > 0.01
    assert fogged.mean() == pytest.approx(clear.mean(), rel=0.01)


def test_cut_outs_have_the_air_of_what_is_behind(tmp_path: Path) -> None:
    veil = """
AttributeBegin
Opacity 0 0 0
Translate 0 0 2
Polygon "P" [-9 -9 0  9 -9 0  9 9 0  -9 9 0]
AttributeEnd
Surface "constant"
"""
    with_veil = render(tmp_path, PLANE.replace('Surface "constant"', veil) % FOG)
    faded = 1 - np.exp(-distance(with_veil) / 5)
    check(with_veil, 1 - faded, faded[..., None] * BACKGROUND)


def test_marching_and_textured_air(tmp_path: Path) -> None:
    """Fog that is thin above and thick below, marched; and a shader whose parameters are in shader space."""
    (tmp_path / "layer.sl").write_text("""
        volume layer(float density = 0.2, top = 1; color glow = 1; float steps = 200) {
            vector along = I / steps;
            point p = P - I + along / 2;
            float thick = 0, k;
            for (k = 0; k < steps; k += 1) {
                point w = transform("shader", p);
                if (ycomp(w) < top) thick += length(along) * density;
                p += along;
            }
            Ci = Ci * exp(-thick) + glow * (1 - exp(-thick));
        }""")
    air = 'Translate 0 -0.5 0 Atmosphere "layer" "uniform color glow" [0.2 0.4 0.8] "uniform float top" 0 '
    air += "Translate 0 0.5 0"
    picture = render(tmp_path, PLANE % air)
    P = picture["P"].astype(np.float64)
    y = P[..., 1]
    below = np.where(y < -0.5, (y + 0.5) / np.minimum(y, -0.5), 0)
    faded = 1 - np.exp(-0.2 * below * distance(picture))
    check(picture, 1 - faded, faded[..., None] * BACKGROUND)


def test_a_shader_that_is_no_line_is_told_once(tmp_path: Path) -> None:
    (tmp_path / "grade.sl").write_text("volume grade() { Ci = color(sqrt(comp(Ci, 0)), comp(Ci, 1), comp(Ci, 2)); }")
    picture = render(tmp_path, PLANE % 'Atmosphere "grade"', 1)
    entries = [e for e in picture.journal.messages if "does more to Ci" in e.message]
    assert len(entries) == 1
    assert entries[0].severity == "warning"
    assert entries[0].line == 5


@pytest.mark.parametrize("lanes", [1, 8, 16])
def test_same_bits_for_any_lanes(tmp_path: Path, lanes: int) -> None:
    reference = render(tmp_path, PLANE % FOG, 2, lanes=8, threads=1)["rgb"]
    assert np.array_equal(render(tmp_path, PLANE % FOG, 2, lanes=lanes, threads=2)["rgb"], reference)


def test_air_costs_no_bytes(tmp_path: Path) -> None:
    clear, fogged = (render(tmp_path, PLANE % air, 1).stats["bytes"]["lobe_inputs"] for air in ("", FOG))
    assert clear == fogged < 1000


MIRROR = "surface mirror() { Oi = 1; Ci = 0.8 * trace(P, reflect(I, N)); }"
PANE = "surface pane() { Oi = 1; Ci = color(0.9, 0.7, 0.5) * trace(P, refract(normalize(I), normalize(N), 1)); }"


def ways(half: float, depth: float, size: int = 32) -> np.ndarray:
    """How far it is from the eye to a plane across the view, by pixel, in double."""
    c = half * (2 * (np.arange(size) + 0.5) / size - 1)
    return depth * np.sqrt(1 + c[None, :] ** 2 + c[:, None] ** 2)


def behind(tmp_path: Path, shader: str, source: str, near: float, wall: float) -> np.ndarray:
    """A foggy picture of a plane `near` ahead with `shader`, and of a bright wall at z = `wall`, in front or behind."""
    (tmp_path / f"{shader}.sl").write_text(source)
    picture = render(
        tmp_path,
        f"""Format 32 32 1
PixelFilter "box" 1 1
Projection "perspective" "fov" 60
WorldBegin
{FOG}
AttributeBegin
Surface "{shader}"
Polygon "P" [-9 -9 {near}  -9 9 {near}  9 9 {near}  9 -9 {near}]
AttributeEnd
Surface "constant"
Color 0.8 0.5 0.1
Polygon "P" [-20 -20 {wall}  -20 20 {wall}  20 20 {wall}  20 -20 {wall}]
WorldEnd
""",
    )
    assert not messages(picture)
    return picture["rgb"]


def in_fog(near: float, way: float, tint: np.ndarray | float) -> tuple[np.ndarray, np.ndarray]:
    """What is seen of it, `way` being how far the wall is from the plane; and what, were the way from it clear."""
    half = np.tan(np.radians(30))
    first, second = np.exp(-ways(half, near) / 5)[..., None], np.exp(-ways(half, way) / 5)[..., None]
    wall = second * COLOR + (1 - second) * BACKGROUND
    return tuple(first * tint * seen + (1 - first) * BACKGROUND for seen in (wall, COLOR))


def test_a_mirror_shows_the_fog_of_what_it_shows(tmp_path: Path) -> None:
    """A mirror 4 ahead, and a wall 3 behind the eye: both ways are foggy."""
    rgb = behind(tmp_path, "mirror", MIRROR, 4, -3)
    expected, clear = in_fog(4, 7, 0.8)
    np.testing.assert_allclose(rgb.mean(1), expected.mean(1), rtol=0.01)
    assert np.abs(clear - expected).mean() > 0.05


def test_what_is_seen_through_a_pane_is_in_the_same_fog(tmp_path: Path) -> None:
    rgb = behind(tmp_path, "pane", PANE, 2, 6)
    expected, clear = in_fog(2, 4, np.array([0.9, 0.7, 0.5]))
    np.testing.assert_allclose(rgb.mean(1), expected.mean(1), rtol=0.015)
    assert np.abs(clear - expected).mean() > 0.05


def test_instances_lie_in_the_same_air(tmp_path: Path) -> None:
    """A plane in three places, once by itself and once as an object; its air has a place of its own."""
    (tmp_path / "layer.sl").write_text("""
        volume layer(float density = 0.3; color glow = 1;) {
            point p = transform("shader", P), e = transform("shader", P - I);
            float thick = density * length(I) * (clamp(-ycomp(p), 0, 1) + clamp(-ycomp(e), 0, 1)) / 2;
            Ci = Ci * exp(-thick) + glow * (1 - exp(-thick));
        }""")
    head = 'Format 32 32 1\nProjection "perspective" "fov" 60\nWorldBegin\n'
    air = 'TransformBegin Translate 0 0.5 0 Atmosphere "layer" "uniform color glow" [0.2 0.4 0.8] TransformEnd\n'
    thing = 'Surface "constant" Color 0.8 0.5 0.1 Polygon "P" [-1 -1 0  -1 1 0  1 1 0  1 -1 0]\n'
    places = ["Translate -1 0 4 Rotate 30 1 0 0", "Translate 1 1 5", "Translate 1 -1 6 Scale 2 1 1"]
    plain = "".join(f"AttributeBegin {at}\n{thing}AttributeEnd\n" for at in places)
    objects = f"ObjectBegin 1\n{thing}ObjectEnd\n" + "".join(
        f"AttributeBegin {at}\nObjectInstance 1\nAttributeEnd\n" for at in places
    )
    whole = render(tmp_path, head + air + plain + "WorldEnd")
    instanced = render(tmp_path, head + air + objects + "WorldEnd")
    assert not messages(instanced)
    clear = render(tmp_path, head + plain + "WorldEnd")
    np.testing.assert_allclose(instanced["rgb"], whole["rgb"], atol=0.02)
    assert instanced["rgb"].mean((0, 1)) == pytest.approx(whole["rgb"].mean((0, 1)), rel=2e-3)
    assert np.abs(whole["rgb"] - clear["rgb"]).mean() > 0.01


def test_random_is_another_one_on_each_way(tmp_path: Path) -> None:
    """A march of two steps that begins anywhere: its mean is the integral, to which two even steps are far off."""
    (tmp_path / "jitter.sl").write_text("""
        volume jitter(color glow = 1;) {
            float k, sum = 0;
            for (k = 0; k < 2; k += 1) sum += pow((k + random()) / 2, 4) / 2;
            Ci = glow * sum;
        }""")
    picture = render(tmp_path, PLANE % 'Atmosphere "jitter"', 256)
    assert picture["rgb"].mean((0, 1)) == pytest.approx([0.2] * 3, rel=0.01)
    assert picture["rgb"].mean(-1).std() < 0.02
