"""Pictures against stored means and variances, made by tools/make_references.py."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

import kanuka

REFERENCES = Path(__file__).parent / "references"


@dataclass(frozen=True)
class Reference:
    """Mean over `runs` renders with seeds of their own, each of `progressions`; variance of one such render."""

    mean: np.ndarray
    variance: np.ndarray
    runs: int
    progressions: int

    def z_test(self, picture: kanuka.Picture, of: int = 1, renders: int = 1) -> kanuka.ZTestResult:
        """One of so many tests, together wrong one time in a hundred; `picture`: the mean of so many renders."""
        variance_of_mean = kanuka.Picture({"rgb": self.variance / self.runs})
        mean = kanuka.Picture({"rgb": self.mean})
        return kanuka.z_test(
            mean,
            variance_of_mean,
            picture,
            reference_samples=self.runs,
            test_samples=renders,
            significance=1 - 0.99 ** (1 / of),
        )

    def mean_errors(self, picture: kanuka.Picture, renders: int = 1) -> np.ndarray:
        """By channel: how far the mean over all pixels is off, over its standard deviation."""
        rgb = picture["rgb"].astype(np.float64)
        pixels = rgb[..., 0].size
        sigma = np.sqrt(self.variance.sum(axis=(0, 1), dtype=np.float64) * (1 / renders + 1 / self.runs)) / pixels
        return (rgb.mean(axis=(0, 1)) - self.mean.mean(axis=(0, 1), dtype=np.float64)) / sigma


def load(name: str) -> Reference:
    with np.load(REFERENCES / f"{name}.npz") as data:
        return Reference(data["mean"], data["variance"], int(data["runs"]), int(data["progressions"]))


def expect_same(reference: Reference, picture: kanuka.Picture, folder: Path, of: int = 1, renders: int = 1) -> None:
    """Each pixel is the reference's; where not, p-values are written into the folder."""
    result = reference.z_test(picture, of, renders)
    if not result.passed:
        result.p_values.write(folder / "p.exr")
    assert result.passed, (
        f"{result.rejected} of {result.tests} values rejected, smallest p {result.smallest_p:.3g} at "
        f"{result.worst_at}; p-values in {folder / 'p.exr'}"
    )
