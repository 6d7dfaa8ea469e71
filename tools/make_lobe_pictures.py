"""Makes docs/images/lobes: a row of five balls for every lobe of docs/lobes.md, one of its inputs over its range."""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PICTURES = ROOT / "docs" / "images" / "lobes"

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
    "BlinnBrdf": ("exponent", ["2", "10", "40", "200", "2000"], ""),
}

# Layers: the upper lobe and the lower one, VALUE changing.
LAYERS = {
    "ThickCoat": (
        ["0", "0.15", "0.4", "1", "2.5"],
        'MicrofacetDielectricBrdf("ior", 1.6, "roughness", 0.03, "absorption", color(0.15, 0.7, 1.6), "thickness", VALUE)',
        'MicrofacetConductorBrdf("reflectance", color(0.9), "roughness", 0.45)',
        "thick",
    ),
}

SCENE = """\
Format 500 108 1
Display "balls.png" "file" "rgb"
PixelSamples 6 6
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


def layered_ball(name: str, value: str) -> str:
    """The shader of one ball of a row of layers."""
    _, upper, lower, operator = LAYERS[name]
    text = LAYERED_BALL.replace("UPPER", upper).replace("LOWER", lower).replace("OPERATOR", operator)
    return text.replace("VALUE", value)


def main() -> None:
    PICTURES.mkdir(parents=True, exist_ok=True)
    page = (ROOT / "docs" / "lobes.md").read_text()
    names = re.findall(r"images/lobes/(\w+)\.png", page)
    for name in sys.argv[1:] or [*names, *LAYERS]:
        key, values, rest = SWEEPS.get(name, ("roughness", ["0", "0.25", "0.5", "0.75", "1"], ""))
        values = LAYERS[name][0] if name in LAYERS else values
        with tempfile.TemporaryDirectory() as folder:
            balls = ""
            for i, value in enumerate(values):
                inputs = f'"{key}", {value}' + (f", {rest}" if rest else "")
                text = BALL.replace("LOBE", name).replace("INPUTS", inputs)
                text = layered_ball(name, value) if name in LAYERS else text
                text = text.replace("NUMBER", str(i))
                (Path(folder) / f"ball{i}.sl").write_text(text)
                balls += f'AttributeBegin\n  Surface "ball{i}"\n  Translate {(i - 2) * 2.25} 0 0\n'
                balls += "  Rotate -90 1 0 0\n  Sphere 1 -1 1 360\nAttributeEnd\n"
            (Path(folder) / "checks.sl").write_text(CHECKS)
            (Path(folder) / "scene.rib").write_text(SCENE.replace("BALLS", balls))
            picture = PICTURES / f"{name}.png"
            command = [sys.executable, "-m", "kanuka", "render", "scene.rib", "-o", str(picture)]
            subprocess.run(command, cwd=folder, check=False)


if __name__ == "__main__":
    main()
