"""The island as a scene: exemplars, ground and sea, and what stands where."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

import kanuka
from kit import plants, shapes
from kit.places import CHUNK, Cells, apart, filled, matrices, scattered
from kit.sinks import Look, Nothing

from . import exemplars as made
from . import plan, stones
from .cameras import CAMERAS, eyes
from .island import CELL, SIDE, Ground, Island, smooth

SHADERS = Path(__file__).resolve().parent / "shaders"
TILE = 256  # quads along a side of a piece of the ground
SUN = (-0.74, 0.30, 0.36)  # late: 20 degrees high, from the left of the shore
FAR = 12_000.0
SEA_CELLS = 216  # along a side of the part of the sea that is near, 6 m each


def exemplar_kinds(make: plants.Maker) -> dict[str, made.Kind]:
    beach, floor = made.litter(make, 700)
    return {
        "palm": made.palm(make, 100),
        "hau": made.broadleaved(
            make, "hau", 200, made.hues((0.12, 0.23, 0.035), (0.26, 0.42, 0.05)), 0.19, 0.85,
            reach=0.6, crown=1.0, angle=68.0,
        ),
        "kamani": made.broadleaved(
            make, "kamani", 300, made.hues((0.055, 0.13, 0.022), (0.12, 0.24, 0.025)), 0.19, 0.5,
            reach=0.62, crown=1.0, angle=70.0,
        ),
        "ironwood": made.ironwood(make, 400),
        "undergrowth": made.undergrowth(make, 500),
        "beach": beach,
        "floor": floor,
    }  # fmt: skip


def detail(scale: float) -> float:
    return max(0.75, (scale / 0.01) ** 0.25)


def sums(make: plants.Maker) -> dict[str, int]:
    return {name: sum(getattr(p, name) for p in make.made) for name in ("quads", "curves", "rows")}


def count(scale: float, seed: int = 1) -> plan.Plan:
    """The numbers alone; what is small is made, and forgotten."""
    make = plants.Maker(Nothing(), seed, detail(scale))
    kinds = exemplar_kinds(make)
    return plan.planned(scale, kinds, sums(make), water_quads(sea_mesh(Island(seed))))


def build(sink: object, scale: float, seed: int = 1) -> plan.Plan:
    island = Island(seed)
    make = plants.Maker(sink, seed, detail(scale))
    kinds = exemplar_kinds(make)
    water = sea_mesh(island)
    numbers = plan.planned(scale, kinds, sums(make), water_quads(water))
    rocks = [stones.rock(make, 800 + k, numbers.rock_side) for k in range(plan.ROCK_KINDS)]
    corals = [stones.coral(make, 900 + k, numbers.coral_side) for k in range(plan.CORAL_KINDS)]
    kinds["rock"] = made.kind(rocks, (0.35, 2.1), 0.35, lean=0.3)
    kinds["coral"] = made.kind(corals, (0.3, 1.3), 0.45, lean=0.1)
    ground = island.ground(numbers.ground_rows, numbers.ground_columns)
    lay_ground(sink, ground, island)
    lay_water(sink, *water)
    cells = shares_of_cells(island)
    for salt, (name, many) in enumerate(numbers.placed.items()):
        place(sink, Placing(name, kinds[name], many, cells(name, int(many.sum())), seed, salt), ground, island)
    grass(sink, numbers, cells("grass", numbers.blades), ground, seed)
    return numbers


# ---- ground and sea


def lay_ground(sink: object, ground: Ground, island: Island) -> None:
    """In tiles that share their borders' points; with smooth normals where quads are coarse, and dunes."""
    x, z = (axis.astype(np.float32) for axis in ground.axes())
    rows, columns = ground.heights.shape
    normals = ground.normals() if SIDE / columns > 0.9 else None
    look = Look("ground", {}, "ground", {}, 2.0)
    shore = Ground(island.inland)
    for top in range(0, rows - 1, TILE):
        for left in range(0, columns - 1, TILE):
            part = slice(top, min(top + TILE, rows - 1) + 1), slice(left, min(left + TILE, columns - 1) + 1)
            high = ground.heights[part]
            points = np.empty((*high.shape, 3), np.float32)
            points[..., 0], points[..., 1], points[..., 2] = x[part[1]], high, z[part[0]][:, None]
            faces = shapes.lattice_faces(*high.shape, over=True)
            more = {} if normals is None else {"normals": normals[part].reshape(-1, 3)}
            dunes = sandy(points[..., 0], shore.height(points[..., 0], points[..., 2])).reshape(-1)
            if dunes.any():
                more["primvars"] = {"vertex float dune": dunes.astype(np.float32)}
            sink.mesh(points.reshape(-1, 3), faces, look, name=f"ground {top} {left}", **more)


def sea_mesh(island: Island) -> tuple[np.ndarray, np.ndarray, dict[str, np.ndarray]]:
    """The water: a lattice that is fine about the island, without what lies under it. Depth, and where waves break."""
    near = np.linspace(-3.0 * SEA_CELLS, 3.0 * SEA_CELLS, SEA_CELLS + 1)
    away = near[-1] + np.geomspace(12, FAR - near[-1], 18)
    axis = np.concatenate([-away[::-1], near, away])
    x, z = np.meshgrid(axis, axis)
    within = np.clip(x, -SIDE / 2, SIDE / 2), np.clip(z, -SIDE / 2, SIDE / 2)
    high, inland = Ground(island.base).height(*within), Ground(island.inland).height(*within)
    depth = np.where(np.maximum(np.abs(x), np.abs(z)) > SIDE / 2, 30.0, -high)
    points = np.stack([x, 0 * x, z], axis=-1).reshape(-1, 3).astype(np.float32)
    faces = shapes.lattice_faces(len(axis), len(axis), over=True)
    depth = depth.reshape(-1).astype(np.float32)
    surf = (smooth(-158, -176, inland) * smooth(-206, -188, inland)).reshape(-1).astype(np.float32)
    wet = depth[faces].max(axis=1) > -0.25
    used, corners = np.unique(faces[wet], return_inverse=True)
    values = {"vertex float depth": depth[used], "vertex float surf": surf[used]}
    return points[used], corners.reshape(-1, 4).astype(np.int32), values


def water_quads(water: tuple) -> int:
    return len(water[1]) + 1  # and the abyss


def lay_water(sink: object, points: np.ndarray, faces: np.ndarray, values: dict[str, np.ndarray]) -> None:
    """Sunlight goes straight through the surface, and what lies below is lit: no caustics, and no noise of theirs."""
    look = Look("sea", {}, "sea", {}, 1.5)
    sink.mesh(points, faces, look, primvars=values, name="sea", shadows_off=["sun"])
    far = np.float32([[-FAR, -35, -FAR], [-FAR, -35, FAR], [FAR, -35, FAR], [FAR, -35, -FAR]])
    deep = Look("matte", {"color": (0.01, 0.035, 0.06)})
    sink.mesh(far, np.array([[0, 1, 2, 3]], np.int32), deep, name="abyss")


# ---- where


def shares_of_cells(island: Island):
    """A function: the cells of some things of a kind. What the cameras see near by is filled first."""
    inner = np.s_[:-1, :-1]
    x, z = island.x[inner] + CELL / 2, island.z[inner] + CELL / 2
    inland, high, slope = island.inland[inner], island.base[inner], island.slope[inner]
    some, other = island.patches[inner], island.other_patches[inner]
    liked = 1e-4 + sum(1 / (1 + (np.hypot(x - e[0], z - e[1]) / e[2]) ** 2) ** 2.2 for e in eyes())
    flat, above = slope < 1.0, high > 1.7
    clear = np.ones_like(x)
    for camera in CAMERAS.values():  # nothing right before the lens
        clear *= smooth(3.5, 11, np.hypot(x - camera.origin[0], z - camera.origin[2]))
    open_, woods = 1 - sandy(x, inland), above * flat * smooth(20, 38, inland)
    rooms = {  # things a square metre
        "palm": above * flat * smooth(15, 24, inland) * (1 - 0.75 * smooth(42, 80, inland)) * (1.15 + some)
        * (0.15 + 0.85 * open_) * 0.016,
        "hau": woods * smooth(30, 52, inland) * (1.1 + some) * open_ * 0.013,
        "kamani": woods * smooth(36, 70, inland) * (1.1 - some) * open_ * 0.013,
        "ironwood": woods * smooth(24, 60, inland) * smooth(-0.4, 0.4, other) * (0.05 + 0.95 * open_) * 0.015,
        "undergrowth": woods * (1.05 + other) * (0.03 + 0.97 * open_) * 9,
        "floor": woods * (1.2 + some) * 12,
        "beach": ((high > -0.6) & flat) * smooth(-16, 2, inland) * (1 - smooth(20, 42, inland)) * (1.1 + other) * 60,
        "rock": headlands(x, z) * smooth(-34, -8, inland) * (1 - smooth(12, 40, inland)) + 0.25 * (slope > 1.1),
        "coral": ((high < -0.95) & (high > -6)) * smooth(-0.1, 0.5, other) * smooth(-28, -44, inland),
        "grass": above * flat * (sandy(x, inland) * (1.3 + other)
        + 0.04 * smooth(17, 24, inland) * (1 - smooth(40, 60, inland))) * 70,
    }  # fmt: skip
    boost = {"coral": 0.2, "rock": 0.3}  # of how much the liking counts

    def cells(name: str, things: int) -> Cells:
        room = np.maximum(rooms[name], 0) * (clear if name not in ("beach", "floor", "coral") else 1.0)
        return Cells((-SIDE / 2, -SIDE / 2), CELL, filled(room * CELL**2, liked ** boost.get(name, 1.0), things))

    return cells


def sandy(x: np.ndarray, inland: np.ndarray) -> np.ndarray:
    """1 on the dunes, 0 elsewhere."""
    return smooth(60, 110, x) * smooth(12, 26, inland) * (1 - smooth(90, 130, inland))


def headlands(x: np.ndarray, z: np.ndarray) -> np.ndarray:
    return np.exp(-(((np.abs(x + 8) - 205) / 60) ** 2)) * smooth(150, 300, z)


@dataclass(frozen=True)
class Placing:
    name: str
    kind: made.Kind
    many: np.ndarray
    cells: Cells
    seed: int
    salt: int


def place(sink: object, p: Placing, ground: Ground, island: Island) -> None:
    rng = np.random.default_rng([p.seed, 11, p.salt])
    if p.kind.apart > 0:  # from one another, of whichever exemplar they are
        all_of_them = apart(p.cells, int(p.many.sum()), p.kind.apart, rng)
    for number, (plant, many) in enumerate(zip(p.kind.exemplars, p.many.tolist(), strict=True)):
        rng = np.random.default_rng([p.seed, 11, p.salt, number])
        if p.kind.apart > 0:
            mine, all_of_them = all_of_them[:many], all_of_them[many:]
            sink.instances(plant.group, standing(p, mine, ground, island, rng))
            continue
        for first in range(0, many, CHUNK):
            xz = scattered(p.cells, min(CHUNK, many - first), rng)
            sink.instances(plant.group, standing(p, xz, ground, island, rng))


def standing(
    p: Placing, xz: np.ndarray, ground: Ground, island: Island, rng: np.random.Generator
) -> np.ndarray:  # fmt: skip
    """Matrices of things at x and z: on the ground, less what they sink."""
    n = len(xz)
    x, z = xz[:, 0], xz[:, 1]
    low, high = p.kind.size
    size = (low + (high - low) * rng.random(n) ** (1 if p.kind.upright else 2.2)).astype(np.float32)
    y = ground.height(x, z) - p.kind.sink * size
    turn = rng.uniform(0, 2 * np.pi, n).astype(np.float32)
    if p.name == "palm":  # to the light over the water
        turn = seaward(island, x, z) + rng.normal(0, 0.55, n).astype(np.float32)
    where = np.stack([x, y, z], axis=1)
    if p.kind.upright:
        return matrices(where, turn, size, p.kind.lean * rng.normal(size=(n, 2)).astype(np.float32))
    step = 0.4
    dx = (ground.height(x + step, z) - ground.height(x - step, z)) / (2 * step)
    dz = (ground.height(x, z + step) - ground.height(x, z - step)) / (2 * step)
    return matrices(where, turn, size, up=np.stack([-dx, np.ones(n), -dz], axis=1).astype(np.float32))


def seaward(island: Island, x: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Turns about y that take x to the nearest water."""
    shore = Ground(island.inland)
    dx, dz = shore.height(x + 6, z) - shore.height(x - 6, z), shore.height(x, z + 6) - shore.height(x, z - 6)
    return np.arctan2(dz, -dx).astype(np.float32)


def grass(sink: object, numbers: plan.Plan, cells: Cells, ground: Ground, seed: int) -> None:
    """Blades one by one, in tufts of a dozen; where there are few they are wider."""
    rng = np.random.default_rng([seed, 12])
    width = 0.008 * (0.01 / numbers.scale) ** 0.25
    looks = [Look("needle", {"color tone": tone}) for tone in ((0.3, 0.27, 0.12), (0.24, 0.26, 0.1), (0.36, 0.3, 0.15))]
    piece = 120_000
    for number, first in enumerate(range(0, numbers.blades, piece)):
        many = min(piece, numbers.blades - first)
        roots = scattered(cells, -(-many // 12), rng)
        xz = (roots[:, None] + rng.normal(size=(len(roots), 12, 2)) * 0.09).reshape(-1, 2)[:many]
        points, widths, counts = plants.blades(
            rng, xz, 0.8, width, ground.height(xz[:, 0], xz[:, 1]).astype(np.float32)
        )
        sink.curves(
            points.reshape(-1, 3), counts, looks[number % 3], basis="catmull-rom", widths=widths, name=f"grass {number}"
        )


# ---- light and camera


def staged(scene: kanuka.Scene, camera: str = "shore") -> kanuka.Scene:
    """With its light, its camera and what a picture of it needs."""
    scene.resolution = 1024, 429
    scene.options.max_depth = 5
    scene.options.shader_path = [str(SHADERS)]
    scene.options.clamp_indirect = 20
    scene.options.exposure_gain = 0.1
    scene.add_light("sky", sun=SUN, turbidity=3.2, name="sky")
    scene.add_light("sun", sun=SUN, turbidity=3.2, name="sun")
    scene.camera = CAMERAS[camera].camera()
    return scene
