"""What moves and what changes, beside the same standing still, in pages and in Embree (kanuka_moving_bench)."""

from __future__ import annotations

import statistics

import intervals
from settings import Found, Say, Settings, built, lines_of

# Balls two units wide that travel and turn, each its own way; terrains 250 units wide whose waves travel by 16 cells.
SCENES = {
    "straight": ("--turn=0", "--travel=1"),
    "turning": ("--turn=20", "--travel=1"),
    "far": ("--turn=60", "--travel=4"),
    "waves-1M": ("--cells=1000000", "--travel=4"),
    "waves-4M": ("--cells=4000000", "--travel=2"),
    "waves-16M": ("--cells=16000000", "--travel=1"),
}
QUICK = {"turning": "--instances=1000", "waves-1M": "--cells=16384"}
ROUNDS = 7


def measure(settings: Settings, scene: str, say: Say) -> Found:
    """One thread traces by the queries of the renderer, two build; rounds go through all four in turn."""
    program = built("kanuka_moving_bench", "bvh")
    rounds = 2 if settings.quick else ROUNDS
    small = [QUICK[scene], "--rays=4096"] if settings.quick else []
    lines = lines_of(program, *SCENES[scene], f"--rounds={rounds}", *small, "--json")
    made: Found = {"tracers": [line for line in lines if "build_s" in line], "rays": []}
    for line in (line for line in lines if "rays" in line):
        ns = {name: line[name] for name in ("pages, still", "pages, moving", "Embree, still", "Embree, moving")}
        over = {
            "pages": intervals.of_ratio(ns["pages, moving"], ns["pages, still"]),
            "Embree": intervals.of_ratio(ns["Embree, moving"], ns["Embree, still"]),
            "pages over Embree": intervals.of_ratio(ns["pages, moving"], ns["Embree, moving"]),
        }
        made["rays"].append(
            {
                "name": line["rays"],
                "count": line["count"],
                "ns": {name: statistics.median(all_rounds) for name, all_rounds in ns.items()},
                "over": {name: vars(ratio) for name, ratio in over.items()},
            }
        )
        say(f"  {scene}, {line['rays']}: " + ", ".join(f"{name} {ratio.value:.2f}" for name, ratio in over.items()))
    return made
