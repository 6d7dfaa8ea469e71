"""Classic surfaces that do with light what no lobe does: run for the lights of the scene, each at its point."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka

PLACE = np.array([1.0, 0.5, 3.0])


def render(tmp_path: Path, body: str, head: str = "", things: str = "") -> kanuka.Picture:
    """A wall 5 ahead, two by two, under a point light in front of it."""
    (tmp_path / "own.sl").write_text(
        "surface own() { normal Nf = faceforward(normalize(N), I); vector V = -normalize(I); color C = 0;\n"
        f"illuminance (P, Nf, PI / 2) {{ vector Ln = normalize(L); {body} }}\nOi = Os; Ci = Os * C; }}"
    )
    (tmp_path / "scene.rib").write_text(
        f'Format 32 32 1\nPixelFilter "box" 1 1\nProjection "orthographic"\n{head}WorldBegin\n{things}'
        'LightSource "pointlight" 1 "intensity" 6 "from" [1 0.5 3] "lightcolor" [1 0.5 0.25]\n'
        'Surface "own"\nPolygon "P" [-1 -1 5  -1 1 5  1 1 5  1 -1 5]\nWorldEnd\n'
    )
    picture = kanuka.render(kanuka.load(tmp_path / "scene.rib"), progressions=256)
    assert not picture.journal.error_count, list(picture.journal)
    return picture


def light() -> tuple[np.ndarray, np.ndarray]:
    """Cosine to the light and its colour at every pixel, RISpec's point light in double."""
    c = 2 * (np.arange(32) + 0.5) / 32 - 1
    x, y = np.meshgrid(c, -c)
    away = PLACE - np.stack([x, y, np.full_like(x, 5)], -1)
    r2 = (away**2).sum(-1)
    return -away[..., 2] / np.sqrt(r2), 6 * np.array([1, 0.5, 0.25]) / r2[..., None]


def test_gooch_shading_is_its_formula(tmp_path: Path) -> None:
    """Gooch et al. 1998: from cool to warm by the cosine, which is no lobe."""
    cosine, Cl = light()
    warm, cool = np.array([0.6, 0.5, 0.1]), np.array([0.1, 0.2, 0.5])
    expected = Cl * (cool + (warm - cool) * ((1 + cosine) / 2)[..., None])
    picture = render(tmp_path, "C += Cl * mix(color(0.1, 0.2, 0.5), color(0.6, 0.5, 0.1), (1 + Ln . Nf) / 2);")
    np.testing.assert_allclose(picture["rgb"], expected, rtol=0.05, atol=2e-3)
    assert picture["rgb"].mean((0, 1)) == pytest.approx(expected.mean((0, 1)), rel=0.005)
    assert any("run for the lights of the scene" in m.message for m in picture.journal.messages)


def test_a_step_is_a_step(tmp_path: Path) -> None:
    cosine, Cl = light()
    picture = render(tmp_path, "C += Cl * (pow(Ln . Nf, 3) > 0.6 ? 0.5 : 0.125);")
    expected = Cl * np.where(cosine**3 > 0.6, 0.5, 0.125)[..., None]
    clear = np.abs(cosine**3 - 0.6) > 0.08
    assert 100 < (cosine**3 > 0.68).sum() < 900 and clear.sum() > 600
    np.testing.assert_allclose(picture["rgb"][clear], expected[clear], rtol=0.05, atol=2e-3)


def test_all_light_between_surfaces_keeps_the_albedo(tmp_path: Path) -> None:
    """Traced in full what a surface shines with would light others, with light that is theirs already."""
    picture = render(tmp_path, "C += Cl * pow(Ln . Nf, 3);", 'Option "kanuka" "string transport" ["full"]\n')
    cosine, Cl = light()
    np.testing.assert_allclose(picture["rgb"], Cl * 0.5 * cosine[..., None], rtol=0.05, atol=3e-3)


@pytest.mark.parametrize("lanes", [1, 8])
def test_any_number_of_lanes_is_the_same(tmp_path: Path, lanes: int) -> None:
    body = "C += Cl * pow(Ln . Nf, 3); if (Ln . V < 0.9) continue; C += 0.1 * Cl;"
    first = render(tmp_path, body)["rgb"]
    again = kanuka.render(kanuka.load(tmp_path / "scene.rib"), progressions=256, lanes=lanes)["rgb"]
    np.testing.assert_allclose(again, first, rtol=2e-5, atol=1e-6)


# Between the lamp and the wall; the camera looks through it.
SCREEN = """Attribute "light" "string shadows" "on"
AttributeBegin
Surface "constant" %s
Attribute "visibility" "integer camera" 0
Polygon "P" [-9 -9 4  -9 9 4  0.3 9 4  0.3 -9 4]
AttributeEnd
"""
GOOCH = "C += Cl * mix(color(0.1, 0.2, 0.5), color(0.6, 0.5, 0.1), (1 + Ln . Nf) / 2);"


def gooch() -> tuple[np.ndarray, np.ndarray]:
    """What it is where there is light, and where on the wall the screen's edge throws no shadow."""
    cosine, Cl = light()
    warm, cool = np.array([0.6, 0.5, 0.1]), np.array([0.1, 0.2, 0.5])
    c = 2 * (np.arange(32) + 0.5) / 32 - 1
    x, _ = np.meshgrid(c, -c)
    crossing = PLACE[0] + (x - PLACE[0]) * (4 - PLACE[2]) / (5 - PLACE[2])
    return Cl * (cool + (warm - cool) * ((1 + cosine) / 2)[..., None]), crossing - 0.3


def test_own_light_is_shadowed_where_its_light_casts_shadows(tmp_path: Path) -> None:
    expected, beyond = gooch()
    seen = render(tmp_path, GOOCH, things=SCREEN % "")["rgb"]
    lit, dark = beyond > 0.04, beyond < -0.04
    assert lit.sum() > 200 < dark.sum()
    np.testing.assert_allclose(seen[lit], expected[lit], rtol=0.05, atol=2e-3)
    assert np.abs(seen[dark]).max() < 1e-3


def test_own_light_without_shadows_shines_through(tmp_path: Path) -> None:
    expected, _ = gooch()
    seen = render(tmp_path, GOOCH, things=(SCREEN % "").replace('"on"', '"off"'))["rgb"]
    np.testing.assert_allclose(seen, expected, rtol=0.05, atol=2e-3)


def test_own_light_takes_the_colour_of_stained_glass(tmp_path: Path) -> None:
    """Of a grey lamp: products of coloured spectra are not those of RGB."""
    grey = "C += luminance(Cl) * (0.2 + pow(Ln . Nf, 3));"
    cosine, Cl = light()
    expected = (Cl @ [0.2126, 0.7152, 0.0722] * (0.2 + cosine**3))[..., None] * np.array([0.1, 0.5, 0.9])
    dark = gooch()[1] < -0.04
    seen = render(tmp_path, grey, things=SCREEN % "Color [0 0 0] Opacity [0.9 0.5 0.1]")["rgb"]
    assert seen[dark].mean(0) == pytest.approx(expected[dark].mean(0), rel=0.02)


def test_own_light_of_two_lamps_has_the_shadow_of_each(tmp_path: Path) -> None:
    expected, beyond = gooch()
    other = 'LightSource "distantlight" 9 "intensity" 0.5 "from" [0 0 0] "to" [-1 0 1]\n'  # beside the screen
    screen = (SCREEN % "").replace("AttributeBegin", other + "AttributeBegin", 1)
    seen = render(tmp_path, GOOCH, things=screen)["rgb"]
    # The second lamp's way goes back along (1, 0, -1): it meets the screen's plane one to the right.
    c = 2 * (np.arange(32) + 0.5) / 32 - 1
    x, _ = np.meshgrid(c, -c)
    clear = x + 1 - 0.3
    cosine = np.sqrt(0.5)
    warm, cool = np.array([0.6, 0.5, 0.1]), np.array([0.1, 0.2, 0.5])
    more = 0.5 * (cool + (warm - cool) * (1 + cosine) / 2)
    whole = expected * (beyond > 0)[..., None] + more * (clear > 0)[..., None]
    sure = (np.abs(beyond) > 0.04) & (np.abs(clear) > 0.04)
    np.testing.assert_allclose(seen[sure], whole[sure], rtol=0.12, atol=5e-3)
    assert seen[sure].mean(0) == pytest.approx(whole[sure].mean(0), rel=0.01)
