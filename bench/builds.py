"""Did a change of the code change pictures, or slow them? Two builds of Kanuka on the same scenes, in turn.

    .venv/bin/python bench/builds.py BEFORE               # this checkout against that one, both built
    .venv/bin/python bench/builds.py BEFORE --only cornell showcase.rib --json out/builds.json

Pictures: each seed is rendered by both builds, and blocks of 16 x 16 pixels are compared by a paired Z-test over the
seeds (pictures.paired). A build that takes other random numbers is compared as well, with less power. Times: the CPU
time of all threads of a whole render, in turn and in both orders, as ratios round by round with their 95 % interval;
the aim is not above 1.02. Exits 1 where a picture differs.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

import numpy as np

import intervals
import machine
import peers
import validation
from pictures import Paired, paired
from settings import ROOT, Found


@dataclass(frozen=True)
class Case:
    """A scene as it is compared: small enough for some seeds."""

    scene: str
    samples: int = 16
    scale: float = 0.5  # of the picture's sides
    n: int = 0


def pictures_of() -> list[Case]:
    ribs = [ROOT / "scenes" / name for name in ("cornell.rib", "showcase.rib", "shapes.rib", "solids.rib")]
    ribs += [ROOT / "scenes" / name for name in ("volumes.rib", "listings.rib")]
    procedurals = sorted((ROOT / "scenes" / "procedurals").glob("*.rib"))
    ribs += [path for path in procedurals if "WorldBegin" in path.read_text()]  # others are archives for scenes
    ribs += sorted((ROOT / "scenes" / "tests").glob("*.rib"))
    made = [Case(str(path), samples=8) for path in ribs]
    made += [Case("cornell"), Case("grey-cornell"), Case("terrain", n=300), Case("forest", n=1000), Case("still-life")]
    made += [Case("smooth"), Case("displaced"), Case("shading", n=16)]
    return made + [Case(name, scale=1) for name in validation.MAKERS]


# What the aim of 1.02 is for. Micropolygons: dicing, shading and building.
TIMED = (
    Case("cornell", samples=16),
    Case("terrain", samples=8),
    Case("forest", samples=8),
    Case("forest", samples=1, n=1_000_000),
    Case("still-life", samples=16),
    Case("shading", samples=4, n=100),
    Case("micropolygons", samples=1, scale=1, n=1_000_000),
    Case(str(ROOT / "scenes" / "showcase.rib"), samples=8),
)


def name_of(case: Case) -> str:
    return Path(case.scene).name + (f" {case.n / 1e6:g} M" if case.n >= 1_000_000 else "")


def render(tree: Path, case: Case, seeds: list[int], threads: int) -> peers.Answer:
    """By the build of a checkout; its shader cache is its own."""
    kept = {name: os.environ.get(name) for name in ("PYTHONPATH", "KANUKA_SHADER_CACHE")}
    os.environ["PYTHONPATH"] = str(tree / "python")
    os.environ["KANUKA_SHADER_CACHE"] = str(tree / "build" / "bench-shaders")
    request = {"scene": case.scene, "n": case.n, "scale": case.scale, "samples": case.samples, "seeds": seeds}
    try:
        return peers.ask(peers.OURS, request | {"threads": threads})
    finally:
        for name, value in kept.items():
            os.environ.pop(name) if value is None else os.environ.update({name: value})


@dataclass
class Comparison:
    pictures: dict[str, Found] = field(default_factory=dict)
    times: dict[str, Found] = field(default_factory=dict)
    failed: dict[str, str] = field(default_factory=dict)

    def differs(self) -> list[str]:
        return [name for name, found in self.pictures.items() if found["differs"]]


def compare_pictures(before: Path, cases: list[Case], seeds: int, threads: int, made: Comparison) -> None:
    print(f"{'picture':<24}{'same bits':>10}{'mean':>22}{'rms z (limit)':>18}{'worst z (limit)':>18}")
    for case in cases:
        try:
            a, b = (render(tree, case, list(range(1, seeds + 1)), threads).pictures for tree in (before, ROOT))
        except peers.WorkerError as error:
            made.failed[name_of(case)] = str(error)
            print(f"{name_of(case):<24} {error}", flush=True)
            continue
        found: Paired = paired(b, a)
        equal = float(np.mean(np.all(a == b, axis=-1)))
        made.pictures[name_of(case)] = asdict(found) | {"equal_pixels": equal, "differs": found.differs}
        mean = f"{100 * (found.mean_ratio - 1):+.3f} ± {100 * found.mean_sigma:.3f} %"
        rms, worst = (
            f"{z:.2f} ({at:.2f})" for z, at in ((found.rms_z, found.rms_limit), (found.worst_z, found.worst_limit))
        )
        mark = " DIFFERS" if found.differs else ""
        print(f"{name_of(case):<24}{100 * equal:>9.1f}%{mean:>22}{rms:>18}{worst:>18}{mark}", flush=True)


def compare_times(before: Path, cases: list[Case], rounds: int, threads: int, made: Comparison) -> None:
    print(f"{'time':<24}{'before':>10}{'after':>10}{'after / before':>26}{'peak memory':>14}{'hierarchy':>20}")
    for case in cases:
        taken: dict[str, list[Found]] = {"before": [], "after": []}
        trees = {"before": before, "after": ROOT}
        for tree in trees.values():  # shaders are compiled, files are read
            render(tree, replace(case, samples=1), [1], threads)
        for number in range(rounds):
            for side in list(trees) if number % 2 == 0 else reversed(list(trees)):
                taken[side].append(render(trees[side], case, [number + 1], threads).figures)
        seconds = {side: [float(f["cpu_s"]) for f in figures] for side, figures in taken.items()}
        ratio = intervals.of_ratio(seconds["after"], seconds["before"])
        memory = intervals.of_ratio(*([float(f["peak_bytes"]) for f in taken[side]] for side in ("after", "before")))
        hierarchy = {side: [float(f["bvh_s"]) for f in figures] for side, figures in taken.items()}
        made.times[name_of(case)] = {
            "rounds": seconds,
            "ratio": asdict(ratio),
            "memory": asdict(memory),
            "bvh_s": hierarchy,
        }
        medians = "".join(f"{float(np.median(values)):>8.2f} s" for values in seconds.values())
        bounds = f"{ratio.value:.3f} ({ratio.low:.3f} to {ratio.high:.3f})" if ratio.low else f"{ratio.value:.3f}"
        built = " to ".join(f"{float(np.median(values)):.3f}" for values in hierarchy.values()) + " s"
        print(f"{name_of(case):<24}{medians}{bounds:>26}{memory.value:>14.3f}{built:>20}", flush=True)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("before", type=Path, help="a checkout with its Python module built")
    parser.add_argument("--only", nargs="+", default=[], metavar="SCENE", help="these alone")
    parser.add_argument("--seeds", type=int, default=8, help="of every picture (8)")
    parser.add_argument("--rounds", type=int, default=6, help="of times (6); 0: none")
    parser.add_argument("--threads", type=int, default=0, help="0 = all")
    parser.add_argument("--no-pictures", action="store_true", help="times alone")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all figures")
    args = parser.parse_args()
    chosen = [case for case in pictures_of() if not args.only or Path(case.scene).name in args.only]
    timed = [case for case in TIMED if not args.only or Path(case.scene).name in args.only]
    made = Comparison()
    if not args.no_pictures:
        compare_pictures(args.before.resolve(), chosen, args.seeds, args.threads, made)
    if args.rounds:
        compare_times(args.before.resolve(), timed, args.rounds, args.threads, made)
    if args.json:
        args.json.parent.mkdir(parents=True, exist_ok=True)
        args.json.write_text(json.dumps({"machine": machine.describe(), **asdict(made)}, indent=1))
    if made.differs():
        print("differ: " + ", ".join(made.differs()))
    return 1 if made.differs() or made.failed else 0


if __name__ == "__main__":
    sys.exit(main())
