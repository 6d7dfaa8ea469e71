"""Stages that the tests of USD are about, piece by piece, and how they are read."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import kanuka
import kanuka.usd

HEAD = '#usda 1.0\n(\n    upAxis = "Y"\n    metersPerUnit = 1\n)\n'
# Looks straight down at the origin from 4 above; the picture is 2 wide.
CAMERA = """
def Camera "cam" {
    float focalLength = 40
    float horizontalAperture = 20
    float verticalAperture = 20
    float2 clippingRange = (0.1, 100)
    matrix4d xformOp:transform = ((1, 0, 0, 0), (0, 0, -1, 0), (0, 1, 0, 0), (0, 4, 0, 1))
    uniform token[] xformOpOrder = ["xformOp:transform"]
}
"""
# Reflects half of the light, alike in all directions.
MATTE = """
def Material "matte" {
    token outputs:surface.connect = </matte/s.outputs:surface>
    def Shader "s" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (0.5, 0.5, 0.5)
        int inputs:useSpecularWorkflow = 1
        color3f inputs:specularColor = (0, 0, 0)
        token outputs:surface
    }
}
"""
FLOOR = """
def Mesh "floor" (prepend apiSchemas = ["MaterialBindingAPI"]) {
    rel material:binding = </matte>
    uniform token subdivisionScheme = "none"
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-1, 0, 1), (1, 0, 1), (1, 0, -1), (-1, 0, -1)]
    EXTRA
}
"""
MOVED = """
def Sphere "b" {
    BODY
    double3 xformOp:translate = PLACE
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
"""
SUN = """
def DistantLight "sun" {
    float inputs:intensity = 2
    bool inputs:normalize = 1
    float inputs:angle = 0
    float xformOp:rotateX = -90
    uniform token[] xformOpOrder = ["xformOp:rotateX"]
}
"""


def stage(folder: Path, *parts: str, name: str = "a.usda", head: str = HEAD) -> Path:
    path = folder / name
    path.write_text(head + "".join(parts))
    return path


def read(path: Path, **options) -> tuple[kanuka.Scene, list[str]]:
    journal = kanuka.Journal()
    scene = kanuka.usd.load(path, journal=journal, **options)
    return scene, [m.message for m in journal]


def picture(scene: kanuka.Scene, size: int = 16, samples: int = 16) -> np.ndarray:
    scene.resolution = (size, size)
    scene.options.filter, scene.options.filter_width = "box", (1, 1)
    return kanuka.render(scene, progressions=samples)["rgb"]


def middle(rgb: np.ndarray) -> float:
    n = len(rgb) // 2
    return float(rgb[n - 1 : n + 1, n - 1 : n + 1].mean())


TEXTURED = """
def Material "matte" {
    token outputs:surface.connect = </matte/s.outputs:surface>
    def Shader "s" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor.connect = </matte/t.outputs:rgb>
        int inputs:useSpecularWorkflow = 1
        color3f inputs:specularColor = (0, 0, 0)
        token outputs:surface
    }
    def Shader "t" {
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @./quarters.png@
        float2 inputs:st.connect = </matte/r.outputs:result>
        token inputs:sourceColorSpace = "SPACE"
        token inputs:wrapS = "clamp"
        token inputs:wrapT = "clamp"
        float4 inputs:scale = (SCALE, SCALE, SCALE, 1)
        color3f outputs:rgb
    }
    def Shader "r" {
        uniform token info:id = "UsdPrimvarReader_float2"
        string inputs:varname = "map"
        float2 outputs:result
    }
}
"""
ST = 'texCoord2f[] primvars:map = [(0, 0), (1, 0), (1, 1), (0, 1)] (interpolation = "faceVarying")'
STANDARD = """
def Material "matte" {
    token outputs:mtlx:surface.connect = </matte/s.outputs:out>
    def Shader "s" {
        uniform token info:id = "ND_standard_surface_surfaceshader"
        float inputs:base = 0.5
        color3f inputs:base_color.connect = </matte/mix.outputs:out>
        float inputs:specular = 0
        token outputs:out
    }
    def Shader "mix" {
        uniform token info:id = "ND_mix_color3"
        color3f inputs:fg = (1, 0.5, 0)
        color3f inputs:bg = (0, 0.5, 1)
        float inputs:mix.connect = </matte/half.outputs:out>
        color3f outputs:out
    }
    def Shader "half" {
        uniform token info:id = "ND_multiply_float"
        float inputs:in1 = 3
        float inputs:in2 = 0.25
        float outputs:out
    }
}
"""
