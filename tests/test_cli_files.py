"""What the command says of files that are missing, folders, of an unknown kind, not to be written: before the work."""

from __future__ import annotations

import os
from pathlib import Path

import pytest


@pytest.fixture
def folder(tmp_path: Path, ball: Path, kanuka_command) -> Path:
    (tmp_path / "shots").mkdir()
    (tmp_path / "plain.sl").write_text("surface plain() { Ci = Cs; }")
    (tmp_path / "junk.exr").write_text("hello")
    (tmp_path / "wood.png").write_text("no picture")
    return tmp_path


@pytest.mark.parametrize(
    ("command", "code", "words"),
    [
        ("render bal.rib", 4, "bal.rib: there is no such file; did you mean ball.rib?"),
        ("render ball", 4, "ball: there is no such file; did you mean ball.rib?"),
        ("render zzz.rib", 4, "zzz.rib: there is no such file; name a RIB file, a USD stage or a model that is there"),
        ("render shots", 4, "shots: is a folder; name a RIB file, a USD stage or a model in it"),
        ("render nowhere/a.rib", 4, "nowhere/a.rib: there is no folder nowhere"),
        ("render ball.rib -o a.tif", 2, "a.tif: pictures are written as .exr or .png"),
        ("render ball.rib -o a", 2, "a: pictures are written as .exr or .png"),
        ("render ball.rib -o shots", 5, "shots: is a folder; name a file in it"),
        ("render ball.rib -o nowhere/a.exr", 5, "nowhere/a.exr: there is no folder nowhere; make it first"),
        ("render ball.rib --stats nowhere/a.json", 5, "there is no folder nowhere; make it first"),
        ("info bal.rib", 4, "did you mean ball.rib?"),
        ("info shots", 4, "is a folder"),
        ("convert bal.rib b.rib", 4, "did you mean ball.rib?"),
        ("convert ball.rib nowhere/b.rib", 5, "there is no folder nowhere; make it first"),
        ("compare jun.exr junk.exr", 4, "did you mean junk.exr?"),
        ("compare shots junk.exr", 4, "shots: is a folder; name a picture in it"),
        ("compare junk.exr junk.exr", 4, "not a readable OpenEXR picture"),
        ("compare junk.exr junk.exr -o a.tif", 2, "a.tif: pictures are written as .exr or .png"),
        ("texture woods.png a.tx", 4, "did you mean wood.png?"),
        ("texture wood.png nowhere/a.tx", 5, "there is no folder nowhere; make it first"),
        ("shader compile plane.sl", 4, "did you mean plain.sl?"),
        ("shader compile plastik", 4, "did you mean plastic?"),
        ("shader compile shots", 4, "is a folder"),
        ("shader info plane.sl", 4, "did you mean plain.sl?"),
        ("shader publish plane.sl", 4, "did you mean plain.sl?"),
        ("shader run plain.sl -o nowhere/a.exr", 5, "there is no folder nowhere; make it first"),
        ("shader run plain.sl -o a.tif", 2, "a.tif: pictures are written as .exr or .png"),
    ],
)
def test_files_that_will_not_do(kanuka_command, folder: Path, command: str, code: int, words: str) -> None:
    result = kanuka_command(*command.split())
    assert result.returncode == code, result.stderr
    assert words in result.stderr
    assert len(result.stderr.splitlines()) == 1, "a sentence, and nothing rendered before it"
    assert result.stdout == ""


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_folders_that_may_not_be_written(kanuka_command, folder: Path) -> None:
    (folder / "shots").chmod(0o500)
    result = kanuka_command("render", "ball.rib", "-o", "shots/a.exr")
    assert result.returncode == 5
    assert "may not be written to" in result.stderr


def test_a_misspelt_shader_is_told_at_its_line(kanuka_command, tmp_path: Path) -> None:
    (tmp_path / "a.rib").write_text('Format 8 8 1\nWorldBegin\n  Surface "plastik"\n  Sphere 1 -1 1 360\nWorldEnd\n')
    result = kanuka_command("render", "a.rib", "--progressions", "1", "-q")
    assert result.returncode == 3
    assert 'error: a.rib:3:3: shader "plastik" is not found' in result.stderr
    assert 'did you mean "plastic"?' in result.stderr


def test_levels_of_what_is_said(kanuka_command, ball: Path) -> None:
    ball.write_text(ball.read_text().replace("Color", 'Attribute "render" "nonsense" [1] Illuminate 9 1\nColor'))
    said = {}
    for flag in ("-v", "-q", "-qq"):
        result = kanuka_command("render", ball, "--progressions", "1", flag)
        said[flag] = result.stderr
    assert "pixels in" in said["-v"] and "memory  " in said["-v"] and "time    " in said["-v"]
    assert "pixels in" not in said["-q"]
    assert len(said["-qq"]) <= len(said["-q"]) < len(said["-v"])
    assert "warning:" not in said["-qq"]
