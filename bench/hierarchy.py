"""Rays through pages of our own beside Embree on the same vertices (kanuka_hierarchy_bench, kanuka_instance_bench)."""

from __future__ import annotations

import statistics

import intervals
from settings import Found, Say, Settings, built, lines_of

SCENES = ("terrain", "cave", "mesh", "globe", "hair")
QUICK_SIZE = {"terrain": 6, "cave": 6, "mesh": 4, "globe": 40, "hair": 4}
OURS = "pages, 8 lanes"
ROUNDS = 7


def rounds(settings: Settings) -> int:
    return 2 if settings.quick else ROUNDS


def measure(settings: Settings, scene: str, say: Say) -> Found:
    """One thread traces, all build. Rounds go through all tracers in turn."""
    program = built("kanuka_hierarchy_bench", "bvh")
    size = [f"--size={QUICK_SIZE[scene]}"] if settings.quick else []
    lines = lines_of(program, f"--scene={scene}", f"--rounds={rounds(settings)}", "--json", *size)
    made: Found = {"tracers": [line for line in lines if "build_ms" in line], "rays": []}
    traced = [line for line in lines if "ns" in line]
    for ours in (line for line in traced if line["tracer"] == OURS):
        others = {
            line["tracer"]: vars(intervals.of_ratio(ours["ns"], line["ns"]))
            for line in traced
            if line["rays"] == ours["rays"] and line["tracer"].startswith("Embree")
        }
        made["rays"].append({"name": ours["rays"], "ns": statistics.median(ours["ns"]), "against": others})
        say(
            f"  {scene}, {ours['rays']}: {statistics.median(ours['ns']):.0f} ns, "
            + ", ".join(f"{ratio['value']:.2f} of {name}" for name, ratio in others.items())
        )
    return made


def instances(settings: Settings, say: Say) -> Found:
    """A level of a million instances, and rays through it."""
    program = built("kanuka_instance_bench", "bvh")
    count = ["--instances=10000"] if settings.quick else []
    level, *rays = lines_of(program, f"--rounds={rounds(settings)}", "--json", *count)
    for line in rays:
        line["ratio"] = vars(intervals.of_ratio(line["pages_ns"], line["embree_ns"]))
        say(f"  instances, {line['rays']}: {line['ratio']['value']:.2f} of Embree's")
    return {"level": level, "rays": rays}
