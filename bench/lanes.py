"""The time of the surface stage by the number of lanes (kanuka_lane_bench)."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from pathlib import Path

from measures import Settings

ROOT = Path(__file__).resolve().parent.parent
BINARY = ROOT / "build" / "src" / "transport" / "kanuka_lane_bench"


def measure(settings: Settings, say: Callable[[str], None]) -> dict[str, object]:
    subprocess.run(["ninja", "-C", ROOT / "build", "kanuka_lane_bench"], check=True, capture_output=True)
    done = subprocess.run(
        [BINARY, *(["--quick"] if settings.quick else [])], capture_output=True, text=True, check=True
    )
    runs = [json.loads(line) for line in done.stdout.splitlines()]
    for run in runs:
        say(
            f"  {run['material']:<7} {run['ns_1']:.0f} ns a hit by one lane, "
            f"{run['ns_8']:.0f} by 8 ({run['of_8']:.1f}×), "
            f"{run['ns_16']:.0f} by 16 ({run['of_16']:.1f}×)"
        )
    return {"runs": runs}
