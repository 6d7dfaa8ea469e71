"""The standard surface shaders against RISpec's definitions: a card under parallel light, seen and lit along its normal
or with the half vector along it, where a highlight is highest."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka

COLOR = (0.6, 0.3, 0.1)


def card(
    shader: str, tilt_degrees: float, light_degrees: float | None = None, specular: str = "prman", **parameters: float
) -> np.ndarray:
    """Mean radiance of a card of the shader, seen at `tilt_degrees` from its normal on one side and lit at as much, or
    at `light_degrees`, on the other."""
    tilt = np.radians(tilt_degrees)
    toward = np.radians(tilt_degrees if light_degrees is None else light_degrees)
    scene = kanuka.Scene()
    scene.resolution = 24, 24
    scene.options.specular = specular
    # The card is the plane y = 0; the view comes down at `tilt` on one side, the light on the other.
    view = np.array([np.sin(tilt), np.cos(tilt), 0.0])
    scene.camera = kanuka.Camera(tuple(200 * view), (0, 0, 0), (0, 0, 1), fov=0.2)
    points = np.array([[-9, 0, -9], [-9, 0, 9], [9, 0, 9], [9, 0, -9]], np.float32)
    faces = np.array([[0, 1, 2, 3]], np.int32)
    scene.add_mesh(points, faces, material=kanuka.Material(shader, color=COLOR, **parameters))
    # Cl = 1 is an irradiance of pi: RISpec's diffuse() multiplies it by the cosine alone.
    scene.add_light("distant", amount=[np.pi] * 3, direction=(float(np.sin(toward)), float(-np.cos(toward)), 0.0))
    picture = kanuka.render(scene, progressions=128, max_depth=1)
    assert not picture.journal.error_count, list(picture.journal)
    return picture["rgb"].mean((0, 1))


@pytest.mark.parametrize("tilt", [0, 20])
def test_matte_is_the_cosine(tilt: float) -> None:
    expected = 0.8 * np.cos(np.radians(tilt)) * np.array(COLOR)
    assert card("matte", tilt, Kd=0.8) == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("tilt", [0, 20])
def test_plastic_adds_a_white_highlight(tilt: float) -> None:
    cosine = np.cos(np.radians(tilt))
    expected = 0.5 * cosine * np.array(COLOR) + 0.4
    assert card("plastic", tilt, Kd=0.5, Ks=0.4, roughness=0.1) == pytest.approx(expected, rel=0.01)


# Seen and lit at these angles from the normal, on two sides of it.
PLACES = [(0, 0), (60, 60), (0, 20), (20, 0), (50, 30), (70, 40), (10, 60)]


def published(view: float, light: float, exponent: float) -> float:
    """pow(max(0, N . H), exponent): N . H is the cosine of half the difference of the angles."""
    return float(np.cos(np.radians(view - light) / 2) ** exponent)


@pytest.mark.parametrize(("view", "light"), PLACES)
@pytest.mark.parametrize(("specular", "one"), [("prman", 8.0), ("rispec", 1.0)])
@pytest.mark.parametrize("roughness", [0.1, 0.03])
def test_specular_is_the_published_formula(
    view: float, light: float, specular: str, one: float, roughness: float
) -> None:
    """PRMan's and Aqsis' 8 / roughness, or RISpec's 1 / roughness: height and width, from wherever it is seen."""
    expected = 0.9 * published(view, light, one / roughness) * np.array(COLOR)
    seen = card("metal", view, light, specular, Ks=0.9, roughness=roughness)
    assert seen == pytest.approx(expected, rel=0.01, abs=1e-4)


HIGHLIGHTS = {
    "specular": ("specular(Nf, V, 0.2)", lambda a, b: published(a, b, 40)),
    "bright": ("2.5 * specular(Nf, V, 0.02)", lambda a, b: 2.5 * published(a, b, 400)),
    "specularbrdf": ("specularbrdf(normalize(L), Nf, V, 0.2)", lambda a, b: published(a, b, 40)),
    "half": ("pow(max(0, Nf . normalize(normalize(L) + V)), 40)", lambda a, b: published(a, b, 40)),
    "phong": ("phong(Nf, V, 25)", lambda a, b: float(np.cos(np.radians(a - b)) ** 25)),
    "mirror": ("pow(max(0, R . normalize(L)), 25)", lambda a, b: float(np.cos(np.radians(a - b)) ** 25)),
}


@pytest.mark.parametrize(("view", "light"), [(0, 0), (55, 40), (15, 40)])
@pytest.mark.parametrize("name", HIGHLIGHTS)
def test_kernels_of_highlights(name: str, view: float, light: float, tmp_path: Path) -> None:
    """However a shader says it."""
    text, formula = HIGHLIGHTS[name]
    loop = "L" in text
    (tmp_path / f"{name}.sl").write_text(
        f"""surface {name}() {{
            normal Nf = faceforward(normalize(N), I); vector V = -normalize(I), R = reflect(-V, Nf);
            color C = 0;
            {f"illuminance(P, Nf, PI / 2) C += Cl * {text};" if loop else f"C = {text};"}
            Oi = Os; Ci = Os * C;
        }}"""
    )
    seen = card(str(tmp_path / f"{name}.sl"), view, light)
    assert seen == pytest.approx(np.full(3, formula(view, light)), rel=0.01, abs=1e-4)


def test_constant_shines_by_itself() -> None:
    assert card("constant", 0) == pytest.approx(np.array(COLOR), rel=0.01)


@pytest.mark.parametrize("kind", ["classic", "lobe"])
def test_light_of_its_own_varies_from_point_to_point(kind: str, tmp_path: Path) -> None:
    """A ramp of emission on one square: traced in large triangles, it would be as coarse as they are."""
    ramp = "color(s, t, 0.5)"
    if kind == "classic":
        text = f"surface ramp() {{ Oi = 1; Ci = {ramp}; }}"
    else:
        text = f"""class ramp() {{
            public void mnk_init(output MnkObjectProperties o; output MnkMaterial m) {{
                MnkMaterialBoundary b = CreateBoundary(m);
                AddLobe(b, "light", DiffuseEmission());
            }}
            public void mnk_prelighting(output MnkMaterialBoundary b) {{
                SetLobe(b, "light", 1, DiffuseEmission("radiance", {ramp}));
            }}
        }}"""
    (tmp_path / "ramp.sl").write_text(text)
    (tmp_path / "ramp.rib").write_text(
        'Format 64 64 1\nPixelFilter "box" 1 1\nProjection "orthographic"\nWorldBegin\nSurface "ramp"\n'
        'Polygon "P" [-1 -1 2  -1 1 2  1 1 2  1 -1 2] "st" [0 1 0 0 1 0 1 1]\nWorldEnd\n'
    )
    picture = kanuka.render(kanuka.load(tmp_path / "ramp.rib"), progressions=64)
    assert not picture.journal.error_count, list(picture.journal)
    across = (np.arange(64) + 0.5) / 64
    rows = picture["rgb"].mean(0)
    np.testing.assert_allclose(rows[:, 0], across, atol=0.02)
    np.testing.assert_allclose(picture["rgb"].mean(1)[:, 1], across, atol=0.02)
    # Pixel by pixel, too: what is left is noise of wavelengths.
    assert np.abs(picture["rgb"][..., 0] - across).mean() < 0.02
