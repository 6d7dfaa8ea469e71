"""The time of a sample and its noise, by the number of lights (kanuka_light_bench)."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from pathlib import Path

from measures import Settings

ROOT = Path(__file__).resolve().parent.parent
BINARY = ROOT / "build" / "src" / "transport" / "kanuka_light_bench"


def measure(settings: Settings, say: Callable[[str], None]) -> dict[str, object]:
    subprocess.run(["ninja", "-C", ROOT / "build", "kanuka_light_bench"], check=True, capture_output=True)
    options = ["--quick"] if settings.quick else []
    done = subprocess.run([BINARY, *options], capture_output=True, text=True, check=True)
    runs = [json.loads(line) for line in done.stdout.splitlines()]
    for run in runs:
        few = next(each for each in runs if each["lights"] == run["lights"] and each["count"] == 10)
        run["slower"] = run["ns_a_sample"] / few["ns_a_sample"]
        run["quieter"] = run["uniform_noise"] / run["noise"]
        say(
            f"  {run['count']:>6} {run['lights']:<9} {run['ns_a_sample']:.0f} ns a sample, {run['slower']:.2f} of 10, "
            f"noise {run['noise']:.2f}, of uniform choice {run['uniform_noise']:.2f}"
        )
    return {"runs": runs}
