"""Displays: the first one's file has all layers, every other file those of its mode."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka

WORLD = """
Format 12 8 1
Projection "perspective" "fov" 60
Translate 0 0 4
WorldBegin
LightSource "distantlight" 1
Surface "matte" Color 0.8 0.3 0.1
Sphere 1 -1 1 360
WorldEnd
"""


def render(kanuka_command, tmp_path: Path, head: str, *options: str):
    (tmp_path / "scene.rib").write_text(head + WORLD)
    return kanuka_command("render", "scene.rib", "--progressions", "1", "--quiet", *options)


def layers(path: Path) -> set[str]:
    return set(kanuka.read(path).keys())


ALL = {"rgb", "alpha", "albedo", "N", "Z", "P", "id"}


@pytest.mark.parametrize(
    ("mode", "expected"),
    [
        ("id", {"id"}),
        ("rgb", {"rgb"}),
        ("rgba", {"rgb", "alpha"}),
        ("z", {"Z"}),
        ("rgbaz", {"rgb", "alpha", "Z"}),
        ("normal N", {"N"}),
        ("Ci,Oi", {"rgb", "alpha"}),
    ],
)
def test_an_added_display_has_a_file(kanuka_command, tmp_path: Path, mode: str, expected: set) -> None:
    done = render(kanuka_command, tmp_path, f'Display "a.tif" "file" "rgba" Display "+ids" "openexr" "{mode}"')
    assert (done.returncode, done.stdout, done.stderr) == (0, "a.exr\nids.exr\n", "")
    assert layers(tmp_path / "a.exr") == ALL
    assert layers(tmp_path / "ids.exr") == expected
    for layer in expected:
        np.testing.assert_array_equal(kanuka.read(tmp_path / "ids.exr")[layer], kanuka.read(tmp_path / "a.exr")[layer])


def test_displays_of_one_name_share_a_file(kanuka_command, tmp_path: Path) -> None:
    head = 'Display "a" "file" "rgb" Display "+a.exr" "file" "z" Display "+b" "file" "z" Display "+b.tif" "file" "id"'
    done = render(kanuka_command, tmp_path, head)
    assert done.stdout == "a.exr\nb.exr\n"
    assert layers(tmp_path / "b.exr") == {"Z", "id"}


def test_without_a_plus_it_replaces_those_before(kanuka_command, tmp_path: Path) -> None:
    done = render(kanuka_command, tmp_path, 'Display "a" "file" "rgb" Display "+b" "file" "z" Display "c" "file" "rgb"')
    assert done.stdout == "c.exr\n"


def test_framebuffers_have_no_file(kanuka_command, tmp_path: Path) -> None:
    done = render(kanuka_command, tmp_path, 'Display "a" "framebuffer" "rgb" Display "+b" "file" "rgb"')
    assert done.stdout == "b.exr\n"
    assert layers(tmp_path / "b.exr") == ALL


def test_added_files_lie_beside_output(kanuka_command, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    done = render(kanuka_command, tmp_path, 'Display "a" "file" "rgb" Display "+ids" "file" "id"', "-o", "out/x.exr")
    assert done.stdout == "out/x.exr\nout/ids.exr\n"


def test_a_display_without_a_name_is_told(kanuka_command, tmp_path: Path) -> None:
    done = render(kanuka_command, tmp_path, 'Display "a" "file" "rgb" Display "+" "openexr" "id"')
    assert done.returncode == 3
    assert done.stdout == "a.exr\n"
    assert 'as in Display "+ids.exr" "openexr" "id"' in done.stderr


def test_frames_keep_their_added_files_apart(kanuka_command, tmp_path: Path) -> None:
    world = WORLD.replace("WorldBegin", 'Display "f" "file" "rgb" Display "+ids" "file" "id" WorldBegin')
    (tmp_path / "scene.rib").write_text(f"FrameBegin 1 {world} FrameEnd FrameBegin 2 {world} FrameEnd")
    done = kanuka_command("render", "scene.rib", "--frame", "all", "--progressions", "1", "--quiet")
    assert done.stdout.split() == ["f.exr", "ids.exr", "f.0002.exr", "ids.0002.exr"]
