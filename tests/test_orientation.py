"""Which way light comes from: letters on the sky, read by cameras and mirrors, against the conventions' formulas."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka

# A letter that no turn and no mirror leaves as it is.
LETTER = np.array([[int(c) for c in row] for row in ("11110", "10001", "10001", "11110", "10000", "10000", "10000")])
HALF = 0.35  # half the letter's height, as the tangent of the angle to its middle
AXES = {
    "+x": ((1, 0, 0), (0, 1, 0)),
    "-x": ((-1, 0, 0), (0, 1, 0)),
    "+y": ((0, 1, 0), (0, 0, 1)),
    "-y": ((0, -1, 0), (0, 0, -1)),
    "+z": ((0, 0, 1), (0, 1, 0)),
    "-z": ((0, 0, -1), (0, 1, 0)),
}
WIDTH, HEIGHT = 512, 256


def openexr_directions() -> np.ndarray:
    """Of all texels, after OpenEXR's Technical Introduction: longitude from +pi at the left to -pi, latitude pi/2 at
    the top is +y; latitude and longitude 0 is +z, longitude pi/2 is +x. USD's DomeLight refers to it."""
    longitude = np.pi * (1 - 2 * (np.arange(WIDTH) + 0.5) / WIDTH)
    latitude = np.pi * (0.5 - (np.arange(HEIGHT) + 0.5) / HEIGHT)[:, None]
    flat = np.cos(latitude)
    return np.stack(
        [np.sin(longitude) * flat, np.broadcast_to(np.sin(latitude), (HEIGHT, WIDTH)), np.cos(longitude) * flat], -1
    )


def rispec_directions() -> np.ndarray:
    """RISpec 3.2, MakeLatLongEnvironment: longitude 0 at the left to 360 degrees, latitude 90 at the top."""
    longitude = 2 * np.pi * (np.arange(WIDTH) + 0.5) / WIDTH
    latitude = np.pi * (0.5 - (np.arange(HEIGHT) + 0.5) / HEIGHT)[:, None]
    flat = np.cos(latitude)
    return np.stack(
        [np.cos(longitude) * flat, np.sin(longitude) * flat, np.broadcast_to(np.sin(latitude), (HEIGHT, WIDTH))], -1
    )


def letters(directions: np.ndarray, left_handed: bool = False) -> np.ndarray:
    """A letter about each axis that an observer inside reads, each axis in a colour of its own."""
    picture = np.full((*directions.shape[:2], 3), 0.02)
    for k, (forward, up) in enumerate(np.array(list(AXES.values()), float)):
        right = np.cross(up, forward) if left_handed else np.cross(forward, up)
        ahead = directions @ forward
        near = np.maximum(ahead, 1e-3)
        column = np.floor((directions @ right / near / HALF * 3.5 / 2.5 + 1) * 2.5).astype(int)
        row = np.floor((1 - directions @ up / near / HALF) * 3.5).astype(int)
        inside = (ahead > 0) & (column >= 0) & (column < 5) & (row >= 0) & (row < 7)
        lit = np.where(inside, LETTER[np.clip(row, 0, 6), np.clip(column, 0, 4)], 0).astype(bool)
        picture[lit] = [0.3 + 0.1 * k, 0.9 - 0.1 * k, 0.5]
    return picture.astype(np.float32)


def written(path: Path, picture: np.ndarray) -> Path:
    kanuka.Picture({"rgb": picture}).write(path)
    return path


def looking(forward, up, left_handed: bool = False) -> kanuka.Scene:
    """Out of the origin; the letter fills the picture: 5 by 7 cells of 8 pixels."""
    scene = kanuka.Scene()
    scene.resolution = 40, 56
    scene.options.filter, scene.options.filter_width = "box", (1, 1)
    scene.camera = kanuka.Camera(
        (0, 0, 0),
        forward,
        up,
        left_handed=left_handed,
        fov_axis="y",
        fov=float(np.degrees(2 * np.arctan(HALF))),
    )
    return scene


def read(picture: kanuka.Picture) -> np.ndarray:
    """The letter that a picture shows, by the middles of its cells."""
    luminance = np.asarray(picture["rgb"]).mean(-1)
    return (luminance.reshape(7, 8, 5, 8)[:, 3:5, :, 3:5].mean((1, 3)) > 0.25).astype(int)


@pytest.mark.parametrize("axis", AXES)
def test_letters_on_the_sky_are_read_from_inside(tmp_path: Path, axis: str) -> None:
    sky = written(tmp_path / "letters.exr", letters(openexr_directions()))
    scene = looking(*AXES[axis])
    scene.add_light("environment", texture=str(sky))
    picture = kanuka.render(scene, progressions=4)
    np.testing.assert_array_equal(read(picture), LETTER)
    k = list(AXES).index(axis)
    stem = np.asarray(picture["rgb"])[40:48, 2:6].mean((0, 1))
    np.testing.assert_allclose(stem, [0.3 + 0.1 * k, 0.9 - 0.1 * k, 0.5], atol=0.03)


@pytest.mark.parametrize("axis", ["+x", "-y", "+z"])
def test_transforms_turn_the_sky(tmp_path: Path, axis: str) -> None:
    """A dome that is turned shows, along the turned axis, what lay on the axis; scale is nothing to it."""
    sky = written(tmp_path / "letters.exr", letters(openexr_directions()))
    turn, _ = np.linalg.qr(np.array([[0.3, 0.8, -0.5], [-0.6, 0.5, 0.7], [0.9, 0.1, 0.4]]))
    turn *= np.sign(np.linalg.det(turn))
    forward, up = (turn @ np.array(v, float) for v in AXES[axis])
    scene = looking(forward, up)
    placed = np.eye(4)
    placed[:3, :3] = 3 * turn
    scene.add_light("environment", texture=str(sky), transform=placed)
    np.testing.assert_array_equal(read(kanuka.render(scene, progressions=4)), LETTER)


def test_skies_are_turned_but_never_stretched(tmp_path: Path) -> None:
    """What a transform that stretches has of a rotation counts, for all ways to find light alike."""
    turn = np.array([[0.8, 0.6, 0], [-0.6, 0.8, 0], [0, 0, 1]])
    stretched = np.eye(4)
    stretched[:3, :3] = np.diag([3, 1, 1]) @ turn
    stretched[:3, 3] = 5, 6, 7
    u, _, vt = np.linalg.svd(stretched[:3, :3])
    pattern = np.full((HEIGHT, WIDTH, 3), 0.2, np.float32)
    pattern[:32] = 5
    pattern[80:112, 160:240] = 3
    sky = written(tmp_path / "sky.exr", pattern)
    # By hand: the irradiance of a floor whose normal is +y, texel by texel.
    cosine = np.maximum((openexr_directions() @ (u @ vt).T)[..., 1], 0)
    solid_angle = 2 * np.pi**2 / (WIDTH * HEIGHT) * np.sin(np.pi * (np.arange(HEIGHT) + 0.5) / HEIGHT)[:, None]
    expected = (pattern[..., 1] * cosine * solid_angle).sum() / np.pi
    corners = np.array([[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1]], np.float32)
    for integrator in ("path", "reference"):
        scene = kanuka.Scene()
        scene.resolution = 8, 8
        scene.camera = kanuka.Camera(
            (0, 1, 0), (0, 0, 0), (0, 0, -1), projection="orthographic", screen_window=(-0.5, 0.5, -0.5, 0.5)
        )
        scene.add_mesh(corners, np.array([[0, 1, 2, 3]], np.int32), material=kanuka.Material("matte", Kd=1))
        scene.add_light("environment", texture=sky, transform=stretched)
        seen = kanuka.render(scene, progressions=1024, integrator=integrator)["rgb"].mean()
        assert seen == pytest.approx(expected, rel=0.03), integrator


def test_a_flat_transform_is_told(tmp_path: Path) -> None:
    scene = looking((0, 0, 1), (0, 1, 0))
    sky = written(tmp_path / "sky.exr", np.ones((4, 8, 3), np.float32))
    with pytest.raises(ValueError, match="transform: it flattens what it places"):
        scene.add_light("environment", texture=sky, transform=np.diag([1.0, 0, 1, 1]))
    (tmp_path / "flat.rib").write_text(
        f'Format 8 8 1 WorldBegin Scale 1 0 1 LightSource "environmentlight" 1 "texture" ["{sky}"] WorldEnd'
    )
    with pytest.warns(kanuka.Warning, match="flat"):
        assert not kanuka.render(kanuka.load(tmp_path / "flat.rib"), progressions=1)["rgb"].any()


def test_a_mirror_ball_shows_what_lies_around_it(tmp_path: Path) -> None:
    pattern = letters(openexr_directions())
    sky = written(tmp_path / "letters.exr", pattern)
    scene = kanuka.Scene()
    scene.resolution = 48, 48
    scene.options.filter, scene.options.filter_width = "box", (1, 1)
    scene.camera = kanuka.Camera((0, 0, 5), (0, 0, 0), projection="orthographic", screen_window=(-1, 1, -1, 1))
    scene.options.geometry_tolerance = 0
    scene.add_sphere(1, material=kanuka.Material("mirror", reflectance=(1, 1, 1)), shading_rate=0.1)
    scene.add_light("environment", texture=str(sky))
    seen = np.asarray(kanuka.render(scene, progressions=64)["rgb"])

    # By hand: the mirror's law, and OpenEXR's formula backwards.
    sub = (np.arange(48 * 4) + 0.5) / (48 * 4) * 2 - 1
    x, y = np.meshgrid(sub, -sub)
    r2 = x * x + y * y
    n = np.stack([x, y, np.sqrt(np.maximum(1 - r2, 0))], -1)
    d = np.array([0, 0, -1.0])
    r = d - 2 * (n @ d)[..., None] * n
    longitude, latitude = np.arctan2(r[..., 0], r[..., 2]), np.arcsin(np.clip(r[..., 1], -1, 1))
    column = np.clip(((1 - longitude / np.pi) / 2 * WIDTH).astype(int), 0, WIDTH - 1)
    row = np.clip(((0.5 - latitude / np.pi) * HEIGHT).astype(int), 0, HEIGHT - 1)
    expected = pattern[row, column].reshape(48, 4, 48, 4, 3).mean((1, 3))
    inside = (r2 < 0.9).reshape(48, 4, 48, 4).all((1, 3))
    error = np.abs(seen - expected).mean(-1)[inside]
    assert error.mean() < 0.03
    mirrored = np.abs(seen[:, ::-1] - expected).mean(-1)[inside]
    assert mirrored.mean() > 3 * error.mean()


@pytest.mark.parametrize("axis", AXES)
def test_rib_keeps_rispecs_sky(tmp_path: Path, axis: str) -> None:
    """In RISpec's left-handed world a picture of MakeLatLongEnvironment's kind is read from inside."""
    written(tmp_path / "letters.exr", letters(rispec_directions(), left_handed=True))
    path = tmp_path / "sky.rib"
    path.write_text('WorldBegin LightSource "environmentlight" 1 "texture" ["letters.exr"] WorldEnd\n')
    scene = kanuka.load(path)
    scene.options.texture_path = [str(tmp_path)]
    view = looking(*AXES[axis], left_handed=True)
    scene.camera, scene.resolution = view.camera, (40, 56)
    scene.options.filter, scene.options.filter_width = "box", (1, 1)
    np.testing.assert_array_equal(read(kanuka.render(scene, progressions=4)), LETTER)


@pytest.mark.parametrize("axis", AXES)
def test_pxrdomelight_is_turned_as_usd_turns_it(tmp_path: Path, axis: str) -> None:
    """OpenUSD's hdPrman gives PxrDomeLight this matrix (by rows) to have OpenEXR's sky in a right-handed world."""
    written(tmp_path / "letters.exr", letters(openexr_directions()))
    path = tmp_path / "sky.rib"
    path.write_text(
        "WorldBegin AttributeBegin ConcatTransform [0 0 -1 0  -1 0 0 0  0 1 0 0  0 0 0 1]\n"
        'Light "PxrDomeLight" "sky" "string lightColorMap" ["letters.exr"] AttributeEnd WorldEnd\n'
    )
    scene = kanuka.load(path)
    scene.options.texture_path = [str(tmp_path)]
    view = looking(*AXES[axis])
    scene.camera, scene.resolution = view.camera, (40, 56)
    scene.options.filter, scene.options.filter_width = "box", (1, 1)
    np.testing.assert_array_equal(read(kanuka.render(scene, progressions=4)), LETTER)


@pytest.mark.parametrize("axis", AXES)
def test_shaders_see_the_sky_that_lights_do(tmp_path: Path, axis: str) -> None:
    """environment() along the line of sight, on a ball about the camera."""
    written(tmp_path / "letters.exr", letters(rispec_directions(), left_handed=True))
    (tmp_path / "look.sl").write_text(
        'surface look(string map = "";) { Oi = 1; Ci = environment(map, vtransform("world", I)); }'
    )
    path = tmp_path / "sky.rib"
    path.write_text(
        'WorldBegin Surface "look" "map" ["letters.exr"] Attribute "dice" "rasterorient" 0 ShadingRate 0.02 '
        "Sphere 5 -5 5 360 WorldEnd\n"
    )
    scene = kanuka.load(path, journal=kanuka.Journal())
    scene.options.texture_path = scene.options.shader_path = [str(tmp_path)]
    view = looking(*AXES[axis], left_handed=True)
    scene.camera, scene.resolution = view.camera, (40, 56)
    scene.options.filter, scene.options.filter_width = "box", (1, 1)
    scene.options.transport = "full"
    np.testing.assert_array_equal(read(kanuka.render(scene, progressions=4)), LETTER)


DIRECTIONS = {
    "ahead": (0, 0, -1),
    "right": (1, 0, 0),
    "left": (-1, 0, 0),
    "back": (0, 0, 1),
    "down": (0, -1, 0),
    "up": (0, 1, 0),
    "aslant": (1, -2, -1),
}


@pytest.mark.parametrize("direction", DIRECTIONS.values(), ids=DIRECTIONS)
def test_pictures_on_quads_are_read_from_where_they_shine_to(tmp_path: Path, direction: tuple) -> None:
    page = np.repeat(np.repeat(LETTER, 8, 0), 8, 1)[..., None] * np.ones(3) * 0.8
    file = written(tmp_path / "page.exr", page.astype(np.float32))
    along = np.array(direction, float) / np.linalg.norm(direction)
    # Upright: the light's +y is the world's, and straight down that is what nodding by a right angle makes of it.
    up = np.array([0, 1, 0.0]) if abs(along[1]) < 0.99 else np.array([0, 0, np.sign(along[1])])
    scene = looking(-along, up)
    at = np.array([3, 4, 5.0])
    scene.camera = kanuka.Camera(at + along, at, up, fov_axis="y", fov=float(np.degrees(2 * np.arctan(3.5))))
    scene.add_light("quad", position=at, direction=direction, width=5, height=7, texture=str(file))
    np.testing.assert_array_equal(read(kanuka.render(scene, progressions=4)), LETTER)


def test_transforms_place_lights_that_shine_along_minus_z(tmp_path: Path) -> None:
    """As USD, Blender and Camera.from_matrix have it."""
    page = np.repeat(np.repeat(LETTER, 8, 0), 8, 1)[..., None] * np.ones(3) * 0.8
    file = written(tmp_path / "page.exr", page.astype(np.float32))
    placed = np.array([[0, 0, 1, 2], [0, 1, 0, 3], [-1, 0, 0, 4], [0, 0, 0, 1.0]])  # -z becomes -x
    scene = looking((1, 0, 0), (0, 1, 0))
    scene.camera = kanuka.Camera((1, 3, 4), (2, 3, 4), fov_axis="y", fov=float(np.degrees(2 * np.arctan(3.5))))
    scene.add_light("quad", transform=placed, width=5, height=7, texture=str(file))
    np.testing.assert_array_equal(read(kanuka.render(scene, progressions=4)), LETTER)


# Vertical angles 0 and 90; horizontal 0, 90, 180, 270, 360: all light goes to the quarter about 90 degrees.
IES = "IESNA:LM-63-2002\nTILT=NONE\n1 1000 1 2 5 1 2 0 0 0\n1 1 10\n0 90\n0 90 180 270 360\n1 1\n9 9\n1 1\n1 1\n1 1\n"


def test_profiles_turn_anticlockwise_as_seen_from_above(tmp_path: Path) -> None:
    """LM-63-2002 measures type C's horizontal angles so; 0 lies along the light's +x."""
    file = tmp_path / "quarter.ies"
    file.write_text(IES)
    scene = kanuka.Scene()
    scene.resolution = 32, 32
    # The map that an architect draws: from above, +x to the right, -z up.
    scene.camera = kanuka.Camera(
        (0, 0.5, 0), (0, 0, 0), (0, 0, -1), projection="orthographic", screen_window=(-2, 2, -2, 2)
    )
    corners = np.array([[-2, 0, 2], [2, 0, 2], [2, 0, -2], [-2, 0, -2]], np.float32)
    scene.add_mesh(corners, np.array([[0, 1, 2, 3]], np.int32), material=kanuka.Material("matte"))
    scene.add_light("point", position=(0, 1, 0), direction=(0, -1, 0), profile=str(file))
    lit = np.asarray(kanuka.render(scene, progressions=4)["rgb"]).mean(-1)
    up, down, left, right = lit[4:12, 16].mean(), lit[20:28, 16].mean(), lit[16, 4:12].mean(), lit[16, 20:28].mean()
    assert up > 2.5 * max(down, left, right)


def brightest(scene: kanuka.Scene) -> np.ndarray:
    """Direction in which a camera that sees all around sees most."""
    scene.resolution = 128, 64
    scene.camera = kanuka.Camera((0, 0, 0), (0, 0, -1), projection="spherical")
    seen = np.asarray(kanuka.render(scene, progressions=4)["rgb"]).sum(-1)
    row, column = np.unravel_index(np.argmax(seen), seen.shape)
    longitude, latitude = ((column + 0.5) / 128 - 0.5) * 2 * np.pi, (0.5 - (row + 0.5) / 64) * np.pi
    return np.array([np.sin(longitude) * np.cos(latitude), np.sin(latitude), -np.cos(longitude) * np.cos(latitude)])


@pytest.mark.parametrize("sun", [(0.8, 0.5, 0.1), (-0.2, 0.4, 0.9), (0.1, 0.6, -0.7)])
def test_skies_are_brightest_at_their_sun(sun: tuple) -> None:
    scene = kanuka.Scene()
    scene.add_light("sky", sun=sun, amount=0.01)
    toward = np.array(sun) / np.linalg.norm(sun)
    assert brightest(scene) @ toward > np.cos(np.radians(6))
    seen = np.asarray(kanuka.render(scene, progressions=4)["rgb"]).sum(-1)
    assert seen[:31].min() > 0, "the zenith is +y"
    assert seen[33:].max() == 0, "the ground is dark"


def test_the_sun_shines_from_where_its_sky_has_it() -> None:
    """A matte quad that faces the sun gets the most of it: its cosine law, over three quads that face the axes."""
    sun = np.array([0.8, 0.5, 0.3])
    got = []
    for axis in range(3):
        n = np.eye(3)[axis]
        u, v = np.eye(3)[(axis + 1) % 3], np.eye(3)[(axis + 2) % 3]
        scene = kanuka.Scene()
        scene.resolution = 4, 4
        scene.camera = kanuka.Camera(n, (0, 0, 0), u, projection="orthographic", screen_window=(-0.1, 0.1, -0.1, 0.1))
        corners = np.array([-u - v, u - v, u + v, v - u], np.float32)
        scene.add_mesh(corners, np.array([[0, 1, 2, 3]], np.int32), material=kanuka.Material("matte"))
        scene.add_light("sun", sun=sun, amount=0.01)
        got.append(float(np.asarray(kanuka.render(scene, progressions=16)["rgb"]).mean()))
    np.testing.assert_allclose(np.array(got) / np.linalg.norm(got), sun / np.linalg.norm(sun), rtol=0.02)


def test_skies_are_found_along_the_texture_path_whatever_their_format(tmp_path: Path) -> None:
    """Radiance's pictures hold floats with a common exponent (Ward, Real Pixels, Graphics Gems II): flat rows."""
    sky = np.full((4, 4, 3), 0.25)
    sky[0] = [2, 1, 0.5]
    exponent = np.ceil(np.log2(sky.max(-1, keepdims=True) * 1.0001))
    rgbe = np.concatenate([np.floor(sky * 256 / 2**exponent), exponent + 128], -1).astype(np.uint8)
    (tmp_path / "sky.hdr").write_bytes(
        b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 4\n" + np.ascontiguousarray(rgbe).tobytes()
    )
    written(tmp_path / "sky.exr", sky.astype(np.float32))
    pictures = []
    for name in ("sky.hdr", "sky.exr"):
        scene = looking((0, 1, 0.2), (0, 0, -1))
        scene.options.texture_path = [str(tmp_path)]
        scene.add_light("environment", texture=name)
        pictures.append(np.asarray(kanuka.render(scene, progressions=16)["rgb"]))
        np.testing.assert_allclose(pictures[-1][20:30].mean((0, 1)), [2, 1, 0.5], rtol=0.02)
    np.testing.assert_allclose(pictures[0], pictures[1], rtol=0.02)


def test_a_sky_that_is_not_found_is_told_with_the_folders() -> None:
    scene = looking((0, 1, 0), (0, 0, -1))
    scene.add_light("environment", texture="nowhere.hdr")
    with pytest.warns(kanuka.Warning, match=r"nowhere\.hdr.*is not found; searched in"):
        picture = kanuka.render(scene, progressions=1)
    assert np.asarray(picture["rgb"]).mean() == pytest.approx(1, rel=0.01)


@pytest.mark.parametrize("visible", [0, 1])
def test_suns_hide_from_the_camera_alone(tmp_path: Path, visible: int) -> None:
    path = tmp_path / "sun.rib"
    path.write_text(
        f'WorldBegin LightSource "distantlight" 1 "from" [0 0 9] "to" [0 0 0] "angle" 90 "visible" {visible} WorldEnd\n'
    )
    scene = kanuka.load(path)
    view = looking((0, 0, 1), (0, 1, 0), left_handed=True)
    scene.camera, scene.resolution = view.camera, (4, 4)
    seen = kanuka.render(scene, progressions=4, journal=kanuka.Journal())["rgb"]
    assert bool(seen.any()) == bool(visible)
