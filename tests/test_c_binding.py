"""C programs: the same picture as by the RIB that they write, and functions of their own."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

import kanuka


def find_program(root: Path, name: str) -> Path:
    path = Path(os.environ.get("KANUKA_BUILD", root / "build")) / "tests/c" / name
    if not path.exists():
        pytest.skip(f"{path} was not built")
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
