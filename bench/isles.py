"""Scenes of instances upon instances: the island at a scale, forests of 100 000 and a million trees, 10^16 leaves.

    python bench/run.py --measure isles [--scene motu] [--isle-scale 0.1]

Each is rendered in a process of its own, at 1024 × 429 with five bounces. Bytes an instance are the difference to the
same scene with one placement of each exemplar, over the placements that it lacks.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import kanuka
from settings import ROOT, Found, Say, Settings

sys.path.append(str(ROOT / "scenes"))

from kit import sinks

RESOLUTION = (1024, 429)
BOUNCES = 5
SAMPLES = 4  # after the first
FORESTS = (100_000, 1_000_000)


def peak() -> int:
    """Most resident bytes of this process. rusage counts what it was before it became this."""
    status = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines())
    return 1024 * int(status["VmHWM"].split()[0])


class Sparse(sinks.Live):
    """One placement of each."""

    def group(self, name: str) -> sinks.Live:
        return sinks.Live(self.scene, self.scene.add_group(name))

    def instances(self, group: sinks.Live, transforms: object) -> None:
        super().instances(group, transforms[:1])


# ---- scenes, each as a function of where it goes; what is made before the clock starts is in a folder


def motu(sink: sinks.Live, folder: Path, _trees: int) -> int:
    from motu import scene

    _, about = sinks.read(folder, sink)
    scene.staged(sink.scene)
    return about["numbers"]["instances"]


def forest(sink: sinks.Live, _folder: Path, trees: int) -> int:
    from forest import woods

    told = woods.build(sink, trees)
    woods.staged(sink.scene)
    return told.instances


def nested(sink: sinks.Live, _folder: Path, _trees: int) -> int:
    from nested import make

    sink.scene = make.scene()
    return sink.scene.summary()["instances"]


MAKERS: dict[str, Callable[[sinks.Live, Path, int], int]] = {"motu": motu, "forest": forest, "nested": nested}


def render(given: argparse.Namespace) -> Found:
    sink = (Sparse if given.sparse else sinks.Live)(kanuka.Scene())
    start = time.perf_counter()
    rows = MAKERS[given.render](sink, given.folder, given.trees)
    found: Found = {"read_s": time.perf_counter() - start, "instances": rows}
    journal = kanuka.Journal()
    session = kanuka.Session(
        sink.scene, progressions=1 + given.samples, threads=given.threads or None, journal=journal, keep_pages=False,
        resolution=(given.width, given.height), max_depth=BOUNCES,
    )  # fmt: skip
    session.prepare()
    found["prepared_s"] = time.perf_counter() - start
    if not given.sparse:
        session.advance(progressions=1)
        found["first_picture_s"] = time.perf_counter() - start
        session.advance()
        found["sample_s"] = (time.perf_counter() - start - found["first_picture_s"]) / given.samples
    picture = session.picture()
    found["rows"] = picture.stats["count"]["instances"]
    found["said"] = [str(message) for message in journal.messages if message.severity != "info"]
    return found | {"peak_bytes": peak()}


def run(settings: Settings, scene: str, folder: Path, trees: int, *more: str) -> Found:
    width, height = (max(16, round(side * settings.scale)) for side in RESOLUTION)
    command = [sys.executable, __file__, "--render", scene, "--folder", folder, "--trees", trees, "--width", width]
    command += ["--height", height, "--threads", settings.threads, "--samples", 1 if settings.quick else SAMPLES, *more]
    done = subprocess.run([*map(str, command)], capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"{scene} ended with {done.returncode}:\n{done.stderr[-2000:]}")
    return json.loads(done.stdout.splitlines()[-1])


def measure(settings: Settings, name: str, say: Say) -> Found:
    """For run.py."""
    scene, _, number = name.partition("-")
    trees = int(number or 0)
    if settings.quick:
        trees //= 100
    scale = 0.005 if settings.quick else settings.isle_scale
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        made: Found = {}
        if scene == "motu":
            start = time.perf_counter()
            command = [sys.executable, ROOT / "scenes/motu/make.py", "--scale", scale, "-o", folder]
            subprocess.run([*map(str, command)], check=True, capture_output=True)
            size = sum(file.stat().st_size for file in folder.iterdir())
            made = {"scale": scale, "made_s": time.perf_counter() - start, "folder_bytes": size}
        found = run(settings, scene, folder, trees) | made
        if scene != "nested":
            sparse = run(settings, scene, folder, trees, "--sparse")
            found["bytes_each"] = (found["peak_bytes"] - sparse["peak_bytes"]) / (found["rows"] - sparse["rows"])
    if scene == "forest":
        found["trees"] = trees
    if found["said"]:
        say("  " + "; ".join(found["said"]))
    say(
        f"  {found['rows']:,} instances: read {found['read_s']:.1f} s, first picture {found['first_picture_s']:.1f} s, "
        f"a sample {found['sample_s']:.2f} s, {found['peak_bytes'] / 1e6:.0f} MB"
    )
    return found


SCENES = ("motu", *(f"forest-{trees}" for trees in FORESTS), "nested")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--render", choices=list(MAKERS), required=True)
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--sparse", action="store_true", help="one placement of each exemplar, and no picture")
    for name, usual in {"trees": 0, "threads": 0, "width": 1024, "height": 429, "samples": SAMPLES}.items():
        parser.add_argument(f"--{name}", type=int, default=usual)
    print(json.dumps(render(parser.parse_args())))


if __name__ == "__main__":
    main()
