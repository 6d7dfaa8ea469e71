"""Pictures against stored means and variances, made by tools/make_references.py."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka
import scenes
import ztest

REFERENCES = Path(__file__).parent / "references"


def load(name: str) -> ztest.Reference:
    with np.load(REFERENCES / f"{name}.npz") as data:
        return ztest.Reference(
            data["mean"].astype(np.float64),
            data["variance"].astype(np.float64),
            int(data["runs"]),
            int(data["progressions"]),
        )


@pytest.mark.parametrize("name", scenes.ALL)
def test_picture_is_the_reference(name: str, tmp_path: Path) -> None:
    reference = load(name)
    picture = kanuka.render(scenes.ALL[name](), progressions=reference.progressions, seed=4242)["rgb"]
    passed, p, threshold = ztest.same(picture, reference)
    if not passed:
        np.save(tmp_path / "p.npy", ztest.p_values(picture, reference))
    assert passed, f"smallest p {p:.3g} < {threshold:.3g}; p-values in {tmp_path / 'p.npy'}"


@pytest.mark.parametrize("name", scenes.ALL)
def test_mean_of_the_picture(name: str) -> None:
    """The mean over all pixels sees a bias that is too small for any one of them."""
    reference = load(name)
    picture = kanuka.render(scenes.ALL[name](), progressions=reference.progressions, seed=99)["rgb"]
    n = picture[..., 0].size
    sigma = np.sqrt(reference.variance.sum(axis=(0, 1)) * (1 + 1 / reference.runs)) / n
    error = picture.mean(axis=(0, 1)) - reference.mean.mean(axis=(0, 1))
    assert (np.abs(error) < 4.5 * sigma + 1e-3 * reference.mean.mean()).all(), (error, sigma)


def fake(rng: np.random.Generator, scale: float = 1) -> np.ndarray:
    return scale * rng.gamma(4, 0.25, size=(16, 24, 3))


def test_the_test_passes_what_is_same_and_finds_what_is_not() -> None:
    rng = np.random.default_rng(1)
    runs = np.stack([np.mean([fake(rng) for _ in range(64)], axis=0) for _ in range(32)])
    reference = ztest.Reference(runs.mean(0), runs.var(0, ddof=1), 32, 64)
    passes = sum(ztest.same(np.mean([fake(rng) for _ in range(64)], axis=0), reference)[0] for _ in range(20))
    assert passes >= 18
    picture = np.mean([fake(rng) for _ in range(64)], axis=0)
    wrong = picture.copy()
    wrong[5, 7] += 0.6
    assert not ztest.same(wrong, reference)[0], "one wrong pixel"
    assert not ztest.same(picture * 1.3, reference)[0], "a bias"
    assert not ztest.same(picture[:, ::-1] * np.linspace(0.5, 1.5, 24)[None, :, None], reference)[0]
