"""Lamps of a pixel or two: what curved ones shine with does not depend on how many pixels look at them."""

from __future__ import annotations

import numpy as np
import pytest

import kanuka

CUBE = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float32)
FACES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 2, 6, 4], [1, 5, 7, 3], [0, 4, 5, 1], [2, 3, 7, 6]]


def bulb(scene: kanuka.Scene, **looks: object) -> None:
    """The limit surface of a cube."""
    scene.add_subdivision(CUBE * 0.1, FACES, **looks)


def bowl(scene: kanuka.Scene, **looks: object) -> None:
    """A patch that arches towards the floor."""
    s = np.linspace(-0.1, 0.1, 4)
    x, y = np.meshgrid(s, s)
    height = 0.15 * np.array([0, 1, 1, 0])
    scene.add_patches(np.stack([x, -np.minimum.outer(height, height), y], -1), **looks)


def floor_light(add, pixels: int, **looks: object) -> float:
    """Mean radiance of a floor that the lamp shines on; the picture is `pixels` wide, the lamp as many / 30."""
    scene = kanuka.Scene()
    scene.resolution = pixels, pixels
    scene.camera = kanuka.Camera((0, 8, 0), (0, 0, 0), (0, 0, -1), fov=40)
    lifted = np.eye(4)
    lifted[1, 3] = 1
    add(scene, transform=lifted, visible_camera=False, **looks)
    scene.add_mesh([[-3, 0, 3], [3, 0, 3], [3, 0, -3], [-3, 0, -3]], [[0, 1, 2, 3]], material="matte")
    picture = kanuka.render(scene, progressions=max(64, 2**18 // pixels**2), threads=1, max_depth=1)
    return float(picture["rgb"].mean())


@pytest.mark.parametrize("add", [bulb, bowl])
def test_small_lamps_keep_their_light(add) -> None:
    """A bulb of six faces, each a micropolygon, has less surface than a round one."""
    finely = floor_light(add, 64, area_light=(20, 20, 20), shading_rate=0.002)
    for pixels in (16, 64):
        assert floor_light(add, pixels, area_light=(20, 20, 20)) == pytest.approx(finely, rel=0.02)


def test_small_lamps_of_a_shader_keep_their_light(tmp_path) -> None:
    """Those that shine by a lobe of their material too."""
    (tmp_path / "glow.sl").write_text(
        """class glow() {
            public void mnk_init(output MnkObjectProperties o; output MnkMaterial material) {
                MnkMaterialBoundary b = CreateBoundary(material);
                AddLobe(b, "light", DiffuseEmission());
            }
            public void mnk_prelighting(output MnkMaterialBoundary b) {
                SetLobe(b, "light", 1.0, DiffuseEmission("radiance", color(20, 20, 20)));
            }
        }"""
    )
    finely = floor_light(bulb, 64, area_light=(20, 20, 20), shading_rate=0.002)

    def add(scene: kanuka.Scene, **looks: object) -> None:
        scene.options.shader_path = [str(tmp_path)]
        bulb(scene, material="glow", **looks)

    assert floor_light(add, 16) == pytest.approx(finely, rel=0.02)
