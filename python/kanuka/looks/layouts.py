"""Pictures of environments in other layouts, by latitude and longitude: OpenEXR's, with +y at the top, +z in the middle
and +x a quarter from the left.

UsdLux names them without saying which way they are turned. Balls are as one is seen from +z with +x on the right: a
mirror in the middle shows +z, and so do light probes of angles (Debevec, "Light Probe Image Gallery": the radius is
acos(z) / pi). A cross is seen from inside, as the picture by latitude and longitude is: +z in its middle, +x to the
left, +y above, and below -y and then -z, upside down.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

FINER = 3  # directions a texel, each way
BAND = 64  # rows that are worked out together: pictures may be large

# Of a picture's height and width, and directions (…, 3): where they are in texels, x and y from the top left.
Place = Callable[[int, int, np.ndarray], tuple[np.ndarray, np.ndarray]]


def mirrored_ball(height: int, width: int, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The normal there is halfway between the direction and that to who looks, so r = sin(theta / 2)."""
    return on_ball(height, width, d, np.sqrt(np.maximum(1 - d[..., 2], 0) / 2))


def angular(height: int, width: int, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return on_ball(height, width, d, np.arccos(np.clip(d[..., 2], -1, 1)) / np.pi)


def on_ball(height: int, width: int, d: np.ndarray, r: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Never so far out that what is outside of the ball would show."""
    across = np.maximum(np.hypot(d[..., 0], d[..., 1]), 1e-12)
    r = np.minimum(r, 1 - 3 / min(height, width)) / across
    return (0.5 + 0.5 * d[..., 0] * r) * width, (0.5 - 0.5 * d[..., 1] * r) * height


# Of a cross of 3 by 4 squares: column, row, where its middle looks, its right and its top.
SQUARES = (
    (1, 1, (0, 0, 1), (-1, 0, 0), (0, 1, 0)),
    (0, 1, (1, 0, 0), (0, 0, 1), (0, 1, 0)),
    (2, 1, (-1, 0, 0), (0, 0, -1), (0, 1, 0)),
    (1, 0, (0, 1, 0), (-1, 0, 0), (0, 0, -1)),
    (1, 2, (0, -1, 0), (-1, 0, 0), (0, 0, 1)),
    (1, 3, (0, 0, -1), (-1, 0, 0), (0, -1, 0)),
)


def vertical_cross(height: int, width: int, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    if width * 4 != height * 3:
        raise ValueError(f"it has {width} by {height} texels: a vertical cross is 3 squares wide and 4 high")
    size = width / 3
    ahead = np.stack([d @ np.array(forward, dtype=float) for _, _, forward, _, _ in SQUARES])
    square = ahead.argmax(axis=0)
    depth = np.take_along_axis(ahead, square[None], axis=0)[0]
    columns, rows, rights, tops = (np.array([each[i] for each in SQUARES], dtype=float) for i in (0, 1, 3, 4))
    s, t = ((d * axes[square]).sum(-1) / depth for axes in (rights, tops))
    half = 0.5 - 0.5 / size  # from the middle of one texel to that of another: neighbours in the cross are strangers
    x, y = np.clip(0.5 * s, -half, half) + 0.5, 0.5 - np.clip(0.5 * t, -half, half)
    return (columns[square] + x) * size, (rows[square] + y) * size


# With the heights of what is made of them, by theirs: as fine as they are where they are finest.
LAYOUTS: dict[str, tuple[Place, float]] = {
    "mirroredBall": (mirrored_ball, math.pi / 4),
    "angular": (angular, 0.5),
    "cubeMapVerticalCross": (vertical_cross, 0.5),
}


def unfolded(rgb: np.ndarray, layout: str) -> np.ndarray:
    """(height, width, 3) in one of LAYOUTS by latitude and longitude. Raises ValueError where it has not its shape."""
    place, scale = LAYOUTS[layout]
    height, width = rgb.shape[:2]
    if min(height, width) < 4:
        raise ValueError(f"it has {width} by {height} texels, which hold no environment")
    rows = max(2, round(height * scale))
    made = np.zeros((rows, 2 * rows, 3))
    inside = (np.arange(FINER) + 0.5) / FINER
    for begin in range(0, rows, BAND):
        band = made[begin : begin + BAND]
        for down in inside:
            theta = np.pi * (begin + np.arange(len(band)) + down)[:, None] / rows
            for along in inside:
                phi = np.pi * (np.arange(2 * rows) + along) / rows
                d = [np.sin(theta) * np.sin(phi), np.cos(theta) + 0 * phi, -np.sin(theta) * np.cos(phi)]
                band += looked_up(rgb, *place(height, width, np.stack(d, axis=-1))) / FINER**2
    return made


def looked_up(rgb: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Between the middles of four texels."""
    x, y = np.clip(x - 0.5, 0, rgb.shape[1] - 1), np.clip(y - 0.5, 0, rgb.shape[0] - 1)
    i, j = (np.minimum(v.astype(int), n - 2) for v, n in ((x, rgb.shape[1]), (y, rgb.shape[0])))
    s, t = (x - i)[..., None], (y - j)[..., None]
    upper = rgb[j, i] * (1 - s) + rgb[j, i + 1] * s
    lower = rgb[j + 1, i] * (1 - s) + rgb[j + 1, i + 1] * s
    return upper * (1 - t) + lower * t
