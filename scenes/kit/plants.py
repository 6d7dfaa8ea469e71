"""Plants in levels: leaves on boughs, boughs on trees.

All grow along y from the origin. Detail is a factor of the sides and rings of wood; leaves are what they are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kanuka.procedurals import trees
from kanuka.procedurals.parameters import read
from kanuka.procedurals.surface import across, unit

from . import shapes
from .places import frames
from .sinks import Look

GOLDEN = trees.GOLDEN


@dataclass
class Plant:
    """A group, and counts: of its own, and with all that its instances come to."""

    group: object
    quads: int = 0
    curves: int = 0
    rows: int = 0  # instances as they are stored: a matrix each
    primitives: int = 0  # quads and curves with all instances
    all_rows: int = 0

    def has(self, quads: int = 0, curves: int = 0) -> None:
        self.quads += quads
        self.curves += curves
        self.primitives += quads + curves

    def places(self, child: Plant, count: int) -> None:
        self.rows += count
        self.all_rows += count * (1 + child.all_rows)
        self.primitives += count * child.primitives


class Maker:
    """Makes groups of a sink, and knows all of them."""

    def __init__(self, sink: object, seed: int, detail: float) -> None:
        self.sink, self.seed, self.detail = sink, seed, detail
        self.made: list[Plant] = []

    def rng(self, *salt: int) -> np.random.Generator:
        return np.random.default_rng([self.seed, *salt])

    def plant(self, name: str) -> Plant:
        made = Plant(self.sink.group(name))
        self.made.append(made)
        return made

    def mesh(self, plant: Plant, points: np.ndarray, faces: np.ndarray, look: Look, **more: object) -> None:
        plant.group.mesh(points.astype(np.float32), faces, look, **more)
        plant.has(quads=len(faces))

    def place(self, plant: Plant, child: Plant, where: np.ndarray) -> None:
        if len(where):
            plant.group.instances(child.group, where)
            plant.places(child, len(where))

    def sides(self, usual: int) -> int:
        return max(3, round(usual * min(self.detail, 2.0)))

    def wood(self, plant: Plant, levels: list, look: Look, sides: int, fine: float = 1) -> None:
        """Tubes along courses; each level has fewer sides."""
        parts = []
        for level, (course, radius) in enumerate(levels):
            rings = max(3, round(course.shape[1] * fine))
            points, normals, faces = shapes.tubes(*shapes.longer(course, radius, rings), max(3, sides - 2 * level))
            parts.append((points, normals, faces))
        points, normals, faces = shapes.joined(parts)
        self.mesh(plant, points, faces, look, normals=normals)


def skeleton(rng_seed: int, **given: object) -> list[tuple[np.ndarray, np.ndarray]]:
    """Branches by the procedural `trees`, along y."""
    p = read(trees.PARAMETERS, "", {"seed": rng_seed, **given})
    levels = trees.branches(p, np.random.default_rng(rng_seed))
    return [(trees.turn_up(course, "y"), radius) for course, radius in levels]


def along(level: tuple[np.ndarray, np.ndarray], s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points and tangents at parameters s (branches, each) in [0, 1] of a level's branches; flat."""
    course = level[0]
    n, points = course.shape[:2]
    at = np.clip(s, 0, 1) * (points - 1)
    i = np.minimum(at.astype(int), points - 2)
    f = (at - i)[..., None]
    row = np.arange(n)[:, None]
    here = course[row, i] * (1 - f) + course[row, i + 1] * f
    return here.reshape(-1, 3), unit(course[row, i + 1] - course[row, i]).reshape(-1, 3)


def turned(tangent: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Directions at right angles to tangents."""
    side, other = across(tangent)
    return np.cos(turn)[:, None] * side + np.sin(turn)[:, None] * other


def leaf(
    make: Maker, name: str, look: Look, *, rows: int = 4, width: float = 0.45, droop: float = 0.25, **more: object
) -> Plant:
    """A leaf a unit long along z."""
    plant = make.plant(name)
    points, faces = shapes.blade(rows, width, 0.25, droop)
    st = np.stack([0.5 + points[:, 0], points[:, 2]], axis=1)
    make.mesh(
        plant, points, faces, look, normals=shapes.normals(points, faces), primvars={"vertex float[2] st": st}, **more
    )
    return plant


def leafed(
    make: Maker, plant: Plant, level: tuple[np.ndarray, np.ndarray], leaves: list[Plant], each: int, size: float,
    rng: np.random.Generator, *, first: float = 0.1, forward: float = 0.6, skyward: float = 1.0,
) -> None:  # fmt: skip
    """Leaves of some kinds along the branches of a level, `each` a branch, turned to the sky."""
    n = level[0].shape[0]
    s = first + (1 - first) * (np.arange(each) + 0.8 * rng.random((n, each))) / each
    here, tangent = along(level, s)
    turn = (GOLDEN * np.arange(each) + 2 * np.pi * rng.random((n, 1))).reshape(-1)
    out = turned(tangent, turn)
    away = forward * tangent + out + 0.3 * rng.normal(size=out.shape) + np.array([0, -0.2, 0])
    up = np.array([0, skyward, 0]) + 0.35 * rng.normal(size=out.shape)
    where = frames(here, away, up, size * rng.uniform(0.65, 1.3, len(here)))
    kind = rng.integers(len(leaves), size=len(here))
    for k, child in enumerate(leaves):
        make.place(plant, child, where[kind == k])


def bough(
    make: Maker, name: str, bark: Look, leaves: list[Plant], seed: int, *, length: float, branches: int, each: int,
    size: float, levels: int = 3, **given: object,
) -> Plant:  # fmt: skip
    """A bough along y with its twigs and leaves."""
    shape = {
        "height": length, "levels": levels, "branches": float(branches), "bare": 0.12, "girth": 0.014, "angle": 48.0,
        "reach": 0.42, "wander": 0.35, "lift": 0.1, "crown": 0.6,
    } | given  # fmt: skip
    wood = skeleton(seed, **shape)
    plant = make.plant(name)
    make.wood(plant, wood, bark, 5, 0.5)
    leafed(make, plant, wood[-1], leaves, each, size, make.rng(seed, 3))
    return plant


def tree(
    make: Maker, name: str, bark: Look, boughs: list[Plant], seed: int, *, height: float, arms: int, each: int,
    size: tuple[float, float] = (0.8, 1.2), outward: float = 0.9, first: float = 0.35, **given: object,
) -> Plant:  # fmt: skip
    """Trunk and arms in one mesh; boughs along the arms, `each` an arm, and at the top of the trunk."""
    shape = {
        "height": height, "levels": 2, "branches": float(arms), "bare": 0.3, "girth": 0.034, "angle": 58.0,
        "reach": 0.5, "wander": 0.3, "lift": 0.4, "crown": 0.9,
    } | given  # fmt: skip
    wood = skeleton(seed, **shape)
    rng = make.rng(seed, 5)
    plant = make.plant(name)
    make.wood(plant, wood, bark, make.sides(9), max(1.0, make.detail))
    for level, count, low in ((wood[1], each, first), (wood[0], max(3, arms // 4), 0.72)):
        n = level[0].shape[0]
        s = low + (1 - low) * (np.arange(count) + 0.7 * rng.random((n, count))) / count
        here, tangent = along(level, s)
        turn = (GOLDEN * np.arange(count) + 2 * np.pi * rng.random((n, 1))).reshape(-1)
        away = tangent + outward * turned(tangent, turn) * (1 - 0.6 * np.clip(s.reshape(-1, 1) - low, 0, 1))
        away = away + 0.2 * rng.normal(size=away.shape) + np.array([0, 0.15, 0])
        scale = rng.uniform(*size, len(here))
        where = upright(here, away, rng.uniform(0, 2 * np.pi, len(here)), scale)
        kind = rng.integers(len(boughs), size=len(here))
        for k, child in enumerate(boughs):
            make.place(plant, child, where[kind == k])
    return plant


def upright(where: np.ndarray, up: np.ndarray, turn: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Matrices of things whose y goes along `up`, any way, turned about it."""
    up = unit(up)
    side = turned(up, turn)
    out = np.stack([side, up, np.cross(side, up), where], axis=2)
    out[:, :, :3] *= scale[:, None, None]
    return out.astype(np.float32)


def tuft(make: Maker, name: str, look: Look, count: int, *, height: float, spread: float, width: float) -> Plant:
    """Blades of grass as curves."""
    rng = make.rng(count, 7)
    plant = make.plant(name)
    points, widths, counts = blades(rng, rng.normal(size=(count, 2)) * spread, height, width)
    plant.group.curves(points.reshape(-1, 3), counts, look, basis="catmull-rom", widths=widths)
    plant.has(curves=count)
    return plant


def blades(
    rng: np.random.Generator, where: np.ndarray, height: float, width: float, base: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Bent blades that stand at x and z (N, 2), at heights `base`: points (N, 5, 3), widths (4 a blade), counts."""
    n = len(where)
    tall = height * rng.uniform(0.55, 1.25, n)
    turn = rng.uniform(0, 2 * np.pi, n)
    bend = rng.uniform(0.15, 0.75, n)
    t = np.array([-0.25, 0, 0.4, 0.75, 1.0])  # the first is a control point: a curve begins at its second
    arch = bend[:, None] * np.maximum(t, -0.05) ** 2
    points = np.empty((n, 5, 3), np.float32)
    points[:, :, 0] = where[:, :1] + np.cos(turn)[:, None] * arch * tall[:, None]
    points[:, :, 2] = where[:, 1:] + np.sin(turn)[:, None] * arch * tall[:, None]
    points[:, :, 1] = tall[:, None] * (t - 0.45 * bend[:, None] * np.maximum(t, 0) ** 2)
    if base is not None:
        points[:, :, 1] += base[:, None]
    # A Catmull-Rom curve ends at its last but one.
    points = np.concatenate([points, 2 * points[:, -1:] - points[:, -2:-1]], axis=1)
    widths = width * np.array([1.0, 0.9, 0.6, 0.12], np.float32) * rng.uniform(0.7, 1.3, n)[:, None].astype(np.float32)
    return points, widths.reshape(-1).astype(np.float32), np.full(n, 6, np.int32)
