"""The time of a sample and its noise, by the number of lights (kanuka_light_bench)."""

from __future__ import annotations

from settings import Found, Say, Settings, built, lines_of, median_lines

ROUNDS = 5


def measure(settings: Settings, say: Say) -> Found:
    program = built("kanuka_light_bench", "transport")
    rounds = [lines_of(program, *(["--quick"] if settings.quick else []))]
    rounds += [lines_of(program, "--times") for _ in range(0 if settings.quick else ROUNDS - 1)]
    runs = median_lines(rounds, ("ns_a_sample", "build_s"))
    for run in runs:
        few = next(each for each in runs if each["lights"] == run["lights"] and each["count"] == 10)
        run["slower"] = run["ns_a_sample"] / few["ns_a_sample"]
        turns = zip(run["rounds"]["ns_a_sample"], few["rounds"]["ns_a_sample"], strict=True)
        run["rounds"]["slower"] = [a / b for a, b in turns]
        run["quieter"] = run["uniform_noise"] / run["noise"]
        say(
            f"  {run['count']:>6} {run['lights']:<10} {run['ns_a_sample']:.0f} ns a sample, {run['slower']:.2f} of 10, "
            f"noise {run['noise']:.2f}, of uniform choice {run['uniform_noise']:.2f}"
        )
    return {"runs": runs}
