"""Scenes of the manual's pictures: a row of balls for every lobe, interiors. Tests render them small, tools as the
manual shows them."""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

import kanuka

ROOT = Path(__file__).resolve().parent.parent
IMAGES = ROOT / "docs" / "images"
SMALL = (80, 18, 3)  # width, height, samples along each side of a pixel
BLOCK = (6, 8)  # rows, columns: two across a ball

# lobe: the input that changes, its five values, what else is given. Others: roughness from 0 to 1.
SWEEPS = {
    "LambertBrdf": ("diffuseReflectance", ["0.1", "0.3", "0.5", "0.7", "0.9"], ""),
    "LambertBtdf": ("diffuseTransmittance", ["0.1", "0.3", "0.5", "0.7", "0.9"], ""),
    "OrenNayarBrdf": ("roughness", ["0", "0.25", "0.5", "0.75", "1"], '"diffuseReflectance", color(0.8, 0.45, 0.25)'),
    "BurleyBrdf": ("roughness", ["0", "0.25", "0.5", "0.75", "1"], '"diffuseReflectance", color(0.8, 0.45, 0.25)'),
    "SheenBrdf": ("roughness", ["0.1", "0.2", "0.35", "0.6", "1"], '"reflectance", color(0.8, 0.3, 0.5)'),
    "MicrofacetConductorBrdf": (
        "anisotropy",
        ["0", "0.4", "0.7", "0.9", "1"],
        '"reflectance", color(0.9, 0.7, 0.5), "roughness", 0.55, "tail", 0.5',
    ),
    "MetalBrdf": ("metal", ['"Ag"', '"Au"', '"Cu"', '"Fe"', '"Ti"'], '"roughness", 0.3'),
    "RetroBrdf": ("roughness", ["0.15", "0.3", "0.45", "0.6", "0.8"], '"reflectance", color(0.9, 0.6, 0.2)'),
    "MicrofacetDielectricBrdf": (
        "filmThickness",
        ["0", "200", "350", "500", "900"],
        '"roughness", 0.1, "filmIor", 2.2',
    ),
    "MicrosurfaceDielectricBsdfRgb_v1": (
        "roughness",
        ["0", "color(0.2)", "color(0.4)", "color(0.6)", "color(0.9)"],
        "",
    ),
    "ThinWalledDielectricBsdf": ("thickness", ["0", "200", "350", "500", "900"], '"ior", 1.33'),
    "GratingBrdf": ("period", ["800", "1200", "1600", "3000", "6000"], '"roughness", 0.1, "depth", 130'),
    "PhongBrdf": ("exponent", ["2", "10", "40", "200", "2000"], ""),
    "DiffuseEmission": ("radiance", ["0.1", "0.25", "0.5", "1", "2"], ""),
    "ConeEmission": ("angle", ["15", "30", "45", "60", "90"], '"softness", 0.4'),
    "ProfileEmission": ("exponent", ["0", "1", "3", "10", "40"], ""),
    "BlinnBrdf": ("exponent", ["2", "10", "40", "200", "2000"], ""),
    "AimedBsdf": ("y", ["-1", "-0.3", "-0.1", "0.1", "1"], '"x", 0.3, "z", 1'),
    "HighlightBrdf": ("exponent", ["8", "20", "80", "400", "2000"], ""),
}

# Layers: the upper lobe and the lower one, VALUE changing.
LAYERS = {
    "ThickCoat": (
        ["0", "0.15", "0.4", "1", "2.5"],
        'MicrofacetDielectricBrdf("ior", 1.6, "roughness", 0.03, "absorption", color(0.15, 0.7, 1.6), '
        '"thickness", VALUE)',
        'MicrofacetConductorBrdf("reflectance", color(0.9), "roughness", 0.45)',
        "thick",
    ),
}

SCENE = """\
Format WIDTH HEIGHT 1
Display "balls.png" "file" "rgb"
PixelSamples SAMPLES SAMPLES
ShadingRate 0.5
Option "searchpath" "string shader" [".:&"]
Projection "perspective" "fov" [13]
Translate 0 0 11.2
Rotate -8 1 0 0
WorldBegin
LightSource "distantlight" 1 "intensity" [2.2] "from" [-2 3 -3] "to" [0 0 0] "float angle" [8]
LightSource "environmentlight" 2 "intensity" [0.7] "lightcolor" [0.8 0.9 1] "float visible" [1]
AttributeBegin
  Surface "checks"
  Patch "bilinear" "P" [-30 -1.05 -30  30 -1.05 -30  -30 -1.05 40  30 -1.05 40]
AttributeEnd
BALLS
WorldEnd
"""

# The drink is a little larger than the hollow that it fills; the glass has the higher priority.
INTERIORS = """\
Format WIDTH HEIGHT 1
Display "interiors.png" "file" "rgb"
PixelSamples SAMPLES SAMPLES
ShadingRate 0.5
Option "kanuka" "integer maxdepth" 24
Option "searchpath" "string shader" [".:&"]
Projection "perspective" "fov" [17]
Translate 0 0.02 12
Rotate -9 1 0 0
WorldBegin
LightSource "distantlight" 1 "intensity" [2.6] "from" [-3 3 -1] "to" [0 0 0] "float angle" [50]
LightSource "environmentlight" 2 "intensity" [0.6] "lightcolor" [0.75 0.87 1] "float visible" [1]
AttributeBegin
  Surface "checks"
  Patch "bilinear" "P" [-30 -1 -30  30 -1 -30  -30 -1 40  30 -1 40]
AttributeEnd
AttributeBegin
  Surface "cloud" "color scattering" [1.6 1.6 1.6] "float droplets" [12]
  Translate -3.6 0 0
  Rotate -90 1 0 0
  Sphere 1 -1 1 360
AttributeEnd
AttributeBegin
  Surface "glass" "float ior" [1.35] "color scattering" [18 22 26] "color absorption" [0.002 0.006 0.03]
          "float meanCosine" [0.5]
  Translate -1.2 0 0
  Rotate -90 1 0 0
  Sphere 1 -1 1 360
AttributeEnd
AttributeBegin
  Surface "glass" "float ior" [1.4] "float roughness" [0.5] "color scattering" [6 8 9]
          "color absorption" [0.05 0.35 0.6] "float meanCosine" [0.3]
  Translate 1.2 0 0
  Rotate -90 1 0 0
  Sphere 1 -1 1 360
AttributeEnd
AttributeBegin
  Translate 3.6 0 0
  Rotate -90 1 0 0
  Surface "glass" "float ior" [1.5] "float priority" [1]
  Sphere 1 -1 1 360
  AttributeBegin
    ReverseOrientation
    Sphere 0.88 -0.88 0.88 360
  AttributeEnd
  Surface "glass" "float ior" [1.33] "color absorption" [0.15 0.9 2.6]
  Sphere 0.92 -0.92 0.15 360
  Disk 0.15 0.9077 360
AttributeEnd
WorldEnd
"""

CHECKS = """\
surface checks()
{
    point Q = transform("shader", P);
    float dark = mod(floor(xcomp(Q) * 1.5) + floor(zcomp(Q) * 1.5), 2);
    Oi = 1;
    Ci = mix(color(0.16), color(0.5), dark) * diffuse(faceforward(normalize(N), I));
}
"""

BALL = """\
class ballNUMBER()
{
    public void mnk_init(output MnkObjectProperties o; output MnkMaterial material)
    {
        MnkMaterialBoundary b = CreateBoundary(material);
        AddLobe(b, "lobe", LOBE(INPUTS));
    }
    public void mnk_prelighting(output MnkMaterialBoundary b)
    {
        SetLobe(b, "lobe", 1, LOBE(INPUTS));
    }
}
"""


LAYERED_BALL = """\
class ballNUMBER()
{
    public void mnk_init(output MnkObjectProperties o; output MnkMaterial material)
    {
        MnkMaterialBoundary b = CreateBoundary(material);
        AddLobe(b, "upper", UPPER);
        AddLobe(b, "lower", LOWER);
        AddLayer(b, "all", "OPERATOR", "upper", "lower");
    }
}
"""


def lobes() -> list[str]:
    """Lobes and layers that have a row of balls: those of docs/lobes.md with a picture, and LAYERS."""
    page = (ROOT / "docs" / "lobes.md").read_text()
    return [*re.findall(r"images/lobes/(\w+)\.png", page), *LAYERS]


def balls_of(name: str) -> list[str]:
    """The shaders of the five balls of a row."""
    if name in LAYERS:
        values, upper, lower, operator = LAYERS[name]
        text = LAYERED_BALL.replace("UPPER", upper).replace("LOWER", lower).replace("OPERATOR", operator)
        shaders = [text.replace("VALUE", value) for value in values]
    else:
        key, values, rest = SWEEPS.get(name, ("roughness", ["0", "0.25", "0.5", "0.75", "1"], ""))
        inputs = [f'"{key}", {value}' + (f", {rest}" if rest else "") for value in values]
        shaders = [BALL.replace("LOBE", name).replace("INPUTS", given) for given in inputs]
    return [text.replace("NUMBER", str(i)) for i, text in enumerate(shaders)]


def write_row(folder: Path, name: str, size: tuple[int, int, int]) -> Path:
    """A lobe's row of balls, as a RIB file and its shaders."""
    balls = ""
    for i, text in enumerate(balls_of(name)):
        (folder / f"ball{i}.sl").write_text(text)
        balls += f'AttributeBegin\n  Surface "ball{i}"\n  Translate {(i - 2) * 2.25} 0 0\n'
        balls += "  Rotate -90 1 0 0\n  Sphere 1 -1 1 360\nAttributeEnd\n"
    return _write(folder, SCENE.replace("BALLS", balls), size)


def write_interiors(folder: Path, size: tuple[int, int, int]) -> Path:
    """Fog, milk, skin, and a glass with a drink in it."""
    return _write(folder, INTERIORS, size)


def _write(folder: Path, scene: str, size: tuple[int, int, int]) -> Path:
    width, height, samples = map(str, size)
    (folder / "checks.sl").write_text(CHECKS)
    path = folder / "scene.rib"
    path.write_text(scene.replace("WIDTH", width).replace("HEIGHT", height).replace("SAMPLES", samples))
    return path


def render_row(name: str, seed: int) -> kanuka.Picture:
    """Small, as the tests hold it against tests/references/lobes."""
    with tempfile.TemporaryDirectory() as folder:
        return kanuka.render(kanuka.load(write_row(Path(folder), name, SMALL)), seed=seed)


def summary(picture: kanuka.Picture) -> kanuka.Picture:
    """Means over blocks of x / (1 + |x|): few samples a pixel have long tails, which no mean and variance describe.
    (A single wavelength's colour may lie outside of Rec.709, so x may be below -1.)"""
    rgb = picture["rgb"].astype(np.float64)
    height, width, _ = rgb.shape
    rows, columns = BLOCK
    blocks = (rgb / (1 + np.abs(rgb))).reshape(height // rows, rows, width // columns, columns, 3)
    return kanuka.Picture({"rgb": blocks.mean(axis=(1, 3)).astype(np.float32)})


def draw(picture: Path, write: Callable[[Path], Path], *arguments: object) -> None:
    """Renders one of the manual's pictures by the command; `write` puts the scene into a folder."""
    picture.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        path = write(Path(folder))
        command = [sys.executable, "-m", "kanuka", "render", str(path), "-o", str(picture), *map(str, arguments)]
        subprocess.run(command, cwd=folder, check=True)


def draw_row(name: str) -> None:
    """docs/images/lobes/NAME.png."""
    draw(IMAGES / "lobes" / f"{name}.png", lambda folder: write_row(folder, name, (500, 108, 6)))
