"""Kanuka and other renderers on the same scenes, in one run on one machine.

    python bench/run.py --quick                            does everything work? small pictures, a minute
    python bench/run.py                                    all of it, into bench/results.json and bench/RESULTS.md
    python bench/run.py --scene cornell --peer mitsuba     a part of it, into out/bench

Renderers live in virtual environments that bench/setup.sh makes, in the folder KANUKA_PEERS (build/peers); meshes and
converged pictures are kept in KANUKA_BENCH_CACHE (build/bench). One that is not installed is left out and named.
"""

from __future__ import annotations

import argparse
import datetime
import shlex
import sys
import time
from pathlib import Path

import machine
import measures
import peers
import report

HERE = Path(__file__).resolve().parent
MEASURES = ("side-by-side", "agreement", "micropolygons", "tolerance")
# Mitsuba's LLVM mode does not take 100 000 instances, and it has no procedural textures.
SCENES = {
    "cornell": ("mitsuba-llvm-spectral", "mitsuba-scalar-spectral", "cycles", "luxcore"),
    "terrain": ("mitsuba-llvm-spectral", "mitsuba-scalar-spectral", "cycles", "luxcore"),
    "forest": ("mitsuba-scalar-spectral", "cycles", "luxcore"),
    "shading": ("cycles", "luxcore"),
}
AGREEMENT = ("cornell", "terrain")


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="small pictures and scenes: no timings worth keeping")
    parser.add_argument("--scene", action="append", choices=SCENES, help="this one alone; may be repeated")
    parser.add_argument("--peer", action="append", metavar="NAME", help=f"of {', '.join(list(peers.RENDERERS)[1:])}")
    parser.add_argument("--measure", action="append", choices=MEASURES, help="this one alone; may be repeated")
    parser.add_argument("--repeats", type=int, default=0, help="runs of each; medians are given (3; quick: 2)")
    parser.add_argument("--threads", type=int, default=0, help="for every renderer; default: all cores")
    parser.add_argument("-o", "--output", type=Path, help="folder of results.json and RESULTS.md")
    arguments = parser.parse_args()
    for name in arguments.peer or ():
        if not any(peer.startswith(name) for peer in peers.RENDERERS):
            parser.error(f"--peer: no renderer's name starts with {name!r}; there are {', '.join(peers.RENDERERS)}")
    if arguments.repeats < 0 or arguments.threads < 0:
        parser.error("--repeats and --threads: from 1 on")
    return arguments


def chosen_peers(scene: str, given: list[str] | None) -> list[peers.Renderer]:
    """Those usual for the scene; named ones in any case."""
    names = SCENES[scene]
    if given:
        names = [name for name in peers.RENDERERS if name != "kanuka" and name.startswith(tuple(given))]
    return [peers.RENDERERS[name] for name in names]


def main() -> int:
    arguments = parse()
    partial = bool(arguments.quick or arguments.scene or arguments.peer or arguments.measure)
    output = arguments.output or (HERE.parent / "out" / "bench" if partial else HERE)
    output.mkdir(parents=True, exist_ok=True)
    settings = measures.Settings(arguments.quick, arguments.repeats or (2 if arguments.quick else 3), arguments.threads)
    wanted = set(arguments.measure or MEASURES)
    chosen = arguments.scene or list(SCENES)
    started = time.monotonic()

    def say(line: str) -> None:
        print(line, flush=True)

    results: dict[str, object] = {
        "machine": machine.describe(),
        "commit": machine.commit(),
        "date": datetime.date.today().isoformat(),
        "command": shlex.join(["bench/run.py", *sys.argv[1:]]),
        "quick": arguments.quick,
        "repeats": settings.repeats,
        "threads": settings.threads or machine.cores(),
    }
    say("{cpu}, {cores} cores, {isa}; load {load_before}".format(**results["machine"]))
    failures: list[str] = []
    summaries: list[dict[str, object]] = []
    if "side-by-side" in wanted:
        for scene in chosen:
            say(f"{scene}:")
            renderers = [measures.OURS]
            for peer in chosen_peers(scene, arguments.peer):
                if peer.installed:
                    renderers.append(peer)
                else:
                    failures.append(f"{peer.name} is not installed: bench/setup.sh does it, or set KANUKA_PEERS")
            runs = measures.side_by_side(settings, scene, renderers, say, failures)
            summaries += [each.summary(scene) for each in runs]
        results["ratios"] = measures.ratios(summaries)
        results["medians"] = summaries

    def attempt(key: str, measure, *given: object) -> None:
        """One measure that fails leaves the others."""
        try:
            found = measure(settings, *given, say)
        except peers.WorkerError as error:
            failures.append(str(error))
            say(f"  {error}")
            return
        results.setdefault(key, []).append(found)

    if "agreement" in wanted:
        say("agreement with a converged picture:")
        for scene in (scene for scene in AGREEMENT if scene in chosen):
            attempt("agreement", measures.agrees, scene)
    if "micropolygons" in wanted and not arguments.scene:
        say("micropolygons:")
        attempt("micropolygons", measures.micropolygons)
    if "tolerance" in wanted and not arguments.scene:
        say("geometry tolerance, on and off:")
        for kind in measures.TOLERANCE_SCENES:
            attempt("tolerance", measures.tolerance, kind)

    results["failures"] = list(dict.fromkeys(failures))
    results["seconds"] = round(time.monotonic() - started)
    results["goals"] = report.goals(results)
    report.write(output, results)
    say("")
    say(report.console(results))
    say(f"{output / 'results.json'}\n{output / 'RESULTS.md'}")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
