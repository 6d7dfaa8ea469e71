"""Motion blur and cameras from a scene to the picture: coverage against closed forms, all ways to say the same."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka

POINTS = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32)
QUAD = np.array([[0, 1, 2, 3]], np.int32)
SIZE = 16


def translate(x: float, y: float = 0, z: float = 0) -> np.ndarray:
    m = np.eye(4)
    m[:3, 3] = x, y, z
    return m


def turn(degrees: float) -> np.ndarray:
    m = np.eye(4)
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    m[:2, :2] = [[c, -s], [s, c]]
    return m


def scene(**camera: object) -> kanuka.Scene:
    """Sees x and y from -2 to 2."""
    s = kanuka.Scene()
    s.resolution = SIZE, SIZE
    s.options.filter = "box"
    s.options.filter_width = 1, 1
    s.options.shutter = 0, 1
    s.camera = kanuka.Camera((0, 0, 2), (0, 0, 0), fov=90, **camera)
    return s


def alpha(s: kanuka.Scene, renders: int = 32, progressions: int = 16) -> tuple[np.ndarray, np.ndarray]:
    """Coverage of every pixel, and its standard error over independent renders."""
    pictures = np.stack([kanuka.render(s, progressions=progressions, seed=i)["alpha"] for i in range(renders)])
    pictures = pictures.reshape(renders, SIZE, SIZE)
    return pictures.mean(0), np.maximum(pictures.std(0, ddof=1) / np.sqrt(renders), 2e-3)


def ramp(distance: float) -> np.ndarray:
    """How long pixels of a row are covered by a quad from -1 to 1 that moves by a distance in x."""
    t = (np.arange(4000) + 0.5) / 4000
    x = (np.arange(SIZE * 64) + 0.5) / (SIZE * 64) * 4 - 2
    inside = np.abs(x[:, None] - distance * t) < 1
    return inside.mean(1).reshape(SIZE, 64).mean(1)


def moving_transform() -> kanuka.Scene:
    s = scene()
    s.add_mesh(POINTS, QUAD, transform=np.stack([translate(0), translate(0.9)]))
    return s


def moving_points() -> kanuka.Scene:
    s = scene()
    s.add_mesh(np.stack([POINTS, POINTS + np.float32([0.45, 0, 0]), POINTS + np.float32([0.9, 0, 0])]), QUAD)
    return s


def moving_instances() -> kanuka.Scene:
    s = scene()
    group = s.add_group()
    group.add_mesh(POINTS, QUAD)
    s.add_instances(group, np.stack([[translate(0)], [translate(0.9)]]), times=[0, 1])
    return s


def moving_member() -> kanuka.Scene:
    """Half of the way by the member of a group, half by the instance; times beyond the shutter's."""
    s = scene()
    group = s.add_group()
    group.add_mesh(POINTS, QUAD, transform=np.stack([translate(-0.45), translate(0.9)]), times=[-1, 2])
    s.add_instances(group, np.stack([[translate(0)], [translate(0.45)]]))
    return s


def moving_camera() -> kanuka.Scene:
    s = scene()
    s.add_mesh(POINTS, QUAD)
    there = kanuka.Camera((-0.9, 0, 2), (-0.9, 0, 0), fov=90)
    s.camera = kanuka.Camera.moving([s.camera, there])
    return s


def rib(tmp_path: Path) -> kanuka.Scene:
    file = tmp_path / "moving.rib"
    file.write_text(
        f'Format {SIZE} {SIZE} 1 PixelFilter "box" 1 1 Shutter 2 4 Projection "perspective" "fov" 90\n'
        "Translate 0 0 2 WorldBegin MotionBegin [2 4] Translate 0 0 0 Translate 0.9 0 0 MotionEnd\n"
        'Polygon "P" [-1 -1 0 1 -1 0 1 1 0 -1 1 0] WorldEnd\n'
    )
    return kanuka.load(file)


@pytest.mark.parametrize("make", [moving_transform, moving_points, moving_instances, moving_member, moving_camera, rib])
def test_a_moving_quad_leaves_a_linear_ramp(make: object, tmp_path: Path) -> None:
    mean, error = alpha(make(tmp_path) if make is rib else make())
    expected = ramp(0.9)
    assert np.count_nonzero((expected > 0.05) & (expected < 0.95)) >= 6
    rows = slice(5, 11)  # all of the quad's height
    z = (mean - expected)[rows] / error[rows]
    assert np.abs(z).max() < 5  # 96 pixels: one in 20 000 pictures
    assert np.abs(z.mean()) < 0.5


def test_a_shutter_that_does_not_stay_open_is_sharp() -> None:
    s = moving_transform()
    s.options.shutter = 0.5, 0.5
    picture = kanuka.render(s, progressions=16)["alpha"]
    still = scene()
    still.add_mesh(POINTS, QUAD, transform=translate(0.45))
    assert np.array_equal(picture, kanuka.render(still, progressions=16)["alpha"])
    assert np.array_equal(picture, kanuka.render(moving_transform(), progressions=16, shutter=(0.5, 0.5))["alpha"])


def test_threads_change_nothing() -> None:
    for make in (moving_transform, moving_points, moving_camera):
        one, two = (kanuka.render(make(), progressions=4, threads=n) for n in (1, 2))
        for layer in one:
            assert np.array_equal(one[layer], two[layer], equal_nan=True), layer


def test_turning_light_and_shade() -> None:
    """A half of a disk that turns once in three keys is half there everywhere."""
    s = scene()
    half = np.array([[0, -3, 0], [3, -3, 0], [3, 3, 0], [0, 3, 0]], np.float32)
    s.add_mesh(half, QUAD, transform=np.stack([turn(a) for a in (0, 120, 240, 360)]))
    mean, error = alpha(s)
    centre = slice(4, 12)
    z = (mean - 0.5)[centre, centre] / error[centre, centre]
    assert np.abs(z).max() < 5


def test_a_fisheye_sees_a_disk_and_a_spherical_camera_everything() -> None:
    s = scene(projection="fisheye")
    s.add_light("environment", amount=1)
    fish = kanuka.render(s, progressions=16)["alpha"].reshape(SIZE, SIZE)
    assert fish.mean() == pytest.approx(np.pi / 4, abs=0.01)
    assert fish[0, 0] == 0
    s = scene(projection="spherical")
    s.resolution = 32, 16
    s.add_sphere(0.5, transform=translate(0, 0, 4))  # behind: at both ends of the picture
    ball = kanuka.render(s, progressions=16)["alpha"].reshape(16, 32)
    assert ball[8, 0] > 0.9
    assert ball[8, 31] > 0.9
    assert ball[:, 8:24].max() == 0


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda s: s.add_mesh(np.stack([POINTS, POINTS]), QUAD, times=[0, 1, 2]), "times: expected 2 numbers"),
        (lambda s: s.add_mesh(np.stack([POINTS, POINTS]), QUAD, times=[1, 0]), "times: they must rise"),
        (lambda s: s.add_mesh(POINTS, QUAD, transform=np.zeros((2, 2, 4))), "one for each time"),
        (lambda s: setattr(s.options, "shutter", (1, 0)), "open before it closes"),
        (lambda s: setattr(s.options, "shutter_opening", [0.5]), "expected 2 numbers"),
        (lambda s: kanuka.Camera((0, 0, 1), (0, 0, 0), projection="cube"), "perspective, orthographic, fisheye"),
        (lambda s: kanuka.Camera((0, 0, 1), (0, 0, 0), blades=2), "3 to 64"),
    ],
)
def test_errors_say_what_would_do(make: object, words: str) -> None:
    with pytest.raises(ValueError, match=words.replace("(", r"\(")):
        make(scene())


def test_clipping_planes_move_with_the_camera(tmp_path: Path) -> None:
    path = tmp_path / "scene.rib"
    path.write_text(
        f'Format {SIZE} {SIZE} 1 PixelFilter "box" 1 1 Shutter 0 1 Projection "perspective" "fov" 90\n'
        "ClippingPlane 0 0 0 1 0 0 MotionBegin [0 1] Translate 0 0 2 Translate 0.7 0 2 MotionEnd\nWorldBegin\n"
        'Surface "constant" Polygon "P" [-9 -9 0 9 -9 0 9 9 0 -9 9 0]\nWorldEnd\n'
    )
    loaded = kanuka.load(path)
    picture = kanuka.render(loaded, progressions=64, journal=loaded.journal)["alpha"].reshape(SIZE, SIZE)
    assert not list(loaded.journal)
    assert (picture[:, : SIZE // 2] == 1).all()
    assert (picture[:, SIZE // 2 :] == 0).all()


def test_a_filter_without_its_table_is_said_where_it_stands(tmp_path: Path) -> None:
    path = tmp_path / "scene.rib"
    path.write_text('Format 8 8 1\nPixelFilter "table" 2 2\nWorldBegin\nSphere 1 -1 1 360\nWorldEnd\n')
    loaded = kanuka.load(path)
    kanuka.render(loaded, progressions=1, journal=loaded.journal)
    said = [str(message) for message in loaded.journal]
    assert any("scene.rib:2:1" in m and 'needs Option "pixelfilter"' in m for m in said), said
