"""Kanuka and other renderers on the same scenes, and Kanuka against itself, on one machine.

    python bench/run.py                        all of it, into bench/results.json, bench/RESULTS.md and docs/
    python bench/run.py --quick                does everything work? small pictures, two minutes; figures into out/bench
    python bench/run.py --measure agreement --scene conductor      a part of it, into out/bench
    python bench/run.py --list                 its parts, and when each was measured

A run that was stopped goes on where it was: what is measured at this commit, on this machine, is not measured again
unless --again says so. Renderers live in virtual environments that bench/setup.sh makes, in the folder KANUKA_PEERS
(build/peers); meshes and converged pictures are kept in KANUKA_BENCH_CACHE (build/bench). A renderer that is not
installed is left out and named.
"""

from __future__ import annotations

import argparse
import datetime
import sys
import time
import traceback
from pathlib import Path

import machine
import peers
import plan
import report
from results import Results
from settings import ROOT, Settings

QUICK_SHARE = 0.05  # of the time of a whole part


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    measures = list(dict.fromkeys(part.measure for part in plan.parts()))
    scenes = list(dict.fromkeys(part.about for part in plan.parts() if part.about))
    parser.add_argument("--quick", action="store_true", help="small pictures and scenes: no timings worth keeping")
    parser.add_argument("--measure", action="append", choices=measures, help="this one alone; may be repeated")
    parser.add_argument("--scene", action="append", choices=scenes, metavar="NAME", help="what parts are about")
    parser.add_argument("--peer", action="append", choices=list(peers.RENDERERS)[1:], metavar="NAME")
    parser.add_argument("--rounds", type=int, default=0, help="of each renderer, in turn (6; quick: 3)")
    parser.add_argument("--threads", type=int, default=0, help="for every renderer; default: all cores")
    parser.add_argument("--isle-scale", type=float, default=Settings.isle_scale, help="of isles/motu: 0.005 to 1 (0.1)")
    parser.add_argument("--again", action="store_true", help="also what is measured already")
    parser.add_argument("--list", action="store_true", help="show the parts, and measure nothing")
    parser.add_argument("-o", "--output", type=Path, help="folder of results.json and RESULTS.md")
    arguments = parser.parse_args()
    if not 0.005 <= arguments.isle_scale <= 1:
        parser.error("--isle-scale: from 0.005 to 1")
    if arguments.rounds < 0 or arguments.threads < 0:
        parser.error("--rounds and --threads: from 1 on")
    return arguments


def chosen(arguments: argparse.Namespace) -> list[plan.Part]:
    return [
        part
        for part in plan.parts(arguments.peer)
        if (not arguments.measure or part.measure in arguments.measure)
        and (not arguments.scene or part.about in arguments.scene)
        and (part.quick or not arguments.quick or arguments.measure or arguments.scene)
    ]


class Clock:
    """How long the rest will take: by what parts took before, or the plan's word, times how that went so far."""

    def __init__(self, parts: list[plan.Part], results: Results, quick: bool) -> None:
        share = QUICK_SHARE if quick else 1
        self.expected = {part.name: results.seconds(part.name) or share * part.seconds for part in parts}
        self.gone = self.planned = 0.0

    def done(self, part: plan.Part, seconds: float) -> None:
        self.gone += seconds
        self.planned += self.expected.pop(part.name)

    def left(self) -> str:
        pace = self.gone / self.planned if self.planned else 1
        return f"{pace * sum(self.expected.values()) / 60:.0f} min left"


def take(part: plan.Part, settings: Settings, results: Results, taken: dict[str, object]) -> str:
    """Measures; says what failed, or nothing. peers.NotInstalled is for the caller."""
    start, before = time.time(), machine.load()
    try:
        found = part.take(settings, say)
    except peers.NotInstalled:
        raise
    except Exception as error:  # one measure that fails leaves the others
        if not isinstance(error, peers.WorkerError | RuntimeError | OSError):
            traceback.print_exc()
        return f"{part.name}: {error}"
    took = {"seconds": round(time.time() - start, 1), "load": [before, machine.load()]}
    results.put(part.name, taken | took, found)
    return ""


def main() -> int:
    arguments = parse()
    partial = bool(arguments.quick or arguments.scene or arguments.peer or arguments.measure or arguments.threads)
    rounds = arguments.rounds or (3 if arguments.quick else 6)
    settings = Settings(arguments.quick, rounds, arguments.threads, arguments.isle_scale)
    folder = arguments.output or (ROOT / "out" / "bench" if partial else ROOT / "bench")
    results = Results(folder / "results.json")
    taken = {
        "commit": machine.commit(),
        "machine": machine.describe(),
        "date": datetime.date.today().isoformat(),
        "rounds": settings.rounds,
        "quick": settings.quick,
        "threads": settings.threads or machine.cores(),
    }
    parts = chosen(arguments)
    if arguments.list:
        for part in parts:
            old = results.parts.get(part.name, {}).get("taken", {})
            say(f"{part.name:<34} {old.get('commit', 'not measured'):<14} {old.get('date', '')}")
        return 0
    if not partial and taken["commit"].endswith("-dirty"):
        say("The sources are not committed: figures would be of no commit. Commit, or measure a part of it.")
        return 2
    waiting = [part for part in parts if arguments.again or arguments.quick or not results.has(part.name, taken)]
    say("{cpu}, {cores} cores, {isa}; load {load}".format(**taken["machine"], load=machine.load()))
    if len(waiting) < len(parts):
        say(f"{len(parts) - len(waiting)} of {len(parts)} parts are there already, in {results.path}")
    clock, failures, left_out = Clock(waiting, results, arguments.quick), [], []
    for number, part in enumerate(waiting, 1):
        say(f"[{number}/{len(waiting)}, {clock.left()}] {part.name}")
        start = time.time()
        try:
            if failed := take(part, settings, results, taken):
                failures.append(failed)
                say(f"  FAILED: {failed}")
        except peers.NotInstalled as error:
            left_out.append(f"{part.name}: {error}")
            say(f"  left out: {error}")
        clock.done(part, time.time() - start)
        report.write(results, folder)
    say(report.console(results))
    if not partial:
        report.write_docs(results)
    for line in left_out:
        say(f"left out: {line}")
    for line in failures:
        say(f"FAILED {line.splitlines()[0]}")
    say(f"{results.path}\n{folder / 'RESULTS.md'}")
    return 1 if failures else 0


def say(line: str) -> None:
    print(line, flush=True)


if __name__ == "__main__":
    sys.exit(main())
