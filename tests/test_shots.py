"""Frames that are rendered together: the same pictures, and what is alike in them is made once."""

from __future__ import annotations

import gc
import json
from pathlib import Path

import numpy as np
import pytest

import kanuka

SET = """
Surface "plastic"
AttributeBegin
Attribute "identifier" "name" "floor" Patch "bilinear" "P" [-9 -1 -9 9 -1 -9 -9 -1 9 9 -1 9]
AttributeEnd
AttributeBegin Translate -0.8 0 0 Color [1 0.3 0.2] Sphere 0.6 -0.6 0.6 360 AttributeEnd
ObjectBegin 1 Color [0.2 0.5 1] Torus 0.3 0.1 0 360 360 ObjectEnd
"""


def shot(path: Path, numbers: range) -> Path:
    """The camera goes aside, a ball rises, a ring turns; floor and red ball stay."""
    text = "Format 48 32 1\nPixelSamples 2 2\n"
    for n in numbers:
        text += f"""FrameBegin {n}
            Display "shot.{n}.exr" "file" "rgba" Projection "perspective" "fov" 50
            Translate {0.02 * n} 0 4
            WorldBegin LightSource "distantlight" 1 "from" [1 2 -1] "to" [0 0 0] "intensity" 2 {SET}
            AttributeBegin Translate 0.8 {0.1 * n} 0 Sphere 0.5 -0.5 0.5 {360 - n} AttributeEnd
            AttributeBegin Translate 0 1 0 Rotate {10 * n} 1 0 0 ObjectInstance 1 AttributeEnd
            WorldEnd FrameEnd
            """
    path.write_text(text)
    return path


def test_frames_of_a_shot_are_pictures_of_the_same_and_less_is_made(kanuka_command, tmp_path: Path) -> None:
    """Diced for all cameras a picture differs from one that is made alone by less than its noise."""
    file = shot(tmp_path / "shot.rib", range(1, 5))
    alone, together = tmp_path / "alone", tmp_path / "together"
    for folder, flags in ((alone, ()), (together, ("--together", "--stats", tmp_path / "s.json"))):
        folder.mkdir()
        result = kanuka_command("render", file, "--frame", "1-4", "--progressions", 16, "-o", folder / "a.exr", *flags)
        assert result.returncode == 0, result.stderr
    for n in range(1, 5):
        a, b = (kanuka.read(folder / f"a.{n:04d}.exr")["rgb"] for folder in (alone, together))
        assert np.abs(a - b).mean() < 0.002 * a.mean(), n  # the same samples of the same things
    counts = [json.loads((tmp_path / f"s.{n:04d}.json").read_text())["count"] for n in range(1, 5)]
    assert [count["primitives"] for count in counts] == [4] * 4
    # The ball that grows is another shape in each frame, and the ring comes nearer: at most those two.
    assert counts[0]["primitives_kept"] == 0
    assert all(count["primitives_kept"] >= 2 for count in counts[1:])


def test_a_frame_has_the_same_bits_alone_and_after_others() -> None:
    """Where a farm renders each frame by itself, as one of the same shot."""
    scenes = [made(1, aside=0.1 * k) for k in range(3)]
    cameras = [scene.camera for scene in scenes]
    session, after_others = None, []
    for scene in scenes:
        if session is None:
            session = kanuka.Session(scene, shot=cameras, progressions=2)
        else:
            session.update(scene)
            session.prepare()
            assert session.kept["primitives_kept"] == session.kept["primitives"] == 2
            assert session.kept["hierarchies_kept"] == 1
        session.advance()
        after_others.append(np.asarray(session.picture()["rgb"]))
    for k, picture in enumerate(after_others):
        assert np.array_equal(kanuka.render(made(1, aside=0.1 * k), shot=cameras, progressions=2)["rgb"], picture)


@pytest.mark.parametrize("away", [0, 1e5])
def test_depth_and_positions_are_those_of_the_camera_and_the_world(away: float) -> None:
    """In all frames, though render space has one origin. A wall at z = 0 that the camera walks along and away from;
    all of it may be far from the world's origin."""
    scene = kanuka.Scene()
    scene.resolution = 33, 33
    wall = np.array([[-50, -50, 0], [50, -50, 0], [50, 50, 0], [-50, 50, 0]], np.float32)
    place = np.eye(4)
    place[0, 3] = away
    scene.add_mesh(wall, np.array([[0, 1, 2, 3]], np.int32), transform=place)
    cameras = [kanuka.Camera((away + k, 0, 4 + k), (away + k, 0, 0), fov=40) for k in range(6)]
    for k, camera in enumerate(cameras):
        scene.camera = camera
        picture = kanuka.render(scene, shot=cameras, progressions=4, integrator="facing")
        assert np.asarray(picture["Z"]) == pytest.approx(4 + k, abs=1e-4)
        x, y, z = np.asarray(picture["P"])[16, 16]
        assert (x, y, z) == pytest.approx((away + k, 0, 0), abs=0.02 + 1e-7 * away)


def test_what_stands_still_is_diced_for_the_nearest_camera() -> None:
    """A square that one frame sees from 4 and another from 8 has the finer vertices in both."""

    def vertices(distance: float, shot: list[float]) -> float:
        def at(d: float) -> kanuka.Scene:
            scene = kanuka.Scene()
            scene.resolution = 256, 256
            square = [[[-1, -1, 0], [1, -1, 0]], [[-1, 1, 0], [1, 1, 0]]]
            scene.add_patches(square, basis="bilinear", material="matte", primvars={"color Cs": np.eye(4)[:, :3]})
            scene.camera = kanuka.Camera((0, 0, d), (0, 0, 0), fov=50)
            return scene

        cameras = [at(d).camera for d in shot]
        return kanuka.render(at(distance), progressions=1, shot=cameras, integrator="facing").stats["count"]["vertices"]

    near, far = vertices(4, []), vertices(8, [])
    assert near > 3 * far
    assert vertices(8, [8, 4]) == vertices(4, [8, 4]) == pytest.approx(near, rel=0.1)
    assert vertices(8, [8, 8]) == far


@pytest.mark.parametrize(
    ("flags", "words"),
    [(("--together",), "of which frames"), (("--together", "--frame", "1-2", "--checkpoint", "c"), "one by one")],
)
def test_what_is_no_shot_is_told(kanuka_command, tmp_path: Path, flags: tuple, words: str) -> None:
    result = kanuka_command("render", shot(tmp_path / "shot.rib", range(1, 3)), *flags)
    assert result.returncode == 2
    assert words in result.stderr


def made(height: float, instances: int = 3, aside: float = 0) -> kanuka.Scene:
    scene = kanuka.Scene()
    scene.resolution = 32, 32
    scene.camera = kanuka.Camera((aside, 1, 6), (aside, 0, 0), fov=40)
    scene.add_light("distant", amount=3, direction=(0.2, -1, -0.3))
    group = scene.add_group("g")
    group.add_torus(0.5, 0.2, material="plastic")
    places = np.tile(np.eye(4), (instances, 1, 1))
    places[:, 0, 3] = np.arange(instances) - 1
    scene.add_instances(group, places)
    scene.add_sphere(0.4, transform=np.diag([1, height, 1, 1]), material="matte")
    return scene


def test_a_session_takes_another_scene() -> None:
    wanted = [np.asarray(kanuka.render(made(h, n), progressions=4)["rgb"]) for h, n in ((1, 3), (2, 3))]
    session = kanuka.Session(made(1, 3), progressions=4)
    session.advance()
    assert np.array_equal(session.picture()["rgb"], wanted[0])
    session.update(made(2, 3))  # the scene before is gone
    gc.collect()
    session.advance()
    assert np.array_equal(session.picture()["rgb"], wanted[1])
    assert session.kept["primitives_kept"] == 1
    session.update()  # and the new one is that of the session
    session.advance()
    assert session.kept["hierarchies_kept"] == 1


def test_what_a_kept_hierarchy_was_made_of_may_go() -> None:
    """Where nothing moves, the camera neither, the next scene has the hierarchy of the one before, which is gone."""
    wanted = np.asarray(kanuka.render(made(1, 400), progressions=2)["rgb"])
    session = kanuka.Session(made(1, 400), progressions=2)
    session.prepare()
    for _ in range(3):
        session.update(made(1, 400))
        gc.collect()
        rubbish = [np.full((400, 3, 4), np.nan, np.float32) for _ in range(50)]  # where the places were
        session.advance()
        assert session.kept["hierarchies_kept"] == 1
        assert np.array_equal(session.picture()["rgb"], wanted)
        del rubbish


def test_a_scene_that_is_refused_changes_nothing() -> None:
    session = kanuka.Session(made(1), progressions=2)
    session.advance()
    before = np.asarray(session.picture()["rgb"])
    with pytest.raises(TypeError, match="scene"):
        session.update("shot.rib")
    with pytest.raises((TypeError, ValueError), match="progressions"):
        session.update(made(2), progressions="many")
    assert np.array_equal(session.picture()["rgb"], before)
    session.update()
    session.advance()
    assert np.array_equal(session.picture()["rgb"], before)


def test_each_scene_has_its_own_journal() -> None:
    first, second = kanuka.Journal(), kanuka.Journal()
    session = kanuka.Session(made(1), progressions=1, journal=first)
    session.advance()
    other = made(1)
    other.add_sphere(material="nobody_has_written_it")
    session.update(other, journal=second)
    session.advance()
    session.picture()
    assert not first.messages
    assert any("nobody_has_written_it" in m.message for m in second.messages)


def test_frames_of_a_stage_go_together(kanuka_command, tmp_path: Path) -> None:
    (tmp_path / "shot.usda").write_text(
        """#usda 1.0
(
    upAxis = "Y"
    startTimeCode = 1
    endTimeCode = 3
)
def Sphere "ball"
{
    color3f[] primvars:displayColor = [(0.8, 0.3, 0.1)]
}
def DistantLight "sun"
{
    float inputs:intensity = 3
    bool inputs:normalize = 1
}
def Camera "cam"
{
    float focalLength = 30
    double3 xformOp:translate.timeSamples = { 1: (0, 0, 6), 3: (0.4, 0, 6) }
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
"""
    )
    arguments = ("--resolution", "48x32", "--progressions", 8, "--frame", "1-3", "--stats", "s.json")
    result = kanuka_command("render", tmp_path / "shot.usda", *arguments, "-o", "a.exr", "--together", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    counts = [json.loads((tmp_path / f"s.{n:04d}.json").read_text())["count"] for n in (1, 2, 3)]
    assert [count["primitives_kept"] for count in counts] == [0, 1, 1]
    pictures = [kanuka.read(tmp_path / f"a.{n:04d}.exr")["rgb"] for n in (1, 2, 3)]
    assert not np.array_equal(pictures[0], pictures[2])
