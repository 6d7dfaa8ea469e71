"""C programs: the same picture as by the RIB that they write, and functions of their own."""

from __future__ import annotations

import gzip
import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import kanuka


def find_program(root: Path, name: str) -> Path:
    path = Path(os.environ.get("KANUKA_BUILD", root / "build")) / "tests/c" / name
    assert path.exists(), f"{path} is not there: ninja -C build {name}"
    return path


@pytest.fixture
def program(root: Path) -> Path:
    return find_program(root, "kanuka_ri_picture")


@pytest.fixture
def own(root: Path) -> Path:
    return find_program(root, "kanuka_ri_own")


def run(*command: object, cwd: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([str(c) for c in command], cwd=cwd, capture_output=True, text=True, check=False)


def test_a_c_program_renders_what_its_rib_renders(program: Path, tmp_path: Path) -> None:
    for name in ("c.exr", "c.rib"):
        result = subprocess.run([program, name], cwd=tmp_path, capture_output=True, text=True, check=False)
        assert (result.returncode, result.stderr) == (0, "")
    by_c = kanuka.read(tmp_path / "c.exr")
    assert (by_c.width, by_c.height) == (160, 120)
    assert by_c["rgb"].mean() > 0.05, "something is lit"
    by_rib = kanuka.render(kanuka.load(tmp_path / "c.rib"))
    by_rib.write(tmp_path / "rib.exr")
    assert np.array_equal(by_c["rgb"], kanuka.read(tmp_path / "rib.exr")["rgb"])


ARCHIVE = """\
##RenderMan RIB-Structure 1.1
# a comment, 50% of it
Declare "a" "float"
AttributeBegin # within
  Frobnicate 1 "two" [3 4]   # of a request that nobody knows
  ArchiveRecord "comment" "recorded"
AttributeEnd
##RenderMan end
"""


def test_a_callback_hears_what_archives_hold_beside_requests(own: Path, tmp_path: Path) -> None:
    (tmp_path / "part.rib").write_text(ARCHIVE)
    result = run(own, "archive", "part.rib", cwd=tmp_path)
    assert result.stdout.splitlines() == [
        "structure|RenderMan RIB-Structure 1.1|",
        "comment| a comment, 50% of it|",
        "comment| within|",
        'verbatim|Frobnicate 1 "two" [3 4]|',
        "comment| inside 100%|",
        "comment| of a request that nobody knows|",
        "comment|recorded|",
        "structure|RenderMan end|",
    ]
    # Without a function the request that nobody knows is reported, once.
    assert result.stderr.count("unknown request Frobnicate") == 1


def test_a_filter_of_the_programs_own_makes_the_picture(own: Path, tmp_path: Path) -> None:
    for name in ("c.exr", "c.rib"):
        result = run(own, "filter", name, cwd=tmp_path)
        assert (result.returncode, result.stderr) == (0, "")
    by_c = kanuka.read(tmp_path / "c.exr")["rgb"]
    # The edge between columns 7 and 8 has moved by a pixel and a half. That between rows 7 and 8 is half a pixel below
    # the centre of row 7, and the half pixel beyond it has half of two thirds of the weight.
    assert by_c[3, 4:9, 0] == pytest.approx([1, 1, 0.5, 0, 0], abs=0.04)
    assert by_c[5:10, 12, 1] == pytest.approx([0, 0, 1 / 3, 5 / 6, 1], abs=0.04)
    by_rib = kanuka.render(kanuka.load(tmp_path / "c.rib"))
    by_rib.write(tmp_path / "rib.exr")
    assert np.array_equal(by_c, kanuka.read(tmp_path / "rib.exr")["rgb"])
    # As other filters, it gives the same bits for any number of lanes.
    pictures = [kanuka.render(kanuka.load(tmp_path / "c.rib"), lanes=lanes)["rgb"] for lanes in (1, 8, 16)]
    assert np.array_equal(pictures[0], pictures[1])
    assert np.array_equal(pictures[0], pictures[2])
    assert "must be more than 0; the Gaussian was used" in run(own, "filter", "none.exr", cwd=tmp_path).stderr


def test_colours_of_samples_are_as_long_as_they_say(own: Path, tmp_path: Path) -> None:
    for name in ("c.exr", "c.rib"):
        result = run(own, "samples", name, cwd=tmp_path)
        assert (result.returncode, result.stderr) == (0, "")
    by_c = kanuka.read(tmp_path / "c.exr")["rgb"]
    ramp = (np.arange(2, 14) + 0.5) / 16  # red on the left, blue on the right
    inside = by_c[2:-2, 2:-2].mean(axis=0)
    np.testing.assert_allclose(inside, np.stack([1 - ramp, 0 * ramp, ramp], axis=1), atol=0.03)
    by_rib = kanuka.render(kanuka.load(tmp_path / "c.rib"))
    by_rib.write(tmp_path / "rib.exr")
    assert np.array_equal(by_c, kanuka.read(tmp_path / "rib.exr")["rgb"])


def test_textures_are_made_without_a_world(own: Path, tmp_path: Path) -> None:
    ramp = np.tile(np.linspace(0, 1, 64, dtype=np.float32)[:, None, None], (1, 64, 3))
    kanuka.Picture({"rgb": ramp}).write(tmp_path / "ramp.exr")
    result = run(own, "texture", "ramp.exr", "ramp.tex", cwd=tmp_path)
    assert (result.returncode, result.stderr) == (0, "")
    made = kanuka.read(tmp_path / "ramp.tex")["rgb"]
    assert np.array_equal(made, kanuka.read(tmp_path / "ramp.exr")["rgb"])
    assert (tmp_path / "made.env").exists()
    kanuka.make_texture(
        [str(tmp_path / "ramp.exr")],
        str(tmp_path / "again.tex"),
        wrap=("periodic", "clamp"),
        filter="gaussian",
        filter_width=(6, 2),
    )
    assert (tmp_path / "again.tex").read_bytes() == (tmp_path / "ramp.tex").read_bytes()


# ---- sessions, by kanuka_ri_session


@pytest.fixture
def session(root: Path) -> Path:
    return find_program(root, "kanuka_ri_session")


BALL = "# one\n# two\nSphere 1 -1 1 360\n"


@pytest.mark.parametrize(
    ("how", "ends", "said", "printed"),
    [
        ("handler", 1, ["43|2|TransformEnd without TransformBegin was left out"], "WorldBegin is not closed"),
        ("callback", 1, [], "WorldBegin is not closed"),
        ("procedural", 1, [], "AttributeBegin is not closed"),
        ("again", 0, ["43|2|TransformEnd without TransformBegin was left out"], "RiObjectInstance was left out"),
    ],
)
def test_programs_may_end_in_their_own_callbacks(
    session: Path, tmp_path: Path, how: str, ends: int, said: list[str], printed: str
) -> None:
    """Under valgrind, where there is one: what has ended is not touched again."""
    (tmp_path / "part.rib").write_text(BALL)
    valgrind = shutil.which("valgrind")
    checker = [valgrind, "-q", "--error-exitcode=9"] if valgrind and how != "again" else []
    result = run(*checker, session, f"end-{how}", cwd=tmp_path)
    assert (result.returncode, result.stdout.splitlines()) == (0, [*said, f"ended {ends}"]), result.stderr
    assert result.stderr.count(printed) == 1


def test_a_program_without_lights_and_shaders_is_lit_from_the_eye(session: Path, tmp_path: Path) -> None:
    (tmp_path / "part.rib").write_text(BALL)
    result = run(session, "plain", cwd=tmp_path)
    assert result.returncode == 0
    assert "lit from the eye" in result.stderr
    run(session, "plain", "plain.rib", cwd=tmp_path)
    by_c = kanuka.read(tmp_path / "plain.exr")["rgb"]
    assert by_c.mean() > 0.05
    kanuka.render(kanuka.load(tmp_path / "plain.rib")).write(tmp_path / "rib.exr")
    assert np.array_equal(by_c, kanuka.read(tmp_path / "rib.exr")["rgb"])


def test_rib_goes_to_a_program(session: Path, tmp_path: Path) -> None:
    run(session, "plain", "plain.rib", cwd=tmp_path)
    assert run(session, "plain", "|cat > piped.rib", cwd=tmp_path).stderr == ""
    assert (tmp_path / "piped.rib").read_text() == (tmp_path / "plain.rib").read_text()
    assert '"false" could not run or failed' in run(session, "plain", "|false", cwd=tmp_path).stderr
    assert "names that end in .rib" in run(session, "plain", "scene", cwd=tmp_path).stderr


def test_each_display_has_its_picture(session: Path, tmp_path: Path) -> None:
    (tmp_path / "part.rib").write_text(BALL)
    run(session, "frames", "anim", cwd=tmp_path)
    first, second = (kanuka.read(tmp_path / f"anim.000{i}.exr")["rgb"] for i in (1, 2))
    assert first[..., 2].max() > 0.5 > second[..., 2].max()


def test_pictures_of_faces_become_textures_called_as_formats_are(session: Path, tmp_path: Path) -> None:
    result = run(session, "faces", cwd=tmp_path)
    assert (result.returncode, result.stderr) == (0, "")
    for i, name in enumerate(("px", "nx", "py", "ny", "pz", "nz")):
        color = [0.0, 0.0, 0.0]
        color[i % 3] = 1 if i < 3 else 0.5
        assert kanuka.read(tmp_path / f"face.{name}.exr")["rgb"][4, 4] == pytest.approx(color, abs=0.02)
    assert (tmp_path / "env").exists()
    assert kanuka.read(tmp_path / "last.exr")["rgb"][4, 4] == pytest.approx([0, 0.5, 0], abs=0.02)


def test_handlers_declarations_and_files_before_the_context(session: Path, tmp_path: Path) -> None:
    result = run(session, "before", "b.rib", cwd=tmp_path)
    assert (result.returncode, result.stderr) == (0, "")
    assert [line.split("|")[0] for line in result.stdout.splitlines()] == ["23", "47", "23"]
    packed = (tmp_path / "b.rib").read_bytes()
    assert packed[:2] == b"\x1f\x8b"
    plain = gzip.decompress(packed)
    assert b"weight" in plain
    assert b'Declare "' not in plain, "it is binary"


def test_records_are_kept_line_by_line(session: Path, tmp_path: Path) -> None:
    run(session, "record", "c.rib", cwd=tmp_path)
    assert (tmp_path / "c.rib").read_text() == (
        "##RenderMan RIB-Structure 1.1\n#one\n#two\n#three\n##Creator a program\n"
        '# four\nDisplay "a.exr" "file" "rgb"\nFormat 64 48 1\nPixelSamples 2 2\n'
        'ArchiveBegin "kept"\nAttribute "user"\n"uniform float x" [1]\nArchiveEnd\n'
    )


def test_names_that_renderers_declare_and_values_that_are_none(session: Path, tmp_path: Path) -> None:
    result = run(session, "names", "d.rib", cwd=tmp_path)
    assert (result.returncode, result.stderr) == (0, "")
    said = [line.split("|", 2) for line in result.stdout.splitlines()]
    assert [code for code, _, _ in said] == ["41", "41", "41", "42", "44"]
    assert "give the address of a char*" in said[0][2]
    assert 'declare it: "uniform float bias"' in said[1][2]
    assert 'RiDeclare("nobodyknows"' in said[2][2]
    written = (tmp_path / "d.rib").read_text().splitlines()
    assert written[1:5] == [
        'Option "shadow" "bias0" [0.25]',
        'Attribute "dice" "binary" [1] "rasterorient" [1]',
        'Attribute "displacementbound" "sphere" [0.25] "space" ["shader"]',
        'Hider "hidden" "jitter" [1]',
    ]
    assert 'Attribute "light" "string shadow" ["on"]' in written
    assert 'Attribute "trace" "bias" [1]' in written


def test_a_file_without_riend_holds_what_was_written(session: Path, tmp_path: Path) -> None:
    result = run(session, "begun", "e.rib", cwd=tmp_path)
    assert "the program ended without RiEnd" in result.stderr
    assert (tmp_path / "e.rib").read_text() == "##RenderMan RIB-Structure 1.1\nWorldBegin\n"
