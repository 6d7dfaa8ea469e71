"""A forest on hills: a few exemplar trees of boughs with leaves as instances, placed any number of times.

Metres, y up. Trees stand about 6.5 m apart, so a million of them cover 42 square kilometres.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

import kanuka
from kit import shapes
from kit.places import CHUNK, frames, matrices
from kit.plants import Maker, Plant, along, bough, leaf, skeleton, tree, turned
from kit.sinks import Look

SHADERS = [Path(__file__).resolve().parent / "shaders", Path(__file__).resolve().parent.parent / "motu" / "shaders"]
SPACING = 6.5
FRAMES = 48
SUN = (-0.45, 0.42, -0.6)
BARK = Look("bark", {"color dark": (0.07, 0.055, 0.045), "color pale": (0.24, 0.21, 0.17)}, "bark", {}, 0.05)
BIRCH = Look("bark", {"color dark": (0.12, 0.11, 0.1), "color pale": (0.62, 0.6, 0.56)}, "bark", {}, 0.05)
TWIG = Look("matte", {"color": (0.16, 0.12, 0.09)})
SHARES = (3.0, 3.0, 2.2, 2.2, 1.5, 1.5)
AUTUMN = 5  # variants of a leaf
HILLS = shapes.Noise(41)


def height(x: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Of the hills, anywhere: the same however large the forest is."""
    p = np.stack([x, z], axis=-1) / 420
    return 55 * HILLS(p) + 20 * HILLS(2.7 * p + 11) + 4 * HILLS(9 * p + 5)


# ---- trees


def foliage(front: tuple, through: tuple, surface: str = "foliage") -> Look:
    return Look(surface, {"color front": front, "color through": through})


def exemplars(make: Maker, autumn: bool = False) -> list[Plant]:
    """`autumn`: leaves have the variants of their shader, from green to brown, for trees to choose."""
    surface, more = ("autumn", {"variants": AUTUMN}) if autumn else ("foliage", {})
    kinds = (("beech", 100, (0.075, 0.16, 0.03), (0.2, 0.36, 0.04), 0.13, 0.6, BARK),
             ("birch", 200, (0.16, 0.21, 0.035), (0.36, 0.42, 0.05), 0.1, 0.7, BIRCH))  # fmt: skip
    made = []
    for name, seed, front, through, size, width, bark in kinds:
        looks = [foliage(tuple(f * np.array(front)), tuple(f * np.array(through)), surface) for f in (0.8, 1.0, 1.2)]
        leaves = [leaf(make, f"{name} leaf {k}", look, rows=2, width=width, **more) for k, look in enumerate(looks)]
        boughs = [
            bough(
                make,
                f"{name} bough {k}",
                TWIG,
                leaves,
                seed + k,
                length=2.6,
                branches=9,
                each=11,
                size=size,
                reach=0.55,
            )
            for k in range(3)
        ]
        slim = {"crown": 0.7, "reach": 0.36, "girth": 0.018} if name == "birch" else {}
        made += [
            tree(make, f"{name} {k}", bark, boughs, seed + 20 + k, height=8.5 + 2 * k, arms=15, each=3, **slim)
            for k in range(2)
        ]
    return made + firs(make, 300)


def firs(make: Maker, seed: int) -> list[Plant]:
    """Needles are curves on a sprig, sprigs stand on boughs, boughs in whorls about the trunk."""
    rng = make.rng(seed)
    sprig, count = make.plant("sprig"), 32
    t = np.repeat(np.linspace(0.05, 1, count // 2), 2) * 0.34
    side = np.tile([-1.0, 1.0], count // 2)
    base = np.stack([0 * t, 0 * t, t], axis=1)
    tip = base + np.stack([0.06 * side, 0.012 + 0.02 * rng.random(count), np.full(count, 0.03)], axis=1)
    points = np.stack([base, tip], axis=1).reshape(-1, 3).astype(np.float32)
    look = Look("needle", {"color tone": (0.045, 0.085, 0.035), "float transmission": 0.2})
    sprig.group.curves(points, np.full(count, 2, np.int32), look, widths=np.tile(np.float32([0.02, 0.009]), count))
    sprig.has(curves=count)
    boughs = []
    for k in range(3):
        wood = skeleton(
            seed + k, height=2.3, levels=2, branches=18.0, girth=0.011, angle=52.0, reach=0.42, lift=0.05, wander=0.12,
            bare=0.05,
        )  # fmt: skip
        wood = [(course * [0.28, 1, 1], radius) for course, radius in wood]  # flat, across x
        plant = make.plant(f"fir bough {k}")
        make.wood(plant, wood, TWIG, 4, 0.5)
        for level, each in ((wood[1], 10), (wood[0], 20)):
            n = level[0].shape[0]
            here, tangent = along(level, (0.1 + 0.9 * (np.arange(each) + rng.random((n, each))) / each))
            turn = np.where(rng.random(len(here)) < 0.5, 0.0, np.pi) + 0.5 * rng.normal(size=len(here))
            away = tangent + 0.7 * turned(tangent, turn) * [0.4, 1, 1]
            make.place(
                plant, sprig, frames(here, away, np.tile([1.0, 0, 0], (len(here), 1)), rng.uniform(0.8, 1.3, len(here)))
            )
        boughs.append(plant)
    return [fir(make, f"fir {k}", boughs, seed + 30 + k, 13.0 + 4 * k) for k in range(2)]


def fir(make: Maker, name: str, boughs: list[Plant], seed: int, tall: float) -> Plant:
    rng = make.rng(seed)
    plant = make.plant(name)
    t = np.linspace(0, 1, 12)
    course = np.stack([0.05 * np.sin(4 * t), tall * t, 0.05 * np.cos(3 * t)], axis=1)
    radius = 0.016 * tall * (1 - 0.95 * t) * (1 + 0.6 * np.exp(-18 * t))
    make.wood(plant, [(course[None], radius[None])], BARK, make.sides(8))
    count = 84
    s = 0.1 + 0.88 * (np.arange(count) + 0.4 * rng.random(count)) / count
    here = np.stack([0.05 * np.sin(4 * s), tall * s, 0.05 * np.cos(3 * s)], axis=1)
    turn = 2.39996 * np.arange(count) + 0.2 * rng.normal(size=count)
    steep = -0.25 + 1.1 * s**2
    out = np.stack([np.cos(turn), steep, np.sin(turn)], axis=1)
    # A bough is flat across its x: that stands upright where the bough lies.
    y = out / np.linalg.norm(out, axis=1, keepdims=True)
    z = np.cross(np.tile([0.0, 1, 0], (count, 1)), y)
    z /= np.linalg.norm(z, axis=1, keepdims=True)
    where = np.stack([np.cross(y, z), y, z, here], axis=2)
    where[:, :, :3] *= (0.12 + (1 - s) ** 0.8 * tall / 9)[:, None, None]
    kind = rng.integers(len(boughs), size=count)
    for k, child in enumerate(boughs):
        make.place(plant, child, where[kind == k].astype(np.float32))
    return plant


# ---- the camera's way


def way(frame: float) -> np.ndarray:
    """Where the camera is at a frame from 1 to 48: along a bend above the trees, and down between them."""
    t = (frame - 1) / (FRAMES - 1)
    x, z = -46 + 92 * t, 14 * np.sin(2.6 * t - 0.6)
    return np.array([x, height(np.array(x), np.array(z)) + 21 - 15.5 * np.exp(-(((t - 0.52) / 0.2) ** 2)), z])


def camera(frame: int) -> kanuka.Camera:
    if not 1 <= frame <= FRAMES:
        raise ValueError(f"frame {frame}: the flight has 1 to {FRAMES}")
    here, ahead = way(frame), way(frame + 7)
    ahead[1] = here[1] + 0.22 * (ahead[1] - here[1]) - 2.4  # it nods less than its way does
    return kanuka.Camera(here, ahead, fov=68, fov_axis="x")


# ---- the whole


@dataclass(frozen=True)
class Forest:
    trees: int
    instances: int  # matrices that are stored
    primitives: int  # with all instances
    leaves: int  # of these, leaves and needles' sprigs
    ground: int  # quads


def places(trees: int, seed: int) -> np.ndarray:
    """x and z of the trees nearest to the middle of the flight, of a jittered lattice without those in its way."""
    side = int(np.ceil(np.sqrt(1.3 * trees))) + 8
    rng = np.random.default_rng([seed, 1])
    z, x = np.mgrid[0:side, 0:side]
    xz = np.stack([x.ravel(), z.ravel()], axis=1) - 0.5 * (side - 1) + rng.uniform(-0.42, 0.42, (side * side, 2))
    xz *= SPACING
    path = np.array([way(f)[[0, 2]] for f in np.linspace(1, FRAMES + 7, 60)])
    near = np.flatnonzero(np.abs(xz).max(axis=1) < 80)
    free = np.ones(len(xz), bool)
    free[near] = np.hypot(*(xz[near, None] - path).transpose(2, 0, 1)).min(axis=1) > 5.5
    xz = xz[free]
    order = np.argsort((xz**2).sum(axis=1), kind="stable")
    return xz[order[:trees]]


def build(sink: object, trees: int, seed: int = 1, autumn: bool = False) -> Forest:
    if not 1 <= trees <= 20_000_000:
        raise ValueError(f"{trees} trees: there may be 1 to 20 million")
    make = Maker(sink, seed, 1.0)
    kinds = exemplars(make, autumn)
    xz = places(trees, seed)
    quads = ground(sink, float(np.abs(xz).max()))
    rng = np.random.default_rng([seed, 2])
    kind = rng.choice(len(kinds), size=trees, p=np.array(SHARES) / sum(SHARES))
    for k, plant in enumerate(kinds):
        mine = xz[kind == k]
        for first in range(0, len(mine), CHUNK):
            x, z = mine[first : first + CHUNK].T
            where = np.stack([x, height(x, z) - 0.25, z], axis=1)
            n = len(where)
            lean = 0.03 * rng.normal(size=(n, 2)).astype(np.float32)
            standing = matrices(where, rng.uniform(0, 2 * np.pi, n), rng.uniform(0.7, 1.2, n), lean)
            sink.instances(plant.group, standing, **(turning(x, z, seed + k) if autumn else {}))
    many = np.bincount(kind, minlength=len(kinds))
    placed = sum(int(n) * p.primitives for n, p in zip(many, kinds, strict=True))
    leaves = sum(int(n) * foliage_of(p) for n, p in zip(many, kinds, strict=True))
    return Forest(trees, trees + sum(p.rows for p in make.made), placed + quads, leaves, quads)


def turning(x: np.ndarray, z: np.ndarray, seed: int) -> dict[str, np.ndarray]:
    """How far each tree has turned: whole slopes early or late, and each tree by itself."""
    own = np.random.default_rng([seed, 3]).normal(size=len(x))
    slope = HILLS(np.stack([x, z], axis=-1) / 60 + 3)
    return {"variant": np.clip(1.9 + 1.5 * slope + 0.9 * own, 0, AUTUMN - 1).astype(np.float32)}


def foliage_of(plant: Plant) -> int:
    """Leaves and sprigs of a tree: what its boughs' instances come to."""
    return plant.all_rows - plant.rows


def ground(sink: object, reach: float) -> int:
    """A lattice under all that has trees and some way beyond, and a coarse one, lower, to the horizon."""
    quads = 0
    for half, cells, lower in ((reach + 250, int(np.clip((reach + 250) / 2, 150, 900)), 0.0), (15_000.0, 240, 12.0)):
        axis = np.linspace(-half, half, cells + 1)
        x, z = np.meshgrid(axis, axis)
        points = np.stack([x, height(x, z) - lower, z], axis=-1).astype(np.float32)
        faces = shapes.lattice_faces(cells + 1, cells + 1, over=True)
        normals = shapes.lattice_normals(points)
        sink.mesh(points.reshape(-1, 3), faces, Look("floor"), normals=normals, name=f"ground {cells}")
        quads += len(faces)
    return quads


def staged(scene: kanuka.Scene, frame: int = 1) -> kanuka.Scene:
    scene.resolution = 960, 400
    scene.options.max_depth = 5
    scene.options.shader_path = [str(folder) for folder in SHADERS]
    scene.options.clamp_indirect = 20
    scene.options.exposure_gain = 0.095
    scene.add_light("sky", sun=SUN, turbidity=3, name="sky")
    scene.add_light("sun", sun=SUN, turbidity=3, name="sun")
    scene.camera = camera(frame)
    return scene
