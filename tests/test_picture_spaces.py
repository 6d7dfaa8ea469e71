"""Raster and NDC space of shaders: those of the picture that is made, whatever the scene asks for."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import kanuka

SHADER = """
surface places(output varying point raster = 0; output varying point unit = 0; output varying point back = 0)
{
    raster = transform("raster", P);
    unit = transform("NDC", P);
    back = transform("raster", "world", raster);
    Oi = 1;
    Ci = Cs;
}
"""
SCENE = """
Format 40 20 1
PixelFilter "box" 1 1
Projection "perspective" "fov" 60
Clipping 1 20
%s
WorldBegin
Surface "places"
Polygon "P" [-9 -9 5  9 -9 5  9 9 5  -9 9 5]
WorldEnd
"""
LAYERS = ["raster", "unit", "back"]


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    (tmp_path / "places.sl").write_text(SHADER)
    path = tmp_path / "scene.rib"
    path.write_text(SCENE % "")
    return path


def check(picture: kanuka.Picture, width: int, height: int) -> None:
    assert picture["alpha"].shape[:2] == (height, width)
    assert (picture["alpha"] > 0.999).all()
    # A plane that faces the camera: the mean over a pixel is what stands in its middle. (Beside sides of grids that
    # are traced more coarsely than what lies between them, values slide by half a pixel.)
    x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    pixel = np.stack([x, y], -1)
    for found, expected, size in (
        (picture["raster"][..., :2], pixel, 1),
        (picture["unit"][..., :2] * (width, height), pixel, 1),
        (picture["back"], picture["P"], 2 * 5 * np.tan(np.pi / 6) / min(width, height)),
    ):
        off = np.abs(found - expected) / size
        assert np.median(off) < 0.05
        assert off.max() < 0.75


@pytest.mark.parametrize("resolution", [(40, 20), (24, 24), (17, 51)])
def test_the_resolution_of_the_render(scene: Path, resolution: tuple[int, int]) -> None:
    loaded = kanuka.load(scene)
    picture = kanuka.render(loaded, progressions=16, aovs=LAYERS, resolution=resolution)
    assert not picture.journal.messages, [m.message for m in picture.journal.messages]
    check(picture, *resolution)
    check(kanuka.render(loaded, progressions=16, aovs=LAYERS), 40, 20)  # the scene is as it was


def test_the_command_s_resolution(scene: Path, tmp_path: Path) -> None:
    scene.write_text(SCENE % 'Display "out.exr" "openexr" "rgba,P,raster,unit,back"')
    command = [sys.executable, "-m", "kanuka", "render", scene, "--resolution", "30x18", "--progressions", "16"]
    subprocess.run(command, check=True, cwd=tmp_path)
    check(kanuka.read(tmp_path / "out.exr"), 30, 18)
