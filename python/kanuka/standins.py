"""What stands in for what a file of another format does not say: where it is seen from, and what lights it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

import kanuka


def lights(scene: kanuka.Scene) -> None:
    """A white sky and a sun."""
    scene.add_light("environment", amount=0.4, visible_camera=False, name="sky of a scene without lights")
    scene.add_light("distant", amount=1.9, direction=(-0.5, -1, -0.7), angle=2, name="sun of a scene without lights")


def camera(bounds: ArrayLike, aspect: float, fov: float = 35) -> kanuka.Camera:
    """From the front, a little above, as near as all of a box allows. `bounds`: its lowest and highest corner; `fov`
    is that of the height."""
    corners = np.stack(np.meshgrid(*np.transpose(bounds), indexing="ij"), axis=-1).reshape(-1, 3)
    middle = np.mean(bounds, axis=0)
    back = np.array([0.3, 0.35, 1.0])
    back /= np.linalg.norm(back)
    right = np.cross([0, 1, 0], back)
    right /= np.linalg.norm(right)
    up = np.cross(back, right)
    away = corners - middle
    slope = math.tan(math.radians(fov / 2)) * 0.92  # some room at the edges
    needed = np.maximum(np.abs(away @ up) / slope, np.abs(away @ right) / (slope * aspect)) + away @ back
    distance = float(needed.max()) or 1.0
    return kanuka.Camera(
        tuple(middle + back * distance),
        tuple(middle),
        fov=fov,
        fov_axis="y",
        near_clip=distance * 1e-3,
        far_clip=distance * 1e3,
    )
