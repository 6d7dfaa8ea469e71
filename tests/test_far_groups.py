"""What is modelled far from its origin and brought back by its instances looks as if it had been modelled there."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka

SHADERS = Path(__file__).parent.parent / "shaders"


def moved(offset: np.ndarray) -> np.ndarray:
    m = np.eye(4, dtype=np.float32)
    m[:3, 3] = offset
    return m


def cube() -> tuple[np.ndarray, np.ndarray]:
    points = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float32)
    faces = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]], np.int32)
    return points, faces


def picture(shape: str, offset: np.ndarray, nested: bool, material: kanuka.Material, **more: int) -> kanuka.Picture:
    scene = kanuka.Scene()
    scene.resolution = 48, 48
    scene.camera = kanuka.Camera((3, 2.5, 5), (0, 0, 0), fov=30)
    scene.add_light("environment", amount=1, visible_camera=False)
    group = scene.add_group("far")
    if shape == "cube":
        points, faces = cube()
        group.add_mesh(points + offset.astype(np.float32), faces, material=material)
    else:
        group.add_sphere(1, material=material, transform=moved(offset))
    back = moved(-offset)
    if nested:
        outer = scene.add_group("outer")
        outer.add_instances(group, moved(0.5 * offset)[None])
        group, back = outer, moved(-1.5 * offset)
    scene.add_instances(group, back[None])
    return kanuka.render(scene, progressions=16, **more)


@pytest.mark.parametrize("far", [1e3, 1e5, 2.0**20])
@pytest.mark.parametrize("shape", ["cube", "sphere"])
@pytest.mark.parametrize("nested", [False, True])
def test_far_models_are_as_precise_as_near_ones(shape: str, far: float, nested: bool) -> None:
    # Multiples of 8: exact in single precision with what is added.
    offset = np.round(np.array([far, -0.5 * far, 0.25 * far]) / 8) * 8
    material = kanuka.Material("matte", color=(0.8, 0.8, 0.8))
    near, away = (picture(shape, at, nested, material) for at in (np.zeros(3), offset))
    solid = near["alpha"] > 0.999
    assert away["rgb"][solid].mean() == pytest.approx(0.8, rel=0.002)
    assert np.abs(away["alpha"] - near["alpha"]).max() < 0.05
    assert np.abs(away["N"] - near["N"])[solid].max() < 0.02


def test_shaders_in_far_groups_know_their_places(tmp_path: Path) -> None:
    """Object coordinates go with the thing; a group's world, where shaders are declared, is its own space, as long as
    its instances share one shading."""
    shader = tmp_path / "places.sl"
    shader.write_text(
        'surface places() { point a = transform("object", P), b = transform("shader", P), c = transform("world", P);\n'
        "    Ci = color(0.5 + 0.5 * sin(3 * xcomp(a)), xcomp(b) / 8192, xcomp(c) / 8192); Oi = 1; }\n"
    )
    offset = np.array([4096.0, -2048, 1024])
    material = kanuka.Material(str(shader))
    near, away = (picture("sphere", at, False, material, unique_up_to=0)["rgb"] for at in (np.zeros(3), offset))
    solid = away[..., 2] > 0.4
    assert solid.sum() > 300
    assert np.abs(near - away)[solid][:, 0].mean() < 0.01
    assert np.median(away[solid][:, 1:]) == pytest.approx(0.5, abs=0.002)  # in the rim there is background
