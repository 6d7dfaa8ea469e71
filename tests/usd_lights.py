"""Stages with lights over a floor, and what the floor has of them by closed forms, for the tests of USD's lights."""

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
        (0, 0.5, 0), (0, 0, 0), up=(0, 0, -1), projection="orthographic", screen_window=(-reach, reach, -reach, reach)
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


INTENSITY = {
    "RectLight": ("float inputs:width = 0.02\nfloat inputs:height = 0.03", 0.0006),
    "DiskLight": ("float inputs:radius = 0.02", math.pi * 0.0004),
    "SphereLight": ("float inputs:radius = 0.02", math.pi * 0.0004),
    "CylinderLight": ("float inputs:radius = 0.005\nfloat inputs:length = 0.05", 0.0005),
}
CONE, SOFT, FOCUS = (f"float inputs:shaping:{name} = %g" for name in ("cone:angle", "cone:softness", "focus"))


def from_points(points: list[tuple[float, float, float]], intensity: float) -> np.ndarray:
    x, z, _ = places()
    total = np.zeros(x.shape)
    for a, b, c in points:
        d2 = (x - a) ** 2 + b**2 + (z - c) ** 2
        total += intensity * b / d2**1.5
    return pixels(total)


def same(found: np.ndarray, expected: np.ndarray) -> None:
    """By means of 4 by 4 pixels: which light a path sees is by chance."""
    found, expected = (values.reshape(8, 4, 8, 4).mean((1, 3)) for values in (found.mean(-1), expected))
    assert found == pytest.approx(expected, rel=0.05)


# A square of side 0.04 that looks down from two units above the floor: 1.6e-3 / 4 of its radiance arrives below.
PANEL = """
def Mesh "panel" (prepend apiSchemas = ["MeshLightAPI", "MaterialBindingAPI"]) {
    uniform token subdivisionScheme = "none"
    int[] faceVertexCounts = [3, 3]
    int[] faceVertexIndices = [0, 1, 2, 0, 2, 3]
    point3f[] points = [(-0.02, 2, -0.02), (0.02, 2, -0.02), (0.02, 2, 0.02), (-0.02, 2, 0.02)]
    BODY
}
"""
GLOWING = """
def Material "glowing" {
    token outputs:surface.connect = </glowing/s.outputs:surface>
    def Shader "s" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (0.5, 0.5, 0.5)
        color3f inputs:emissiveColor = (0.5, 1, 2)
        int inputs:useSpecularWorkflow = 1
        color3f inputs:specularColor = (0, 0, 0)
        token outputs:surface
    }
}
"""


def panel(*body: str) -> str:
    return PANEL.replace("BODY", "\n    ".join(body))


TILE = """
class Xform "_tile" {
    def Mesh "top" (prepend apiSchemas = ["MaterialBindingAPI"]) {
        rel material:binding = </matte>
        uniform token subdivisionScheme = "none"
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        point3f[] points = [(-0.5, 0, 2), (0.5, 0, 2), (0.5, 0, -2), (-0.5, 0, -2)]
    }
}
"""
NOON = """
def DistantLight "sun" {
    float inputs:intensity = 1
    bool inputs:normalize = 1
    float inputs:angle = 0
    float xformOp:rotateX = -90
    uniform token[] xformOpOrder = ["xformOp:rotateX"]
    LINK
}
"""


def tile(name: str, x: float) -> str:
    return f"""
def Xform "{name}" (instanceable = true
    inherits = </_tile>) {{
    double3 xformOp:translate = ({x}, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}}
"""


TILES = "".join(tile(name, x) for name, x in (("a", -1.5), ("b", -0.5), ("c", 0.5), ("d", 1.5)))
