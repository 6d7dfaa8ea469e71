"""Levels of detail of instances: rocks from near by to the horizon, with and without, each render a process of its own.

    PYTHONPATH=python python bench/levels.py [--rounds 5] [--kinds 24] [--count 20000] [--rate 0.1] [--fov 40]
        [--memory 200M]

Prints medians, and medians of the ratios of rounds that took turns. For run.py: VIEWS, with levels over without.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import statistics
import subprocess
import sys
from time import process_time

import numpy as np

import intervals
from budgets import resident
from settings import Found, Say, Settings

# By a narrow lens those that are near stand beside the picture, which shows what is far and coarse.
VIEWS = {"near": ("40", "0.1", ""), "far": ("8", "1", ""), "budget": ("8", "1", "350M")}
RATIOS = ("vertices_m", "geometry_mb", "build_cpu_s", "trace_cpu_s")  # with levels over without


def rocks(kinds: int, count: int, fov: float) -> object:
    """So many kinds of rocks, displaced heavily, on a plain: as many in each octave of distance, 1000 units far."""
    import kanuka
    import own

    scene = kanuka.Scene()
    scene.resolution = 480, 270
    scene.options.shader_path = [str(own.SHADERS)]
    random = np.random.default_rng(1)
    depth = 2.5 * np.exp(random.uniform(0, 1, count) * math.log(400))
    places = np.zeros((count, 3, 4), np.float32)
    turn, size = random.uniform(0, 2 * np.pi, count), random.uniform(0.5, 1, count)
    places[:, 0, 0] = places[:, 2, 2] = np.cos(turn) * size
    places[:, 0, 2], places[:, 2, 0] = np.sin(turn) * size, -np.sin(turn) * size
    places[:, 1, 1] = size
    places[:, 0, 3], places[:, 2, 3] = random.uniform(-0.7, 0.7, count) * depth, -depth
    for k in range(kinds):
        lumps = kanuka.Shader("rough", swell=0.2, frequency=2 + 0.01 * k, grain=0.02, fineness=20)
        stone = kanuka.Material("matte", color=(0.5, 0.4, 0.3), displacement=lumps, displacement_bound=0.3)
        group = scene.add_group(f"rock {k}")
        group.add_sphere(0.5, material=stone)
        scene.add_instances(group, places[k::kinds])
    plain = np.array([[-3000, 0, -3000], [-3000, 0, 9], [3000, 0, 9], [3000, 0, -3000]], np.float32)
    scene.add_mesh(plain, np.array([[0, 1, 2, 3]], np.int32), material=kanuka.Material("matte", color=(0.3, 0.3, 0.3)))
    scene.camera = kanuka.Camera((0, 1.5, 0), (0, 1.5 - 0.003 * fov, -2), fov=fov)
    own.daylight(scene)
    return scene


def render(arguments: argparse.Namespace, levels: float) -> None:
    """In this process, which must be new: its peak counts."""
    import kanuka

    scene = rocks(arguments.kinds, arguments.count, arguments.fov)
    before = resident("VmHWM")
    options = {"memory": arguments.memory} if arguments.memory else {}
    begin = process_time()
    session = kanuka.Session(
        scene, progressions=arguments.samples + 1, shading_rate=arguments.rate, instance_levels=levels, **options
    )
    session.advance(progressions=1)
    built = process_time()
    session.advance()
    traced = process_time()
    picture = session.picture()
    time, count, taken = (picture.stats[kind] for kind in ("time", "count", "bytes"))
    rgb = picture["rgb"].astype(np.float64)
    found = {
        "build_cpu_s": built - begin,
        "trace_cpu_s": traced - built,
        "trace_s": time["transport_s"],
        "geometry_mb": (taken["grids"] + taken["lobe_inputs"] + taken["bvh"]) / 1e6,
        "peak_mb": (resident("VmHWM") - before) / 1e6,
        "given_back_mb": taken["given_back"] / 1e6,
        "vertices_m": count["vertices"] / 1e6,
        "coarser": count["instances_coarser"],
        "mean": float(rgb.mean()),
    }
    print(json.dumps(found))


def in_a_process(levels: str, *arguments: str) -> dict[str, float]:
    command = [sys.executable, __file__, *arguments, "--one", levels]
    done = subprocess.run(command, capture_output=True, text=True, env=os.environ)
    if done.returncode:
        raise RuntimeError(f"{' '.join(command)} ended with {done.returncode}: {done.stderr[-1000:]}")
    return json.loads(done.stdout.splitlines()[-1])


def measure(settings: Settings, view: str, say: Say) -> Found:
    """For run.py. The scene is of the same density in a quick run, which has a twentieth of it."""
    fov, rate, memory = VIEWS[view]
    kinds, count = (2, 500) if settings.quick else (12, 10_000)
    arguments = ["--kinds", str(kinds), "--count", str(count), "--fov", fov, "--rate", rate]
    arguments += ["--memory", "60M" if settings.quick else memory] if memory else []
    runs: dict[str, list[dict[str, float]]] = {"0": [], "1": []}
    for _ in range(1 if settings.quick else settings.rounds):
        for levels, of in runs.items():
            of.append(in_a_process(levels, *arguments))
    rounds = {levels: {name: [run[name] for run in of] for name in of[0]} for levels, of in runs.items()}
    without, with_ = rounds["0"], rounds["1"]
    found = {
        "kinds": kinds,
        "count": count,
        "memory": memory,
        "coarser": with_["coarser"][0],
        "vertices": round(1e6 * with_["vertices_m"][0]),
        "means_apart": abs(with_["mean"][0] / without["mean"][0] - 1),
        **{name: vars(intervals.of_ratio(with_[name], without[name])) for name in RATIOS},
        "rounds": rounds,
    }
    if memory and all(without["given_back_mb"]) and all(with_["given_back_mb"]):
        found["given_back_mb"] = vars(intervals.of_ratio(with_["given_back_mb"], without["given_back_mb"]))
    say("  " + ", ".join(f"{name} {found[name]['value']:.3f}×" for name in RATIOS))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--kinds", type=int, default=24)
    parser.add_argument("--count", type=int, default=20_000)
    parser.add_argument("--rate", type=float, default=0.1, help="shading rate")
    parser.add_argument("--samples", type=int, default=8)
    parser.add_argument("--fov", type=float, default=40, help="small: near ones lie beside the picture")
    parser.add_argument("--memory", default="", help="a budget, as 200M")
    parser.add_argument("--levels", default="0 1 2", help="the instance_levels that are compared with the first")
    parser.add_argument("--one", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.one:
        render(arguments, float(arguments.one))
        return
    runs: dict[str, list[dict[str, float]]] = {each: [] for each in arguments.levels.split()}
    for _ in range(arguments.rounds):
        for levels, found in runs.items():
            found.append(in_a_process(levels, *sys.argv[1:]))
    first = next(iter(runs.values()))
    for name in first[0]:
        cells = []
        for found in runs.values():
            median = statistics.median(each[name] for each in found)
            ratios = [each[name] / other[name] for each, other in zip(found, first, strict=True) if other[name]]
            over = f" ({statistics.median(ratios):.3f}, {min(ratios):.2f} to {max(ratios):.2f})" if ratios else ""
            cells.append(f"{median:.4g}{over}")
        print(f"{name:14}", " | ".join(cells))


if __name__ == "__main__":
    main()
