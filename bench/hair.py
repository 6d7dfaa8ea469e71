"""Five million hairs: how long they load, dice, build and render, and what they take.

    python bench/hair.py [--hairs 5000000] [--cubic] [--output hair.exr]

A field of bent hairs of five segments, in pieces of a hundred thousand as a groom has them, written as binary RIB into
a temporary folder; a process of its own loads and renders it, so that its peak memory is its own.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

SEGMENTS = 5
PIECE = 100_000  # hairs of a Curves request
SIDE, LENGTH, WIDTH = 2.0, 0.06, 0.0004
TIMES = ("load_s", "dice_s", "shade_s", "bvh_s", "transport_s")
MEMORY = ("loaded_bytes", "grids_bytes", "lobe_inputs_bytes", "bvh_bytes", "peak_bytes")
HEAD = """\
Format 640 360 1
PixelSamples 2 2
Projection "perspective" "fov" [40]
Rotate -35 1 0 0
Translate 0 -1.1 1.6
WorldBegin
LightSource "distantlight" 1 "point from" [-1 3 -1] "point to" [0 0 0]
LightSource "environmentlight" 2 "float intensity" [0.4]
Basis "b-spline" 1 "b-spline" 1
Color [0.35 0.2 0.1]
"""


def piece(rng: np.random.Generator, count: int, vertices: int) -> np.ndarray:
    """Control points of `count` hairs, (count, vertices, 3): up from the ground, bent over."""
    t = np.linspace(0, 1, vertices, dtype=np.float32)[None, :, None]
    root = np.zeros((count, 1, 3), np.float32)
    root[:, 0, 0::2] = (rng.random((count, 2), np.float32) - 0.5) * SIDE
    lean = (rng.random((count, 1, 3), np.float32) - 0.5) * np.float32(0.6)
    bend = (rng.random((count, 1, 3), np.float32) - 0.5) * np.float32(1.2)
    up = np.array([0, 1, 0], np.float32)
    return root + np.float32(LENGTH) * ((up + lean) * t + (bend - 0.4 * up) * t * t)


def floats(array: np.ndarray) -> bytes:
    """RISpec C.2: an array of floats with a length of four bytes."""
    return b"\313" + int(array.size).to_bytes(4, "big") + array.astype(">f4").tobytes()


def write(path: Path, hairs: int, cubic: bool) -> None:
    rng = np.random.default_rng(1)
    vertices = SEGMENTS + (3 if cubic else 1)
    with path.open("wb") as file:
        file.write(HEAD.encode())
        for begin in range(0, hairs, PIECE):
            count = min(PIECE, hairs - begin)
            file.write(b'Curves "%s" [' % (b"cubic" if cubic else b"linear"))
            file.write(b"%d " % vertices * count)
            file.write(b'] "nonperiodic" "P" ' + floats(piece(rng, count, vertices)))
            file.write(b' "constantwidth" [%g]\n' % WIDTH)
        file.write(b"WorldEnd\n")


def render(path: Path, output: str, threads: int) -> None:
    """Prints the figures as JSON; runs as a process of its own."""
    import resource
    import time

    import kanuka

    begin, cpu = time.perf_counter(), time.process_time()
    scene = kanuka.load(path)
    load_s, load_cpu_s = time.perf_counter() - begin, time.process_time() - cpu
    loaded_peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    begin, cpu = time.perf_counter(), time.process_time()
    picture = kanuka.render(scene, threads=threads or None)
    stats = picture.stats
    figures = {
        "load_s": load_s,
        "load_cpu_s": load_cpu_s,
        "loaded_bytes": loaded_peak,
        **{name: stats["time"][name] for name in ("dice_s", "shade_s", "bvh_s", "transport_s")},
        "all_s": load_s + time.perf_counter() - begin,
        "cpu_s": load_cpu_s + time.process_time() - cpu,
        "polygons": stats["count"]["traced_polygons"],
        **{f"{name}_bytes": stats["bytes"][name] for name in ("grids", "lobe_inputs", "bvh")},
        "peak_bytes": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024,
        "messages": [str(message) for message in scene.journal.messages],
    }
    if output:
        picture.write(output)
    print(json.dumps(figures))


def run(hairs: int, cubic: bool, threads: int = 0, output: Path | None = None) -> dict[str, object]:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "hair.rib"
        write(path, hairs, cubic)
        size = path.stat().st_size
        command = [sys.executable, __file__, "--render", path, "--threads", threads]
        command += ["--output", output.absolute()] if output else []
        done = subprocess.run([*map(str, command)], capture_output=True, text=True)
        if done.returncode:
            raise RuntimeError(f"{hairs} hairs ended with {done.returncode}:\n{done.stderr[-2000:]}")
    figures = json.loads(done.stdout.splitlines()[-1])
    kind = "cubic" if cubic else "linear"
    return {"hairs": hairs, "segments": hairs * SEGMENTS, "kind": kind, "file_bytes": size, **figures}


def summary(f: dict) -> str:
    times = ", ".join(f"{name[:-2]} {f[name]:.1f}" for name in TIMES)
    memory = ", ".join(f"{name[:-6].replace('_', ' ')} {f[name] / 1e9:.2f}" for name in MEMORY)
    return (
        f"{f['hairs'] / 1e6:g} M {f['kind']} hairs, {f['segments'] / 1e6:g} M segments, {f['polygons'] / 1e6:.1f} M "
        f"polygons: {times} s (together {f['all_s']:.1f} s, CPU {f['cpu_s']:.1f} s); {memory} GB"
    )


def measure(settings: object, kind: str, say: Callable[[str], None]) -> dict[str, object]:
    """For run.py: one run, linear or cubic."""
    found = run(20_000 if settings.quick else 5_000_000, kind == "cubic", settings.threads)
    say(f"  {summary(found)}")
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hairs", type=int, default=5_000_000)
    parser.add_argument(
        "--cubic", action="store_true", help="uniform B-splines of eight points instead of lines of six"
    )
    parser.add_argument("--threads", type=int, default=0)
    parser.add_argument("--output", type=Path, help="the picture")
    parser.add_argument("--render", type=Path, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.render:
        render(arguments.render, str(arguments.output or ""), arguments.threads)
        return
    figures = run(arguments.hairs, arguments.cubic, arguments.threads, arguments.output)
    print(summary(figures))
    for message in figures["messages"]:
        print(message)


if __name__ == "__main__":
    main()
