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


FAULT = "column 4: there is 'X', expected one of D G S . or [, >, 'name'\nC<RX>L\n   ^"


def test_displays_that_cannot_be_read_are_reported(scene, tmp_path: Path, kanuka_command) -> None:
    head = 'Display "a.exr" "openexr" "rgba"\n\n  Display "+b.exr" "openexr" "color lpe:C<RX>L"\n'
    head += 'Display "+c.exr" "openexr" "lpe:C.*"\n Display "+d.exr" "openexr" "lpe:C<RX>L"\n'
    picture = kanuka.render(scene(head), progressions=1)
    told = [(Path(e.file).name, e.line, e.column) for e in picture.journal.messages if FAULT in e.message]
    assert told == [("scene.rib", 4, 3), ("scene.rib", 6, 2)]
    assert "lpe:C.*" in picture and "lpe:C<RX>L" not in picture
    done = kanuka_command("render", tmp_path / "scene.rib", "--progressions", "1")
    assert "scene.rib:4:3: the light path expression cannot be read: " + FAULT in done.stderr, done.stderr


def test_callers_are_told_at_once(scene, tmp_path: Path, kanuka_command) -> None:
    for refused in (
        lambda: kanuka.render(scene(), aovs=["lpe:C.*", "lpe:C<RX>L"]),
        lambda: kanuka.Session(scene(), aovs=["lpe:C<RX>L"]),
        lambda: kanuka.check_layer("lpe:C<RX>L"),
    ):
        with pytest.raises(ValueError, match="cannot be read: column 4: there is 'X', expected one of D G S") as caught:
            refused()
        assert FAULT in str(caught.value)
    for layer in ("lpe:C<RD>[<L.>O]", "tint", "rgb"):
        kanuka.check_layer(layer)
    scene()
    done = kanuka_command("render", tmp_path / "scene.rib", "--aov", "lpe:C<RX>L", "-o", tmp_path / "x.exr")
    assert done.returncode == 2 and FAULT in done.stderr and "--aov: " in done.stderr, done.stderr
    assert not (tmp_path / "x.exr").exists()


ROOM = """
Format 24 24 1
Projection "perspective" "fov" 70
Option "kanuka" "string transport" ["full"]
WorldBegin
AttributeBegin
  Surface "plastic" "roughness" [0.2]
  Patch "bilinear" "P" [-3 -1 0  3 -1 0  -3 -1 6  3 -1 6]
AttributeEnd
%s
WorldEnd
"""
PANEL = 'Translate %g 1 3 Rotate -90 1 0 0 Patch "bilinear" "P" [-0.5 0.5 0  0.5 0.5 0  -0.5 -0.5 0  0.5 -0.5 0]'
LIGHTS = {
    "AreaLightSource": 'AreaLightSource "arealight" "lamp" "intensity" [5] "string group" ["warm key"]',
    "PxrMeshLight": 'Light "PxrMeshLight" "lamp" "float intensity" [5] "string lightGroup" ["key"]',
}


@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize("instanced", [False, True])
def test_area_lights_are_lights(light: str, instanced: bool, tmp_path: Path) -> None:
    """A panel that is an area light is L, by its handle and group too; one whose surface shines is O."""
    both = f"AttributeBegin {LIGHTS[light]} {PANEL % -1} AttributeEnd\n"
    both += f'AttributeBegin Surface "emitter" {PANEL % 1} AttributeEnd\n'
    if instanced:
        both = f'ObjectBegin "panels"\n{both}ObjectEnd\nObjectInstance "panels"\n'
    path = tmp_path / "room.rib"
    path.write_text(ROOM % both)
    names = ["lpe:C.*L", "lpe:C.*O", "lpe:C.*<L.'lamp'>", "lpe:C.*<L.'key'>", "lpe:C.*<L.'other'>"]
    picture = kanuka.render(kanuka.load(path), progressions=32, aovs=names)
    assert not picture.journal.messages, [e.message for e in picture.journal.messages]
    lights, shines, by_handle, by_group, none = (picture[name] for name in names)
    total = lights.astype(np.float64) + shines
    assert np.abs(total - picture["rgb"]).max() < 1e-5 * picture["rgb"].max()
    assert lights.mean() > 0.01 and shines.mean() > 0.01
    assert np.array_equal(by_handle, lights) and np.array_equal(by_group, lights)
    assert not none.any()


def test_area_lights_of_parts_that_are_read_late(tmp_path: Path) -> None:
    (tmp_path / "panels.rib").write_text(f"AttributeBegin {LIGHTS['AreaLightSource']} {PANEL % -1} AttributeEnd\n")
    late = 'Procedural "DelayedReadArchive" ["panels.rib"] [-3 3 0.5 1.5 2 4]\n'
    path = tmp_path / "room.rib"
    path.write_text(ROOM % f'{late}AttributeBegin Surface "emitter" {PANEL % 1} AttributeEnd')
    names = ["lpe:C.*L", "lpe:C.*O", "lpe:C.*<L.'lamp'>"]
    for on_demand in (False, True):
        picture = kanuka.render(kanuka.load(path, on_demand=on_demand), progressions=8, aovs=names)
        lights, shines, by_handle = (picture[name].astype(np.float64) for name in names)
        assert np.abs(lights + shines - picture["rgb"]).max() < 1e-5 * picture["rgb"].max()
        assert lights.mean() > 0.01 and shines.mean() > 0.01 and np.array_equal(lights, by_handle)


def test_area_lights_of_python_go_by_their_names() -> None:
    points = np.array([[-1, 1, 3], [1, 1, 3], [1, 1, 5], [-1, 1, 5]], np.float32)
    scene = kanuka.Scene()
    scene.resolution = 16, 16
    scene.camera = kanuka.Camera(origin=(0, 0, 0), target=(0, 0, 1), fov=70)
    for x, name in ((-1.5, "left"), (1.5, "right")):
        moved = points + np.array([x, 0, 0], np.float32)
        scene.add_mesh(moved, np.array([[0, 1, 2, 3]], np.int32), area_light=(3, 2, 1), name=name)
    scene.add_mesh(points * (4, -1, 1), np.array([[3, 2, 1, 0]], np.int32), material="matte")
    names = ["lpe:C.*<L.'left'>", "lpe:C.*<L.'right'>", "lpe:C.*O"]
    picture = kanuka.render(scene, progressions=16, aovs=names)
    left, right, shines = (picture[name].astype(np.float64) for name in names)
    assert np.abs(left + right - picture["rgb"]).max() < 1e-5 * picture["rgb"].max()
    assert left.mean() > 0.01 and right.mean() > 0.01 and not shines.any()
    assert (left[:, :6].sum() > right[:, :6].sum()) != (left[:, 10:].sum() > right[:, 10:].sum())


@pytest.mark.parametrize("lanes", [1, 16])
def test_same_bits(scene, lanes: int) -> None:
    reference = kanuka.render(scene(), progressions=4, lanes=8, aovs=PARTS, threads=1)
    picture = kanuka.render(scene(), progressions=4, lanes=lanes, aovs=PARTS, threads=2)
    plain = kanuka.render(scene(), progressions=4, lanes=8)
    for name in PARTS:
        assert np.array_equal(picture[name], reference[name]), name
    assert np.array_equal(plain["rgb"], picture["rgb"])
