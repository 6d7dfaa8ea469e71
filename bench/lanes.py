"""The time of the surface stage by the number of lanes (kanuka_lane_bench)."""

from __future__ import annotations

from settings import Found, Say, Settings, built, lines_of


def measure(settings: Settings, say: Say) -> Found:
    """The program takes lane counts in turn, round by round."""
    program = built("kanuka_lane_bench", "transport")
    lines = lines_of(program, "--quick" if settings.quick else f"--rounds={max(settings.rounds, 5)}")
    for run in lines:
        one, eight, sixteen = (sorted(run["rounds"][n])[len(run["rounds"][n]) // 2] for n in ("1", "8", "16"))
        run |= {"ns_1": one, "ns_8": eight, "ns_16": sixteen}
        say(
            f"  {run['material']:<7} {one:.0f} ns a hit by one lane, {eight:.0f} by 8 ({one / eight:.1f}×), "
            f"{sixteen:.0f} by 16 ({one / sixteen:.1f}×)"
        )
    return {"runs": lines}
