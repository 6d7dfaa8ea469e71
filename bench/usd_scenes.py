"""Stages of the USD Working Group's assets, with a camera and lights where they have none, and stages of many prims.

KANUKA_USD_ASSETS names a copy of github.com/usd-wg/assets; what needs it is left out where there is none.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from scenes import Camera, Scene, cache_folder

ASSETS = {
    "chess": "full_assets/OpenChessSet/chess_set.usda",
    "shader-ball": "full_assets/StandardShaderBall/standard_shader_ball_scene.usda",
}
# Looks at the board from one corner of it; a sky and a low sun.
CHESS = """#usda 1.0
(
    subLayers = [@{asset}@]
    upAxis = "Y"
    metersPerUnit = 1
)
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
def DomeLight "bench_sky"
{{
    color3f inputs:color = (0.8, 0.9, 1)
    float inputs:intensity = 0.6
}}
def DistantLight "bench_sun"
{{
    float inputs:angle = 2
    float inputs:intensity = 2
    bool inputs:normalize = 1
    float3 xformOp:rotateXYZ = (-40, 30, 0)
    uniform token[] xformOpOrder = ["xformOp:rotateXYZ"]
}}
"""


def asset(name: str) -> Path | None:
    folder = os.environ.get("KANUKA_USD_ASSETS")
    path = Path(folder) / ASSETS[name] if folder else None
    return path.resolve() if path and path.exists() else None


def there() -> list[str]:
    return [name for name in ASSETS if asset(name)]


def staged(name: str, text: str, resolution: tuple[int, int]) -> Scene:
    path = asset(name)
    if path is None:
        raise FileNotFoundError(f"{name}: KANUKA_USD_ASSETS names no folder with {ASSETS[name]}")
    if text:
        stage = cache_folder() / f"{name}.usda"
        stage.write_text(text.format(asset=path))
        path = stage
    return Scene(name, resolution, 32, Camera((0, 0, 1), (0, 0, 0), 40), stage=path)


MAKERS: dict[str, tuple[Callable[[int], Scene], int]] = {
    "chess": (lambda n: staged("chess", CHESS, (960, 540)), 0),
    "shader-ball": (lambda n: staged("shader-ball", "", (640, 640)), 0),
}
