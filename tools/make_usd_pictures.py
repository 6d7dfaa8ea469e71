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
# A camera, a sky and a window.
SET = """#usda 1.0
(
    {layers}
    upAxis = "Y"
    metersPerUnit = 1
)
def Camera "cam"
{{
    float focalLength = {focal_length}
    float horizontalAperture = 24
    float verticalAperture = {aperture}
    float2 clippingRange = (0.01, 100)
    matrix4d xformOp:transform = {camera}
    uniform token[] xformOpOrder = ["xformOp:transform"]
}}
def DomeLight "sky"
{{
    color3f inputs:color = (0.75, 0.85, 1)
    float inputs:intensity = {sky}
}}
def RectLight "window"
{{
    float inputs:width = {size}
    float inputs:height = {size}
    float inputs:intensity = {window}
    color3f inputs:color = (1, 0.93, 0.82)
    double3 xformOp:translate = {place}
    float3 xformOp:rotateXYZ = {turn}
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ"]
}}
"""
CHESS = {
    "focal_length": 50,
    "aperture": 12,
    "camera": "((0.866, 0, -0.5, 0), (-0.1913, 0.9239, -0.3314, 0), (0.462, 0.3827, 0.8, 0), (0.46, 0.40, 0.80, 1))",
    "sky": 0.35,
    "size": 0.8,
    "window": 12,
    "place": "(-1.2, 0.9, 0.5)",
    "turn": "(-33, -67, 0)",
}
TABLE = {
    "layers": "",
    "focal_length": 29,
    "aperture": 6,
    "camera": "((1, 0, 0, 0), (0, 0.9397, -0.342, 0), (0, 0.342, 0.9397, 0), (0, 1.1, 2.7, 1))",
    "sky": 0.3,
    "size": 2,
    "window": 9,
    "place": "(-2.5, 2.5, 1.5)",
    "turn": "(-40, -59, 0)",
}
TABLE_TOP = """
def Mesh "table"
{
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-9, 0, 9), (9, 0, 9), (9, 0, -9), (-9, 0, -9)]
    uniform token subdivisionScheme = "none"
    color3f[] primvars:displayColor = [(0.3, 0.27, 0.25)]
}
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


def rendered(scene: kanuka.Scene, samples: int) -> np.ndarray:
    """(height, width, 3), linear."""
    return np.asarray(kanuka.render(scene, progressions=samples, clamp_indirect=10, journal=kanuka.Journal())["rgb"])


def staged(text: str, resolution: tuple[int, int], samples: int) -> np.ndarray:
    with tempfile.TemporaryDirectory() as folder:
        stage = Path(folder) / "stage.usda"
        stage.write_text(text)
        return rendered(kanuka.usd.load(stage, resolution=resolution, journal=kanuka.Journal()), samples)


def chess(assets: Path, samples: int) -> np.ndarray:
    layers = f"subLayers = [@{assets}/OpenChessSet/chess_set.usda@]"
    return staged(SET.format(layers=layers, **CHESS), (960, 480), samples)


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
    pots = [
        TEAPOT.format(assets=assets, number=i, model=model, shading=shading, x=0.55 * (i - 1.5))
        for i, (model, shading) in enumerate(TEAPOTS)
    ]
    return staged(SET.format(**TABLE) + TABLE_TOP + "".join(pots), (960, 240), samples)


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
