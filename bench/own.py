"""Scenes that measure Kanuka against itself, made by its Python API: what dicing costs, what the tolerance saves."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

import kanuka

SHADERS = Path(__file__).resolve().parent / "shaders"
GREY = (0.5, 0.5, 0.5)


def lattice(n: int, half: float, height: Callable[[np.ndarray, np.ndarray], np.ndarray] | None = None) -> tuple:
    """n² quads over [-half, half]² in x and z, facing up."""
    x, z = np.meshgrid(*[np.linspace(-half, half, n + 1)] * 2)
    y = height(x, z) if height else 0 * x
    points = np.stack([x, y, z], -1).reshape(-1, 3).astype(np.float32)
    corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).reshape(-1, 1)
    return points, (corner + np.array([0, n + 1, n + 2, 1])).astype(np.int32)


def daylight(scene: kanuka.Scene) -> None:
    scene.add_light("environment", amount=(0.4, 0.5, 0.7))
    scene.add_light("distant", amount=(2.4, 2.2, 1.8), direction=(-1, -1.4, -0.8), angle=4)


def square(n: int, material: kanuka.Material) -> kanuka.Scene:
    """One square that fills the picture of 512² pixels, displaced by more than the tolerance everywhere.

    A shading rate of 512² / n gives n micropolygons, whatever the number of pixels.
    """
    scene = kanuka.Scene()
    scene.resolution = (512, 512)
    scene.options.shader_path = [str(SHADERS)]
    points, faces = lattice(16, 1)
    scene.add_subdivision(points, faces, material=material, shading_rate=512 * 512 / n)
    scene.camera = kanuka.Camera(
        (0, 4, 0), (0, 0, 0), (0, 0, -1), projection="orthographic", screen_window=(-1, 1, -1, 1)
    )
    daylight(scene)
    return scene


def micropolygons(n: int) -> kanuka.Scene:
    """Of one colour."""
    rough = kanuka.Shader("rough", swell=0.05, grain=0.003, fineness=300)
    material = kanuka.Material("matte", color=GREY, displacement=rough, displacement_bound=0.05)
    return square(n or 4_000_000, material)


def two_lobes(n: int) -> kanuka.Scene:
    """A body under an interface, all of whose inputs vary."""
    return square(n or 1_000_000, kanuka.Material("varied", displacement_bound=0.02))


def smooth(_n: int) -> kanuka.Scene:
    """Curved, undisplaced: a subdivision surface in waves, a ball."""
    scene = kanuka.Scene()
    scene.resolution = (512, 512)
    scene.camera = kanuka.Camera((0, 2.2, 4), (0, 0.2, 0), fov=38)
    waves = lattice(12, 2, lambda x, z: 0.15 * np.sin(3 * x) * np.cos(2.5 * z))
    scene.add_subdivision(*waves, material=kanuka.Material("matte", color=(0.6, 0.55, 0.5)))
    place = np.eye(4)
    place[:3, 3] = (0, 0.85, 0)
    scene.add_sphere(0.7, material=kanuka.Material("plastic", color=(0.2, 0.4, 0.7), roughness=0.15), transform=place)
    daylight(scene)
    return scene


def displaced(_n: int) -> kanuka.Scene:
    """Swells and grain on ground and ball: nothing to simplify where the grain is larger than the tolerance."""
    scene = kanuka.Scene()
    scene.resolution = (512, 512)
    scene.options.shader_path = [str(SHADERS)]
    scene.camera = kanuka.Camera((0, 2.2, 4), (0, 0.2, 0), fov=38)
    ground = kanuka.Shader("rough", swell=0.15, frequency=2, grain=0.02, fineness=40)
    stone = kanuka.Shader("rough", swell=0.2, frequency=3, grain=0.02, fineness=40)
    scene.add_subdivision(
        *lattice(12, 2), material=kanuka.Material("matte", color=GREY, displacement=ground, displacement_bound=0.1)
    )
    place = np.eye(4)
    place[:3, 3] = (0, 0.75, 0)
    material = kanuka.Material("matte", color=(0.6, 0.35, 0.2), displacement=stone, displacement_bound=0.12)
    scene.add_sphere(0.7, material=material, transform=place)
    daylight(scene)
    return scene


MAKERS: dict[str, Callable[[int], kanuka.Scene]] = {
    "micropolygons": micropolygons,
    "two-lobes": two_lobes,
    "smooth": smooth,
    "displaced": displaced,
}
