"""kanuka texture-cache, and the folder that renders fill."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import kanuka

SCENE = """
Display "a.exr" "file" "rgba" Format 16 16 1 Projection "perspective" Translate 0 0 3
WorldBegin
LightSource "distantlight" 1
Surface "paintedplastic" "texturename" "wood.png"
Sphere 1 -1 1 360
WorldEnd
"""


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("KANUKA_TEXTURE_CACHE", str(tmp_path / "cache"))
    rgb = np.linspace(0, 1, 1024 * 512 * 3, dtype=np.float32).reshape(512, 1024, 3)
    kanuka.Picture({"rgb": rgb}).write(tmp_path / "wood.png")
    (tmp_path / "scene.rib").write_text(SCENE)
    return tmp_path / "cache"


def test_renders_fill_the_folder_once(cache: Path) -> None:
    made = [
        kanuka.render(kanuka.load(cache.parent / "scene.rib"), progressions=1).stats["count"]["textures_made"]
        for _ in range(2)
    ]
    assert made == [1, 0]
    (file,) = kanuka.texture_cache_files()
    assert Path(file["file"]).parent == cache and file["bytes"] > 1000


def test_the_folder_is_the_renders_where_none_is_named(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Not the working directory, whose files may be somebody's."""
    kanuka.render(kanuka.load(cache.parent / "scene.rib"), progressions=1)
    (cache.parent / "mine").mkdir()
    (cache.parent / "mine" / "a.tiled.exr").write_text("not to be deleted")
    monkeypatch.chdir(cache.parent / "mine")
    assert kanuka.texture_cache_prune(bytes=0) == 1
    assert kanuka.texture_cache_files() == []
    assert (cache.parent / "mine" / "a.tiled.exr").exists()


def test_the_command_lists_trims_and_clears(cache: Path, kanuka_command) -> None:
    kanuka.render(kanuka.load(cache.parent / "scene.rib"), progressions=1)
    told = json.loads(kanuka_command("texture-cache", "list", "--json").stdout)
    assert told["folder"] == str(cache) and len(told["files"]) == 1 and told["limit"] == 20 << 30
    assert "wood." in kanuka_command("texture-cache", "list").stdout
    assert kanuka_command("texture-cache", "trim", "--size", "1G").stdout == "0 files removed\n"
    assert json.loads(kanuka_command("texture-cache", "clear", "--json").stdout)["removed"] == 1
    assert not list(cache.glob("*.exr"))
