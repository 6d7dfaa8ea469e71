"""Instances that are shaded where they stand."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import kanuka
from test_instance_variation import SHADERS, banded, moved, row, shaders, stage  # noqa: F401
from test_sessions import same

FLOODED = """surface flooded(float level = 0; uniform float variant = 0;) {
    point Q = transform("world", P);
    Oi = 1;
    Ci = (ycomp(Q) > level ? color(0.8 - 0.2 * variant, 0.5, 0.3) : color(0.1, 0.1, 0.3)) * diffuse(normalize(N));
}
"""


def flooded(unique: bool, apart: bool, **more: object) -> kanuka.Scene:
    """Balls at three heights, some in pairs on a stand."""
    scene = stage()
    places = row(3).copy()
    places[:, 1, 3] = -0.4, 0, 0.5
    inner = np.stack([moved(-0.3, 0.1, 0, 0.5), moved(0.4, -0.2, 0, 0.4)]).astype(np.float32)
    material = kanuka.Material("flooded")
    if apart:
        for i, place in enumerate(places):
            whole = np.vstack([place, [0, 0, 0, 1]])
            scene.add_sphere(0.6, material=material, transform=whole)
            ball = scene.add_group(f"small {i}")
            ball.add_sphere(0.9, material="matte")
            scene.add_instances(ball, np.stack([(whole @ np.vstack([m, [0, 0, 0, 1]]))[:3] for m in inner]))
        return scene
    ball, group = scene.add_group("small"), scene.add_group("thing")
    ball.add_sphere(0.9, material="matte")
    group.add_sphere(0.6, material=material)
    group.add_instances(ball, inner)
    scene.add_instances(group, places, unique=unique, **more)
    return scene


@pytest.fixture
def water(tmp_path: Path) -> None:
    (Path(SHADERS[0]) / "flooded.sl").write_text(FLOODED)


def test_unique_instances_are_shaded_where_they_stand(water: None) -> None:
    unique = kanuka.render(flooded(True, False), progressions=4)
    assert same(unique, kanuka.render(flooded(True, False), progressions=4, threads=1))
    expected = kanuka.render(flooded(False, True), progressions=4)
    difference = np.abs(np.asarray(unique["rgb"], np.float64) - np.asarray(expected["rgb"], np.float64))
    assert difference.mean() < 1e-3  # small ones are diced for all of their places, or for those of a group
    shared = kanuka.render(flooded(False, False), progressions=4, unique_up_to=0)
    assert np.abs(np.asarray(unique["rgb"]) - np.asarray(shared["rgb"])).max() > 0.1
    told = " ".join(map(str, shared.journal))
    assert "its shader asks where in the world it is" in told
    assert "its shader asks" not in " ".join(map(str, unique.journal))


def test_unique_instances_may_differ_besides(water: None) -> None:
    plain = kanuka.render(flooded(True, False), progressions=4)
    grey = kanuka.render(flooded(True, False, tint=[(1, 1, 1), (0.2, 0.2, 0.2), (1, 1, 1)]), progressions=4)
    a, b = np.asarray(plain["rgb"], np.float64), np.asarray(grey["rgb"], np.float64)
    assert np.abs(a - b)[:, 36:60].mean() > 10 * np.abs(a - b)[:, :28].mean()
    shifted = kanuka.render(flooded(True, False, variant=[0, 0, 2.5]), progressions=4)
    c = np.asarray(shifted["rgb"], np.float64)
    assert np.abs(a - c)[:, 64:].max() > 0.1
    assert np.abs(a - c)[:, :30].max() < 0.1


def test_what_lies_in_a_unique_instance_takes_what_it_says(water: None) -> None:
    def small(**more: object) -> np.ndarray:
        """The ball in the middle of three, a group in the group."""
        scene = stage()
        ball, group = scene.add_group("small"), scene.add_group("thing")
        ball.add_sphere(0.9, material=banded(), variants=3)
        group.add_instances(ball, np.stack([moved(0)]).astype(np.float32))
        scene.add_instances(group, row(3), **more)
        return np.asarray(kanuka.render(scene, progressions=4)["rgb"], np.float64)[12:20, 44:52].mean((0, 1))

    for said in ({"tint": (0.2, 0.9, 0.2)}, {"variant": [0, 2, 0]}):
        assert small(unique=True, **said) == pytest.approx(small(**said), rel=0.02)
        assert small(unique=True, **said) != pytest.approx(small(unique=True), rel=0.1)


def test_unique_instances_say_variant_0_unless_they_say_another(water: None) -> None:
    def middle(**more: object) -> np.ndarray:
        scene = stage()
        group = scene.add_group("thing")
        group.add_sphere(0.9, material=banded(variant=2), variants=3)  # its own value is not asked for
        scene.add_instances(group, row(1), **more)
        return np.asarray(kanuka.render(scene, progressions=4)["rgb"], np.float64)[12:20, 44:52].mean((0, 1))

    assert middle(unique=True) == pytest.approx(middle(), rel=0.02)
    assert middle(unique=True).argmax() == 0


def test_unique_instances_far_away_keep_their_digits(water: None) -> None:
    def picture(unique: bool) -> np.ndarray:
        scene = kanuka.Scene()
        scene.resolution = 48, 48
        far = 1e6
        scene.camera = kanuka.Camera((far, 0, 1), (far, 0, 0), fov=20)
        ball, group = scene.add_group("ball"), scene.add_group("thing")
        ball.add_sphere(0.02)
        group.add_instances(ball, np.stack([moved(x) for x in (-0.1, 0.1)]).astype(np.float32))
        scene.add_instances(group, np.stack([moved(far)]).astype(np.float32), unique=unique)
        scene.add_light("environment", amount=1)
        return np.asarray(kanuka.render(scene, progressions=16)["alpha"], np.float64)

    assert np.abs(picture(True) - picture(False)).mean() < 0.01


def test_the_world_is_told_of_where_it_matters(water: None, tmp_path: Path) -> None:
    def told(scene: kanuka.Scene, **more: object) -> bool:
        journal = kanuka.render(scene, progressions=1, unique_up_to=0, **more).journal
        return "its shader asks where in the world" in " ".join(map(str, journal))

    assert told(flooded(False, False))
    assert told(flooded(False, False), store=tmp_path)
    assert told(flooded(False, False), store=tmp_path)  # by its pages
    alone = stage()
    group = alone.add_group("thing")
    group.add_sphere(0.6, material="flooded")
    alone.add_instances(group, row(1))
    assert not told(alone)


def test_an_oracle_knows_nothing_of_unique_instances(water: None, tmp_path: Path) -> None:
    file = tmp_path / "a.oracle"
    kanuka.write_oracle(flooded(True, False), file)
    plain = kanuka.render(flooded(False, False), progressions=1)
    asked = kanuka.render(flooded(False, False), progressions=1, oracle=file)
    assert asked.stats["count"]["micropolygons"] > 0.5 * plain.stats["count"]["micropolygons"]


# ---- by themselves ---------------------------------------------------------------------------------------------------


def told(scene: kanuka.Scene, **more: object) -> str:
    return " ".join(map(str, kanuka.render(scene, progressions=1, **more).journal))


def test_instances_that_ask_for_the_world_become_unique(water: None, tmp_path: Path) -> None:
    expected = kanuka.render(flooded(True, False), progressions=4)
    shared = kanuka.render(flooded(False, False), progressions=4)
    assert same(shared, expected)
    assert same(kanuka.render(flooded(False, False), progressions=4, threads=1), expected)
    for _ in range(2):  # by pages of a store that say what was asked
        assert same(kanuka.render(flooded(False, False), progressions=4, store=tmp_path), expected)
    what = told(flooded(False, False))
    assert "its instances are shaded where they stand" in what
    assert "look alike" not in what
    asked_for = " ".join(map(str, expected.journal))
    assert "its shader asks" not in asked_for


def test_more_vertices_than_they_may_have_keep_them_alike(water: None) -> None:
    scene = flooded(False, False)
    made = re.search(r"\((\d+) with what they lie in; (\d+) vertices, 1 MB at most\)", told(scene))
    assert made is not None
    assert int(made[1]) == 3
    vertices = int(made[2])
    assert vertices >= kanuka.render(flooded(True, False), progressions=1).stats["count"]["vertices"] / 2
    assert "look alike" not in told(scene, unique_up_to=vertices)
    kept = told(scene, unique_up_to=vertices - 1)
    assert 'look alike. Attribute "instance" "int unique" [1]' in kept
    assert f"They would be {vertices} vertices" in kept
    alike = [kanuka.render(scene, progressions=2, unique_up_to=most) for most in (0, vertices - 1)]
    assert same(*alike)
    assert not same(alike[0], kanuka.render(scene, progressions=2))


def nested(asks: bool, unique: bool, moving: bool = False) -> kanuka.Scene:
    """Rocks on stands, in threes."""
    scene = stage()
    rock, stand = scene.add_group("rock"), scene.add_group("stand")
    rock.add_sphere(0.5, material="flooded" if asks else "matte")
    stand.add_sphere(0.3, material="matte")
    stand.add_instances(rock, np.stack([moved(0, 0.4), moved(0, -0.5)]).astype(np.float32), unique=unique)
    places = row(3).copy()
    places[:, 1, 3] = -0.4, 0, 0.5
    if moving:
        scene.options.shutter = 0, 1
        scene.add_instances(stand, np.stack([places, places + np.float32(1e-4)]))
    else:
        scene.add_instances(stand, places, unique=unique)
    return scene


def test_so_do_those_that_they_lie_in(water: None) -> None:
    expected = kanuka.render(nested(True, True), progressions=2)
    picture = kanuka.render(nested(True, False), progressions=2)
    assert same(picture, expected)
    assert "(9 with what they lie in" in " ".join(map(str, picture.journal))
    assert "its shader asks" not in told(nested(False, False))
    alike = told(nested(True, False, moving=True))  # what moves does not
    assert "shaded where they stand" not in alike


def test_those_that_take_least_come_first(water: None) -> None:
    def scene_of(most: int) -> str:
        scene = stage()
        large, small = scene.add_group("large"), scene.add_group("small")
        large.add_sphere(0.7, material="flooded", name="large")
        small.add_sphere(0.2, material="flooded", name="small")
        scene.add_instances(large, row(3))
        up = row(2).copy()
        up[:, 1, 3] = 0.5
        scene.add_instances(small, up)
        return told(scene, unique_up_to=most)

    sizes = sorted(int(n) for n in re.findall(r"; (\d+) vertices", scene_of(10**6)))
    assert len(sizes) == 2
    assert sizes[0] < sizes[1] / 2
    for most, made, alike in ((sum(sizes), 2, 0), (sum(sizes) - 1, 1, 1), (sizes[0] - 1, 0, 2)):
        what = scene_of(most)
        assert (what.count("shaded where they stand"), what.count("look alike")) == (made, alike), most


def test_lamps_that_ask_shine_once() -> None:
    """What their group was made as beside them is no lamp."""
    (Path(SHADERS[0]) / "lamp.sl").write_text(
        "class lamp() { public void mnk_init(output MnkObjectProperties o; output MnkMaterial m) {"
        ' AddLobe(CreateBoundary(m), "glow", DiffuseEmission()); }'
        " public void mnk_prelighting(output MnkMaterialBoundary b) {"
        ' point Q = transform("world", P); color c = xcomp(Q) > 0 ? color(3, 1, 0.2) : color(0.2, 1, 3);'
        ' SetLobe(b, "glow", 1, DiffuseEmission("radiance", c)); } }'
    )

    def picture(unique: bool) -> kanuka.Picture:
        scene = stage()
        group = scene.add_group("lamp")
        group.add_sphere(0.3, material="lamp")
        scene.add_instances(group, row(2), unique=unique)
        return kanuka.render(scene, progressions=4)

    assert same(picture(True), picture(False))


def test_a_session_keeps_what_stands_where_it_stood(water: None) -> None:
    scene = flooded(False, False)
    session = kanuka.Session(scene, progressions=2)
    session.advance()
    first = session.picture()
    session.update(unique_up_to=0)
    session.advance()
    assert same(session.picture(), kanuka.render(scene, progressions=2, unique_up_to=0))
    assert session.picture().stats["count"]["shader_evaluations"] == 0  # the one was made as well
    session.update(unique_up_to=10**6)
    session.advance()
    assert same(session.picture(), first)


def test_a_unique_instance_that_moves_is_refused() -> None:
    scene = stage()
    group = scene.add_group("thing")
    group.add_sphere(0.8)
    with pytest.raises(ValueError, match="unique: what moves as an instance stays one"):
        scene.add_instances(group, np.stack([row(1), row(1) + 0.1]), unique=True)
