"""How fast RIB is read, of one thread's CPU time (kanuka_rib_bench)."""

from __future__ import annotations

import tempfile

from settings import Found, Say, Settings, built, median_lines, rounds_of

ROUNDS = 5


def measure(settings: Settings, say: Say) -> Found:
    program = built("kanuka_rib_bench", "ingest")
    megabytes = 2 if settings.quick else 60
    with tempfile.TemporaryDirectory() as folder:
        rounds = rounds_of(settings, program, megabytes, folder, rounds=ROUNDS)
    runs = median_lines(rounds, ("seconds", "bytes_per_s", "peak_bytes"))
    for run in runs:
        say(
            f"  {run['what']:<16} {run['bytes'] / 1e6:6.1f} MB, {run['primitives']} primitives: "
            f"{run['seconds']:.3f} s, {run['bytes_per_s'] / 1e6:.0f} MB/s, {run['peak_bytes'] / 1e6:.0f} MB at most"
        )
    return {"runs": runs}
