"""How sure a figure is: 95 % confidence intervals of few rounds, by Student's t on logarithms.

Rounds are taken in turn, so what disturbs the machine disturbs both sides of a ratio: they are compared round by round.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

CONFIDENCE = 0.95


def t_quantile(freedom: int, confidence: float = CONFIDENCE) -> float:
    """x with P(|t| < x) = confidence: Simpson's rule and bisection."""
    scale = math.exp(math.lgamma((freedom + 1) / 2) - math.lgamma(freedom / 2)) / math.sqrt(freedom * math.pi)

    def inside(x: float, steps: int = 400) -> float:
        # t = sqrt(freedom) tan(angle) makes the tails short.
        end = math.atan(x / math.sqrt(freedom))
        h = end / steps
        heights = [math.cos(k * h) ** (freedom - 1) for k in range(steps + 1)]
        whole = heights[0] + heights[-1] + 4 * sum(heights[1:-1:2]) + 2 * sum(heights[2:-1:2])
        return 2 * scale * math.sqrt(freedom) * whole * h / 3

    low, high = 0.0, 1.0
    while inside(high) < confidence:
        high *= 2
    for _ in range(50):
        middle = (low + high) / 2
        low, high = (middle, high) if inside(middle) < confidence else (low, middle)
    return high


@dataclass(frozen=True)
class Interval:
    """The geometric mean and where the truth may lie; without bounds if there was one round."""

    value: float
    low: float | None = None
    high: float | None = None

    def below(self, limit: float) -> str:
        """met: all of the interval is below; missed: all of it is above; else nothing is decided."""
        if self.low is None or self.high is None:
            return "undecided"
        return "met" if self.high < limit else "missed" if self.low > limit else "undecided"

    def root(self, degree: int) -> Interval:
        """Of each of so many equal factors."""
        return Interval(*(None if x is None else x ** (1 / degree) for x in (self.value, self.low, self.high)))

    def above(self, limit: float) -> str:
        turned = {"met": "missed", "missed": "met", "undecided": "undecided"}
        return turned[self.below(limit)]


def of(values: Sequence[float]) -> Interval:
    """Of positive numbers, one a round."""
    if len(values) == 0 or min(values) <= 0:
        return Interval(sum(values) / len(values) if len(values) else 0.0)
    logs = [math.log(value) for value in values]
    mean = sum(logs) / len(logs)
    if len(logs) < 2:
        return Interval(math.exp(mean))
    spread = math.sqrt(sum((x - mean) ** 2 for x in logs) / (len(logs) - 1) / len(logs))
    half = t_quantile(len(logs) - 1) * spread
    return Interval(math.exp(mean), math.exp(mean - half), math.exp(mean + half))


def of_ratio(ours: Sequence[float], theirs: Sequence[float]) -> Interval:
    """Ours over theirs, round by round."""
    return of([a / b for a, b in zip(ours, theirs, strict=True)])
