"""Makes docs/images/usd_scenes.png: OpenChessSet, StandardShaderBall and Teapot of the USD Working Group's assets.

KANUKA_USD_ASSETS=~/usd-wg/assets python tools/make_usd_pictures.py [SAMPLES]
"""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path

import numpy as np

import kanuka
import kanuka.usd

PICTURE = Path(__file__).resolve().parent.parent / "docs" / "images" / "usd_scenes.png"
BALLS = ("gold", "glass", "plastic", "bubblegum")
CHESS = """#usda 1.0
(
    subLayers = [@{assets}/OpenChessSet/chess_set.usda@]
    upAxis = "Y"
    metersPerUnit = 1
)
def Camera "cam"
{{
    float focalLength = 50
    float horizontalAperture = 24
    float verticalAperture = 12
    float2 clippingRange = (0.01, 100)
    matrix4d xformOp:transform = ((0.866, 0, -0.5, 0), (-0.1913, 0.9239, -0.3314, 0),
                                  (0.462, 0.3827, 0.8, 0), (0.46, 0.40, 0.80, 1))
    uniform token[] xformOpOrder = ["xformOp:transform"]
}}
def DomeLight "sky"
{{
    color3f inputs:color = (0.75, 0.85, 1)
    float inputs:intensity = 0.35
}}
def RectLight "window"
{{
    float inputs:width = 0.8
    float inputs:height = 0.8
    float inputs:intensity = 12
    color3f inputs:color = (1, 0.93, 0.82)
    double3 xformOp:translate = (-1.2, 0.9, 0.5)
    float3 xformOp:rotateXYZ = (-33, -67, 0)
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ"]
}}
"""
# A teapot, and where it stands.
TEAPOT = """
def "pot_{number}" (
    references = @{assets}/Teapot/Teapot.usd@
    variants = {{
        string modelVariant = "{model}"
        string shadingVariant = "{shading}"
    }}
)
{{
    double3 xformOp:translate = ({x}, 0, 0)
    float xformOp:rotateY = -60
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateY"]
}}
"""
TEAPOTS = (("Fancy", "PorcelainFlowers"), ("Utah", "CeramicBlue"), ("Utah", "CeramicOrange"), ("Utah", "CeramicBlack"))
TABLE = """#usda 1.0
(
    upAxis = "Y"
    metersPerUnit = 1
)
def Camera "cam"
{
    float focalLength = 29
    float horizontalAperture = 24
    float verticalAperture = 6
    float2 clippingRange = (0.01, 100)
    matrix4d xformOp:transform = ((1, 0, 0, 0), (0, 0.9397, -0.342, 0), (0, 0.342, 0.9397, 0), (0, 1.1, 2.7, 1))
    uniform token[] xformOpOrder = ["xformOp:transform"]
}
def Mesh "table"
{
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-9, 0, 9), (9, 0, 9), (9, 0, -9), (-9, 0, -9)]
    uniform token subdivisionScheme = "none"
    color3f[] primvars:displayColor = [(0.3, 0.27, 0.25)]
}
def DomeLight "sky"
{
    color3f inputs:color = (0.75, 0.85, 1)
    float inputs:intensity = 0.3
}
def RectLight "window"
{
    float inputs:width = 2
    float inputs:height = 2
    float inputs:intensity = 9
    color3f inputs:color = (1, 0.94, 0.85)
    double3 xformOp:translate = (-2.5, 2.5, 1.5)
    float3 xformOp:rotateXYZ = (-40, -59, 0)
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ"]
}
"""


def rendered(scene: kanuka.Scene, samples: int) -> np.ndarray:
    """(height, width, 3), linear."""
    return np.asarray(kanuka.render(scene, progressions=samples, clamp_indirect=10, journal=kanuka.Journal())["rgb"])


def chess(assets: Path, samples: int) -> np.ndarray:
    with tempfile.TemporaryDirectory() as folder:
        stage = Path(folder) / "chess.usda"
        stage.write_text(CHESS.format(assets=assets))
        return rendered(kanuka.usd.load(stage, resolution=(960, 480), journal=kanuka.Journal()), samples)


def ball(assets: Path, material: str, samples: int) -> np.ndarray:
    root = "/standard_shader_ball_scene"
    variants = {
        f"{root}{{example_material}}": f"mtlx_{material}",
        f"{root}/materials{{material_model}}": "standard_surface",
    }
    path = assets / "StandardShaderBall" / "standard_shader_ball_scene.usda"
    scene = kanuka.usd.load(path, resolution=(240, 240), variants=variants, journal=kanuka.Journal())
    return rendered(scene, samples)


def teapots(assets: Path, samples: int) -> np.ndarray:
    with tempfile.TemporaryDirectory() as folder:
        stage = Path(folder) / "table.usda"
        pots = [
            TEAPOT.format(assets=assets, number=i, model=model, shading=shading, x=0.55 * (i - 1.5))
            for i, (model, shading) in enumerate(TEAPOTS)
        ]
        stage.write_text(TABLE + "".join(pots))
        return rendered(kanuka.usd.load(stage, resolution=(960, 240), journal=kanuka.Journal()), samples)


def main() -> None:
    folder = os.environ.get("KANUKA_USD_ASSETS")
    if not folder:
        sys.exit("KANUKA_USD_ASSETS: name a copy of github.com/usd-wg/assets")
    assets, samples = Path(folder).resolve() / "full_assets", int(sys.argv[1]) if len(sys.argv) > 1 else 64
    row = np.concatenate([ball(assets, material, 2 * samples) for material in BALLS], axis=1)
    whole = np.concatenate([chess(assets, samples), row, teapots(assets, samples)])
    kanuka.Picture({"rgb": whole}).write(PICTURE)


if __name__ == "__main__":
    main()
