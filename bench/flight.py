"""A flight through a forest: does anything pop that is diced otherwise in one frame than in the next?

Frames of scenes/forest, each diced for its own camera, and all for one shot (docs/sessions.md, "Shots"), beside a
reference that is diced once, four times as finely. A pixel's second difference in time, f[t-1] - 2 f[t] + f[t+1], is
what the camera's motion leaves and what pops. All have the same two seeds; the product of two seeds' differences is on
the mean the square of what there is without noise.
"""

from __future__ import annotations

import sys
from collections.abc import Callable

import numpy as np

from settings import ROOT, Found, Say, Settings

sys.path.append(str(ROOT / "scenes"))

SEEDS = (1, 2)
BLOCK = 8
TREES, RESOLUTION, SAMPLES = 2_000, (80, 48), 32  # samples of each seed
BOUNCES = 1  # light from the sun and the sky alone: noise of what they light would hide what pops
QUICK_FRAMES, QUICK_TREES, QUICK_SAMPLES = 5, 60, 4
FINER = 0.25  # times the shading rate: micropolygons half as long
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
WAYS: dict[str, tuple[int, Callable[[int], float]]] = {
    "whole": (48, lambda t: 1 + t),  # 92 m, 2 m a frame
    "slow": (24, lambda t: 1 + t / 4),  # the beginning, where trees are near and exemplars change most often
}


def shot_of(way: str, quick: bool) -> list[object]:
    from forest import woods

    frames, place = WAYS[way]
    return [woods.camera(place(t)) for t in range(QUICK_FRAMES if quick else frames)]


def film(settings: Settings, cameras: list[object], together: bool, rate: float) -> tuple[np.ndarray, list[Found]]:
    """Luminance, (seed, frame, row, column), and what each frame diced again."""
    import kanuka
    from forest import woods
    from kit import sinks

    scene = kanuka.Scene()
    woods.build(sinks.Live(scene), QUICK_TREES if settings.quick else TREES)
    woods.staged(scene)
    scene.camera = cameras[0]
    session = kanuka.Session(
        scene, shot=cameras if together else [], shading_rate=rate, resolution=RESOLUTION, max_depth=BOUNCES,
        progressions=QUICK_SAMPLES if settings.quick else SAMPLES, threads=settings.threads or None, seed=SEEDS[0],
    )  # fmt: skip
    pictures, again = [], []
    for camera in cameras:
        scene.camera = camera
        session.update(seed=SEEDS[0])
        session.prepare()
        again.append({reason["why"]: reason["primitives"] for reason in session.made_again})
        for seed in SEEDS:
            session.update(seed=seed)
            session.advance()
            pictures.append(session.picture()["rgb"] @ LUMINANCE)
    return np.array(pictures).reshape(len(cameras), len(SEEDS), *pictures[0].shape).swapaxes(0, 1), again


def second(film: np.ndarray) -> np.ndarray:
    return film[:, :-2] - 2 * film[:, 1:-1] + film[:, 2:]


def blocks(picture: np.ndarray) -> np.ndarray:
    """Means of blocks; rows and columns come last."""
    height, width = (side // BLOCK * BLOCK for side in picture.shape[-2:])
    cut = picture[..., :height, :width]
    return cut.reshape(*cut.shape[:-2], height // BLOCK, BLOCK, width // BLOCK, BLOCK).mean(axis=(-3, -1))


def power(film: np.ndarray) -> np.ndarray:
    """Of second differences, by blocks, without what noise adds."""
    one, other = second(film)
    return blocks((one * other).mean(axis=0))


def compared(film: np.ndarray, reference: np.ndarray) -> Found:
    mine, theirs = power(film), power(reference)
    off = film - reference
    steps = np.diff(blocks(off), axis=1) / reference.mean()  # of what the reference has not
    jumps, noise = np.abs(steps.mean(axis=0)), np.abs(steps[0] - steps[1]) / 2
    some = 0.05 * theirs.mean()  # blocks of sky have next to nothing, and less than nothing where noise says so
    over = (np.maximum(mine, 0) + some) / (np.maximum(theirs, 0) + some)
    return {
        "ratio": float(mine.mean() / theirs.mean()),
        "ratio_error": float((mine - theirs).std() / theirs.mean() / np.sqrt(mine.size)),
        "ratio_99": float(np.percentile(over, 99)),
        "difference": float(power(off).mean() / theirs.mean()),
        "jump": float(jumps.max()),
        "jump_noise": float(noise.max()),
        "jump_frame": int(np.unravel_index(jumps.argmax(), jumps.shape)[0]) + 2,
        "steps": [round(float(step), 7) for step in (steps[0] * steps[1]).mean(axis=(1, 2))],  # squared, by frame
    }


def measure(settings: Settings, way: str, say: Say) -> Found:
    """For run.py."""
    cameras = shot_of(way, settings.quick)
    reference, _ = film(settings, cameras, True, FINER)
    found: Found = {"frames": len(cameras), "samples": len(SEEDS) * (QUICK_SAMPLES if settings.quick else SAMPLES)}
    for name, together in (("alone", False), ("shot", True)):
        made, again = film(settings, cameras, together, 1)
        found[name] = compared(made, reference) | {"again": again}
        told = (
            "{}, {}: {ratio:.4f} ± {ratio_error:.4f}, blocks {ratio_99:.3f}, jump {jump:.4f} of noise {jump_noise:.4f}"
        )
        say("  " + told.format(way, name, **found[name]))
    return found
