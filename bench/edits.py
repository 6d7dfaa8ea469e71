"""What an edit costs: kanuka.Session makes the showcase, and makes it again after edits of it."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable

import numpy as np

import intervals
from settings import ROOT, Found, Say, Settings

SCENE = ROOT / "scenes" / "showcase.rib"
Edit = Callable[["object", int], None]  # of the scene, differently in each round


def moved(round_: int) -> np.ndarray:
    matrix = np.eye(4)
    matrix[0, 3] = 0.01 * (round_ + 1)
    return matrix


def look(scene: object, aside: float) -> None:
    """As the file does, by eye and target."""
    import kanuka

    eye = (0.05 + aside, 1.6, -7.0)
    scene.camera = kanuka.Camera(eye, (0.05 + aside, 1.6 - np.tan(np.radians(7.2)), -6.0), fov=30, left_handed=True)


# All are of nodes that the file names.
EDITS: dict[str, Edit] = {
    "nothing": lambda scene, round_: None,
    "bounces": lambda scene, round_: setattr(scene.options, "max_depth", 4 + round_ % 2),
    "a light": lambda scene, round_: scene.node("1", kind="light").set(intensity=0.5 + 0.01 * round_),
    "a material": lambda scene, round_: scene.node("knot", "surface").set(coatRoughness=0.1 + 0.01 * round_),
    "a place": lambda scene, round_: scene.node("knot").place(moved(round_)),
    "the camera moves": lambda scene, round_: look(scene, 0.02 * (round_ + 1)),
    "the camera": lambda scene, round_: scene.node("camera").set(fov=30 + 0.1 * (round_ + 1)),
}


def measure(settings: Settings, say: Say) -> Found:
    """For run.py. Seconds until rays can be traced, of each round; the first making is that of the same round."""
    import kanuka

    options = {"resolution": (96, 54) if settings.quick else (960, 540), "progressions": 1}
    rounds: dict[str, list[float]] = {name: [] for name in ("first", *EDITS)}
    kept, why = {}, {}
    for round_ in range(settings.rounds):
        scene = kanuka.load(str(SCENE))
        look(scene, 0)
        session = kanuka.Session(scene, threads=settings.threads or None, **options)
        rounds["first"].append(seconds(session.prepare))
        for name, edit in EDITS.items():
            edit(scene, round_)
            session.update()
            rounds[name].append(seconds(session.prepare))
            kept[name] = session.kept
            why[name] = [reason["why"] for reason in session.made_again]
    found = {
        name: {
            "seconds": statistics.median(rounds[name]),
            "rounds": rounds[name],
            "ratio": vars(intervals.of_ratio(rounds[name], rounds["first"])),
            "again": kept[name]["primitives"] - kept[name]["primitives_kept"],
            "hierarchy": not kept[name]["hierarchies_kept"],
            "why": why[name],
        }
        for name in EDITS
    }
    first = statistics.median(rounds["first"])
    say(f"  first {first:.3f} s; " + ", ".join(f"{name} {f['seconds']:.3f} s" for name, f in found.items()))
    return {"first": first, "primitives": kept["nothing"]["primitives"], "edits": found}


def seconds(call: Callable[[], object]) -> float:
    start = time.perf_counter()
    call()
    return time.perf_counter() - start
