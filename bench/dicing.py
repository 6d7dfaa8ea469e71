"""How fast surfaces are diced, without displacement or shading (kanuka_dice_bench)."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from pathlib import Path

from measures import Settings

ROOT = Path(__file__).resolve().parent.parent
BINARY = ROOT / "build" / "src" / "dice" / "kanuka_dice_bench"


def measure(settings: Settings, say: Callable[[str], None]) -> dict[str, object]:
    """One thread: the goal is a thread's."""
    subprocess.run(["ninja", "-C", ROOT / "build", "kanuka_dice_bench"], check=True, capture_output=True)
    done = subprocess.run(
        [BINARY, *(["--quick"] if settings.quick else [])], capture_output=True, text=True, check=True
    )
    runs = [json.loads(line) for line in done.stdout.splitlines()]
    for run in runs:
        say(
            f"  {run['case']:<34} {run['vertices'] / 1e6:6.2f} M vertices in {run['seconds']:.2f} s (CPU "
            f"{run['cpu_s']:.2f} s): {run['vertices_per_cpu_s'] / 1e6:.1f} M a second"
        )
    return {"runs": runs}
