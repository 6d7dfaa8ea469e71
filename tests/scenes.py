"""Small scenes through the Python API, for determinism and statistical image tests. Each is some dozen pixels wide."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

import kanuka

RESOLUTION = (24, 16)


def quad(*corners: tuple[float, float, float]) -> tuple[np.ndarray, np.ndarray]:
    return np.array(corners, np.float32), np.array([[0, 1, 2, 3]], np.int32)


def grid(n: int, height: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """A height field over [-1, 1]² in x and z with n² quads, normals up."""
    t = np.linspace(-1, 1, n + 1, dtype=np.float32)
    x, z = np.meshgrid(t, t)
    points = np.stack([x, height(x, z), z], axis=-1).reshape(-1, 3).astype(np.float32)
    corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).reshape(-1, 1)
    faces = corner + np.array([0, n + 1, n + 2, 1])
    return points, faces.astype(np.int32)


def ball() -> kanuka.Scene:
    """A red ball under a distant light and a dim sky."""
    scene = kanuka.Scene()
    scene.resolution = RESOLUTION
    scene.camera = kanuka.Camera((0, 0, 5), (0, 0, 0), fov=40)
    scene.add_sphere(material=kanuka.Material("matte", color=(0.8, 0.3, 0.1)))
    scene.add_light("distant", amount=2, direction=(-1, -1, -1), angle=5)
    scene.add_light("environment", amount=(0.1, 0.15, 0.2))
    return scene


def box() -> kanuka.Scene:
    """A closed box lit by a panel: all light is indirect but for what the panel sends."""
    scene = kanuka.Scene()
    scene.resolution = RESOLUTION
    scene.camera = kanuka.Camera((0, 0, 3.4), (0, 0, 0), fov=40)
    white = kanuka.Material("matte", color=(0.7, 0.7, 0.7))
    red, green = kanuka.Material("matte", color=(0.6, 0.1, 0.1)), kanuka.Material("matte", color=(0.1, 0.5, 0.1))
    a, b, c, d = (-1, -1, -1), (1, -1, -1), (1, -1, 1), (-1, -1, 1)
    e, f, g, h = (-1, 1, -1), (1, 1, -1), (1, 1, 1), (-1, 1, 1)
    for corners, material in (((d, c, b, a), white), ((e, f, g, h), white), ((a, b, f, e), white)):
        scene.add_mesh(*quad(*corners), material=material)
    scene.add_mesh(*quad(d, a, e, h), material=red)
    scene.add_mesh(*quad(b, c, g, f), material=green)
    y = 0.99
    panel = quad((-0.4, y, -0.4), (0.4, y, -0.4), (0.4, y, 0.4), (-0.4, y, 0.4))
    scene.add_mesh(*panel, material=white, area_light=(6, 6, 5))
    scene.add_sphere(0.4, material=white, transform=[[1, 0, 0, 0.3], [0, 1, 0, -0.6], [0, 0, 1, 0], [0, 0, 0, 1]])
    return scene


def instances() -> kanuka.Scene:
    """Balls of plastic on a wavy ground: instances, gloss, a subdivision surface, a spot light."""
    scene = kanuka.Scene()
    scene.resolution = RESOLUTION
    scene.camera = kanuka.Camera((0, 2, 4), (0, 0, 0), fov=35)
    points, faces = grid(8, lambda x, z: 0.1 * np.sin(4 * x) * np.cos(3 * z))
    stretch = np.diag([3, 1, 3, 1])
    scene.add_subdivision(points, faces, material=kanuka.Material("matte"), transform=stretch)
    group = scene.add_group("ball")
    group.add_sphere(0.3, material=kanuka.Material("plastic", Ks=0.4, roughness=0.2, color=(0.2, 0.4, 0.8)))
    place = np.tile(np.eye(4, dtype=np.float32)[:3], (5, 1, 1))
    place[:, :, 3] = [(-1, 0.4, 0), (-0.5, 0.4, 0.6), (0, 0.4, 0), (0.5, 0.4, 0.6), (1, 0.4, 0)]
    scene.add_instances(group, place)
    scene.add_light("spot", amount=30, position=(2, 4, 2), direction=(-2, -4, -2), cone_angle=40, radius=0.3)
    scene.add_light("environment", amount=0.2)
    return scene


ALL: dict[str, Callable[[], kanuka.Scene]] = {"ball": ball, "box": box, "instances": instances}
