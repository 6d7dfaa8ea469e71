"""What all Python tests share: the command, small scenes."""

from __future__ import annotations

import functools
import os
import subprocess
import sys
from pathlib import Path

import pytest

import kanuka

ROOT = Path(__file__).resolve().parent.parent
COMMAND = Path(sys.executable).parent / "kanuka"

HEADER = """\
Format 48 32 1
Display "ball.exr" "file" "rgba"
PixelSamples 2 2
Projection "perspective" "fov" [40]
Translate 0 0 5
"""
WORLD = """\
WorldBegin
LightSource "distantlight" 1 "intensity" [2] "from" [1 1 -1] "to" [0 0 0]
Color [0.8 0.3 0.1]
Surface "matte"
Sphere 1 -1 1 360
WorldEnd
"""


@pytest.fixture(scope="session", autouse=True)
def shader_cache(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Tests neither read nor fill the user's shader cache."""
    for name in ("KANUKA_STORE", "OCIO"):
        os.environ.pop(name, None)
    os.environ["KANUKA_TEXTURE_CACHE"] = str(tmp_path_factory.mktemp("texture_cache"))
    os.environ["KANUKA_SHADER_CACHE"] = str(tmp_path_factory.mktemp("shader_cache"))


@pytest.fixture(autouse=True)
def no_sample_is_dropped(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Samples that are not finite count as black, so that a furnace or a comparison may pass for their lack: every
    picture of kanuka.render is without, but of tests with the mark drops_samples."""
    if request.node.get_closest_marker("drops_samples"):
        return
    render = kanuka.render

    @functools.wraps(kanuka.render)
    def checked(*arguments: object, **keywords: object) -> kanuka.Picture:
        picture = render(*arguments, **keywords)
        assert picture.stats["count"]["nan_samples"] == 0, list(picture.journal)
        return picture

    monkeypatch.setattr(kanuka, "render", checked)


@pytest.fixture
def root() -> Path:
    return ROOT


@pytest.fixture
def ball(tmp_path: Path) -> Path:
    """A lit ball, 48 by 32 pixels: the smallest scene that shows something."""
    path = tmp_path / "ball.rib"
    path.write_text(HEADER + WORLD)
    return path


@pytest.fixture
def kanuka_command(tmp_path: Path):
    """Runs the command in an empty folder: kanuka_command("render", scene, …) -> CompletedProcess."""

    def run(*arguments: object, **keywords) -> subprocess.CompletedProcess[str]:
        keywords.setdefault("cwd", tmp_path)
        keywords.setdefault("timeout", 300)
        return subprocess.run([COMMAND, *map(str, arguments)], capture_output=True, text=True, **keywords)

    return run
