"""Stages of the USD Working Group's assets, with a camera, lights and one material.

KANUKA_USD_ASSETS names a copy of github.com/usd-wg/assets; what needs it is left out where there is none.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from scenes import Camera, Scene, cache_folder

ASSETS = {
    "chess": "full_assets/OpenChessSet/chess_set.usda",
    "ball": "full_assets/StandardShaderBall/standard_shader_ball_scene.usda",
}
# One preview surface is on everything: Blender reads no MaterialX, so materials would not be the same.
CLAY = """#usda 1.0
(
    subLayers = [@{asset}@]
    upAxis = "Y"
    metersPerUnit = 1
)
over "ROOT" (
    prepend apiSchemas = ["MaterialBindingAPI"]
)
{{
    rel material:binding = </bench_clay> (
        bindMaterialAs = "strongerThanDescendants"
    )
}}
def Material "bench_clay"
{{
    token outputs:surface.connect = </bench_clay/surface.outputs:surface>
    def Shader "surface"
    {{
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (0.5, 0.45, 0.4)
        float inputs:roughness = 0.35
        token outputs:surface
    }}
}}
"""
# Looks at the board from one corner, by the light of two panels.
CHESS = (
    CLAY.replace("ROOT", "ChessSet")
    + """
def Camera "bench_camera"
{{
    float focalLength = 40
    float horizontalAperture = 24
    float verticalAperture = 13.5
    float2 clippingRange = (0.01, 100)
    matrix4d xformOp:transform = ((0.7071, 0, -0.7071, 0), (-0.2989, 0.9063, -0.2989, 0),
                                  (0.6409, 0.4226, 0.6409, 0), (0.62, 0.45, 0.62, 1))
    uniform token[] xformOpOrder = ["xformOp:transform"]
}}
def RectLight "bench_roof"
{{
    float inputs:width = 2
    float inputs:height = 2
    float inputs:intensity = 1.5
    double3 xformOp:translate = (0, 1.5, 0)
    float xformOp:rotateX = -90
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateX"]
}}
def RectLight "bench_window"
{{
    float inputs:width = 0.6
    float inputs:height = 0.6
    float inputs:intensity = 8
    double3 xformOp:translate = (-1.2, 0.8, 0.6)
    float3 xformOp:rotateXYZ = (-30, -63, 0)
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ"]
}}
"""
)
# In its box, by its own camera and lights.
BALL = CLAY.replace("ROOT", "standard_shader_ball_scene")


def asset(name: str) -> Path | None:
    folder = os.environ.get("KANUKA_USD_ASSETS")
    path = Path(folder) / ASSETS[name] if folder else None
    return path.resolve() if path and path.exists() else None


def there() -> list[str]:
    return [name for name in ASSETS if asset(name)]


def staged(name: str, text: str, resolution: tuple[int, int]) -> Scene:
    """The asset below what `text` puts over it."""
    path = asset(name)
    if path is None:
        raise FileNotFoundError(f"{name}: KANUKA_USD_ASSETS names no folder with {ASSETS[name]}")
    stage = cache_folder() / f"{name}.usda"
    stage.write_text(text.format(asset=path))
    return Scene(name, resolution, 16, Camera((0, 0, 1), (0, 0, 0), 40), stage=stage)


MAKERS: dict[str, tuple[Callable[[int], Scene], int]] = {
    "chess": (lambda n: staged("chess", CHESS, (960, 540)), 0),
    "ball": (lambda n: staged("ball", BALL, (480, 480)), 0),
}
