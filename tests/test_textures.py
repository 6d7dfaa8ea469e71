"""Textures made by scenes, by the library and by the command."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import kanuka

SCENE = """
MakeTexture "picture.exr" "made.tex" "periodic" "clamp" "gaussian" 2 2
Format 32 32 1
Projection "orthographic"
WorldBegin
Surface "paintedplastic" "Ka" 1 "Kd" 0 "Ks" 0 "texturename" "made.tex"
LightSource "ambientlight" 1
Translate 0 0 1
Polygon "P" [-1 -1 0 1 -1 0 1 1 0 -1 1 0] "st" [0 1 1 1 1 0 0 0]
WorldEnd
"""


@pytest.fixture
def picture(tmp_path: Path) -> Path:
    """A sky of radiance 0.7."""
    scene = kanuka.Scene()
    scene.camera = kanuka.Camera((0, 0, 2), (0, 0, 0), fov=60)
    scene.add_light("environment", amount=0.7)
    path = tmp_path / "picture.exr"
    kanuka.render(scene, resolution=(64, 64), progressions=1).write(path)
    return path


def test_a_scene_makes_its_textures(picture: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.rib").write_text(SCENE)
    result = kanuka.render(kanuka.load("scene.rib"), progressions=4)
    assert not [m.message for m in result.journal.messages]
    assert (tmp_path / "made.tex").exists()
    assert result["rgb"].mean() / result["alpha"].mean() == pytest.approx(kanuka.read(picture)["rgb"].mean(), rel=0.02)


@pytest.mark.parametrize("name", ["env", "tif", "tx"])
def test_a_texture_may_be_called_as_a_format_is(
    picture: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.rib").write_text(SCENE.replace("made.tex", name))
    result = kanuka.render(kanuka.load("scene.rib"), progressions=1)
    assert not [m.message for m in result.journal.messages]
    assert result["rgb"].mean() / result["alpha"].mean() == pytest.approx(kanuka.read(picture)["rgb"].mean(), rel=0.05)


def test_the_library_and_the_command_make_the_same(picture: Path, tmp_path: Path) -> None:
    kanuka.make_texture([str(picture)], str(tmp_path / "a.tx"), wrap=("black", "clamp"), filter="triangle")
    command = [sys.executable, "-m", "kanuka", "texture", str(picture), str(tmp_path / "b.tx")]
    subprocess.run([*command, "--wrap", "black,clamp", "--filter", "triangle"], check=True)
    a, b = (kanuka.read(tmp_path / name) for name in ("a.tx", "b.tx"))
    assert np.array_equal(a["rgb"], b["rgb"])
    failed = subprocess.run([*command, "--wrap", "round"], capture_output=True, text=True, check=False)
    assert failed.returncode == 4
    assert "there are black, clamp, periodic, mirror" in failed.stderr
    with pytest.raises(kanuka.Error, match="of six"):
        kanuka.make_texture([], str(tmp_path / "c.tx"))
