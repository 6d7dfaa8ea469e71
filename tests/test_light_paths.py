"""Light path expressions as layers: from RIB and Python through to the EXR, and complements that sum to the picture."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka

SCENE = """
%s
Format 24 24 1
Projection "perspective" "fov" 60
Option "kanuka" "string transport" ["full"]
WorldBegin
LightSource "pointlight" 1 "intensity" [3] "from" [-1 1 1] "string group" ["key"]
LightSource "distantlight" 2 "intensity" [0.4] "from" [0 0 0] "to" [0.3 -1 0.4]
AttributeBegin
  Surface "matte"
  Color [0.7 0.4 0.3]
  Patch "bilinear" "P" [-3 -1 0  3 -1 0  -3 -1 6  3 -1 6]
  Patch "bilinear" "P" [-3 -1 5  3 -1 5  -3 3 5  3 3 5]
AttributeEnd
WorldEnd
"""
PARTS = ["lpe:C<RD>[<L.>O]", "lpe:C<RD>.+[<L.>O]", "lpe:C[LO]", "lpe:C[^<RD>LO].*"]


@pytest.fixture
def scene(tmp_path: Path):
    def load(head: str = "") -> kanuka.Scene:
        path = tmp_path / "scene.rib"
        path.write_text(SCENE % head)
        return kanuka.load(path)

    return load


def check_sum(picture: kanuka.Picture, names: list[str]) -> None:
    total = sum(picture[name].astype(np.float64) for name in names)
    assert np.abs(total - picture["rgb"]).max() < 2e-3 * picture["rgb"].max()  # layers and picture are halfs
    assert picture[names[0]].max() > 0.1 and picture[names[1]].max() > 0.01


def test_displays_ask(scene, tmp_path: Path, kanuka_command) -> None:
    head = 'Display "a.exr" "openexr" "rgba"\n' + "".join(
        f'Display "+b{k}.exr" "openexr" "{name}"\n' for k, name in enumerate(PARTS)
    )
    picture = kanuka.render(scene(head), progressions=16)
    assert not picture.journal.messages, [e.message for e in picture.journal.messages]
    check_sum(picture, PARTS)
    picture.write(tmp_path / "out.exr")
    check_sum(kanuka.read(tmp_path / "out.exr"), PARTS)
    done = kanuka_command("render", tmp_path / "scene.rib", "--progressions", "1")
    assert done.returncode == 0, done.stderr
    assert PARTS[1] in kanuka.read(tmp_path / "b1.exr")


def test_groups(scene) -> None:
    names = ["lpe:C.*<L.'key'>", "lpe:C.*[^<L.'key'>]"]
    check_sum(kanuka.render(scene(), progressions=16, aovs=names), names)


def test_exposure_is_the_pictures(scene) -> None:
    picture = kanuka.render(scene(), progressions=4, aovs=["lpe:C.*"], exposure_stops=1.5)
    assert np.allclose(picture["lpe:C.*"], picture["rgb"], atol=1e-5 * picture["rgb"].max())


def test_what_cannot_be_read_is_reported(scene) -> None:
    picture = kanuka.render(scene(), progressions=1, aovs=["lpe:C<RX>L", "lpe:C.*"])
    assert any("light path expression" in e.message and "expected" in e.message for e in picture.journal.messages)
    assert "lpe:C.*" in picture and "lpe:C<RX>L" not in picture


@pytest.mark.parametrize("lanes", [1, 16])
def test_same_bits(scene, lanes: int) -> None:
    reference = kanuka.render(scene(), progressions=4, lanes=8, aovs=PARTS, threads=1)
    picture = kanuka.render(scene(), progressions=4, lanes=lanes, aovs=PARTS, threads=2)
    plain = kanuka.render(scene(), progressions=4, lanes=8)
    for name in PARTS:
        assert np.array_equal(picture[name], reference[name]), name
    assert np.array_equal(plain["rgb"], picture["rgb"])
