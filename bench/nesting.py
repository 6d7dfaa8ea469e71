"""What a level of nesting costs: the same knots at the same places, as instances one to six groups deep in each other.

For run.py. A render has one session for each depth, and their samples take turns.
"""

from __future__ import annotations

import time

import numpy as np

import intervals
from settings import Found, Say, Settings

SIDE = 64  # places along each axis, a unit apart: 64³
# Blocks of places along x, y and z, from the inmost on: so many groups deep.
BLOCKS = {
    1: ((64, 64, 64),),
    2: ((8, 8, 8),) * 2,
    3: ((4, 4, 4),) * 3,
    6: ((2, 2, 2),) * 6,
}
QUICK_SIDE, QUICK_BLOCKS = 4, {1: ((4, 4, 4),), 2: ((2, 2, 2),) * 2}
EACH = 4  # samples a round
TRACERS = {"embree": {}, "pages": {"memory": "20G"}}  # a budget has everything in pages


def knot(bends: int = 3, sides: int = 12, length: int = 96) -> tuple[np.ndarray, np.ndarray]:
    """A tube around a circle that is bent, in a ball of half a unit: no two views of it are alike."""
    t, s = np.meshgrid(2 * np.pi * np.arange(length) / length, 2 * np.pi * np.arange(sides) / sides, indexing="ij")
    spread = 0.27 + 0.08 * np.cos(bends * t) + 0.07 * np.cos(s)
    points = np.stack([spread * np.cos(2 * t), spread * np.sin(2 * t), 0.2 * np.sin(bends * t) + 0.07 * np.sin(s)], -1)
    i, j = np.indices((length, sides)).reshape(2, -1)
    corners = [(i, j), ((i + 1) % length, j), ((i + 1) % length, (j + 1) % sides), (i, (j + 1) % sides)]
    faces = np.stack([a * sides + b for a, b in corners], -1)
    return points.reshape(-1, 3).astype(np.float32), faces.astype(np.int32)


def block(count: tuple[int, int, int], step: np.ndarray) -> np.ndarray:
    """Places of a block, (N, 3, 4), `step` apart."""
    at = np.stack(np.meshgrid(*map(np.arange, count), indexing="ij"), -1).reshape(-1, 3) * step
    return np.concatenate([np.broadcast_to(np.eye(3), (len(at), 3, 3)), at[:, :, None]], 2).astype(np.float32)


def scene(depth: int, side: int) -> object:
    import kanuka
    import own

    made = kanuka.Scene()
    made.resolution = (320, 180)
    made.options.max_depth = 3
    inner = made.add_group("knot")
    inner.add_mesh(*knot(), material=kanuka.Material("matte", color=(0.6, 0.5, 0.4)))
    step, blocks = np.ones(3), (BLOCKS if side == SIDE else QUICK_BLOCKS)[depth]
    for k, count in enumerate(blocks):
        outer = made if k == len(blocks) - 1 else made.add_group(f"block {k}")
        outer.add_instances(inner, block(count, step))
        inner, step = outer, step * count
    made.camera = kanuka.Camera((-0.4 * side, 1.3 * side, -0.5 * side), (0.5 * side,) * 3, fov=44)
    own.daylight(made)
    return made


def measure(settings: Settings, tracer: str, say: Say) -> Found:
    import kanuka

    side, depths = (QUICK_SIDE, tuple(QUICK_BLOCKS)) if settings.quick else (SIDE, tuple(BLOCKS))
    rounds: dict[int, list[float]] = {depth: [] for depth in depths}
    sessions = {}
    for depth in depths:
        sessions[depth] = kanuka.Session(
            scene(depth, side), progressions=64, threads=settings.threads or None, adaptive=0, **TRACERS[tracer]
        )
        sessions[depth].advance(progressions=EACH)  # after which roulette is as it stays
    for taken in range(1, 2 if settings.quick else 1 + max(settings.rounds, 5)):
        for depth, session in sessions.items():
            begin = time.process_time()
            session.advance(progressions=(taken + 1) * EACH)
            rounds[depth].append(time.process_time() - begin)
    pictures = {depth: session.picture() for depth, session in sessions.items()}
    means = {depth: float(picture["rgb"].mean()) for depth, picture in pictures.items()}
    found: Found = {
        "places": side**3,
        "rounds": {str(depth): seconds for depth, seconds in rounds.items()},
        "rays": {str(depth): picture.stats["count"]["rays"] for depth, picture in pictures.items()},
        "means_apart": max(abs(mean / means[1] - 1) for mean in means.values()),
        "over": {str(depth): vars(intervals.of_ratio(rounds[depth], rounds[1])) for depth in depths[1:]},
    }
    for depth in depths[1:]:
        over = intervals.Interval(**found["over"][str(depth)])
        say(f"  {tracer}: {depth} deep over one: {over.value:.2f} ({over.low or 0:.2f} to {over.high or 0:.2f})")
    return found
