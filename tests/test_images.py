"""Pictures against stored means and variances, made by tools/make_references.py."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import kanuka
import scenes

REFERENCES = Path(__file__).parent / "references"


@dataclass(frozen=True)
class Reference:
    """Mean over `runs` renders with seeds of their own, each of `progressions`; variance of one such render."""

    mean: np.ndarray
    variance: np.ndarray
    runs: int
    progressions: int

    def z_test(self, picture: kanuka.Picture) -> kanuka.ZTestResult:
        variance_of_mean = kanuka.Picture({"rgb": self.variance / self.runs})
        mean = kanuka.Picture({"rgb": self.mean})
        return kanuka.z_test(mean, variance_of_mean, picture, reference_samples=self.runs, test_samples=1)


def load(name: str) -> Reference:
    with np.load(REFERENCES / f"{name}.npz") as data:
        return Reference(data["mean"], data["variance"], int(data["runs"]), int(data["progressions"]))


def render(name: str, seed: int, **keywords: object) -> kanuka.Picture:
    return kanuka.render(scenes.ALL[name](), progressions=load(name).progressions, seed=seed, **keywords)


@pytest.mark.parametrize("name", scenes.ALL)
def test_each_pixel_is_the_references(name: str, tmp_path: Path) -> None:
    result = load(name).z_test(render(name, seed=4242))
    if not result.passed:
        result.p_values.write(tmp_path / "p.exr")
    assert result.passed, (
        f"{result.rejected} of {result.tests} values rejected, smallest p {result.smallest_p:.3g} at "
        f"{result.worst_at}; p-values in {tmp_path / 'p.exr'}"
    )


@pytest.mark.parametrize("name", scenes.ALL)
def test_mean_of_the_picture(name: str) -> None:
    """The mean over all pixels sees a bias that is too small for any one of them."""
    reference = load(name)
    picture = render(name, seed=99)["rgb"].astype(np.float64)
    pixels = picture[..., 0].size
    sigma = np.sqrt(reference.variance.sum(axis=(0, 1), dtype=np.float64) * (1 + 1 / reference.runs)) / pixels
    error = picture.mean(axis=(0, 1)) - reference.mean.mean(axis=(0, 1), dtype=np.float64)
    assert (np.abs(error) < 4 * sigma).all(), (error / sigma, error)


@pytest.mark.parametrize(("factor", "pixel"), [(1.02, 0.0), (0.98, 0.0), (1.0, 0.5)])
def test_a_small_bias_and_a_wrong_pixel_are_found(factor: float, pixel: float) -> None:
    picture = render("box", seed=7)["rgb"] * np.float32(factor)
    picture[3, 5] += pixel
    reference = load("box")
    passed = reference.z_test(kanuka.Picture({"rgb": picture})).passed
    error = abs(picture.mean() - reference.mean.mean())
    sigma = np.sqrt(reference.variance.sum(dtype=np.float64)) / picture.size
    assert not passed or error > 4 * sigma


def test_other_routes_to_the_same_picture() -> None:
    """Finer shading and untouched micropolygons change the work, not the expectation."""
    reference = load("instances")
    for keywords in ({"shading_rate": 0.25}, {"geometry_tolerance": 0.0}):
        error = render("instances", seed=5, **keywords)["rgb"].mean() / reference.mean.mean() - 1
        assert abs(error) < 0.01, keywords
