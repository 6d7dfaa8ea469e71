"""Scenes larger than the memory: the same picture within budgets of memory, each render a process of its own."""

from __future__ import annotations

import hashlib
import json
import os
import statistics
import subprocess
import sys
from pathlib import Path

import numpy as np

import intervals
from settings import Found, Say, Settings

# Of what geometry takes without a budget.
PARTS = {"none": None, "all": 4, "a fifth": 1 / 5, "a twentieth": 1 / 20}


def balls(count: int) -> object:
    """Displaced balls on a lattice, 400 000 micropolygons each at a shading rate of 0.01."""
    import kanuka
    import own

    scene = kanuka.Scene()
    scene.resolution = 320, 180
    scene.options.shader_path = [str(own.SHADERS)]
    side = int(np.ceil(np.sqrt(count)))
    lumps = kanuka.Shader("rough", swell=0.2, frequency=2, grain=0.02, fineness=20)
    clay = kanuka.Material("matte", color=(0.5, 0.4, 0.3), displacement=lumps, displacement_bound=0.3)
    for i in range(count):
        place = np.eye(4)
        place[:3, 3] = 2.1 * (i % side - (side - 1) / 2), 0, 2.1 * (i // side - (side - 1) / 2)
        scene.add_sphere(1, transform=place, material=clay)
    scene.camera = kanuka.Camera((0, 1.1 * side, 2.6 * side), (0, 0, 0), fov=42)
    own.daylight(scene)
    return scene


def render(count: int, rate: float, memory: int) -> Found:
    """In this process, which must be new: its peak counts."""
    import kanuka

    scene = balls(count)
    before = resident("VmHWM")
    options = {"memory": str(memory)} if memory else {}
    picture = kanuka.render(scene, progressions=4, shading_rate=rate, journal=kanuka.Journal(), **options)
    stats = picture.stats
    time, taken = stats["time"], stats["bytes"]
    return {
        "build_s": time["total_s"] - time["transport_s"],
        "render_s": time["transport_s"],
        "geometry_bytes": taken["grids"] + taken["lobe_inputs"] + taken["bvh"],
        "peak_bytes": resident("VmHWM") - before,
        "given_back_bytes": taken["given_back"],
        "micropolygons": stats["count"]["micropolygons"],
        "picture": hashlib.sha256(np.ascontiguousarray(picture["rgb"]).tobytes()).hexdigest()[:16],
    }


def resident(name: str) -> int:
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith(name)) << 10


def in_a_process(count: int, rate: float, memory: int) -> Found:
    done = subprocess.run(
        [sys.executable, __file__, str(count), str(rate), str(memory)], capture_output=True, text=True, env=os.environ
    )
    if done.returncode:
        raise RuntimeError(f"the render within {memory} bytes ended with {done.returncode}: {done.stderr[-1000:]}")
    return json.loads(done.stdout)


def measure(settings: Settings, say: Say) -> Found:
    count, rate = (4, 0.1) if settings.quick else (64, 0.01)
    geometry = in_a_process(count, rate, 0)["geometry_bytes"]
    runs: dict[str, list[Found]] = {name: [] for name in PARTS}
    for _ in range(1 if settings.quick else settings.rounds):
        for name, part in PARTS.items():
            # The budget is of the whole process, which has some 250 MB without a scene.
            runs[name].append(in_a_process(count, rate, int(geometry * part) if part else 0))
    found: Found = {"geometry_bytes": geometry, "micropolygons": runs["none"][0]["micropolygons"], "budgets": {}}
    pictures = {run["picture"] for name, of in runs.items() if name != "none" for run in of}
    found["same"] = len(pictures) == 1
    for name, of in runs.items():
        whole = {
            figure: [run[figure] for run in of] for figure in ("build_s", "render_s", "peak_bytes", "given_back_bytes")
        }
        medians = {figure: statistics.median(values) for figure, values in whole.items()}
        ratios = {
            f"{figure}_ratio": vars(intervals.of_ratio(whole[figure], [run[figure] for run in runs["none"]]))
            for figure in ("build_s", "render_s")
        }
        budget = int(geometry * PARTS[name]) if PARTS[name] else None
        found["budgets"][name] = {"budget_bytes": budget, **medians, **ratios, "rounds": whole}
        say(
            f"  {name}: {medians['build_s']:.2f} s, {medians['render_s']:.2f} s, "
            f"peak {medians['peak_bytes'] / 1e6:.0f} MB of {geometry / 1e6:.0f} MB of geometry"
        )
    return found


if __name__ == "__main__":
    print(json.dumps(render(int(sys.argv[1]), float(sys.argv[2]), int(sys.argv[3]))))
