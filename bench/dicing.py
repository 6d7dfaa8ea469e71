"""How fast surfaces are diced, without displacement or shading (kanuka_dice_bench)."""

from __future__ import annotations

from settings import Found, Say, Settings, built, median_lines, rounds_of

ROUNDS = 5


def measure(settings: Settings, say: Say) -> Found:
    """One thread: the goal is a thread's."""
    program = built("kanuka_dice_bench", "dice")
    rounds = rounds_of(settings, program, *(["--quick"] if settings.quick else []), rounds=ROUNDS)
    runs = median_lines(rounds, ("cpu_s", "seconds", "vertices_per_cpu_s"))
    for run in runs:
        say(
            f"  {run['case']:<34} {run['vertices'] / 1e6:6.2f} M vertices in {run['seconds']:.2f} s (CPU "
            f"{run['cpu_s']:.2f} s): {run['vertices_per_cpu_s'] / 1e6:.1f} M a second"
        )
    return {"runs": runs}
