"""DynamicLoad of libraries in C: compiled here, against ri.h alone."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

import kanuka
from kanuka.procedurals import library

SCENE = 'Declare "wear" "uniform float"\nFormat 32 32 1\n{}WorldBegin\n{}\nWorldEnd\n'
COMB = 'Procedural "DynamicLoad" ["{}" "{}"] [-1 9 -1 3 -1 1]'


@pytest.fixture
def folder(root: Path, tmp_path: Path) -> Path:
    compiler = os.environ.get("CC") or shutil.which("cc") or shutil.which("gcc")
    assert compiler, "there is no C compiler"
    assert any(path.exists() for path in library.candidates()), "libkanuka is not there: make build"
    source = root / "tests/c/comb.c"
    command = [compiler, "-std=c99", "-shared", "-fPIC", "-I", str(root / "include"), str(source), "-o", "comb.so"]
    subprocess.run(command, cwd=tmp_path, check=True)
    (tmp_path / "empty.c").write_text("int nothing;\n")
    subprocess.run([compiler, "-shared", "-fPIC", "empty.c", "-o", "empty.so"], cwd=tmp_path, check=True)
    return tmp_path


def load(folder: Path, body: str, options: str = "", **more: object) -> kanuka.Scene:
    path = folder / "scene.rib"
    path.write_text(SCENE.format(options, body))
    return kanuka.load(path, **more)


def messages(scene: kanuka.Scene) -> str:
    return "\n".join(str(message) for message in scene.journal.messages)


def test_a_library_makes_its_calls_here(folder: Path) -> None:
    scene = load(folder, COMB.format("comb.so", "3 0.4"))
    assert not messages(scene)
    assert sum(scene.summary()["primitives"].values()) == 4  # its own procedural is asked, too
    assert sum(load(folder, COMB.format("comb", "3 0.4")).summary()["primitives"].values()) == 4


def test_it_is_looked_for_along_the_search_path(folder: Path) -> None:
    (folder / "plugins").mkdir()
    (folder / "comb.so").rename(folder / "plugins/comb.so")
    said = messages(load(folder, COMB.format("comb.so", "1 0.4")))
    assert "no such library in" in said
    assert "scene.rib:4" in said
    option = 'Option "searchpath" "string procedural" ["plugins"]\n'
    assert not messages(load(folder, COMB.format("comb.so", "1 0.4"), option))


def test_what_is_no_plug_in_is_told(folder: Path) -> None:
    assert "it has no function ConvertParameters" in messages(load(folder, COMB.format("empty.so", "")))
    (folder / "text.so").write_text("no library\n")
    assert "text.so" in messages(load(folder, COMB.format("text.so", "")))


def test_it_may_be_forbidden(folder: Path) -> None:
    assert "forbidden" in messages(load(folder, COMB.format("comb.so", "1 1"), run_programs=False))
    option = 'Option "procedural" "int runprograms" 0\n'
    assert "forbidden" in messages(load(folder, COMB.format("comb.so", "1 1"), option))


def test_it_waits_for_rays(folder: Path) -> None:
    scene = load(folder, 'LightSource "distantlight" 1 ' + COMB.format("comb.so", "3 0.4"), on_demand=True)
    picture = kanuka.render(scene, progressions=4)
    assert picture.stats["count"]["procedurals_read"] >= 1
    assert picture["alpha"].max() > 0
