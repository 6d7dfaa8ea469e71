"""Statistics of pictures: how noisy, and whether two renderers make the same one.

A renderer's picture is estimated from several renders of their own seeds, as long as one another; what they differ by
says how far their mean may be off. Everything below follows from those batches: nothing is assumed about how a
renderer's noise is distributed over pixels, or how neighbours share it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

BLOCK = 16  # pixels a side


@dataclass(frozen=True)
class Estimate:
    """Sums over batches; `blocks` keeps every batch's block means, (batches, height / 16, width / 16, 3)."""

    total: np.ndarray
    squares: np.ndarray
    blocks: np.ndarray
    samples: int  # a pixel, of one batch

    @staticmethod
    def of(pictures: np.ndarray, samples: int, block: int = BLOCK) -> Estimate:
        pictures = pictures.astype(np.float64)
        blocks = np.stack([block_means(p, block) for p in pictures])
        return Estimate(pictures.sum(0), (pictures**2).sum(0), blocks, samples)

    def __add__(self, other: Estimate) -> Estimate:
        if self.samples != other.samples:
            raise ValueError("batches of different length do not add up")
        blocks = np.concatenate([self.blocks, other.blocks])
        return Estimate(self.total + other.total, self.squares + other.squares, blocks, self.samples)

    def superposed(self, other: Estimate) -> Estimate:
        """Of the sum of two pictures that were estimated apart, batch by batch; variances add up."""
        if (self.samples, self.batches) != (other.samples, other.batches):
            raise ValueError("only batches as many and as long are superposed")
        n = self.batches
        total = self.total + other.total
        squares = total**2 / n + (self.variance + other.variance) * (n - 1)
        return Estimate(total, squares, self.blocks + other.blocks, self.samples)

    @property
    def batches(self) -> int:
        return len(self.blocks)

    @property
    def mean(self) -> np.ndarray:
        return self.total / self.batches

    @property
    def variance(self) -> np.ndarray:
        """Of a single batch, for each pixel."""
        return np.maximum(self.squares - self.total**2 / self.batches, 0) / (self.batches - 1)

    def noise(self) -> float:
        """Relative variance of a single batch, averaged over the picture; falls as 1 / samples."""
        return float(np.mean(self.variance / (self.mean**2 + 0.01)))

    def scaled(self, factor: np.ndarray) -> Estimate:
        """Channels times `factor`."""
        return Estimate(self.total * factor, self.squares * factor**2, self.blocks * factor, self.samples)


def block_means(picture: np.ndarray, block: int = BLOCK) -> np.ndarray:
    rows, columns = (side // block for side in picture.shape[:2])
    return picture[: rows * block, : columns * block].reshape(rows, block, columns, block, -1).mean((1, 3))


def normal_score(t: np.ndarray, freedom: np.ndarray) -> np.ndarray:
    """|z| of the normal distribution that is as rare as Student's t: Wallace's approximation (1959)."""
    return (8 * freedom + 1) / (8 * freedom + 3) * np.sqrt(freedom * np.log1p(t * t / freedom))


@dataclass(frozen=True)
class Agreement:
    mean_ratio: tuple[float, float, float]  # of the channels' means, ours over theirs
    mean_sigma: tuple[float, float, float]  # of those ratios
    # After the means are made equal, blocks of 16²: their differences over what noise explains.
    rms_z: float  # 1 = noise alone
    rms_limit: float  # four sigma above 1, were a block's three channels one
    worst_z: float
    worst_limit: float  # Šidák's, at 1 in 1000
    residual: float  # what noise does not explain, r.m.s., as a part of the mean
    noise: float  # what it does

    @property
    def mean_error(self) -> float:
        return max(abs(ratio - 1) for ratio in self.mean_ratio)

    @property
    def structure(self) -> bool:
        """Is there more in the difference than noise?"""
        return self.rms_z > self.rms_limit or self.worst_z > self.worst_limit


def agreement(ours: Estimate, theirs: Estimate, level: bool = True) -> Agreement:
    """`level` takes a difference in the channels' means out before it looks for structure."""
    a, b = ours.blocks.mean((1, 2)), theirs.blocks.mean((1, 2))  # (batches, 3)
    ratio = a.mean(0) / b.mean(0)
    sigma = ratio * np.sqrt(_of_mean(a) / a.mean(0) ** 2 + _of_mean(b) / b.mean(0) ** 2)
    if level:
        ours = ours.scaled(1 / ratio)
    difference = ours.blocks.mean(0) - theirs.blocks.mean(0)
    va, vb = _of_mean(ours.blocks), _of_mean(theirs.blocks)
    # Welch's degrees of freedom; a block without noise must agree to rounding.
    floor = (1e-4 * np.abs(theirs.blocks.mean(0)) + 1e-6) ** 2
    variance = va + vb + floor
    freedom = variance**2 / (va**2 / (ours.batches - 1) + vb**2 / (theirs.batches - 1) + 1e-300)
    freedom = np.minimum(freedom, 1e6)
    z = normal_score(difference / np.sqrt(variance), freedom)
    scale = float(theirs.blocks.mean())
    unexplained = float(np.mean(difference**2 - variance))
    return Agreement(
        tuple(map(float, ratio)),
        tuple(map(float, sigma)),
        float(np.sqrt(np.mean(z**2))),
        math.sqrt(1 + 4 * math.sqrt(2 / z[..., 0].size)),
        float(z.max()),
        NormalDist().inv_cdf(1 - (1 - (1 - 1e-3) ** (1 / z.size)) / 2),
        math.sqrt(max(unexplained, 0)) / scale,
        math.sqrt(float(variance.mean())) / scale,
    )


@dataclass(frozen=True)
class Paired:
    """Of pictures by two builds with the same seeds: blocks' differences, over what their spread explains."""

    mean_ratio: float
    mean_sigma: float
    rms_z: float  # 1 = noise alone
    rms_limit: float  # four sigma above 1, were a block's three channels one
    worst_z: float
    worst_limit: float  # Šidák's, at 1 in 1000
    largest: float  # a block's relative difference

    @property
    def differs(self) -> bool:
        means = abs(self.mean_ratio - 1) > 4 * self.mean_sigma + 1e-5
        return means or self.rms_z > self.rms_limit or self.worst_z > self.worst_limit


def paired(ours: np.ndarray, theirs: np.ndarray, block: int = BLOCK) -> Paired:
    """Of (seeds, height, width, 3). What two builds have in common, the noise of the same random numbers, cancels.

    Differences below a ten-thousandth of a block's light are rounding: a bent path here and there, not a fault.
    """
    a, b = (np.stack([block_means(p.astype(np.float64), block) for p in side]) for side in (ours, theirs))
    n = len(a)
    difference = (a - b).mean(0)
    variance = (a - b).var(0, ddof=1) / n + (1e-4 * np.abs(b.mean(0)) + 1e-6) ** 2
    z = normal_score(difference / np.sqrt(variance), np.full(variance.shape, n - 1.0))
    means = (a - b).mean((1, 2, 3)) / b.mean()
    return Paired(
        1 + float(means.mean()),
        float(means.std(ddof=1)) / math.sqrt(n),
        float(np.sqrt(np.mean(z**2))),
        math.sqrt(1 + 4 * math.sqrt(2 / z[..., 0].size)),
        float(z.max()),
        NormalDist().inv_cdf(1 - (1 - (1 - 1e-3) ** (1 / z.size)) / 2),
        float(np.max(np.abs(difference) / (np.abs(b.mean(0)) + 1e-3 * b.mean()))),
    )


def _of_mean(batches: np.ndarray) -> np.ndarray:
    """Variance of the mean over batches."""
    return batches.var(0, ddof=1) / len(batches)


def relative_error(picture: np.ndarray, converged: Estimate) -> float:
    """Squared error over the square of what should be, averaged, less what the converged picture's own noise adds."""
    truth = converged.mean
    squared = (picture.astype(np.float64) - truth) ** 2 - converged.variance / converged.batches
    return float(np.mean(squared / (truth**2 + 0.01)))
