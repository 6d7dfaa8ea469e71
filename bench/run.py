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
from collections.abc import Callable
from pathlib import Path

import compiler
import dicing
import hair
import lanes
import lights
import machine
import measures
import peers
import report
from results import Results

ROOT = Path(__file__).resolve().parent.parent
MEASURES = (
    "side-by-side",
    "micropolygons",
    "dice",
    "hair",
    "networks",
    "shaders",
    "lights",
    "lanes",
    "tolerance",
    "agreement",
)
# Mitsuba's LLVM mode does not take 100 000 instances, and it has no procedural textures.
SCENES = {
    "cornell": ("mitsuba-llvm-spectral", "mitsuba-scalar-spectral", "cycles", "luxcore"),
    "terrain": ("mitsuba-llvm-spectral", "mitsuba-scalar-spectral", "cycles", "luxcore"),
    "forest": ("mitsuba-scalar-spectral", "cycles", "luxcore"),
    "still-life": ("mitsuba-llvm-spectral", "mitsuba-llvm-rgb", "cycles", "luxcore"),
    "shading": ("cycles", "luxcore"),
}
AGREEMENT = ("cornell", "grey-cornell", "terrain", "environment", "conductor", "dielectric", "dispersion")


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="small pictures and scenes: no timings worth keeping")
    parser.add_argument(
        "--scene",
        action="append",
        choices=list(dict.fromkeys([*SCENES, *AGREEMENT])),
        help="this one alone; may be repeated",
    )
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
    """Ours, and those usual for the scene; named ones in any case."""
    names = SCENES[scene]
    if given:
        names = [name for name in peers.RENDERERS if name != "kanuka" and name.startswith(tuple(given))]
    return [measures.OURS, *(peers.RENDERERS[name] for name in names)]


def main() -> int:
    arguments = parse()
    partial = bool(arguments.quick or arguments.scene or arguments.peer or arguments.measure)
    settings = measures.Settings(arguments.quick, arguments.repeats or (2 if arguments.quick else 3), arguments.threads)
    header = {
        "machine": machine.describe(),
        "commit": machine.commit(),
        "date": datetime.date.today().isoformat(),
        "command": shlex.join(["bench/run.py", *sys.argv[1:]]),
        "quick": arguments.quick,
        "repeats": settings.repeats,
        "threads": settings.threads or machine.cores(),
    }
    say("{cpu}, {cores} cores, {isa}; load {load_before}".format(**header["machine"]))
    results = Results(arguments.output or (ROOT / "out" / "bench" if partial else ROOT / "bench"), header, say)
    wanted = set(arguments.measure or MEASURES)
    chosen = arguments.scene or list(dict.fromkeys([*SCENES, *AGREEMENT]))
    failures: list[str] = []

    def attempt(measure: Callable[..., dict[str, object]], *given: object) -> list[dict[str, object]]:
        """One measure that fails leaves the others."""
        try:
            return [measure(settings, *given, say)]
        except peers.WorkerError as error:
            failures.append(str(error))
            say(f"  {error}")
            return []

    if "side-by-side" in wanted:
        for scene in (scene for scene in chosen if scene in SCENES):
            say(f"{scene}:")
            runs = measures.side_by_side(settings, scene, chosen_peers(scene, arguments.peer), say, failures)
            summaries = [each.summary(scene) for each in runs]
            results.put("medians", scene, summaries)
            results.put("ratios", scene, measures.ratios(summaries))
    if "micropolygons" in wanted and not arguments.scene:
        say("micropolygons:")
        results.put("micropolygons", "", attempt(measures.micropolygons))
    if "dice" in wanted and not arguments.scene:
        say("dicing, a thread:")
        results.put("dice", "", attempt(dicing.measure))
    if "hair" in wanted and not arguments.scene:
        say("hair:")
        results.put("hair", "", attempt(hair.measure))
    if "networks" in wanted and not arguments.scene:
        say("shader networks, from an empty cache to the last pixel:")
        for n in measures.NETWORK_SAMPLES:
            results.put("networks", n, attempt(measures.network, n))
    if "shaders" in wanted and not arguments.scene:
        say("the shader compiler and what it makes:")
        results.put("shaders", "", attempt(compiler.measure))
    if "lights" in wanted and not arguments.scene:
        say("lights, from ten to a hundred thousand:")
        results.put("lights", "", attempt(lights.measure))
    if "lanes" in wanted and not arguments.scene:
        say("the surface stage by one lane, by 8 and by 16:")
        results.put("lanes", "", attempt(lanes.measure))
    if "tolerance" in wanted and not arguments.scene:
        say("geometry tolerance, on and off:")
        for kind in measures.TOLERANCE_SCENES:
            results.put("tolerance", kind, attempt(measures.tolerance, kind))
    if "agreement" in wanted:
        say("agreement with a converged picture:")
        for scene in (scene for scene in AGREEMENT if scene in chosen):
            results.put("agreement", scene, attempt(measures.agrees, scene))

    for line in failures:
        results.fail(line)
    say("")
    say(report.console(results.data))
    say(f"{results.folder / 'results.json'}\n{results.folder / 'RESULTS.md'}")
    return 1 if failures else 0


def say(line: str) -> None:
    print(line, flush=True)


if __name__ == "__main__":
    sys.exit(main())
