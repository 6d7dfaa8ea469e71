"""Files of several frames: which there are, and how they are rendered one after another."""

from __future__ import annotations

from pathlib import Path

import pytest

import kanuka

WORLD = 'WorldBegin\nSurface "constant"\n{what}\nSphere 1 -1 1 360\nWorldEnd\n'


def film(numbers: list[int], display: str = "walk.{n}.tif") -> str:
    text = 'Format 8 8 1\nProjection "perspective"\nTranslate 0 0 1.2\n'
    for n in numbers:
        text += f'FrameBegin {n}\nDisplay "{display.format(n=n)}" "file" "rgba"\n'
        text += WORLD.format(what=f"Color [{n / 10} 0 0]") + "FrameEnd\n"
    return text


@pytest.fixture
def walk(tmp_path: Path) -> Path:
    path = tmp_path / "walk.rib"
    path.write_text(film([3, 4, 7]))
    return path


def test_frames_are_listed_with_what_they_are_for(tmp_path: Path) -> None:
    path = tmp_path / "passes.rib"
    path.write_text(
        'FrameBegin 1\nDisplay "a.z" "zfile" "z"\n' + WORLD.format(what="") + "FrameEnd\n"
        'FrameBegin 2\nDisplay "env" "file" "rgb"\n' + WORLD.format(what="") + "FrameEnd\n"
        'MakeTexture "env" "env.tx" "periodic" "periodic" "gaussian" 2 2\n'
        "FrameBegin 5\n" + WORLD.format(what="") + WORLD.format(what="") + "FrameEnd\n" + WORLD.format(what="")
    )
    frames = [(f["number"], f["picture"]) for f in kanuka.frames(path)]
    assert frames == [(1, False), (2, False), (5, True), (1, True)]
    assert kanuka.frames(path)[0]["line"] == 3


def test_all_frames_are_rendered_under_their_displays_names(kanuka_command, walk: Path) -> None:
    result = kanuka_command("render", walk, "--frame", "all", "--progressions", 4)
    assert result.returncode == 0, result.stderr
    assert result.stdout.split() == ["walk.3.exr", "walk.4.exr", "walk.7.exr"]
    assert "frame 4 (2 of 3)" in result.stderr
    red = [kanuka.read(walk.parent / name)["rgb"][4, 4, 0] for name in result.stdout.split()]
    assert red == pytest.approx([0.3, 0.4, 0.7], rel=0.1)


@pytest.mark.parametrize(
    ("frame", "output", "names"),
    [
        ("3-5,7", "a.exr", ["a.0003.exr", "a.0004.exr", "a.0007.exr"]),
        ("all", "a_###.exr", ["a_003.exr", "a_004.exr", "a_007.exr"]),
        ("7,4", "%02d.exr", ["04.exr", "07.exr"]),
        ("4", "a.exr", ["a.exr"]),
    ],
)
def test_names_of_several_frames_have_their_numbers(
    kanuka_command, walk: Path, frame: str, output: str, names: list[str]
) -> None:
    stats = walk.with_name("stats.json")
    result = kanuka_command("render", walk, "--frame", frame, "-o", output, "--stats", stats, "--progressions", 1)
    assert result.stdout.split() == names, result.stderr
    assert stats.exists() == (frame == "4")
    assert stats.with_name("stats.0004.json").exists() == (frame != "4")


def test_frames_of_one_display_do_not_overwrite_each_other(kanuka_command, tmp_path: Path) -> None:
    path = tmp_path / "one.rib"
    path.write_text(film([1, 2], display="one.tif"))
    result = kanuka_command("render", path, "--frame", "all", "--progressions", 1)
    assert result.stdout.split() == ["one.exr", "one.0002.exr"]


def test_frames_of_one_number_are_all_rendered(kanuka_command, tmp_path: Path) -> None:
    path = tmp_path / "same.rib"
    path.write_text(film([1, 3, 4]).replace("FrameBegin 3", "FrameBegin 1").replace("FrameBegin 4", "FrameBegin 1"))
    assert [(f["number"], f["repeat"]) for f in kanuka.frames(path)] == [(1, 0), (1, 1), (1, 2)]
    result = kanuka_command("render", path, "--frame", "all", "-o", "a.##.exr", "--progressions", 16)
    assert result.stdout.split() == ["a.01.exr", "a.01-2.exr", "a.01-3.exr"], result.stderr
    red = [kanuka.read(tmp_path / name)["rgb"][4, 4, 0] for name in result.stdout.split()]
    assert red == pytest.approx([0.1, 0.3, 0.4], rel=0.05)


def test_faces_of_an_environment_are_rendered_for_what_is_mirrored_in_it(kanuka_command, tmp_path: Path) -> None:
    """Six frames of one number make a cube, of which a seventh reads: each face has a colour of its own."""
    colors = {"px": "1 0 0", "nx": "0 1 0", "py": "0 0 1", "ny": "1 1 0", "pz": "0 1 1", "nz": "1 0 1"}
    text = 'Format 8 8 1\nPixelFilter "box" 1 1\n'
    for side, color in colors.items():
        text += f'FrameBegin 1\nDisplay "{side}.tif" "file" "rgb"\nProjection "perspective" "fov" 90\n'
        text += f'WorldBegin\nSurface "constant"\nColor [{color}]\nSphere 5 -5 5 360\nWorldEnd\nFrameEnd\n'
    names = " ".join(f'"{side}.tif"' for side in colors)
    text += f'MakeCubeFaceEnvironment {names} "room.env" 90 "box" 1 1\n'
    text += 'FrameBegin 1\nDisplay "seen.tif" "file" "rgb"\nProjection "orthographic"\nWorldBegin\n'
    text += 'Surface "seen"\nPolygon "P" [-1 -1 2  -1 1 2  1 1 2  1 -1 2]\nWorldEnd\nFrameEnd\n'
    (tmp_path / "seen.sl").write_text(
        'surface seen() { Oi = 1; Ci = environment("room.env", vector "world" (xcomp(P) > 0 ? 1 : -1, 0, 0)); }'
    )
    path = tmp_path / "cube.rib"
    path.write_text(text)
    result = kanuka_command(
        "render", path, "--frame", "all", "-o", "out.exr", "--resolution", "16x16", "--progressions", 64
    )
    assert result.returncode == 0, result.stderr
    assert result.stdout.split()[:-1] == [f"{side}.exr" for side in colors]
    assert result.stdout.split()[-1] == "out.0001-7.exr"
    seen = kanuka.read(tmp_path / "out.0001-7.exr")["rgb"]
    assert kanuka.read(tmp_path / "px.exr")["rgb"].shape[:2] == (8, 8)  # as fine as the scene says
    assert seen[8, 12] == pytest.approx([1, 0, 0], abs=0.05)
    assert seen[8, 3] == pytest.approx([0, 1, 0], abs=0.05)


def test_passes_that_make_no_picture_are_not_among_all(kanuka_command, tmp_path: Path) -> None:
    path = tmp_path / "passes.rib"
    path.write_text('FrameBegin 1\nDisplay "a.z" "zfile" "z"\n' + WORLD.format(what="") + "FrameEnd\n" + film([2, 3]))
    result = kanuka_command("render", path, "--frame", "all", "--progressions", 1)
    assert result.stdout.split() == ["walk.2.exr", "walk.3.exr"]


def test_an_error_in_one_frame_fails_the_command_and_spares_the_others(kanuka_command, tmp_path: Path) -> None:
    path = tmp_path / "bad.rib"
    path.write_text(film([1, 2, 3]).replace("Color [0.1 0 0]", "Color [0.1 0"))
    result = kanuka_command("render", path, "--frame", "all", "--progressions", 1)
    assert result.returncode == 3
    assert len(result.stdout.split()) == 3


@pytest.mark.parametrize(
    ("frame", "says"),
    [("9-10", "there is no such frame; the frames are: 3, 4, 7"), ("5", "there is no frame 5"), ("x", "A-B")],
)
def test_frames_that_are_not_there_are_said(kanuka_command, walk: Path, frame: str, says: str) -> None:
    result = kanuka_command("render", walk, "--frame", frame, "--progressions", 1)
    assert result.returncode != 0
    assert says in result.stderr


def test_standard_input_is_no_place_for_several(kanuka_command) -> None:
    result = kanuka_command("render", "-", "--frame", "all")
    assert result.returncode != 0
    assert "name the file" in result.stderr
