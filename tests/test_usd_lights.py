"""Lights of USD stages: shaping, meshes that shine, portals, instances, linking; against closed forms."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import kanuka
from usd_stages import CAMERA, HEAD, MATTE, read, stage

# A floor that reflects half of the light, 6 by 6, and what lies two units above its middle and shines down.
FLOOR = """
def Mesh "floor" (prepend apiSchemas = ["MaterialBindingAPI"]) {
    rel material:binding = </matte>
    uniform token subdivisionScheme = "none"
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-3, 0, 3), (3, 0, 3), (3, 0, -3), (-3, 0, -3)]
}
"""
DOWN = """
double3 xformOp:translate = (0, 2, 0)
float xformOp:rotateX = -90
uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateX"]
"""


def lamp(kind: str, body: str, place: str = DOWN, name: str = "lamp") -> str:
    return f'def {kind} "{name}" (prepend apiSchemas = ["ShapingAPI"]) {{\n{body}\n{place}}}\n'


def irradiance(scene: kanuka.Scene, samples: int = 64, size: int = 32, reach: float = 2.0) -> np.ndarray:
    """Of the floor in a grid of (size, size) places from -reach to reach, the first row at +z: (size, size, 3)."""
    scene.camera = kanuka.Camera(
        (0, 1.2, 0), (0, 0, 0), up=(0, 0, -1), projection="orthographic", screen_window=(-reach, reach, -reach, reach)
    )
    scene.resolution = (size, size)
    scene.options.filter, scene.options.filter_width = "box", (1, 1)
    rgb = kanuka.render(scene, progressions=samples, threads=1, max_depth=1)["rgb"]
    return rgb[::-1] * math.pi / 0.5


FINER = 8  # of what is expected of a pixel's area


def places(size: int = 32, reach: float = 2.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """x, z and the angle to straight down, from two units above the floor, in degrees; for pixels()."""
    n = size * FINER
    x, z = np.meshgrid(*[((np.arange(n) + 0.5) / n - 0.5) * 2 * reach] * 2)
    return x, -z, np.degrees(np.arctan(np.hypot(x, z) / 2))


def pixels(values: np.ndarray) -> np.ndarray:
    n = len(values) // FINER
    return values.reshape(n, FINER, n, FINER).mean((1, 3))


def smooth(low: float, high: float, x: np.ndarray) -> np.ndarray:
    t = np.clip((x - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


def shone(tmp_path: Path, *parts: str, head: str = HEAD, **options) -> tuple[np.ndarray, list[str]]:
    scene, told = read(stage(tmp_path, CAMERA, MATTE, FLOOR, *parts, head=head))
    return irradiance(scene, **options), told


# ---- shaping. A small light of area A and radiance 1 sends the intensity A g(theta) w(theta): its outline, its shaping.

INTENSITY = {
    "RectLight": ("float inputs:width = 0.02\nfloat inputs:height = 0.03", 0.0006),
    "DiskLight": ("float inputs:radius = 0.02", math.pi * 0.0004),
    "SphereLight": ("float inputs:radius = 0.02", math.pi * 0.0004),
    "CylinderLight": ("float inputs:radius = 0.005\nfloat inputs:length = 0.05", 0.0005),
}
CONE, SOFT, FOCUS = (f"float inputs:shaping:{name} = %g" for name in ("cone:angle", "cone:softness", "focus"))
SHAPES = {
    "hard cone": (CONE % 30, lambda t: 1.0 * (t <= 30)),
    "soft cone": (f"{CONE % 40}\n{SOFT % 0.75}", lambda t: 1 - smooth(10, 40, t)),
    "focus": (FOCUS % 3, lambda t: np.cos(np.radians(t)) ** 3),
    "focus of no whole number": (FOCUS % 2.5, lambda t: np.cos(np.radians(t)) ** 2.5),
    "cone and focus": (f"{CONE % 30}\n{FOCUS % 4}", lambda t: (t <= 30) * np.cos(np.radians(t)) ** 4),
}


@pytest.mark.parametrize("kind", INTENSITY)
@pytest.mark.parametrize("shape", SHAPES)
def test_lights_shine_by_angle(tmp_path: Path, kind: str, shape: str) -> None:
    size, area = INTENSITY[kind]
    settings, weight = SHAPES[shape]
    found, told = shone(tmp_path, lamp(kind, f"{size}\n{settings}\nfloat inputs:intensity = 1000"))
    assert told == []
    x, z, theta = places()
    cosine = np.cos(np.radians(theta))
    outline = {"RectLight": cosine, "DiskLight": cosine, "SphereLight": 1.0}.get(
        kind, np.sqrt(1 - x**2 / (x**2 + z**2 + 4))
    )
    expected = pixels(1000 * area * outline * weight(theta) * cosine**3 / 4)
    grey = found.mean(-1)
    # Where the edge, which the light's size blurs a little, cuts a pixel is the noise.
    whole = pixels(1.0 * (weight(theta - 0.7) > 0)) == pixels(1.0 * (weight(theta + 0.7) > 0))
    assert grey[whole] == pytest.approx(expected[whole], rel=0.02, abs=0.01 * expected.max())
    assert grey.sum() == pytest.approx(expected.sum(), rel=0.01)
