"""The benchmark's verdict on two pictures: it must pass noise and find bias and structure."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest

SOURCE = Path(__file__).parent.parent / "bench" / "pictures.py"
SPEC = importlib.util.spec_from_file_location("bench_pictures", SOURCE)
pictures = importlib.util.module_from_spec(SPEC)
sys.modules[SPEC.name] = pictures  # dataclasses look their module up
SPEC.loader.exec_module(pictures)

SHAPE = (128, 128, 3)


def truth() -> np.ndarray:
    return 0.2 + np.random.default_rng(0).random(SHAPE)


def estimate(seed: int, image: np.ndarray, batches: int = 8, samples: int = 64) -> pictures.Estimate:
    """Renders of `image` with the skewed noise of path tracing."""
    rng = np.random.default_rng(seed)
    noise = rng.exponential(size=(batches, 4, *SHAPE)).mean(1)
    return pictures.Estimate.of(image * noise, samples)


def test_noise_alone_agrees() -> None:
    found = [pictures.agreement(estimate(2 * k, truth()), estimate(2 * k + 1, truth())) for k in range(10)]
    assert sum(a.structure for a in found) <= 1
    assert np.mean([a.rms_z for a in found]) == pytest.approx(1, abs=0.05)
    assert all(a.residual < 0.01 for a in found)
    errors = [(np.array(a.mean_ratio) - 1) / a.mean_sigma for a in found]
    assert np.abs(errors).max() < 5


def test_a_dimmer_picture_is_a_bias_and_no_structure() -> None:
    found = pictures.agreement(estimate(1, 0.98 * truth()), estimate(2, truth()))
    assert found.mean_error == pytest.approx(0.02, abs=0.004)
    assert not found.structure
    assert pictures.agreement(estimate(1, 0.98 * truth()), estimate(2, truth()), level=False).rms_z > 1.1


def test_a_shadow_that_is_off_is_structure() -> None:
    image = truth()
    image[40:60, 30:70] *= 1.15
    found = pictures.agreement(estimate(1, image), estimate(2, truth()))
    assert found.structure
    assert found.residual > 0.01


def test_sums_of_estimates_are_estimates_of_all() -> None:
    a, b = estimate(1, truth()), estimate(2, truth(), batches=3)
    both = a + b
    assert both.batches == 11
    np.testing.assert_allclose(both.mean, (8 * a.mean + 3 * b.mean) / 11)
    with pytest.raises(ValueError, match="length"):
        a + estimate(3, truth(), samples=32)


def test_noise_is_the_relative_variance_of_one_batch() -> None:
    image = truth()
    measured = estimate(5, image, batches=64).noise()
    assert measured == pytest.approx(np.mean(0.25 * image**2 / (image**2 + 0.01)), rel=0.03)


def renders(seed: int, image: np.ndarray, seeds: int = 8) -> np.ndarray:
    return image * np.random.default_rng(seed).exponential(size=(seeds, 4, *SHAPE)).mean(1)


def test_two_builds_with_noise_of_their_own_agree() -> None:
    found = [pictures.paired(renders(2 * k, truth()), renders(2 * k + 1, truth())) for k in range(10)]
    assert sum(a.differs for a in found) <= 1
    assert np.mean([a.rms_z for a in found]) == pytest.approx(1, abs=0.05)


def test_two_builds_with_the_same_noise_are_compared_far_below_it() -> None:
    made = renders(1, truth())
    assert not pictures.paired(made, made).differs
    # A bent path here and there.
    bent = made.copy()
    bent[np.random.default_rng(2).random(made.shape[:3]) < 1e-4] *= 1.5
    assert not pictures.paired(bent, made).differs
    shadow = made.copy()
    shadow[:, 48:64, 32:64] *= 0.998
    found = pictures.paired(shadow, made)
    assert found.differs
    assert found.largest == pytest.approx(0.002, rel=0.01)
    assert pictures.paired(made * 1.0003, made).differs
