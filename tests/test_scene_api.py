"""Scenes from Python: arrays without copies, typed parameters, cameras, errors that say what would do."""

from __future__ import annotations

import sys

import numpy as np
import pytest

import kanuka
import scenes

POINTS = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32)
QUAD = np.array([[0, 1, 2, 3]], np.int32)


def facing_camera() -> kanuka.Scene:
    """A constant quad of two by two in front of a camera that sees four by four."""
    scene = kanuka.Scene()
    scene.resolution = 16, 16
    scene.options.filter = "box"
    scene.options.filter_width = 1, 1
    scene.camera = kanuka.Camera((0, 0, 2), (0, 0, 0), fov=90)
    return scene


def test_arrays_are_the_scene_s_own() -> None:
    points, faces = POINTS.copy(), QUAD.copy()
    before = sys.getrefcount(points), sys.getrefcount(faces)
    scene = kanuka.Scene()
    scene.add_mesh(points, faces)
    scene.add_subdivision(points, faces)
    assert (sys.getrefcount(points), sys.getrefcount(faces)) == before


def test_other_types_and_layouts_are_converted() -> None:
    scene = kanuka.Scene()
    scene.add_mesh(POINTS.tolist(), QUAD.tolist())
    scene.add_mesh(POINTS.astype(np.float64)[::1], QUAD.astype(np.int64))
    scene.add_mesh(np.asfortranarray(POINTS), [0, 1, 2, 0, 2, 3], counts=[3, 3])
    assert scene.summary()["primitives"] == {"polygon mesh": 3}
    assert scene.summary()["points"] == 12


@pytest.mark.parametrize(
    ("arguments", "keywords", "words"),
    [
        ((POINTS[:, :2], QUAD), {}, "points: expected shape (N, 3), got (4, 2)"),
        ((POINTS, [[0, 1, 4]]), {}, "index 4 at position 2, but there are 4 points"),
        ((POINTS, [[0, -1, 2]]), {}, "index -1"),
        ((POINTS, [0, 1, 2]), {}, "faces: expected shape (M, 3) or (M, 4)"),
        ((POINTS, [0, 1, 2, 3], [3]), {}, "add up to 3, but faces has 4"),
        ((POINTS, [0, 1], [2]), {}, "three corners"),
        ((POINTS, QUAD), {"primvars": {"Cs": np.zeros((3, 3))}}, "3 values fit nothing here; one of 4 (vertex)"),
        ((POINTS, QUAD), {"primvars": {"colour Cs": np.zeros((4, 3))}}, '"colour" is neither'),
        ((POINTS, QUAD), {"transform": np.eye(3)}, "transform: expected a 4x4 or 3x4"),
        ((POINTS, QUAD), {"area_light": (1, 2)}, "area_light: expected three numbers"),
        ((POINTS, QUAD), {"uv": np.zeros((4, 3))}, "does not hold values of type float"),
        ((POINTS, QUAD), {"primvars": {"matrix m": np.zeros((4, 5))}}, "does not hold values of type matrix"),
    ],
)
def test_errors_say_what_was_found(arguments: tuple, keywords: dict, words: str) -> None:
    with pytest.raises(ValueError) as error:
        kanuka.Scene().add_mesh(*arguments, **keywords)
    assert words in str(error.value)


def test_words_for_arrays_are_type_errors() -> None:
    with pytest.raises(TypeError, match="points: not an array"):
        kanuka.Scene().add_mesh("points", QUAD)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: kanuka.Camera((0, 0, 0), (0, 0, 0)), "the same point"),
        (lambda: kanuka.Camera((0, 0, 0), (0, 1, 0)), "up points along the line of sight"),
        (lambda: kanuka.Camera((0, 0, 1), (0, 0, 0), fov=180), "between 0 and 180"),
        (lambda: kanuka.Camera((0, 0, 1), (0, 0, 0), fov_axis="z"), "not one of"),
        (lambda: kanuka.Scene().add_light("moon"), '"moon" is not one of "distant"'),
        (lambda: kanuka.Scene().add_sphere(-1), "positive"),
        (lambda: kanuka.Material("matte", Kd=[]), "an empty value"),
        (lambda: kanuka.Scene().add_subdivision(POINTS, QUAD, scheme="butterfly"), "catmull-clark"),
        (lambda: kanuka.Scene().add_instances(kanuka.Scene().add_group(), np.eye(4)[None]), "another scene"),
    ],
)
def test_wrong_values(call, words: str) -> None:
    with pytest.raises(ValueError) as error:
        call()
    assert words in str(error.value)


def test_groups_hold_only_earlier_groups() -> None:
    scene = kanuka.Scene()
    first, second = scene.add_group("first"), scene.add_group("second")
    second.add_instances(first, np.eye(4)[None])
    with pytest.raises(ValueError, match="made before"):
        first.add_instances(second, np.eye(4)[None])


def test_camera_space_is_right_up_forward() -> None:
    camera = kanuka.Camera((1, 2, 5), (1, 2, 0))
    point = camera.camera_from_world @ np.array([2, 4, 0, 1])
    np.testing.assert_allclose(point, [1, 2, 5, 1], atol=1e-6)
    left = kanuka.Camera((1, 2, -5), (1, 2, 0), left_handed=True)
    np.testing.assert_allclose(left.camera_from_world @ np.array([2, 4, 0, 1]), [1, 2, 5, 1], atol=1e-6)
    placed = np.eye(4)
    placed[:3, 3] = 1, 2, 5
    same = kanuka.Camera.from_matrix(placed)
    np.testing.assert_allclose(same.camera_from_world, camera.camera_from_world, atol=1e-6)


def test_missing_file_raises_an_error_with_its_place() -> None:
    with pytest.raises(kanuka.Error) as error:
        kanuka.load("nowhere.rib")
    assert error.value.exit_code == 4
    assert "nowhere.rib" in str(error.value)


def test_picture_is_not_mirrored_and_layers_say_what_is_seen() -> None:
    scene = facing_camera()
    red = scene.add_mesh(POINTS[:, :] * 0.5 + (1, 1, 0), QUAD, area_light=(1, 0, 0))
    picture = kanuka.render(scene, progressions=64)
    ids = picture["id"]
    rows, columns = np.nonzero(ids == red)
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (2, 5, 10, 13), "upper right"
    np.testing.assert_allclose(picture["rgb"][2:6, 10:14].mean(axis=(0, 1)), [1, 0, 0], atol=0.02)
    np.testing.assert_allclose(picture["Z"][3, 11], 2, rtol=1e-3)
    np.testing.assert_allclose(np.abs(picture["N"][3, 11]), [0, 0, 1], atol=1e-2)
    np.testing.assert_allclose(picture["alpha"][3, 11], 1)
    assert picture["alpha"][12, 3] == 0
    assert picture["P"].shape == (16, 16, 3)


@pytest.mark.parametrize(
    ("axis", "resolution", "width", "height"),
    [
        ("smaller", (32, 16), 8, 8),
        ("y", (32, 16), 8, 8),
        ("x", (32, 16), 16, 16),
        ("smaller", (16, 32), 8, 8),
        ("x", (16, 32), 8, 8),
        ("y", (16, 32), 16, 16),
    ],
)
def test_field_of_view(axis: str, resolution: tuple[int, int], width: int, height: int) -> None:
    """90 degrees from two units away span four units; the quad is two wide."""
    scene = facing_camera()
    scene.camera = kanuka.Camera((0, 0, 2), (0, 0, 0), fov=90, fov_axis=axis)
    scene.add_mesh(POINTS, QUAD, area_light=(1, 1, 1))
    picture = kanuka.render(scene, progressions=1, resolution=resolution)
    rows, columns = np.nonzero(picture["alpha"] > 0.5)
    assert (np.ptp(columns) + 1, np.ptp(rows) + 1) == (width, height)


def test_primvars_reach_the_shader() -> None:
    colors = np.array([[1, 0, 0], [1, 0, 0], [0, 0, 1], [0, 0, 1]], np.float32)
    scene = facing_camera()
    scene.add_mesh(POINTS, QUAD, primvars={"Cs": colors}, material=kanuka.Material("matte"))
    picture = kanuka.render(scene, progressions=4)
    bottom, top = picture["albedo"][11, 8], picture["albedo"][4, 8]
    assert bottom[0] > 0.6 > 0.4 > bottom[2]
    assert top[2] > 0.6 > 0.4 > top[0]


def test_instances_have_ids_of_their_own() -> None:
    scene = facing_camera()
    group = scene.add_group()
    group.add_mesh(POINTS * np.float32(0.4), QUAD)
    places = np.tile(np.eye(4, dtype=np.float32), (2, 1, 1))
    places[:, 0, 3] = -1, 1
    scene.add_instances(group, places)
    picture = kanuka.render(scene, progressions=1)
    assert picture["alpha"][8, 4] == 1
    assert picture["alpha"][8, 12] == 1
    assert picture["alpha"][8, 8] == 0
    assert picture.stats["count"]["instances"] == 2


def test_progress_runs_through_the_phases() -> None:
    reports: list[tuple[str, float]] = []
    kanuka.render(scenes.ball(), progressions=2, progress=lambda *report: reports.append(report))
    phases = list(dict.fromkeys(phase for phase, _ in reports))
    assert phases[-1] == "progressions"
    assert {"dice", "shade", "build"} & set(phases)
    assert all(0 <= fraction <= 1 for _, fraction in reports)


def test_what_the_progress_function_raises_comes_out() -> None:
    def stop(phase: str, fraction: float) -> None:
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        kanuka.render(scenes.ball(), progressions=1_000_000, progress=stop)


def test_interrupting_returns_what_is_there() -> None:
    def interrupt(phase: str, fraction: float) -> None:
        if phase == "progressions" and fraction > 0:
            raise KeyboardInterrupt

    picture = kanuka.render(scenes.ball(), progressions=10_000_000, progress=interrupt)
    assert picture.cancelled
    assert picture["rgb"].max() > 0.05


def test_missing_shader_is_in_the_journal() -> None:
    scene = facing_camera()
    scene.add_mesh(POINTS, QUAD, material=kanuka.Material("no_such_shader"))
    picture = kanuka.render(scene, progressions=1)
    assert picture.journal.error_count >= 1
    assert any("no_such_shader" in message.message and message.severity == "error" for message in picture.journal)
    assert len(scene.journal) == 0, "a render's messages are the render's"


def test_pictures_go_through_files(tmp_path) -> None:
    picture = kanuka.render(scenes.ball(), progressions=2)
    picture.write(tmp_path / "a.exr")
    again = kanuka.read(tmp_path / "a.exr")
    assert set(again.keys()) == set(picture.keys())
    np.testing.assert_allclose(again["rgb"], picture["rgb"], rtol=1e-3)
    np.testing.assert_array_equal(again["P"], picture["P"])
    assert again.metadata["kanuka.version"] == kanuka.__version__
    assert again.stats is None
    with pytest.raises(kanuka.Error, match=r"a\.jpg"):
        picture.write(tmp_path / "a.jpg")
    with pytest.raises(kanuka.Error) as error:
        picture.write(tmp_path / "no" / "a.exr")
    assert error.value.exit_code == 5


def test_pictures_from_arrays_compare() -> None:
    rng = np.random.default_rng(0)
    pixels = rng.random((32, 48, 3), np.float32)
    a, b = kanuka.Picture({"rgb": pixels}), kanuka.Picture({"rgb": pixels * np.float32(1.1)})
    np.testing.assert_array_equal(a["rgb"], pixels)
    assert kanuka.compare(a, a).relative_mse == 0
    result = kanuka.compare(b, a)
    assert result.mean_ratio == pytest.approx(1.1, rel=1e-3)
    expected = np.mean((0.1 * pixels.astype(float)) ** 2 / (pixels.astype(float) ** 2 + 0.01))
    assert result.relative_mse == pytest.approx(expected, rel=1e-3)
    assert 0 < result.flip < 1
    with pytest.raises(kanuka.Error):
        kanuka.compare(a, kanuka.Picture({"rgb": pixels[:10]}))
    with pytest.raises(KeyError, match="there are rgb"):
        a["albedo"]


def test_every_option_is_set_and_read_back() -> None:
    """By its last choice, by half, or by itself: what is set is what is read, and what a render takes."""
    for name, about in kanuka.option_parameters().items():
        scene = kanuka.Scene()
        value = about["choices"][-1] if about["choices"] else about["default"]
        setattr(scene.options, name, value)
        assert getattr(scene.options, name) == value, name
        with pytest.raises((TypeError, ValueError), match=name):
            setattr(scene.options, name, object())


def test_bounds_are_of_all_that_is_there() -> None:
    scene = kanuka.Scene()
    assert scene.bounds() is None
    scene.add_sphere(2, transform=np.diag([1, 1, 3, 1]))
    assert scene.bounds() == ((-2, -2, -6), (2, 2, 6))
    group = scene.add_group("ball")
    group.add_sphere(1)
    places = np.tile(np.eye(3, 4, dtype=np.float32), (2, 1, 1))
    places[:, 0, 3] = 10, 20
    scene.add_instances(group, places)
    assert scene.bounds() == ((-2, -2, -6), (21, 2, 6))
