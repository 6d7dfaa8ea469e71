"""Volume shaders that look for light on their way: beams in fog."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka

DENSITY, FAR, STEPS = 0.35, 6.0, 256

# As published smoke and fog shaders march: light gathered at each step, dimmed by what lies before it.
BEAMS = f"""volume beams(float density = {DENSITY};) {{
    float i, far = length(I), step = far / {STEPS}, clear = 1;
    vector along = normalize(I); point from = P - I;
    color gathered = 0;
    for (i = 0; i < {STEPS}; i += 1) {{
        point here = from + along * ((i + 0.5) * step);
        color light = 0;
        illuminance (here) {{ light += Cl; }}
        float dimmed = exp(-density * step);
        gathered += clear * (1 - dimmed) * light;
        clear *= dimmed;
    }}
    Ci = gathered + clear * Ci; Oi = gathered + clear * Oi;
}}"""

# The scene's own light: a hard cone and no falloff.
CONE = """light cone(point from = point "shader" (0, 0, 0); vector axis = vector "shader" (0, 0, 1);) {
    illuminate (from, axis, 0.3) { Cl = color(0.5, 1, 0.25); }
}"""


def render(tmp_path: Path, lights: str, loop: str = "illuminance (here)") -> np.ndarray:
    """A black wall 6 ahead, seen from the origin along +z; what is between them shows."""
    (tmp_path / "beams.sl").write_text(BEAMS.replace("illuminance (here)", loop))
    (tmp_path / "cone.sl").write_text(CONE)
    (tmp_path / "scene.rib").write_text(
        'Format 24 24 1\nPixelFilter "box" 1 1\nProjection "perspective" "fov" 40\nWorldBegin\n'
        f'{lights}Atmosphere "beams"\nColor [0 0 0] Surface "constant"\n'
        f'ShadingRate 1\nPolygon "P" [-9 -9 {FAR} -9 9 {FAR} 9 9 {FAR} 9 -9 {FAR}]\nWorldEnd\n'
    )
    picture = kanuka.render(kanuka.load(tmp_path / "scene.rib"), progressions=64)
    assert not picture.journal.error_count, list(picture.journal)
    return picture["rgb"]


def blocks(picture: np.ndarray) -> np.ndarray:
    """Means of 4 by 4 pixels: what is left of the noise of wavelengths is little."""
    return picture.reshape(6, 4, 6, 4, 3).mean((1, 3))


def along_rays(light, steps: int = 4000) -> np.ndarray:
    """Single scattering in the closed form of its integral, in double: density exp(-density t) Cl(x(t)) dt."""
    scale = np.tan(np.radians(20)) * (2 * (np.arange(24) + 0.5) / 24 - 1)
    x, y = np.meshgrid(scale, -scale)
    direction = np.stack([x, y, np.ones_like(x)], -1)
    length = np.linalg.norm(direction, axis=-1)
    t = (np.arange(steps) + 0.5) / steps
    depth = FAR * length[..., None] * t
    places = direction[:, :, None, :] * (FAR * t)[None, None, :, None]
    weight = DENSITY * np.exp(-DENSITY * depth) * FAR * length[..., None] / steps
    return (weight[..., None] * light(places)).sum(2)


def test_a_point_light_shines_in_fog(tmp_path: Path) -> None:
    place = np.array([0.7, 1.6, 3.0])
    color = np.array([1, 0.5, 0.25])
    expected = along_rays(lambda p: 4 * color / ((p - place) ** 2).sum(-1, keepdims=True))
    seen = render(tmp_path, 'LightSource "pointlight" 1 "intensity" 4 "from" [0.7 1.6 3] "lightcolor" [1 0.5 0.25]\n')
    np.testing.assert_allclose(blocks(seen), blocks(expected), rtol=0.015)


def test_a_distant_light_and_fog_make_a_veil(tmp_path: Path) -> None:
    expected = along_rays(lambda p: np.full(p.shape, 0.5))
    seen = render(tmp_path, 'LightSource "distantlight" 1 "intensity" 0.5 "from" [0 1 0] "to" [0 0 0]\n')
    np.testing.assert_allclose(blocks(seen), blocks(expected), rtol=0.015)


def test_a_spotlight_shows_its_beam(tmp_path: Path) -> None:
    """From the left to the right, through what is seen: RISpec's cone, with soft edges and falloff."""
    place, axis, cone, delta = np.array([-3.0, 0, 3]), np.array([1.0, 0, 0]), 0.16, 0.05

    def spot(p: np.ndarray) -> np.ndarray:
        away = p - place
        r = np.linalg.norm(away, axis=-1)
        cosine = away @ axis / r
        t = np.clip((cosine - np.cos(cone)) / (np.cos(cone - delta) - np.cos(cone)), 0, 1)
        return np.repeat((9 * t * t * (3 - 2 * t) * cosine**2 / r**2)[..., None], 3, -1)

    seen = render(
        tmp_path,
        'LightSource "spotlight" 1 "intensity" 9 "from" [-3 0 3] "to" [0 0 3] "coneangle" 0.16 "conedeltaangle" 0.05\n',
    )
    expected = along_rays(spot)
    assert expected[12, 12, 0] > 0.05 > 100 * expected[1, 12, 0]  # a beam, and not a glow
    np.testing.assert_allclose(blocks(seen), blocks(expected), rtol=0.02, atol=2e-3)


def test_light_shaders_of_the_scene_are_run_on_the_way(tmp_path: Path) -> None:
    place, axis = np.array([0.0, 2.5, 4]), np.array([0.0, -1, 0])

    def cone(p: np.ndarray) -> np.ndarray:
        away = p - place
        inside = away @ axis >= np.cos(0.3) * np.linalg.norm(away, axis=-1)
        return inside[..., None] * np.array([0.5, 1, 0.25])

    lamp = 'AttributeBegin\nTranslate 0 2.5 4\nRotate 90 1 0 0\nLightSource "cone" 1\nAttributeEnd\nIlluminate 1 1\n'
    seen = render(tmp_path, lamp)
    expected = along_rays(cone)
    assert expected[12, 12, 1] > 0.05
    np.testing.assert_allclose(blocks(seen), blocks(expected), rtol=0.03, atol=0.01)


def test_a_cone_of_the_loop_chooses_lights(tmp_path: Path) -> None:
    lights = (
        'LightSource "distantlight" 1 "intensity" 0.5 "from" [0 1 0] "to" [0 0 0] "lightcolor" [1 0 0]\n'
        'LightSource "distantlight" 2 "intensity" 0.5 "from" [0 -1 0] "to" [0 0 0] "lightcolor" [0 1 0]\n'
        'LightSource "ambientlight" 3 "intensity" 7\n'  # from nowhere
    )
    up = render(tmp_path, lights, 'illuminance (here, vector "world" (0, 1, 0), PI / 3)')
    assert up[..., 0].mean() == pytest.approx(along_rays(lambda p: np.full(p.shape, 0.5)).mean(), rel=0.02)
    assert np.abs(up[..., 1].mean()) < 1e-3


def quad(x0: float, x1: float, y0: float, y1: float, z: float, attributes: str) -> str:
    return (
        f'AttributeBegin\n{attributes}\nAttribute "visibility" "integer camera" 0\n'
        f'Polygon "P" [{x0} {y0} {z} {x0} {y1} {z} {x1} {y1} {z} {x1} {y0} {z}]\nAttributeEnd\n'
    )


SHADOWS = 'Attribute "light" "string shadows" "on"\n'


def crosses(p: np.ndarray, light: np.ndarray, box: tuple[float, float, float, float], z: float) -> np.ndarray:
    """Is a rectangle between points and a light? By the plane that it lies in."""
    t = (z - p[..., 2]) / (light[2] - p[..., 2])
    x, y = (p[..., c] + t * (light[c] - p[..., c]) for c in (0, 1))
    return (t > 0) & (t < 1) & (x > box[0]) & (x < box[1]) & (y > box[2]) & (y < box[3])


def test_what_is_in_the_way_throws_a_shadow_into_fog(tmp_path: Path) -> None:
    """A wall with a window: a lamp behind it shows a shaft."""
    place = np.array([-1.2, 0.9, 1.0])
    parts = [(-9, 9, 0.7, 9), (-9, 9, -9, 0.1), (-9, -0.7, 0.1, 0.7), (0.1, 9, 0.1, 0.7)]

    def light(p: np.ndarray) -> np.ndarray:
        hidden = np.zeros(p.shape[:-1], bool)
        for part in parts:
            hidden |= crosses(p, place, part, 2.5)
        return np.repeat((~hidden * 3 / ((p - place) ** 2).sum(-1))[..., None], 3, -1)

    lamp = f'{SHADOWS}LightSource "pointlight" 1 "intensity" 3 "from" [-1.2 0.9 1]\n'
    wall = "".join(quad(*part, 2.5, 'Surface "constant"') for part in parts)
    seen, expected = render(tmp_path, lamp + wall), along_rays(light)
    assert expected.max() > 2 * expected.min()  # a shaft
    np.testing.assert_allclose(blocks(seen), blocks(expected), rtol=0.02)
    assert seen.mean() == pytest.approx(expected.mean(), rel=0.005)


def test_lights_without_shadows_shine_through(tmp_path: Path) -> None:
    """As RISpec's lights do, which look no map up."""
    lamp = 'LightSource "pointlight" 1 "intensity" 3 "from" [-1.2 0.9 1]\n'
    clear = render(tmp_path, lamp)
    wall = quad(-9, 9, -9, 9, 2.5, 'Surface "constant"')
    np.testing.assert_array_equal(render(tmp_path, lamp + wall), clear)


def test_shaders_of_the_scene_throw_shadows(tmp_path: Path) -> None:
    """Parallel light by a shader of the scene, half of it behind a screen."""
    (tmp_path / "sun.sl").write_text("light sun() { solar(vector (1, 0, 0), 0) { Cl = color(0.5, 1, 0.25); } }")
    lamp = f'{SHADOWS}LightSource "sun" 1\n'
    screen = 'AttributeBegin\nSurface "constant"\nAttribute "visibility" "integer camera" 0\n'
    screen += 'Polygon "P" [-7 0 -1  -7 9 -1  -7 9 9  -7 0 9]\nAttributeEnd\n'
    expected = along_rays(lambda p: (p[..., 1:2] < 0) * np.array([0.5, 1, 0.25]))
    seen = render(tmp_path, lamp + screen)
    np.testing.assert_allclose(blocks(seen), blocks(expected), rtol=0.02, atol=1e-4)


def test_stained_glass_colours_its_shaft(tmp_path: Path) -> None:
    place = np.array([0.0, 2.0, 1.0])
    glass = quad(-9, 9, -9, 9, 1.75, 'Surface "constant" Color [0 0 0] Opacity [1 0.5 0.2]')

    def light(p: np.ndarray) -> np.ndarray:
        passed = np.where(p[..., 2:] > 1.75, np.array([0, 0.5, 0.8]), 1)
        return passed * 3 / ((p - place) ** 2).sum(-1, keepdims=True)

    lamp = f'{SHADOWS}LightSource "pointlight" 1 "intensity" 3 "from" [0 2 1]\n'
    seen, expected = render(tmp_path, lamp + glass), along_rays(light)
    np.testing.assert_allclose(blocks(seen), blocks(expected), rtol=0.04, atol=2e-3)
    assert seen.mean((0, 1)) == pytest.approx(expected.mean((0, 1)), rel=0.01)


@pytest.mark.parametrize("threads", [1, 2])
def test_any_number_of_threads_sees_the_same_shaft(tmp_path: Path, threads: int) -> None:
    lamp = f'{SHADOWS}LightSource "pointlight" 1 "intensity" 3 "from" [-1.2 0.9 1]\n'
    glass = quad(-9, 0, -9, 9, 2.5, 'Surface "constant" Opacity [0.5 0.7 0.2]')
    first = render(tmp_path, lamp + glass)
    scene = kanuka.load(tmp_path / "scene.rib")
    assert np.array_equal(kanuka.render(scene, progressions=64, threads=threads)["rgb"], first)


def over_a_square(p: np.ndarray, middle: np.ndarray, half: float, count: int = 12) -> np.ndarray:
    """What a square of radiance one that faces +x brings to points, over pi: by quadrature, no cosine there."""
    c = half * (2 * (np.arange(count) + 0.5) / count - 1)
    sum_ = np.zeros(p.shape[:-1])
    for y in c:
        for z in c:
            away = p - (middle + np.array([0, y, z]))
            r2 = (away**2).sum(-1)
            sum_ += np.maximum(away[..., 0], 0) / np.sqrt(r2) / r2
    return sum_ * (2 * half / count) ** 2 / np.pi


SQUARE = "Translate -2.5 0 3\nRotate 90 0 1 0\n"


@pytest.mark.parametrize(
    "lamp",
    [
        f'AttributeBegin\n{SQUARE}LightSource "quadlight" 1 "intensity" 5 "width" 1.6 "height" 1.6\n'
        "AttributeEnd\nIlluminate 1 1\n",
        f'AttributeBegin\n{SQUARE}AreaLightSource "arealight" 1 "intensity" 5\n'
        'Polygon "P" [-0.8 -0.8 0  0.8 -0.8 0  0.8 0.8 0  -0.8 0.8 0]\nAttributeEnd\n',
    ],
    ids=["quadlight", "arealight"],
)
def test_lights_with_an_extent_shine_in_fog(tmp_path: Path, lamp: str) -> None:
    middle = np.array([-2.5, 0, 3.0])
    square = over_a_square
    expected = along_rays(lambda p: np.repeat(5 * square(p, middle, 0.8)[..., None], 3, -1), 500)
    seen = render(tmp_path, lamp)
    np.testing.assert_allclose(blocks(seen), blocks(expected), rtol=0.04)
    assert seen.mean() == pytest.approx(expected.mean(), rel=0.01)


def test_a_sky_shines_in_fog_and_what_hides_it_counts(tmp_path: Path) -> None:
    """A wall of 9 by 9 ahead hides its solid angle of a sky that brings four times its radiance from all around."""

    def light(p: np.ndarray) -> np.ndarray:
        corner = lambda x, y, z: np.arctan2(x * y, z * np.sqrt(x * x + y * y + z * z))  # noqa: E731
        x, y, z = p[..., 0], p[..., 1], FAR - p[..., 2]
        hidden = sum(corner(9 - a * x, 9 - b * y, z) for a in (-1, 1) for b in (-1, 1))
        return np.repeat((0.5 * (4 - hidden / np.pi))[..., None], 3, -1)

    seen = render(tmp_path, 'LightSource "environmentlight" 1 "intensity" 0.5 "visible" 0\n')
    expected = along_rays(light)
    np.testing.assert_allclose(blocks(seen), blocks(expected), rtol=0.03)
    assert seen.mean() == pytest.approx(expected.mean(), rel=0.01)
