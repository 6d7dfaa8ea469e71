"""Scenes of instances: the island at a scale, forests of 100 000 and a million trees, a million pebbles, 10^16 leaves.

    python bench/run.py --measure isles [--scene motu] [--isle-scale 0.1]

Each is rendered in a process of its own, at 1024 × 429 with five bounces. Bytes an instance are the difference to the
same scene with the few placements of each exemplar that are nearest to the camera, over the placements that it lacks:
by those exemplars are diced, so both have the same micropolygons. `bytes_each`: of the process's peak, but for forests:
theirs is that of leaves as they are diced, and the hierarchy is made in what is free after that. Pebbles are one small
shape, so their peak is that of instances. `kept_each`: a placement and its part of the hierarchy as they stay.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

import kanuka
from goals import PLACEMENT
from settings import ROOT, Found, Say, Settings

sys.path.append(str(ROOT / "scenes"))

from kit import places, sinks

RESOLUTION = (1024, 429)
BOUNCES = 5
SAMPLES = 4  # after the first
FORESTS = (100_000, 1_000_000)
PEBBLES = 1_000_000
PEBBLES_EYE = (0.0, 30.0, -60.0)


def peak() -> int:
    """Most resident bytes of this process. rusage counts what it was before it became this."""
    status = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines())
    return 1024 * int(status["VmHWM"].split()[0])


class Sparse(sinks.Live):
    """Few placements of each: those that the camera at `eye` sees largest."""

    FEW, CHUNK = 64, 1 << 18

    def __init__(self, scene: kanuka.Scene, eye: Sequence[float]) -> None:
        super().__init__(scene)
        self.eye = np.array(eye)

    def group(self, name: str) -> sinks.Live:
        return sinks.Live(self.scene, self.scene.add_group(name))

    def instances(self, group: sinks.Live, transforms: np.ndarray) -> None:
        super().instances(group, self.largest(transforms))

    def largest(self, transforms: np.ndarray) -> np.ndarray:
        if len(transforms) > self.CHUNK:  # a bit at a time: what this takes is none of the scene's
            firsts = range(0, len(transforms), self.CHUNK)
            transforms = np.concatenate([self.largest(transforms[first : first + self.CHUNK]) for first in firsts])
        sizes = np.linalg.norm(transforms[:, :, :3], axis=1).max(axis=1)
        seen = sizes / np.maximum(np.linalg.norm(transforms[:, :, 3] - self.eye, axis=1), 1e-6)
        return transforms[np.sort(np.argsort(-seen, kind="stable")[: self.FEW])]


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


def pebbles(sink: sinks.Live, _folder: Path, number: int) -> int:
    """On a jittered lattice, and a few thousand at a time: what makes them has no memory to speak of."""
    pebble = sink.group("pebble")
    pebble.into.add_sphere(0.3, material="matte")
    side = int(np.ceil(np.sqrt(number)))
    rng = np.random.default_rng(7)
    for first in range(0, number, Sparse.CHUNK):
        row, column = np.divmod(np.arange(first, min(first + Sparse.CHUNK, number)), side)
        n = len(row)
        x, z = (axis - 0.5 * side + rng.random(n) for axis in (column, row))
        where = np.stack([x, 0.1 * rng.random(n), z], axis=1).astype(np.float32)
        sink.instances(pebble, places.matrices(where, rng.uniform(0, 2 * np.pi, n), rng.uniform(0.5, 1.2, n)))
    sink.scene.camera = kanuka.Camera(PEBBLES_EYE, (0, 0, 0), fov=50)
    sink.scene.add_light("sky", turbidity=3)
    return number


def nested(sink: sinks.Live, _folder: Path, _trees: int) -> int:
    from nested import make

    sink.scene = make.scene()
    return sink.scene.summary()["instances"]


MAKERS: dict[str, Callable[[sinks.Live, Path, int], int]] = {
    "motu": motu,
    "forest": forest,
    "pebbles": pebbles,
    "nested": nested,
}


def eye(scene: str) -> Sequence[float]:
    from forest import woods
    from motu import cameras

    return {"motu": cameras.CAMERAS["shore"].origin, "forest": woods.way(1), "pebbles": PEBBLES_EYE}[scene]


def render(given: argparse.Namespace) -> Found:
    scene = kanuka.Scene()
    sink = Sparse(scene, eye(given.render)) if given.sparse else sinks.Live(scene)
    start = time.perf_counter()
    rows = MAKERS[given.render](sink, given.folder, given.many)
    found: Found = {"read_s": time.perf_counter() - start, "instances": rows}
    journal = kanuka.Journal()
    session = kanuka.Session(
        sink.scene, progressions=1 + given.samples, threads=given.threads or None, journal=journal, keep_pages=False,
        resolution=(given.width, given.height), max_depth=BOUNCES,
    )  # fmt: skip
    of_processor = time.process_time()
    session.prepare()
    found["prepare_cpu_s"] = time.process_time() - of_processor
    found["prepared_s"] = time.perf_counter() - start
    session.advance(progressions=1)
    found["first_picture_s"] = time.perf_counter() - start
    if not given.sparse:
        session.advance()
        found["sample_s"] = (time.perf_counter() - start - found["first_picture_s"]) / given.samples
    picture = session.picture()
    found["rows"], found["vertices"] = (picture.stats["count"][of] for of in ("instances", "vertices"))
    found["hierarchy_bytes"], found["hierarchy_s"] = picture.stats["bytes"]["bvh"], picture.stats["time"]["bvh_s"]
    found["said"] = [str(message) for message in journal.messages if message.severity != "info"]
    return found | {"peak_bytes": peak()}


def run(settings: Settings, scene: str, folder: Path, many: int, *more: str) -> Found:
    width, height = (max(16, round(side * settings.scale)) for side in RESOLUTION)
    command = [sys.executable, __file__, "--render", scene, "--folder", folder, "--many", many, "--width", width]
    command += ["--height", height, "--threads", settings.threads, "--samples", 1 if settings.quick else SAMPLES, *more]
    done = subprocess.run([*map(str, command)], capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"{scene} ended with {done.returncode}:\n{done.stderr[-2000:]}")
    return json.loads(done.stdout.splitlines()[-1])


def measure(settings: Settings, name: str, say: Say) -> Found:
    """For run.py."""
    scene, _, number = name.partition("-")
    many = int(number or 0)
    if settings.quick:
        many //= 100
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
        found = run(settings, scene, folder, many) | made
        if scene != "nested":
            sparse = run(settings, scene, folder, many, "--sparse")
            more = found["rows"] - sparse["rows"]
            if scene != "forest":
                found["bytes_each"] = (found["peak_bytes"] - sparse["peak_bytes"]) / more
            found["kept_each"] = PLACEMENT + (found["hierarchy_bytes"] - sparse["hierarchy_bytes"]) / more
            found["vertices_ratio"] = found["vertices"] / sparse["vertices"]
    if scene == "forest":
        found["trees"] = many
    if found["said"]:
        say("  " + "; ".join(found["said"]))
    say(
        f"  {found['rows']:,} instances: read {found['read_s']:.1f} s, first picture {found['first_picture_s']:.1f} s, "
        f"a sample {found['sample_s']:.2f} s, {found['peak_bytes'] / 1e6:.0f} MB"
    )
    return found


SCENES = ("motu", *(f"forest-{trees}" for trees in FORESTS), f"pebbles-{PEBBLES}", "nested")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--render", choices=list(MAKERS), required=True)
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--sparse", action="store_true", help="few placements of each exemplar, and one sample")
    for name, usual in {"many": 0, "threads": 0, "width": 1024, "height": 429, "samples": SAMPLES}.items():
        parser.add_argument(f"--{name}", type=int, default=usual)
    print(json.dumps(render(parser.parse_args())))


if __name__ == "__main__":
    main()
