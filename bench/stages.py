"""Times the scenes of scenes/ through the command: best of some runs, a process each, figures as the statistics file's.

.venv/bin/python bench/stages.py [SCENE.rib …] --progressions 16 --repeat 3
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
COMMAND = Path(sys.executable).parent / "kanuka"
COLUMNS = ("dice_s", "shade_s", "bvh_s", "transport_s", "first_pixel_s", "total_s")


def run(scene: Path, progressions: int) -> dict:
    with tempfile.TemporaryDirectory() as folder:
        stats = Path(folder) / "stats.json"
        command = [COMMAND, "render", scene, "-o", Path(folder) / "a.exr", "--stats", stats, "--quiet"]
        subprocess.run([*map(str, command), "--progressions", str(progressions)], check=True, stdout=subprocess.DEVNULL)
        return json.loads(stats.read_text())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", type=Path, default=sorted((ROOT / "scenes").glob("*.rib")))
    parser.add_argument("--progressions", type=int, default=16)
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("-o", "--output", type=Path, help="write all figures as JSON")
    arguments = parser.parse_args()

    best: dict[str, dict] = {}
    print(f"{'scene':<20}" + "".join(f"{name:>15}" for name in COLUMNS) + f"{'Mrays/s':>10}{'peak MB':>9}")
    for scene in arguments.scenes:
        runs = [run(scene, arguments.progressions) for _ in range(arguments.repeat)]
        fastest = best[scene.stem] = min(runs, key=lambda stats: stats["time"]["total_s"])
        time, count = fastest["time"], fastest["count"]
        rate = count["rays"] / max(time["transport_s"], 1e-9) / 1e6
        figures = "".join(f"{time[name]:15.3f}" for name in COLUMNS)
        print(f"{scene.stem:<20}{figures}{rate:10.2f}{fastest['bytes']['peak_rss'] / 1e6:9.0f}", flush=True)
    if arguments.output:
        arguments.output.parent.mkdir(parents=True, exist_ok=True)
        arguments.output.write_text(json.dumps(best, indent=2) + "\n")
        print(arguments.output)


if __name__ == "__main__":
    main()
