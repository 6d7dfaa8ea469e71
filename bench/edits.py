"""What an edit costs: kanuka.Session makes a scene, and makes it again after edits of it.

The showcase; a million places of a group whose shapes lie in pages of the hierarchy; and many shapes in one page.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

import intervals
from settings import ROOT, Found, Say, Settings

SCENE = ROOT / "scenes" / "showcase.rib"
Edit = Callable[["object", int], None]  # of the scene, or what has it; differently in each round


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


def showcase(_settings: Settings) -> object:
    import kanuka

    scene = kanuka.load(str(SCENE))
    look(scene, 0)
    return scene


# ---- what lies in pages: seen so near that it has millions of micropolygons


def lumps(seed: int, rise: float = 0) -> np.ndarray:
    """Points of a patch that is 2 wide; one of them rises."""
    side = np.linspace(-1, 1, 13)
    x, z = np.meshgrid(side, side)
    points = np.stack([x, np.random.default_rng(seed).uniform(0, 0.5, x.shape), z], -1)
    points[5, 5, 1] += rise
    return points


def staged() -> object:
    import kanuka

    scene = kanuka.Scene()
    scene.camera = kanuka.Camera((0, 30, -40), (0, 0, 0), fov=40)
    scene.add_light("environment")
    return scene


class Crowd:
    """Places of one group, on a lattice that is jittered."""

    def __init__(self, settings: Settings) -> None:
        self.scene = staged()
        self.group = self.scene.add_group("lumps")
        for k in range(1 if settings.quick else 16):
            place = np.eye(4)
            place[:3, 3] = k % 4 - 1.5, 0, k // 4 - 1.5
            self.group.add_patches(lumps(k), basis="b-spline", material="plastic", transform=place)
        count = 10_000 if settings.quick else 1_000_000
        side = int(np.ceil(np.sqrt(count)))
        at = np.arange(count)
        jitter = np.random.default_rng(1).uniform(0, 2, (count, 2))
        self.places = np.zeros((count, 3, 4), np.float32)
        self.places[:, 0, 0] = self.places[:, 1, 1] = self.places[:, 2, 2] = 1
        self.places[:, 0, 3] = 5 * (at % side - side / 2) + jitter[:, 0]
        self.places[:, 2, 3] = 5 * (at // side - side / 2) + jitter[:, 1]
        self.node = self.scene.add_instances(self.group, self.places)

    def place(self) -> None:
        self.scene.remove([self.node])
        self.node = self.scene.add_instances(self.group, self.places)

    def one_moves(self, round_: int) -> None:
        self.places[len(self.places) // 3, :, 3] += (0.3, 0, 0.2 + 0.01 * round_)
        self.place()

    def all_move(self, round_: int) -> None:
        self.places[:, 0, 3] += 0.05 * np.sin(np.arange(len(self.places)) + round_)
        self.place()

    def one_comes(self, _round: int) -> None:
        self.places = np.concatenate([self.places, self.places[:1] + 1])
        self.place()


SHAPES = 50


def place_of(k: int) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, 3] = 2.5 * (k % 7 - 3), 0, 2.5 * (k // 7 - 3)
    return matrix


def shapes(settings: Settings) -> object:
    scene = staged()
    for k in range(4 if settings.quick else SHAPES):
        scene.add_patches(lumps(k), basis="b-spline", material="plastic", transform=place_of(k), name=f"lumps{k}")
    return scene


def reshape(scene: object, round_: int) -> None:
    scene.remove([scene.node("lumps3")])
    points = lumps(3, 0.01 * (round_ + 1))
    scene.add_patches(points, basis="b-spline", material="plastic", transform=place_of(3), name="lumps3")


# ---- all of it


@dataclass(frozen=True)
class Edited:
    make: Callable[[Settings], object]
    edits: dict[str, Edit]
    resolution: tuple[int, int] = (960, 540)
    options: dict[str, object] = field(default_factory=dict)


NEAR = {"shading_rate": 0.4, "geometry_tolerance": 0.001, "crop": (0.4, 0.41, 0.4, 0.41)}
ALL = {
    "": Edited(showcase, EDITS),
    "places": Edited(
        Crowd,
        {
            "no place": lambda scene, round_: None,
            "one of a million places": Crowd.one_moves,
            "all of a million places, a little": Crowd.all_move,
            "a place more": Crowd.one_comes,
        },
        (4096, 2304),
        NEAR,
    ),
    "shapes": Edited(
        shapes,
        {
            "no shape": lambda scene, round_: None,
            "the place of one of 50 shapes": lambda scene, round_: scene.node("lumps2").place(moved(round_)),
            "the vertices of one of 50 shapes": reshape,
        },
        (4096, 2304),
        NEAR,
    ),
}


def measure(settings: Settings, which: str, say: Say) -> Found:
    """For run.py. Seconds until rays can be traced, of each round; the first making is that of the same round."""
    import kanuka

    about = ALL[which]
    options = {"resolution": (96, 54) if settings.quick else about.resolution, "progressions": 1, **about.options}
    rounds: dict[str, list[float]] = {name: [] for name in ("first", *about.edits)}
    kept, why = {}, {}
    for round_ in range(settings.rounds):
        made = about.make(settings)
        session = kanuka.Session(getattr(made, "scene", made), threads=settings.threads or None, **options)
        rounds["first"].append(seconds(session.prepare))
        for name, edit in about.edits.items():
            edit(made, round_)
            session.update()
            rounds[name].append(seconds(session.prepare))
            kept[name] = session.kept
            why[name] = [reason["why"] for reason in session.made_again]
    found = {
        name: {
            "seconds": statistics.median(rounds[name]),
            "interval": vars(intervals.of(rounds[name])),
            "rounds": rounds[name],
            "ratio": vars(intervals.of_ratio(rounds[name], rounds["first"])),
            "again": kept[name]["primitives"] - kept[name]["primitives_kept"],
            "hierarchy": not kept[name]["hierarchies_kept"],
            "why": why[name],
        }
        for name in about.edits
    }
    first = statistics.median(rounds["first"])
    say(f"  first {first:.3f} s; " + ", ".join(f"{name} {f['seconds']:.3f} s" for name, f in found.items()))
    primitives = next(iter(kept.values()))["primitives"]
    return {"first": first, "primitives": primitives, "edits": found}


def seconds(call: Callable[[], object]) -> float:
    start = time.perf_counter()
    call()
    return time.perf_counter() - start
