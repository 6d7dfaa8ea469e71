"""Makes docs/images/interiors.png: fog, milk, skin, and a glass with a drink in it, in a row."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PICTURE = ROOT / "docs" / "images" / "interiors.png"

# The drink is a little larger than the hollow that it fills; the glass has the higher priority.
SCENE = """\
Format 384 120 1
Display "interiors.png" "file" "rgb"
PixelSamples 3 3
ShadingRate 0.5
Option "kanuka" "integer maxdepth" 24
Option "searchpath" "string shader" [".:&"]
Projection "perspective" "fov" [17]
Translate 0 0.02 12
Rotate -9 1 0 0
WorldBegin
LightSource "distantlight" 1 "intensity" [2.6] "from" [-3 3 -1] "to" [0 0 0] "float angle" [5]
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


def main() -> None:
    PICTURE.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "checks.sl").write_text(CHECKS)
        (Path(folder) / "scene.rib").write_text(SCENE)
        command = [sys.executable, "-m", "kanuka", "render", "scene.rib", "-o", str(PICTURE), *sys.argv[1:]]
        subprocess.run(command, cwd=folder, check=False)


if __name__ == "__main__":
    main()
