"""Is a picture of the same scene as a stored one? Per pixel, by mean and variance [Mitsuba 3, test_renders.py].

A pixel of the reference is the mean over `runs` renders with seeds of their own, each as long as the one
under test; their variance is that of a single render. Under the hypothesis that nothing but the seed changed,

    z = (x - mean) / sqrt(variance (1 + 1 / runs))

is Student's t with runs - 1 degrees of freedom. Over n values, the smallest p is held against Šidák's
1 - (1 - a)^(1/n).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Reference:
    mean: np.ndarray
    variance: np.ndarray
    runs: int
    progressions: int


def t_sf(t: np.ndarray, dof: int) -> np.ndarray:
    """Two-sided tail of Student's t, by Wallace's normal approximation (relative error of p well below a tenth)."""
    from math import erfc

    z = (8 * dof + 1) / (8 * dof + 3) * np.sqrt(dof * np.log1p(t * t / dof))
    return np.vectorize(erfc)(z / np.sqrt(2))


def p_values(picture: np.ndarray, reference: Reference) -> np.ndarray:
    """One for each value of the picture."""
    scale = np.sqrt(reference.variance * (1 + 1 / reference.runs))
    # Pixels without noise (constant background) must agree up to rounding to half.
    scale = np.maximum(scale, 1e-3 * np.abs(reference.mean) + 1e-6)
    return t_sf((picture - reference.mean) / scale, reference.runs - 1)


def same(picture: np.ndarray, reference: Reference, significance: float = 1e-3) -> tuple[bool, float, float]:
    """Whether the test passes, the smallest p, and what it is held against."""
    p = p_values(picture.astype(np.float64), reference)
    threshold = 1 - (1 - significance) ** (1 / p.size)
    return bool(p.min() >= threshold), float(p.min()), threshold
