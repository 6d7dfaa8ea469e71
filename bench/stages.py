"""Times the scenes of scenes/ through the command: medians of some runs, a process each.

.venv/bin/python bench/stages.py [SCENE.rib …] --progressions 16 --rounds 3
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

from settings import ROOT, Found, Say, Settings

COLUMNS = ("dice_s", "shade_s", "bvh_s", "transport_s", "first_pixel_s", "total_s")
SCENES = ("showcase",)


def run(scene: Path, *options: object) -> dict:
    with tempfile.TemporaryDirectory() as folder:
        stats = Path(folder) / "stats.json"
        command = [sys.executable, "-m", "kanuka", "render", scene, "-o", Path(folder) / "a.exr", "--stats", stats]
        environment = {"PYTHONPATH": str(ROOT / "python"), **os.environ}
        command += ["--quiet", *options]
        subprocess.run([*map(str, command)], check=True, stdout=subprocess.DEVNULL, env=environment)
        return json.loads(stats.read_text())


def summary(runs: list[dict]) -> Found:
    found = {name: statistics.median(run["time"][name] for run in runs) for name in COLUMNS}
    rays = runs[0]["count"]["rays"]
    return found | {"rays_per_s": rays / max(found["transport_s"], 1e-9), "peak_bytes": runs[0]["bytes"]["peak_rss"]}


def line(name: str, found: Found) -> str:
    figures = "".join(f"{found[column]:15.3f}" for column in COLUMNS)
    return f"{name:<20}{figures}{found['rays_per_s'] / 1e6:10.2f}{found['peak_bytes'] / 1e6:9.0f}"


def measure(settings: Settings, scene: str, say: Say) -> Found:
    """For run.py."""
    options = ["--progressions", 1 if settings.quick else 16]
    if settings.quick:
        options += ["--resolution", "96x54"]
    found = summary([run(ROOT / "scenes" / f"{scene}.rib", *options) for _ in range(settings.rounds)])
    say(f"  {line(scene, found)}")
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", type=Path, default=sorted((ROOT / "scenes").glob("*.rib")))
    parser.add_argument("--progressions", type=int, default=16)
    parser.add_argument("--rounds", type=int, default=3)
    arguments = parser.parse_args()
    print(f"{'scene':<20}" + "".join(f"{name:>15}" for name in COLUMNS) + f"{'Mrays/s':>10}{'peak MB':>9}")
    for scene in arguments.scenes:
        runs = [run(scene, "--progressions", arguments.progressions) for _ in range(arguments.rounds)]
        print(line(scene.stem, summary(runs)), flush=True)


if __name__ == "__main__":
    main()
