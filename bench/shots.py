"""Frames of a shot that are rendered together: a slow camera in a scene that stands still, until rays can be traced."""

from __future__ import annotations

import statistics
from collections.abc import Callable

import numpy as np

import intervals
from edits import seconds
from settings import Found, Say, Settings

FRAMES = 24
STEP = 0.02  # of the camera, in each frame: half a unit in a second


def wood(frame: int, trees: int) -> object:
    """A displaced ground, and a tree with leaves whose colours are computed, in a hundred sizes, `trees` times."""
    import kanuka
    import own

    scene = kanuka.Scene()
    scene.resolution = (960, 400)
    scene.options.shader_path = [str(own.SHADERS)]
    rough = kanuka.Shader("rough", swell=0.4, frequency=0.5, grain=0.03, fineness=8)
    points, faces = own.lattice(32, 60)
    scene.add_subdivision(
        points,
        faces,
        material=kanuka.Material("matte", color=(0.3, 0.25, 0.2), displacement=rough, displacement_bound=0.3),
    )
    rng = np.random.default_rng(7)
    leaf = scene.add_group("leaf")
    leaf.add_patches(
        np.array([[[-0.5, 0, 0], [0.5, 0, 0]], [[-0.5, 1, 0.2], [0.5, 1, 0.2]]]),
        basis="bilinear",
        material=kanuka.Material("plastic", color=(0.2, 0.5, 0.1)),
    )
    tree = scene.add_group("tree")
    bark = kanuka.Shader("rough", swell=0.1, frequency=4, grain=0.05, fineness=30)
    tree.add_cylinder(
        0.15, 0, 3, material=kanuka.Material("matte", color=(0.4, 0.3, 0.2), displacement=bark, displacement_bound=0.1)
    )
    tree.add_instances(leaf, placed(rng, 800, 1.2, 3, 0.25))
    trees_at = placed(rng, trees, 40, 0, 1)
    trees_at[:, 2, 3] -= 15  # the camera stands before the wood
    trees_at[:, :3, :3] = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]]) * rng.uniform(0.7, 1.3, (trees, 1, 1))
    scene.add_instances(tree, trees_at)
    scene.camera = kanuka.Camera((STEP * frame, 4, 34), (STEP * frame, 2, 0), fov=50)
    own.daylight(scene)
    return scene


def placed(rng: np.random.Generator, count: int, spread: float, height: float, size: float) -> np.ndarray:
    """(count, 4, 4): turned at random, up to `spread` aside and in z."""
    matrices = np.tile(np.eye(4), (count, 1, 1))
    turns, _ = np.linalg.qr(rng.normal(size=(count, 3, 3)))
    matrices[:, :3, :3] = turns * size
    matrices[:, :3, 3] = rng.uniform(-spread, spread, (count, 3)) * (1, 0.3 * (height > 0), 1)
    if height > 0:
        matrices[:, 2, 3] += height
    return matrices


def showcase(frame: int, _trees: int) -> object:
    import edits
    import kanuka

    scene = kanuka.load(str(edits.SCENE))
    scene.resolution = (960, 540)
    edits.look(scene, STEP * frame)
    return scene


SCENES: dict[str, Callable[[int, int], object]] = {"wood": wood, "showcase": showcase}


def measure(settings: Settings, name: str, say: Say) -> Found:
    """For run.py. Seconds of all frames until rays can be traced, without reading: each from nothing, and together."""
    import kanuka

    frames, trees = (4, 200) if settings.quick else (FRAMES, 20_000)
    options = {"threads": settings.threads or None, "progressions": 1}
    rounds: dict[str, list[float]] = {"alone": [], "together": []}
    made: list[int] = []
    for _ in range(settings.rounds):
        scenes = [SCENES[name](frame, trees) for frame in range(frames)]
        rounds["alone"].append(
            sum(seconds(kanuka.Session(scene, keep_pages=False, **options).prepare) for scene in scenes)
        )
        session, total, made = None, 0.0, []
        for scene in scenes:
            if session is None:
                session = kanuka.Session(scene, shot=[s.camera for s in scenes], **options)
            else:
                session.update(scene)
            total += seconds(session.prepare)
            made.append(session.kept["primitives"] - session.kept["primitives_kept"])
        rounds["together"].append(total)
    found = {
        "frames": frames,
        "rounds": rounds,
        "ratio": vars(intervals.of_ratio(rounds["together"], rounds["alone"])),
        "made_again": made,
        **{kind: statistics.median(values) for kind, values in rounds.items()},
    }
    say(f"  {frames} frames: {found['alone']:.2f} s alone, {found['together']:.2f} s together")
    return found
