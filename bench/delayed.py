"""A million delayed archives: how long they load, what they take, how many are read.

    python bench/delayed.py [--archives 1000000] [--folder /tmp/delayed]

Boxes with balls in them stand on a plane, PITCH apart. The camera stands in a court; walls hide what is beyond it.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import kanuka

FILES = 300  # that the archives are taken from, by turns
PITCH = 4.0


def write(folder: Path, count: int) -> Path:
    rng = np.random.default_rng(1)
    for i in range(FILES):
        balls = "".join(
            f"TransformBegin Translate {x:.3f} {y:.3f} {z:.3f} Sphere 0.4 -0.4 0.4 360 TransformEnd\n"
            for x, y, z in rng.random((8, 3)) * 1.2 + 0.4
        )
        (folder / f"thing{i}.rib").write_text(f"Color [{0.2 + 0.6 * i / FILES:.3f} 0.5 0.4]\n{balls}")
    side = int(np.ceil(np.sqrt(count)))
    lines = []
    for k in range(count):
        x, z = (k % side - side / 2) * PITCH, (k // side - side / 2) * PITCH
        lines.append(
            f'TransformBegin Translate {x:g} 0 {z:g} Procedural "DelayedReadArchive" ["thing{k % FILES}.rib"] '
            "[0 2 0 2 0 2] TransformEnd\n"
        )
    path = folder / "scene.rib"
    path.write_text(
        'Format 320 180 1\nPixelSamples 2 2\nProjection "perspective" "fov" [40]\nRotate -4 1 0 0\nTranslate 0 -3 2\n'
        'WorldBegin\nLightSource "distantlight" 1 "point from" [-1 3 -1] "point to" [0 0 0]\n'
        'LightSource "environmentlight" 2 "float intensity" [0.4]\n'
        'Polygon "P" [-9000 0 -9000 -9000 0 9000 9000 0 9000 9000 0 -9000]\n'
        'Polygon "P" [-60 0 60 -60 40 60 60 40 60 60 0 60]\n'
        'Polygon "P" [-60 0 -20 60 0 -20 60 40 -20 -60 40 -20]\n'
        'Polygon "P" [-60 0 -20 -60 40 -20 -60 40 60 -60 0 60]\n'
        'Polygon "P" [60 0 -20 60 0 60 60 40 60 60 40 -20]\n' + "".join(lines) + "WorldEnd\n"
    )
    return path


def peak() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def load_and_render(path: Path, output: Path | None) -> dict[str, object]:
    begin, cpu = time.perf_counter(), time.process_time()
    scene = kanuka.load(path, on_demand=True)
    found = {"load_s": time.perf_counter() - begin, "load_cpu_s": time.process_time() - cpu, "load_peak_bytes": peak()}
    begin, cpu = time.perf_counter(), time.process_time()
    picture = kanuka.render(scene)
    found |= {"render_s": time.perf_counter() - begin, "render_cpu_s": time.process_time() - cpu, "peak_bytes": peak()}
    if output:
        picture.write(output)
    count = picture.stats["count"]
    return found | {"read": count["procedurals_read"], "messages": [str(m) for m in scene.journal.messages]}


def run(archives: int, folder: Path, output: Path | None = None) -> dict[str, object]:
    """In a process of its own, so that its peak memory is its own."""
    path = write(folder, archives)
    command = [sys.executable, __file__, "--render", path, *(["--output", output] if output else [])]
    done = subprocess.run([*map(str, command)], capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"{archives} archives ended with {done.returncode}:\n{done.stderr[-2000:]}")
    return {
        "archives": archives,
        "files": FILES,
        "rib_bytes": path.stat().st_size,
        **json.loads(done.stdout.splitlines()[-1]),
    }


def summary(f: dict) -> str:
    return (
        f"{f['archives']} delayed archives, {f['rib_bytes'] / 1e6:.0f} MB of RIB: load {f['load_s']:.1f} s (CPU "
        f"{f['load_cpu_s']:.1f} s), {f['load_peak_bytes'] / 1e6:.0f} MB; render {f['render_s']:.1f} s (CPU "
        f"{f['render_cpu_s']:.1f} s), {f['peak_bytes'] / 1e6:.0f} MB; {f['read']} read"
    )


def measure(settings: object, say: Callable[[str], None]) -> dict[str, object]:
    """For run.py."""
    with tempfile.TemporaryDirectory() as folder:
        found = run(20_000 if settings.quick else 1_000_000, Path(folder))
    say(f"  {summary(found)}")
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--archives", type=int, default=1_000_000)
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--output", type=Path)
    parser.add_argument("--render", type=Path, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.render:
        print(json.dumps(load_and_render(arguments.render, arguments.output)))
        return
    with tempfile.TemporaryDirectory() as temporary:
        folder = arguments.folder or Path(temporary)
        folder.mkdir(exist_ok=True)
        print(summary(run(arguments.archives, folder, arguments.output)))


if __name__ == "__main__":
    main()
