"""Makes what docs/shader-tutorial.md shows of its shaders: the pictures, and what the command prints.

    <!-- shader NAME.sl -->         the indented block below is the shader
    <!-- picture run NAME.sl -->    docs/images/tutorial/NAME.png: the unit square
    <!-- picture render NAME.sl --> the same: a ball on a floor
    <!-- info NAME.sl -->           the indented block below is what `kanuka shader info` prints
    <!-- emit NAME.sl -->           the indented block below is --emit=c of the prelighting

tests/test_tutorial.py compiles the shaders."""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "python"))
PAGE = ROOT / "docs" / "shader-tutorial.md"
PICTURES = ROOT / "docs" / "images" / "tutorial"

SCENE = """\
Format 320 240 1
Display "ball.exr" "file" "rgba"
PixelSamples 8 8
Projection "perspective" "fov" [30]
Translate 0 -0.15 5
WorldBegin
LightSource "distantlight" 1 "intensity" [0.7] "from" [2 3 -2] "to" [0 0 0] "uniform float angle" [6]
LightSource "environmentlight" 2 "intensity" [0.6] "uniform float visible" [0]
Attribute "displacementbound" "sphere" [0.2]
AttributeBegin
  Color [0.8 0.5 0.1]
  Surface "NAME"
  Rotate -90 1 0 0
  Sphere 1 -1 1 360
AttributeEnd
AttributeBegin
  Color [0.35 0.35 0.38]
  Surface "matte"
  Polygon "P" [-20 -1 -20  -20 -1 30  20 -1 30  20 -1 -20]
AttributeEnd
WorldEnd
"""


def blocks(page: str, kind: str) -> dict[str, str]:
    """The indented blocks that follow marks of a kind, by name."""
    found = {}
    for match in re.finditer(rf"<!-- {kind} (\S+) -->\n\n((?:(?:    .*)?\n)*)", page):
        found[match[1]] = re.sub(r"^    ", "", match[2], flags=re.MULTILINE).strip("\n") + "\n"
    return found


def command(folder: Path, *arguments: object) -> str:
    words = [sys.executable, "-m", "kanuka", *map(str, arguments)]
    return subprocess.run(words, cwd=folder, check=True, text=True, stdout=subprocess.PIPE).stdout


def insert(page: str, mark: str, text: str) -> str:
    indented = "".join(f"    {line}\n" if line else "\n" for line in text.splitlines())
    return re.sub(
        rf"(<!-- {re.escape(mark)} -->\n)(?:\n(?:    .*\n|\n)*)?(?=\S|\Z)", lambda m: f"{m[1]}\n{indented}\n", page
    )


def main() -> None:
    page = PAGE.read_text()
    PICTURES.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for file, text in blocks(page, "shader").items():
            (folder / file).write_text(text)
        for kind, file in re.findall(r"<!-- picture (run|render) (\S+) -->", page):
            picture = PICTURES / Path(file).with_suffix(".png").name
            if kind == "run":
                command(folder, "shader", "run", file, "--grid", "256x256", "-o", picture)
            else:
                (folder / "scene.rib").write_text(SCENE.replace("NAME", Path(file).stem))
                command(folder, "render", "scene.rib", "--progressions", 64, "--quiet", "-o", "out.exr", "--png")
                (folder / "out.png").replace(picture)
            print(picture.relative_to(ROOT), picture.stat().st_size)
        for file in re.findall(r"<!-- info (\S+) -->", page):
            page = insert(page, f"info {file}", command(folder, "shader", "info", file))
        for file in re.findall(r"<!-- emit (\S+) -->", page):
            text = command(folder, "shader", "compile", file, "--emit=c", "--stage", "prelighting", "--lanes", 8)
            page = insert(page, f"emit {file}", text)
    PAGE.write_text(page)


if __name__ == "__main__":
    main()
