"""Multipliers of lights by lobes, `diffuse` and `specular`: for every kind of light, found by light sampling, by
directions, or by both."""

from pathlib import Path

import numpy as np
import pytest

import kanuka
from test_bright_lights import write_floats

SKY = np.linspace(0.2, 1.0, 8 * 16 * 3, dtype=np.float32).reshape(8, 16, 3)

LIGHTS = {
    "point": dict(kind="point", amount=4, position=(0.3, 2, 0.5)),
    "soft point": dict(kind="point", amount=4, position=(0.3, 2, 0.5), radius=0.4),
    "distant": dict(kind="distant", amount=2, direction=(0.2, -1, 0.1)),
    "sun": dict(kind="distant", amount=2, direction=(0.2, -1, 0.1), angle=30),
    "quad": dict(kind="quad", amount=3, position=(0, 1.5, 0), direction=(0, -1, 0), width=2, height=2),
    "sphere": dict(kind="sphere", amount=3, position=(0, 2, 0), radius=0.7, visible_camera=False),
    "constant environment": dict(kind="environment", amount=0.7, visible_camera=False),
    "picture": dict(kind="environment", amount=1, visible_camera=False),
}
PAINT = kanuka.Material("plastic", Ka=0, Kd=0.6, Ks=0.4, roughness=0.3)
SQUARE = [[-1, 0, -1], [-1, 0, 1], [1, 0, 1], [1, 0, -1]]


def floor(material: kanuka.Material, light: str, tmp_path: Path, lanes: int = 0, **lobes: float) -> np.ndarray:
    """A floor below a light, (H, W, 3)."""
    scene = kanuka.Scene()
    scene.camera = kanuka.Camera((0, 2.5, 2.5), (0, 0, 0), (0, 1, 0), fov=35)
    scene.add_mesh(SQUARE, [[0, 1, 2, 3]], material=material)
    if light == "mesh":
        lamp = np.array(SQUARE) * 0.5 + [0, 1.5, 0]
        shine = kanuka.Shader("arealight", intensity=3.0, **lobes)
        scene.add_mesh(lamp, [[3, 2, 1, 0]], area_light=shine, visible_camera=False)
    else:
        settings = dict(LIGHTS[light])
        if light == "picture":
            write_floats(tmp_path / "sky.exr", SKY)
            settings["texture"] = str(tmp_path / "sky.exr")
        scene.add_light(settings.pop("kind"), **settings, **lobes)
    return kanuka.render(scene, progressions=16, resolution=(16, 16), seed=3, max_depth=2, lanes=lanes)["rgb"]


@pytest.mark.parametrize("light", [*LIGHTS, "mesh"])
def test_what_lobes_show_adds_up(light: str, tmp_path: Path) -> None:
    """With the same samples pictures are linear in the factors, of each half of MIS as of both."""

    def shown(**lobes: float) -> np.ndarray:
        return floor(PAINT, light, tmp_path, **lobes)

    matte, gloss, both = shown(specular=0), shown(diffuse=0), shown()
    assert matte.mean() > 0.02 and gloss.mean() > 0.001
    np.testing.assert_allclose(matte + gloss, both, rtol=2e-4, atol=1e-5)
    np.testing.assert_allclose(shown(diffuse=0.25, specular=3), 0.25 * matte + 3 * gloss, rtol=2e-4, atol=1e-5)


@pytest.mark.parametrize("light", [*LIGHTS, "mesh"])
def test_one_kind_of_lobe_goes_by_its_own_factor(light: str, tmp_path: Path) -> None:
    for material, mine, other in (("matte", "diffuse", "specular"), ("conductor", "specular", "diffuse")):
        looks = kanuka.Material(material)
        plain = floor(looks, light, tmp_path)
        np.testing.assert_allclose(floor(looks, light, tmp_path, **{mine: 0.5}), 0.5 * plain, rtol=2e-4, atol=1e-6)
        np.testing.assert_array_equal(floor(looks, light, tmp_path, **{other: 0.5, mine: 1.0}), plain)


@pytest.mark.parametrize("light", ["quad", "picture", "mesh"])
def test_any_number_of_lanes_shows_the_same(light: str, tmp_path: Path) -> None:
    one, eight = (floor(PAINT, light, tmp_path, lanes=lanes, diffuse=0.3, specular=2.0) for lanes in (1, 8))
    np.testing.assert_array_equal(one, eight)


@pytest.mark.parametrize("factor", [0.0, 0.5])
def test_renderman_has_them_by_the_same_names(factor: float, tmp_path: Path) -> None:
    """Of a light of its own, and of a mesh that shines; the camera sees it as it is."""
    text = """
Display "a.exr" "file" "rgb"
Format 8 8 1
PixelFilter "box" 1 1
Projection "perspective" "fov" [40]
Translate 0 0 4
WorldBegin
  AttributeBegin
    Translate 0 0 -3
    Light "PxrRectLight" "key" "float intensity" [2] "float diffuse" [FACTOR]
  AttributeEnd
  Bxdf "PxrDiffuse" "paint" "color diffuseColor" [0.5 0.5 0.5]
  Polygon "P" [-3 -3 0  3 -3 0  3 3 0  -3 3 0]
WorldEnd
"""

    def seen(diffuse: float) -> np.ndarray:
        path = tmp_path / "a.rib"
        path.write_text(text.replace("FACTOR", str(diffuse)))
        return kanuka.render(kanuka.load(path), progressions=8, max_depth=2)["rgb"]

    plain = seen(1)
    assert plain.mean() > 0.01
    np.testing.assert_allclose(seen(factor), factor * plain, rtol=1e-4, atol=1e-6)


def test_who_looks_at_a_light_sees_all_of_it(tmp_path: Path) -> None:
    scene = kanuka.Scene()
    scene.camera = kanuka.Camera((0, 0, 3), (0, 0, 0), (0, 1, 0), fov=35)
    scene.add_light("sphere", amount=3, radius=2, diffuse=0, specular=0)
    rgb = kanuka.render(scene, progressions=64, resolution=(8, 8))["rgb"]
    assert rgb.mean() == pytest.approx(3, rel=0.01)


def test_a_factor_below_zero_is_none(tmp_path: Path) -> None:
    below, none = (floor(PAINT, "mesh", tmp_path, diffuse=diffuse) for diffuse in (-1.0, 0.0))
    np.testing.assert_array_equal(below, none)
    with pytest.raises(ValueError, match="diffuse"):
        floor(PAINT, "quad", tmp_path, diffuse=-1)
