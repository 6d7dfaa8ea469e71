"""Pictures of lobes, by matplotlib: `kanuka.plots.lobe(kanuka.Lobe("SheenBrdf"))`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from ._native import Lobe

COLORS = ("#d62728", "#2ca02c", "#1f77b4")  # red, green, blue


def in_plane(degrees: np.ndarray) -> np.ndarray:
    """(N, 3): unit vectors in the x-z plane, from the normal towards +x."""
    angle = np.radians(degrees)
    return np.stack([np.sin(angle), np.zeros_like(angle), np.cos(angle)], -1)


def lobe(shown: Lobe, angles: tuple[float, ...] = (0, 30, 60), axes: Any = None) -> Any:
    """Draws f |cos wi| in the plane of incidence, for light from `angles` (degrees from the normal, on the left).

    Colours in red, green and blue, as one line where they are equal. Returns matplotlib's polar axes; `axes` are others
    to draw into. Raises ImportError without matplotlib.
    """
    if axes is None:
        from matplotlib import pyplot

        axes = pyplot.subplots(subplot_kw={"projection": "polar"})[1]
    axes.set_theta_zero_location("N")
    axes.set_theta_direction(-1)
    degrees = np.linspace(-180, 180, 1441)[:-1]
    wi = in_plane(degrees)
    for style, angle in zip(("-", "--", ":", "-."), angles, strict=False):
        value, _ = shown.evaluate(in_plane(np.array([-angle], dtype=float)), wi)
        gray = np.array_equal(value[:, 0], value[:, 1]) and np.array_equal(value[:, 0], value[:, 2])
        for channel, color in ((0, "black"),) if gray else tuple(enumerate(COLORS)):
            label = f"{angle:g}°" if channel == 0 else None
            axes.plot(np.radians(degrees), value[:, channel], style, color=color, label=label)
    axes.set_title(shown.name)
    axes.legend(title="light from")
    return axes
