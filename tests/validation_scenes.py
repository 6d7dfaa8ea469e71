"""Small scenes that the integrator `path` must render as the plain `reference` does: one a feature of transport.

Lights are large and depths small, since the reference finds them by chance. Each scene is square and few pixels wide.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

import kanuka
from scenes import grid, quad

SHADERS = Path(__file__).parent / "shaders"
ALL: dict[str, Callable[[], kanuka.Scene]] = {}


def validation(build: Callable[[], kanuka.Scene]) -> Callable[[], kanuka.Scene]:
    ALL[build.__name__] = build
    return build


def place(x: float, y: float, z: float, scale: float = 1) -> np.ndarray:
    return np.array([[scale, 0, 0, x], [0, scale, 0, y], [0, 0, scale, z], [0, 0, 0, 1]], np.float32)


def matte(*color: float) -> kanuka.Material:
    return kanuka.Material("matte", color=color)


def lobe(name: str) -> kanuka.Material:
    """A material of the shader tests that shows one lobe."""
    return kanuka.Material(str(SHADERS / f"lobe_{name}"))


def broad(name: str) -> kanuka.Material:
    """Likewise, of a lobe so broad that directions by chance find it."""
    return kanuka.Material(str(SHADERS / "broad" / name))


def floor(scene: kanuka.Scene, material: kanuka.Material, y: float = -1, **keywords: object) -> None:
    scene.add_mesh(*quad((-3, y, 3), (3, y, 3), (3, y, -3), (-3, y, -3)), material=material, **keywords)


def stage(sky: tuple[float, float, float] = (0, 0, 0), depth: int = 4) -> kanuka.Scene:
    scene = kanuka.Scene()
    scene.resolution = 32, 32
    scene.camera = kanuka.Camera((0, 1.2, 5), (0, -0.2, 0), fov=38)
    scene.options.max_depth = depth
    if any(sky):
        scene.add_light("environment", amount=sky)
    return scene


def ball_on_floor(
    material: kanuka.Material, sky: tuple[float, float, float] = (0.3, 0.35, 0.4), depth: int = 4, light: str = "quad"
) -> kanuka.Scene:
    scene = stage(sky, depth)
    floor(scene, matte(0.6, 0.5, 0.4))
    scene.add_sphere(material=material)
    if light == "quad":
        scene.add_light("quad", amount=4, position=(1.5, 3, 1.5), direction=(-1, -2, -1), width=2.5, height=2)
    return scene


@validation
def matte_ball_under_a_panel() -> kanuka.Scene:
    return ball_on_floor(matte(0.8, 0.3, 0.1))


@validation
def closed_room_with_an_emitter() -> kanuka.Scene:
    scene = stage(depth=6)
    scene.camera = kanuka.Camera((0, 0, 0.95), (0, 0, 0), fov=80)
    a, b, c, d = (-1, -1, -1), (1, -1, -1), (1, -1, 1), (-1, -1, 1)
    e, f, g, h = (-1, 1, -1), (1, 1, -1), (1, 1, 1), (-1, 1, 1)
    white = matte(0.7, 0.7, 0.7)
    for corners in ((d, c, b, a), (e, f, g, h), (a, b, f, e), (c, d, h, g)):
        scene.add_mesh(*quad(*corners), material=white)
    scene.add_mesh(*quad(d, a, e, h), material=matte(0.7, 0.1, 0.1))
    scene.add_mesh(*quad(b, c, g, f), material=matte(0.1, 0.6, 0.1))
    y = 0.98
    panel = quad((-0.6, y, -0.6), (0.6, y, -0.6), (0.6, y, 0.6), (-0.6, y, 0.6))
    scene.add_mesh(*panel, material=white, area_light=(3, 3, 2.5))
    return scene


@validation
def sun_with_an_angle_and_a_lamp_without() -> kanuka.Scene:
    scene = ball_on_floor(matte(0.5, 0.6, 0.7), light="")
    scene.add_light("distant", amount=(2, 1.8, 1.5), direction=(-1, -1, -0.5), angle=60)
    scene.add_light("point", amount=3, position=(-1.5, 1, 1.5))
    return scene


@validation
def spots_hard_and_soft() -> kanuka.Scene:
    scene = ball_on_floor(matte(0.6, 0.6, 0.6), light="")
    scene.add_light("spot", amount=20, position=(2, 3, 2), direction=(-2, -3, -2), cone_angle=25)
    scene.add_light("spot", amount=12, position=(-2, 2.5, 1), direction=(2, -2.5, -1), cone_angle=40, radius=0.5)
    return scene


@validation
def lights_of_every_shape() -> kanuka.Scene:
    scene = ball_on_floor(kanuka.Material("plastic", roughness=0.4, color=(0.3, 0.5, 0.7)), (0, 0, 0), light="")
    scene.add_light("disk", amount=(6, 2, 2), position=(-2, 1.5, 0), direction=(2, -1.5, 0), radius=0.8)
    scene.add_light("sphere", amount=(2, 5, 2), position=(1.8, 0.3, 1), radius=0.6)
    scene.add_light(
        "cylinder",
        amount=(2, 2, 6),
        radius=0.3,
        height=2.5,
        transform=[[0, 0, 1, 0], [0, 1, 0, 2], [-1, 0, 0, 0], [0, 0, 0, 1]],
    )
    return scene


@validation
def many_lights_in_the_hierarchy() -> kanuka.Scene:
    scene = stage()
    floor(scene, matte(0.7, 0.7, 0.7))
    scene.add_sphere(material=matte(0.5, 0.5, 0.5))
    rng = np.random.default_rng(7)
    for k in range(40):
        x, z = rng.uniform(-2.5, 2.5, 2)
        color = tuple(map(float, 0.5 + rng.random(3)))
        scene.add_light("sphere", amount=color, position=(float(x), 1 + 0.03 * k, float(z)), radius=0.3)
    return scene


@validation
def emitters_in_instances() -> kanuka.Scene:
    scene = stage((0.05, 0.05, 0.08))
    floor(scene, matte(0.7, 0.7, 0.7))
    group = scene.add_group("lamp")
    group.add_sphere(0.5, material=matte(0.2, 0.2, 0.2), area_light=(2, 1.5, 1))
    places = np.stack([place(-1.4, 0, 0), place(0, 0.6, -0.5, 0.7), place(1.3, -0.2, 0.4, 1.2)])
    scene.add_instances(group, places[:, :3])
    return scene


@validation
def mirror_and_smooth_glass() -> kanuka.Scene:
    scene = ball_on_floor(kanuka.Material("mirror"), depth=6)
    scene.add_sphere(0.5, material=kanuka.Material("glass"), transform=place(0.6, -0.5, 1.4))
    return scene


@validation
def sun_in_a_mirror() -> kanuka.Scene:
    scene = ball_on_floor(kanuka.Material("mirror"), light="")
    scene.add_light("distant", amount=3, direction=(-0.5, -1, -0.5), angle=50)
    return scene


@validation
def lamps_behind_a_pane() -> kanuka.Scene:
    """Asked for through it, and met through it."""
    scene = stage((0.1, 0.1, 0.1))
    floor(scene, matte(0.7, 0.7, 0.7))
    scene.add_sphere(0.7, material=matte(0.6, 0.4, 0.2))
    scene.add_mesh(*quad((-3, 1, 3), (3, 1, 3), (3, 1, -3), (-3, 1, -3)), material=broad("pane"))
    scene.add_light("quad", amount=5, position=(-1, 3, 0), direction=(0, -1, 0), width=2, height=2)
    scene.add_light("point", amount=4, position=(1.5, 1.8, 0.5))
    scene.add_light("distant", amount=1, direction=(0.5, -1, -0.5), angle=50)
    return scene


@validation
def lamps_in_tinted_water() -> kanuka.Scene:
    """One interior, which only absorbs: a tank around all."""
    scene = stage()
    floor(scene, matte(0.7, 0.7, 0.7))
    water = kanuka.Material("glass", ior=1.0001, absorption=(0.5, 0.2, 0.1))
    scene.add_sphere(8, material=water)
    scene.add_light("quad", amount=20, position=(-1, 2, 0), direction=(0, -1, 0), width=2, height=2)
    scene.add_light("sphere", amount=12, position=(1.2, 0, 0.5), radius=0.5)
    scene.add_light("point", amount=9, position=(1.5, 1.8, -0.5))
    return scene


@validation
def glass_that_disperses_and_absorbs() -> kanuka.Scene:
    glass = kanuka.Material("glass", ior=1.6, abbe=12, absorption=(0.1, 0.3, 0.8))
    return ball_on_floor(glass, depth=6)


@validation
def rough_glass_that_disperses() -> kanuka.Scene:
    return ball_on_floor(kanuka.Material("glass", ior=1.5, abbe=15, roughness=0.8), depth=3)


@validation
def rough_gold() -> kanuka.Scene:
    return ball_on_floor(kanuka.Material("conductor", reflectance=(1.0, 0.78, 0.34), roughness=0.6))


@validation
def brushed_metal() -> kanuka.Scene:
    return ball_on_floor(broad("brushed"))


@validation
def lacquer_over_paint() -> kanuka.Scene:
    return ball_on_floor(kanuka.Material("lacquer", metallic=0.4, coatRoughness=0.6))


@validation
def coat_that_absorbs() -> kanuka.Scene:
    return ball_on_floor(broad("coat"))


@validation
def velvet() -> kanuka.Scene:
    return ball_on_floor(lobe("sheen"))


@validation
def retro_reflection() -> kanuka.Scene:
    return ball_on_floor(lobe("retro"))


@validation
def grating() -> kanuka.Scene:
    return ball_on_floor(broad("grating"))


@validation
def phong_and_blinn() -> kanuka.Scene:
    scene = ball_on_floor(lobe("phong"))
    scene.add_sphere(0.5, material=lobe("blinn"), transform=place(0.6, -0.5, 1.4))
    return scene


@validation
def leaf_lit_from_behind() -> kanuka.Scene:
    scene = stage((0.1, 0.1, 0.1))
    floor(scene, matte(0.5, 0.5, 0.5))
    leaf = kanuka.Material("leaf", transmission=0.6)
    scene.add_mesh(*quad((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)), material=leaf)
    scene.add_light("quad", amount=5, position=(0.5, 1, -2), direction=(0, -0.2, 1), width=2, height=2)
    return scene


@validation
def panes_that_are_partly_there() -> kanuka.Scene:
    scene = ball_on_floor(matte(0.8, 0.3, 0.1))
    veil = kanuka.Material("matte", color=(0.2, 0.3, 0.8), opacity=(0.4, 0.4, 0.4))
    scene.add_mesh(*quad((-1.5, -1, 1.3), (0.2, -1, 1.3), (0.2, 1, 1.3), (-1.5, 1, 1.3)), material=veil)
    return scene


@validation
def light_that_skips_one_half() -> kanuka.Scene:
    scene = stage((0.1, 0.1, 0.1))
    y = -1
    left, right = ((-3, y, 3), (0, y, 3), (0, y, -3), (-3, y, -3)), ((0, y, 3), (3, y, 3), (3, y, -3), (0, y, -3))
    scene.add_mesh(*quad(*left), material=matte(0.7, 0.7, 0.7), lights_off=["key"])
    scene.add_mesh(*quad(*right), material=matte(0.7, 0.7, 0.7))
    scene.add_sphere(material=matte(0.6, 0.4, 0.2), shadows_off=["key"])
    scene.add_light("quad", amount=5, position=(0, 3, 0), direction=(0, -1, 0), width=2, height=2, name="key")
    scene.add_light("sphere", amount=3, position=(-1.8, 0.5, 1), radius=0.5, name="fill")
    return scene


@validation
def ball_on_its_way() -> kanuka.Scene:
    scene = stage((0.3, 0.3, 0.4))
    scene.options.shutter = 0, 1
    floor(scene, matte(0.6, 0.5, 0.4))
    group = scene.add_group("ball")
    group.add_sphere(0.7, material=kanuka.Material("plastic", roughness=0.3, color=(0.7, 0.2, 0.2)))
    steps = np.stack([place(-1, 0, 0)[None, :3], place(1, 0.4, 0)[None, :3]])
    scene.add_instances(group, steps, times=[0, 1])
    scene.add_light("quad", amount=4, position=(1.5, 3, 1.5), direction=(-1, -2, -1), width=2.5, height=2)
    return scene


@validation
def waves_under_a_lens() -> kanuka.Scene:
    scene = stage((0.4, 0.5, 0.6))
    scene.camera = kanuka.Camera((0, 1.2, 5), (0, -0.2, 0), fov=38, f_stop=2, focal_length=0.5, focal_distance=4)
    points, faces = grid(16, lambda x, z: 0.12 * np.sin(7 * x) * np.cos(6 * z) - 0.4)
    wide = np.diag([2.5, 1, 2.5, 1])
    scene.add_subdivision(points, faces, material=kanuka.Material("plastic", roughness=0.25), transform=wide)
    scene.add_light("sphere", amount=3, position=(0.5, 1.5, 0), radius=0.7)
    return scene


@validation
def bumps_under_a_panel() -> kanuka.Scene:
    bumps = kanuka.Shader(str(SHADERS / "broad" / "bumps"))
    scene = ball_on_floor(kanuka.Material("plastic", roughness=0.3, displacement=bumps, color=(0.7, 0.4, 0.2)))
    coated = kanuka.Material("lacquer", metallic=0.5, coatRoughness=0.5, displacement=bumps)
    scene.add_sphere(0.5, material=coated, transform=place(1, -0.5, 1.2))
    return scene
