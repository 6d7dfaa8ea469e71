"""kanuka.Lobe: formulas in double precision, normalisation, and what sampling gives."""

from __future__ import annotations

import numpy as np
import pytest

import kanuka
import kanuka.plots

rng = np.random.default_rng(3)


def sphere(n: int) -> np.ndarray:
    z = rng.uniform(-1, 1, n)
    phi = rng.uniform(0, 2 * np.pi, n)
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], -1)


def at(degrees: float) -> np.ndarray:
    return kanuka.plots.in_plane(np.array([degrees]))


def test_lambert_is_the_cosine_over_pi() -> None:
    lobe = kanuka.Lobe("LambertBrdf", diffuseReflectance=(0.2, 0.5, 0.8))
    wi = sphere(100)
    value, pdf = lobe.evaluate(at(40), wi)
    cosine = np.maximum(wi[:, 2:], 0) / np.pi
    np.testing.assert_allclose(value, cosine * [0.2, 0.5, 0.8], atol=1e-6)
    np.testing.assert_allclose(pdf, cosine[:, 0], atol=1e-6)
    np.testing.assert_allclose(lobe.albedo(at(40)), [[0.2, 0.5, 0.8]], rtol=1e-6)


def test_burley_is_the_published_formula() -> None:
    """Burley 2012, 5.3, normalised by Lagarde and de Rousiers 2014, "Moving Frostbite to PBR", listing 1."""
    roughness, wo, wi = 0.7, in_units([-0.5, 0.1, 0.7]), in_units([0.3, 0.2, 0.3])
    half = in_units(wo + wi)
    grazing, factor = 0.5 * roughness + 2 * roughness * (wi @ half) ** 2, 1 + roughness * (1 / 1.51 - 1)
    published = (1 + (grazing - 1) * (1 - wi[2]) ** 5) * (1 + (grazing - 1) * (1 - wo[2]) ** 5) * factor / np.pi
    value, _ = kanuka.Lobe("BurleyBrdf", roughness=roughness).evaluate(wo, wi)
    np.testing.assert_allclose(value[0], published * wi[2], rtol=1e-5)


def in_units(v: object) -> np.ndarray:
    return np.asarray(v) / np.linalg.norm(v)


def test_ggx_at_its_peak() -> None:
    """Head-on the mirror direction of a conductor with reflectance 1 has D G / 4 cos = 1 / (4 pi alpha^2)."""
    for roughness in (0.2, 0.5):
        lobe = kanuka.Lobe("MicrofacetConductorBrdf", roughness=roughness)
        value, _ = lobe.evaluate((0, 0, 1), (0, 0, 1))
        single = 1 / (4 * np.pi * roughness**4)
        assert single <= value[0, 0] < 1.1 * single  # several facets add a little


@pytest.mark.parametrize("name", kanuka.lobe_names())
def test_sampling_estimates_the_integral(name: str) -> None:
    """Mean of value / pdf over samples is the integral of evaluate() over the sphere, without single directions."""
    inputs = {"roughness": 0.5} if "roughness" in kanuka_inputs(name) else {}
    lobe = kanuka.Lobe(name, **inputs)
    n = 200_000
    drawn = lobe.sample(at(-35), rng.uniform(size=(n, 3)))
    assert drawn["wi"].shape == (n, 3)
    assert drawn["valid"].mean() > 0.5
    np.testing.assert_allclose(np.linalg.norm(drawn["wi"][drawn["valid"]], axis=1), 1, atol=1e-4)
    weight = np.where(drawn["valid"][:, None], drawn["value"] / np.maximum(drawn["pdf"], 1e-20)[:, None], 0)
    estimate, error = weight.mean(0), weight.std(0) / np.sqrt(n)
    if drawn["delta"].any():
        assert (estimate <= 1 + 5 * error).all()
        return
    wi = sphere(n)
    value, pdf = lobe.evaluate(at(-35), wi)
    np.testing.assert_allclose((pdf * 4 * np.pi).mean(), drawn["valid"].mean(), atol=0.05)
    whole = value * 4 * np.pi
    spread = np.hypot(whole.std(0) / np.sqrt(n), error)
    assert (np.abs(whole.mean(0) - estimate) <= 5 * spread + 1e-4).all()
    # What evaluate() says of a drawn direction is what sample() said.
    again, density = lobe.evaluate(at(-35), drawn["wi"][:64])
    valid = drawn["valid"][:64]
    np.testing.assert_allclose(again[valid], drawn["value"][:64][valid], rtol=2e-3, atol=1e-5)
    np.testing.assert_allclose(density[valid], drawn["pdf"][:64][valid], rtol=2e-3, atol=1e-5)


def kanuka_inputs(name: str) -> str:
    with pytest.raises(TypeError) as error:
        kanuka.Lobe(name, nothing=1)
    return str(error.value)


def test_glass_from_inside_reflects_all_beyond_the_critical_angle() -> None:
    glass = kanuka.Lobe("MicrosurfaceDielectricBsdfRgb_v1", ior=1.5)
    for degrees, total in ((180 - 41, False), (180 - 43, True)):  # asin(1 / 1.5) = 41.8
        drawn = glass.sample(at(degrees), rng.uniform(size=(4096, 3)))
        assert drawn["delta"].all()
        assert (drawn["wi"][:, 2] < 0).all() == total


def test_measured_metals_have_their_colours() -> None:
    gold = kanuka.Lobe("MetalBrdf", metal="Au", roughness=0.3).albedo((0, 0, 1))[0]
    assert gold[0] > gold[1] > gold[2] + 0.2


def test_bad_input_is_told() -> None:
    for call, words in (
        (lambda: kanuka.Lobe("Lambert"), "is no lobe that scatters.*LambertBrdf"),
        (lambda: kanuka.Lobe("DiffuseEmission"), "is no lobe that scatters"),
        (lambda: kanuka.Lobe("LambertBrdf").evaluate((0, 0, 0), (0, 0, 1)), "wo: a direction has a length"),
        (lambda: kanuka.Lobe("LambertBrdf").evaluate(np.eye(3), np.eye(3)[:2]), "as many rows"),
        (lambda: kanuka.Lobe("LambertBrdf").sample((0, 0, 1), (0, 0, 1)), "u: expected numbers"),
        (lambda: kanuka.Lobe("MetalBrdf", metal="Xx"), 'metal: there is no "Xx"'),
    ):
        with pytest.raises(ValueError, match=words):
            call()
    with pytest.raises(TypeError, match="has no input rough; it has"):
        kanuka.Lobe("SheenBrdf", rough=1)


def test_plots(tmp_path) -> None:
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    axes = kanuka.plots.lobe(kanuka.Lobe("LambertBrdf", diffuseReflectance=(1, 0.5, 0.2)), angles=(0, 60))
    assert len(axes.lines) == 6
    red = axes.lines[0]
    assert red.get_ydata().max() == pytest.approx(1 / np.pi, rel=1e-3)
    assert red.get_xdata()[np.argmax(red.get_ydata())] == pytest.approx(0, abs=0.01)
    assert len(kanuka.plots.lobe(kanuka.Lobe("SheenBrdf")).lines) == 3  # no colour: one line each
    axes.figure.savefig(tmp_path / "lobe.png")
    assert (tmp_path / "lobe.png").stat().st_size > 5000
