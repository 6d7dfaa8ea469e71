"""What grows and lies on the island, each kind in some exemplars, made by kit.plants. Sizes are metres."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kit import shapes
from kit.places import frames, matrices
from kit.plants import Maker, Plant, along, bough, leaf, leafed, skeleton, tree, tuft
from kit.sinks import Look


@dataclass(frozen=True)
class Kind:
    """Things that are placed alike: exemplars, how often each of them, sizes, how deep they stand in the ground."""

    exemplars: list[Plant]
    shares: np.ndarray
    size: tuple[float, float]
    sink: float  # in its own unit, times its size
    lean: float = 0.04  # tangent of what it leans by, at one deviation
    upright: bool = True  # or as the ground slopes
    apart: float = 0  # metres that they keep, if there is room

    @property
    def mean_primitives(self) -> float:
        return float(sum(s * e.primitives for s, e in zip(self.shares, self.exemplars, strict=True)))


def kind(exemplars: list[Plant], size: tuple[float, float], sink: float, shares: object = None, **more: object) -> Kind:
    shares = np.ones(len(exemplars)) if shares is None else np.asarray(shares, float)
    return Kind(exemplars, shares / shares.sum(), size, sink, **more)


def foliage(front: tuple, through: tuple, transmission: float = 0.4) -> Look:
    return Look("foliage", {"color front": front, "color through": through, "float transmission": transmission})


def hues(front: tuple, through: tuple, count: int = 3) -> list[Look]:
    """Leaves of one plant: younger and older."""
    found = []
    for k in range(count):
        f = 0.78 + 0.45 * k / max(count - 1, 1)
        tint = np.array([1.15 if k == count - 1 else 1.0, 1.0, 0.9])
        found.append(foliage(tuple(np.array(front) * f * tint), tuple(np.array(through) * f * tint)))
    return found


BARK = Look("bark", {"color dark": (0.09, 0.07, 0.055), "color pale": (0.3, 0.26, 0.21)}, "bark", {}, 0.05)
RINGS = {"float rings": 9.0, "float height": 0.007}
PALM_BARK = Look(
    "bark", {"color dark": (0.16, 0.13, 0.1), "color pale": (0.42, 0.37, 0.3), **RINGS}, "bark",
    {"rings": 9.0, "height": 0.007}, 0.05,
)  # fmt: skip
TWIG = Look("matte", {"color": (0.2, 0.16, 0.11)})
DRY = foliage((0.36, 0.25, 0.12), (0.3, 0.18, 0.06), 0.25)


# ---- trees


def broadleaved(make: Maker, name: str, seed: int, looks: list[Look], size: float, width: float, **more: float) -> Kind:
    leaves = [leaf(make, f"{name} leaf {k}", look, rows=10, width=width) for k, look in enumerate(looks)]
    boughs = [
        bough(make, f"{name} bough {k}", TWIG, leaves, seed + k, length=2.5, branches=8, each=9, size=size, reach=0.72)
        for k in range(4)
    ]
    trees = [
        tree(make, f"{name} {k}", BARK, boughs, seed + 20 + k, height=5.6 + 0.9 * k, arms=14, each=3, **more)
        for k in range(5)
    ]
    return kind(trees, (0.65, 1.1), 0.1, apart=4.2)


def ironwood(make: Maker, seed: int) -> Kind:
    """Casuarina: needles that hang in sprays."""
    sprays = []
    for k, c in enumerate([(0.12, 0.15, 0.07), (0.16, 0.18, 0.08)]):
        rng = make.rng(seed, k)
        plant = make.plant(f"ironwood spray {k}")
        count, t = 32, np.array([-0.3, 0, 0.5, 1.0, 1.4])
        out = rng.normal(size=(count, 1, 2)) * 0.13
        points = np.zeros((count, 5, 3))
        points[:, :, [0, 2]] = out * (np.maximum(t, 0) ** 0.7)[None, :, None] + 0.02 * rng.normal(size=(count, 1, 2))
        points[:, :, 1] = -t * rng.uniform(0.2, 0.42, (count, 1)) + 0.1 * np.maximum(t, 0) * (1 - t)
        look = Look("needle", {"color tone": c})
        widths = np.tile(np.float32([0.011, 0.01, 0.004]), count)
        plant.group.curves(
            points.reshape(-1, 3).astype(np.float32), np.full(count, 5, np.int32), look, basis="catmull-rom",
            widths=widths,
        )  # fmt: skip
        plant.has(curves=count)
        sprays.append(plant)
    boughs = []
    for k in range(4):
        wood = skeleton(
            seed + k, height=2.4, levels=2, branches=14.0, girth=0.012, angle=50.0, reach=0.45, lift=0.2, bare=0.05
        )
        plant = make.plant(f"ironwood bough {k}")
        make.wood(plant, wood, TWIG, 4, 0.5)
        hang(make, plant, wood, sprays, make.rng(seed, 9, k))
        boughs.append(plant)
    trees = [
        tree(
            make, f"ironwood {k}", BARK, boughs, seed + 30 + k, height=9.5 + 1.5 * k, arms=24, each=2, crown=0.25,
            reach=0.32, girth=0.02, angle=64.0, bare=0.16, lift=0.3, outward=0.5, first=0.3,
        )
        for k in range(5)
    ]  # fmt: skip
    return kind(trees, (0.7, 1.1), 0.1, apart=4.2)


def hang(make: Maker, plant: Plant, wood: list, sprays: list[Plant], rng: np.random.Generator) -> None:
    """Sprays along a bough and its branches, straight down whichever way it goes."""
    for level, each in ((wood[0], 5), (wood[1], 4)):
        n = level[0].shape[0]
        here, _ = along(level, 0.15 + 0.85 * (np.arange(each) + rng.random((n, each))) / each)
        for k, child in enumerate(sprays):
            mine = here[k :: len(sprays)]
            lean = 0.35 * rng.normal(size=(len(mine), 2))
            scale = rng.uniform(0.7, 1.1, len(mine))
            make.place(plant, child, matrices(mine, rng.uniform(0, 6.28, len(mine)), scale, lean))


POSES = (72, 52, 34, 16, -4, -26, -48)  # degrees above the horizon at which fronds leave the crown


def palm(make: Maker, seed: int) -> Kind:
    looks = hues((0.13, 0.2, 0.035), (0.26, 0.34, 0.04))
    leaflets = [leaf(make, f"leaflet {k}", look, rows=5, width=0.085, droop=0.3) for k, look in enumerate(looks)]
    fronds = [frond(make, seed + k, pose, leaflets, curves=k in (1, 4)) for k, pose in enumerate(POSES)]
    fronds.append(frond(make, seed + 17, -72, [leaf(make, "dry leaflet", DRY, rows=5, width=0.05)], curves=False))
    nut = make.plant("coconut")
    points, faces = shapes.ball(2)
    look = Look("worn", {"color tone": (0.16, 0.14, 0.03)})
    make.mesh(nut, points * [0.12, 0.15, 0.12], faces, look, normals=shapes.normals(points, faces))
    palms = [one_palm(make, seed + 40 + k, 7.5 + 1.2 * k, fronds, nut) for k in range(8)]
    return kind(palms, (0.85, 1.15), 0.15, apart=3.2)


def frond(make: Maker, seed: int, pose: float, leaflets: list[Plant], curves: bool) -> Plant:
    """From the origin along z, falling as it goes; leaflets as meshes, or all of them as curves."""
    rng = make.rng(seed, 1)
    plant = make.plant(f"frond {pose}")
    length, t = 4.6, np.linspace(0, 1, 13)
    fall = np.radians(pose) - np.radians(62 + 0.25 * abs(pose)) * t**1.3
    step = np.stack([0.03 * rng.normal() * t, np.sin(fall), np.cos(fall)], axis=1) * (length / 12)
    course = np.concatenate([np.zeros((1, 3)), np.cumsum(step[:-1], axis=0)])[None]
    rib = Look("foliage", {"color front": (0.2, 0.19, 0.06), "color through": (0.0, 0.0, 0.0)})
    make.wood(plant, [(course, 0.035 * (1.05 - t)[None])], rib, 4, 0.7)
    count = 52
    s = 0.17 + 0.83 * (np.arange(count) + 0.3 * rng.random(count)) / count
    here, tangent = along((course, None), s[None])
    here, tangent = np.repeat(here, 2, axis=0), np.repeat(tangent, 2, axis=0)
    side = np.tile([-1.0, 1.0], count)[:, None]
    up = np.cross(tangent, np.array([1.0, 0, 0]))
    size = np.repeat(0.28 + 0.62 * np.sin(np.pi * np.clip(0.12 + 0.86 * s, 0, 1)) ** 0.8, 2)
    away = tangent * 0.75 + side * np.array([1.0, 0, 0]) - np.array([0, 0.38, 0]) + 0.1 * rng.normal(size=here.shape)
    if curves:
        away /= np.linalg.norm(away, axis=1, keepdims=True)
        u = np.array([-0.33, 0, 0.33, 0.66, 1.0, 1.33])
        points = here[:, None] + size[:, None, None] * (
            u[:, None] * away[:, None] - np.array([0, 0.3, 0]) * np.maximum(u, 0)[:, None] ** 2
        )
        widths = np.tile(np.float32([0.028, 0.05, 0.042, 0.008]), len(here))
        look = foliage((0.12, 0.18, 0.035), (0.22, 0.3, 0.04))
        plant.group.curves(
            points.reshape(-1, 3).astype(np.float32), np.full(len(here), 6, np.int32), look, basis="catmull-rom",
            widths=widths, normals=np.repeat(up, 6, axis=0).astype(np.float32),
        )  # fmt: skip
        plant.has(curves=len(here))
        return plant
    where = frames(here, away, up + 0.25 * side * np.array([1.0, 0, 0]), size)
    which = rng.integers(len(leaflets), size=len(here))
    for k, child in enumerate(leaflets):
        make.place(plant, child, where[which == k])
    return plant


def one_palm(make: Maker, seed: int, height: float, fronds: list[Plant], nut: Plant) -> Plant:
    """It leans towards x and rises again, as palms at the shore do; fronds by golden angles, the youngest upright."""
    rng = make.rng(seed, 2)
    plant = make.plant(f"palm {height:.0f}")
    t = np.linspace(0, 1, 12)
    lean = rng.uniform(0.25, 0.62) * height
    x = lean * (1.15 * t - 0.4 * t**2.4) + 0.02 * height * np.sin(5 * t)
    course = np.stack([x - x[0], height * t, 0.03 * height * np.sin(4 * t + rng.uniform(0, 6))], axis=1)
    course[:, 2] -= course[0, 2]
    radius = 0.13 * (1 - 0.42 * t) * (1 + 0.75 * np.exp(-14 * t)) + 0.035 * np.exp(-((t - 1) ** 2) / 0.002)
    make.wood(plant, [(course[None], radius[None])], PALM_BARK, make.sides(10), 2 * max(1.0, make.detail))
    top = course[-1]
    count = 31
    poses = np.linspace(0, len(POSES), count, endpoint=False).astype(int)
    turn = np.arange(count) * 2.39996 + 0.2 * rng.normal(size=count) + rng.uniform(0, 6)
    scale = rng.uniform(0.85, 1.1, count) * (0.75 + 0.03 * height)
    for k in range(len(POSES)):
        mine = poses == k
        at = np.tile(top, (mine.sum(), 1))
        make.place(plant, fronds[k], matrices(at, turn[mine], scale[mine], 0.08 * rng.normal(size=(mine.sum(), 2))))
    dead = rng.integers(2, 5)
    at = np.tile(top - [0, 0.1, 0], (dead, 1))
    make.place(plant, fronds[-1], matrices(at, rng.uniform(0, 6.28, dead), np.full(dead, 0.75)))
    nuts = rng.integers(4, 10)
    around = rng.uniform(0, 6.28, nuts)
    at = top + np.stack([0.24 * np.cos(around), rng.uniform(-0.35, -0.12, nuts), 0.24 * np.sin(around)], axis=1)
    make.place(plant, nut, matrices(at, around, rng.uniform(0.8, 1.1, nuts)))
    return plant


# ---- undergrowth


def undergrowth(make: Maker, seed: int) -> Kind:
    shrub_leaves = [leaf(make, f"shrub leaf {k}", x, rows=7, width=0.55, droop=0.1)
                    for k, x in enumerate(hues((0.14, 0.26, 0.05), (0.28, 0.42, 0.06)))]  # fmt: skip
    broad_leaves = [leaf(make, f"broad leaf {k}", x, rows=12, width=0.7, droop=0.45)
                    for k, x in enumerate(hues((0.07, 0.17, 0.03), (0.16, 0.34, 0.04)))]  # fmt: skip
    blade = fern_frond(make)
    made = [shrub(make, seed + k, shrub_leaves) for k in range(5)]
    made += [rosette(make, f"fern {k}", seed + 10 + k, [blade], 11, (0.5, 1.0), 0.9) for k in range(4)]
    made += [rosette(make, f"arum {k}", seed + 20 + k, broad_leaves, 8, (0.45, 0.9), 1.1) for k in range(3)]
    grass = Look("needle", {"color tone": (0.17, 0.19, 0.06)})
    made += [tuft(make, f"tuft {k}", grass, 40 + k, height=0.55, spread=0.09, width=0.008) for k in range(4)]
    return kind(made, (0.6, 1.35), 0.02, [3] * 5 + [1.5] * 4 + [1.2] * 3 + [1.6] * 4, lean=0.1)


def shrub(make: Maker, seed: int, leaves: list[Plant]) -> Plant:
    wood = skeleton(seed, height=0.75, levels=2, branches=9.0, girth=0.02, angle=55.0, reach=0.75, bare=0.05, crown=1.0)
    plant = make.plant(f"shrub {seed}")
    make.wood(plant, wood, TWIG, 4, 0.5)
    leafed(make, plant, wood[1], leaves, 9, 0.17, make.rng(seed, 3), first=0.35)
    leafed(make, plant, wood[0], leaves, 10, 0.15, make.rng(seed, 4), first=0.6)
    return plant


def fern_frond(make: Maker) -> Plant:
    """A unit long along z, rising and falling: pinnae of two quads each on both sides."""
    t = np.linspace(0.12, 1, 17)
    rib = np.stack([0 * t, 0.75 * t - 0.95 * t**2, t], axis=1)
    half = 0.2 * np.sin(np.pi * t**0.8) ** 0.9 + 0.01
    gap = 0.026
    parts = []
    for side in (-1, 1):
        tip = rib + np.stack([side * half, -0.25 * half, 0.35 * half], axis=1)
        middle = 0.5 * (rib + tip) + [0, 0.02, 0]
        ahead, behind = np.array([0, 0, gap]), np.array([0, 0, -gap])
        quads = np.stack([rib + behind, middle + behind, tip, middle + ahead, rib + ahead], axis=1)
        points = quads[:, [0, 1, 3, 4, 1, 2, 2, 3]].reshape(-1, 3)
        faces = np.arange(len(points)).reshape(-1, 4)
        parts.append((points, np.zeros_like(points), faces if side < 0 else faces[:, ::-1]))
    points, _, faces = shapes.joined(parts)
    plant = make.plant("fern frond")
    make.mesh(plant, points, faces, foliage((0.1, 0.22, 0.03), (0.2, 0.38, 0.04)))
    return plant


def rosette(
    make: Maker, name: str, seed: int, leaves: list[Plant], count: int, size: tuple[float, float], rise: float
) -> Plant:
    """Leaves from one place, the youngest upright."""
    rng = make.rng(seed, 6)
    plant = make.plant(name)
    turn = 2.39996 * np.arange(count) + rng.uniform(0, 6)
    steep = rise * (1 - 0.7 * np.arange(count) / count) + 0.1 * rng.normal(size=count)
    away = np.stack([np.cos(turn), steep, np.sin(turn)], axis=1)
    where = frames(np.zeros((count, 3)), away, np.tile([0.0, 1, 0], (count, 1)), rng.uniform(*size, count))
    for k, child in enumerate(leaves):
        make.place(plant, child, where[k :: len(leaves)])
    return plant


# ---- what lies on the ground


def litter(make: Maker, seed: int) -> tuple[Kind, Kind]:
    """On the beach, and below trees."""
    beach, shares = [], []
    tones = [(0.55, 0.5, 0.42), (0.3, 0.27, 0.24), (0.2, 0.18, 0.17), (0.42, 0.33, 0.25), (0.62, 0.58, 0.5)]
    for k in range(10):
        rng = make.rng(seed, k)
        points, faces = shapes.ball(2)
        noise = shapes.Noise(seed + k)
        grown = points * (1 + 0.25 * noise(points * 1.3))[:, None] * rng.uniform([0.7, 0.4, 0.7], [1.3, 0.75, 1.3])
        plant = make.plant(f"pebble {k}")
        look = Look("worn", {"color tone": tones[k % 5]})
        make.mesh(plant, grown, faces, look, normals=shapes.normals(grown, faces))
        beach.append(plant)
        shares.append(6.0)
    beach += [shell(make, k) for k in range(4)] + [rubble(make, seed + k) for k in range(4)]
    shares += [2.0] * 4 + [2.5] * 4
    beach += [stick(make, seed + 60 + k) for k in range(3)]
    shares += [0.8] * 3
    floor = [leaf(make, f"fallen leaf {k}", look, rows=2, width=0.5, droop=0.15 - 0.1 * k)
             for k, look in enumerate([DRY, foliage((0.25, 0.15, 0.07), (0.1, 0.05, 0.02), 0.2),
                                       foliage((0.3, 0.26, 0.08), (0.2, 0.15, 0.03), 0.3)])]  # fmt: skip
    floor += [stick(make, seed + 70 + k) for k in range(2)]
    return (
        kind(beach, (0.012, 0.075), 0.25, shares, lean=0.0, upright=False),
        kind(floor, (0.08, 0.2), 0.0, [4, 4, 3, 0.5, 0.5], lean=0.0, upright=False),
    )


def shell(make: Maker, k: int) -> Plant:
    """A fan, ribbed, its hollow down."""
    u, v = np.meshgrid(np.linspace(-1, 1, 7), np.linspace(0.05, 1, 4))
    ribs = 1 + 0.06 * np.cos(9 * u + k)
    points = np.stack(
        [0.9 * u * v**0.7 * ribs, 0.45 * np.sqrt(np.clip(1.02 - u**2, 0, 1)) * v * (1.4 - v), v - 0.5], -1
    )
    points = points.reshape(-1, 3)
    plant = make.plant(f"shell {k}")
    tone = [(0.75, 0.66, 0.56), (0.72, 0.52, 0.42), (0.8, 0.76, 0.7), (0.6, 0.5, 0.46)][k]
    look = Look("worn", {"color tone": tone, "float roughness": 0.3})
    make.mesh(plant, points, shapes.lattice_faces(4, 7), look)
    return plant


def rubble(make: Maker, seed: int) -> Plant:
    """A broken branch of coral."""
    wood = skeleton(seed, height=1.6, levels=2, branches=4.0, girth=0.1, taper=0.3, reach=0.5, bare=0.2, lift=0.1)
    wood = [(course[..., [1, 0, 2]] + [-0.8, 0.16, 0], radius) for course, radius in wood]
    plant = make.plant(f"rubble {seed}")
    make.wood(plant, wood, Look("matte", {"color": (0.68, 0.62, 0.54)}), 5, 0.4)
    return plant


def stick(make: Maker, seed: int) -> Plant:
    """Driftwood, lying along x."""
    rng = make.rng(seed, 8)
    t = np.linspace(0, 1, 6)
    course = np.stack([5 * (t - 0.5), 0.18 + 0.1 * np.sin(3 * t + rng.uniform(0, 6)), 0.3 * np.sin(4 * t)], axis=1)
    plant = make.plant(f"stick {seed}")
    make.wood(plant, [(course[None], (0.17 * (1.1 - 0.6 * t))[None])], Look("matte", {"color": (0.38, 0.34, 0.29)}), 5)
    return plant
