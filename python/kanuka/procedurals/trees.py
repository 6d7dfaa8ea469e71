"""Trees with leaves: branches that divide by rule and chance, as one mesh of wood and one of leaves."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from . import rib
from .parameters import Parameter, read
from .surface import across, rings, unit

PARAMETERS = (
    Parameter("seed", 1, "another seed, another tree of the same kind", 0),
    Parameter("height", 6.0, "of the trunk; the tree stands on the origin", 1e-6),
    Parameter("up", "y", "axis that it grows along", choices=("x", "y", "z")),
    Parameter("levels", 4, "trunk, boughs, branches, twigs", 1, 6),
    Parameter("girth", 0.028, "radius of the trunk's foot, as part of the height", 1e-4, 0.5),
    Parameter("taper", 0.75, "part of the radius that a branch loses on its way", 0, 1),
    Parameter("bare", 0.28, "part of the trunk without boughs", 0, 0.95),
    Parameter("branches", 20.0, "that a trunk bears; each level bears fewer", 0, 200),
    Parameter("fewer", 0.65, "factor of their number from level to level", 0.05, 2),
    Parameter("reach", 0.5, "length of boughs, as part of the trunk", 0.01, 2),
    Parameter("shorter", 0.55, "the same from level to level after them", 0.01, 1),
    Parameter("angle", 62.0, "degrees between a branch and what bears it", 0, 170),
    Parameter("crown", 0.8, "shape: 0 is a cone, 1 a ball, between them an egg", 0, 1),
    Parameter("wander", 0.25, "how crooked branches are", 0, 2),
    Parameter("lift", 0.35, "how branches turn up on their way; below 0 they hang", -3, 3),
    Parameter("sides", 8, "of the trunk; thinner branches have fewer, at least 3", 3, 64),
    Parameter("leaves", 13.0, "a twig; 0 = a bare tree", 0, 1000),
    Parameter("leafsize", 0.17, "length of a leaf", 1e-6),
    Parameter("leafshape", 0.5, "width of a leaf, as part of its length", 0.01, 2),
    Parameter("leafcolor", (0.15, 0.30, 0.06), "primvar `front` of leaves: what they reflect"),
    Parameter("leafglow", (0.30, 0.45, 0.05), "primvar `through`: what they let through"),
    Parameter("colorvariation", 0.3, "part of the leaves' colours that varies", 0, 1),
    Parameter("leafsurface", "leaf", "surface shader of the leaves; wood has that of the Procedural"),
)
NAMES = {p.name for p in PARAMETERS}
GOLDEN = np.pi * (3 - np.sqrt(5))  # leaves and branches turn by it, so that none is above another


def expand(request) -> bytes:
    p = read(PARAMETERS, request.data, {k: v for k, v in request.parameters.items() if k in NAMES})
    rng = np.random.default_rng(p.seed)
    levels = branches(p, rng)
    parts = [wood(levels, p)]
    if p.leaves > 0:
        parts += leaves(levels[-1], p, rng)
    return b"".join(parts)


def turn_up(v: np.ndarray, up: str) -> np.ndarray:
    """Trees grow along z here; `up` is the scene's."""
    return {"z": v, "y": v[..., [1, 2, 0]], "x": v[..., [2, 0, 1]]}[up]


def branches(p: SimpleNamespace, rng: np.random.Generator) -> list[tuple[np.ndarray, np.ndarray]]:
    """Of every level: points (branches, points, 3) and radii (branches, points)."""
    start, direction = np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]])
    length, radius = np.array([p.height]), np.array([p.height * p.girth])
    levels = []
    for level in range(p.levels):
        n, points = len(start), max(5, 13 - 3 * level)
        t = np.linspace(0, 1, points)
        # Course: straight, off it by a random walk that is smooth, up by the sine of the way.
        walk = np.cumsum(rng.normal(size=(n, points - 1, 3)), axis=1) * (p.wander * (0.35 if level == 0 else 0.8))
        walk /= np.sqrt(points)
        lift = np.zeros(3)
        lift[2] = p.lift if level else 0.3
        d = unit(direction[:, None] + walk + lift * t[1:, None])
        steps = d * (length / (points - 1))[:, None, None]
        course = np.concatenate([np.zeros((n, 1, 3)), np.cumsum(steps, axis=1)], axis=1) + start[:, None]
        thick = radius[:, None] * (1 - p.taper * t - (1 - p.taper) * 0.9 * (t > 0.999))
        if level == 0:  # the foot widens
            thick = thick * (1 + 0.7 * np.exp(-18 * t))
        levels.append((course, thick))
        if level + 1 == p.levels:
            break
        # Children: along the parent by a golden angle; longer in the middle of a ball, at the foot of a cone.
        each = max(1, round(p.branches * p.fewer**level)) if p.branches > 0 else 0
        if each == 0 or n == 0:
            break
        if n * each > 400_000:
            raise ValueError(f"{n * each} branches on level {level + 2}: give fewer branches, or fewer levels")
        low = p.bare if level == 0 else 0.15
        s = (np.arange(each) + rng.random((n, each))) / each
        at = low + (0.98 - low) * s
        grid = at * (points - 1)
        i = np.minimum(grid.astype(int), points - 2)
        f = (grid - i)[:, :, None]
        row = np.arange(n)[:, None]
        here = course[row, i] * (1 - f) + course[row, i + 1] * f
        tangent = d[row, i]
        girth = thick[row, i] * (1 - f[..., 0]) + thick[row, i + 1] * f[..., 0]
        cone, ball = 1 - 0.85 * s, np.sqrt(np.clip(1 - (1.7 * s - 0.65) ** 2, 0.04, 1))
        shape = cone + (ball - cone) * p.crown if level == 0 else 1 - 0.5 * s
        ratio = p.reach if level == 0 else p.shorter
        turn = GOLDEN * np.arange(each) + 2 * np.pi * rng.random((n, 1)) + 0.35 * rng.normal(size=(n, each))
        side, up = across(tangent)
        out = np.cos(turn)[..., None] * side + np.sin(turn)[..., None] * up
        angle = np.radians(p.angle) * (1 - 0.45 * s) * (1 + 0.15 * rng.normal(size=(n, each)))
        direction = unit(np.cos(angle)[..., None] * tangent + np.sin(angle)[..., None] * out).reshape(-1, 3)
        start = here.reshape(-1, 3)
        longest = length[:, None] * ratio * shape * (0.8 + 0.4 * rng.random((n, each)))
        # No thicker than what it grows from; a branch's girth goes with its length (Leonardo's rule, loosely).
        radius = np.minimum(0.75 * girth, 0.6 * girth * (longest / length[:, None]) ** 0.6 * 1.6).reshape(-1)
        length = longest.reshape(-1)
    return levels


def wood(levels: list[tuple[np.ndarray, np.ndarray]], p: SimpleNamespace) -> bytes:
    """Tubes with normals."""
    points, normals, st, faces, base = [], [], [], [], 0
    for level, (course, thick) in enumerate(levels):
        n, k = thick.shape
        sides = max(3, p.sides - 2 * level)
        around_course, arm, angle = rings(course, thick, sides)
        points.append(around_course.reshape(-1, 3))
        normals.append(arm.reshape(-1, 3))
        run = np.linalg.norm(np.diff(course, axis=1), axis=2).cumsum(axis=1)
        run = np.concatenate([np.zeros((n, 1)), run], axis=1)
        around = np.broadcast_to(angle / (2 * np.pi), (n, k, sides))
        st.append(np.stack([around, np.broadcast_to(run[:, :, None], (n, k, sides))], axis=-1).reshape(-1, 2))
        ring = base + (np.arange(n)[:, None, None] * k + np.arange(k - 1)[:, None]) * sides
        i, j = np.arange(sides), (np.arange(sides) + 1) % sides
        faces.append(np.stack([ring + i, ring + j, ring + sides + j, ring + sides + i], axis=-1).reshape(-1, 4))
        base += n * k * sides
    faces = np.concatenate(faces)
    return rib.mesh(
        np.full(len(faces), 4),
        faces,
        turn_up(np.concatenate(points), p.up),
        {
            "vertex normal N": turn_up(np.concatenate(normals), p.up),
            "vertex float[2] st": np.concatenate(st),
        },
    )


# A leaf of length 1 along x, z is its upper side: pointed, folded along its rib, drooping at the tip.
LEAF = np.array(
    [
        [0.0, 0.0, 0.0],
        [0.22, -0.36, 0.07], [0.25, 0.0, 0.0], [0.22, 0.36, 0.07],
        [0.58, -0.42, 0.04], [0.60, 0.0, -0.04], [0.58, 0.42, 0.04],
        [1.0, 0.0, -0.16],
    ]
)  # fmt: skip
LEAF_FACES = np.array(
    [[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2], [2, 5, 6], [2, 6, 3], [4, 7, 5], [5, 7, 6]]
)  # fmt: skip


def leaves(twigs: tuple[np.ndarray, np.ndarray], p: SimpleNamespace, rng: np.random.Generator) -> list[bytes]:
    course, _ = twigs
    n, points = course.shape[:2]
    each = max(1, round(p.leaves))
    if n * each > 20_000_000:
        raise ValueError(f"{n * each} leaves are too many; give fewer leaves, branches or levels")
    s = (np.arange(each) + 0.7 * rng.random((n, each))) / each
    grid = (0.1 + 0.9 * s) * (points - 1)
    i = np.minimum(grid.astype(int), points - 2)
    f = (grid - i)[:, :, None]
    row = np.arange(n)[:, None]
    here = (course[row, i] * (1 - f) + course[row, i + 1] * f).reshape(-1, 3)
    tangent = unit(course[row, i + 1] - course[row, i]).reshape(-1, 3)
    turn = (GOLDEN * np.arange(each) + 2 * np.pi * rng.random((n, 1))).reshape(-1)
    side, up = across(tangent)
    out = np.cos(turn)[:, None] * side + np.sin(turn)[:, None] * up
    along = unit(0.6 * tangent + out + 0.35 * rng.normal(size=out.shape) - np.array([0, 0, 0.25]))
    normal = np.array([0, 0, 1.0]) + 0.35 * rng.normal(size=out.shape)  # leaves turn to the sky
    wide = unit(np.cross(normal, along))
    normal = np.cross(along, wide)
    size = p.leafsize * (0.65 + 0.7 * rng.random(len(here)))[:, None, None]
    shape = LEAF * [1, p.leafshape, 1]
    frame = np.stack([along, wide, normal], axis=1)  # rows
    stalk = 0.12
    corners = here[:, None] + size * (np.matmul(shape + np.array([stalk, 0, 0]), frame))
    count = len(here)
    faces = (LEAF_FACES + np.arange(count)[:, None, None] * len(LEAF)).reshape(-1, 3)
    # A leaf's colours: lighter and yellower, or darker, each by itself; the same for both sides.
    bright = 1 + p.colorvariation * (2 * rng.random((count, 1)) - 1)
    yellow = p.colorvariation * rng.random((count, 1)) * np.array([0.9, 0.25, -0.3])

    def colors(base: tuple[float, ...]) -> np.ndarray:
        return np.repeat(np.clip(np.array(base) * bright * (1 + yellow), 0, 1), len(LEAF_FACES), axis=0)

    st = np.broadcast_to(np.stack([LEAF[:, 0], 0.5 + LEAF[:, 1]], axis=1), (count, len(LEAF), 2))
    values = {
        "uniform color front": colors(p.leafcolor),
        "uniform color through": colors(p.leafglow),
        "vertex float[2] st": st,
    }
    return [
        b"Surface " + rib.string(p.leafsurface) + b"\n",
        rib.mesh(np.full(len(faces), 3), faces, turn_up(corners.reshape(-1, 3), p.up), values),
    ]
