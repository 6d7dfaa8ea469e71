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


def along_rays(light) -> np.ndarray:
    """Single scattering in the closed form of its integral, in double: density exp(-density t) Cl(x(t)) dt."""
    scale = np.tan(np.radians(20)) * (2 * (np.arange(24) + 0.5) / 24 - 1)
    x, y = np.meshgrid(scale, -scale)
    direction = np.stack([x, y, np.ones_like(x)], -1)
    length = np.linalg.norm(direction, axis=-1)
    t = (np.arange(4000) + 0.5) / 4000
    depth = FAR * length[..., None] * t
    places = direction[:, :, None, :] * (FAR * t)[None, None, :, None]
    weight = DENSITY * np.exp(-DENSITY * depth) * FAR * length[..., None] / 4000
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
