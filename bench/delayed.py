"""A million delayed archives: how long they load, what they take, how many are read.

    python bench/delayed.py [--archives 1000000] [--folder /tmp/delayed]

Boxes with balls in them stand on a plane, PITCH apart. The camera stands in a court; walls hide what is beyond it.
"""

from __future__ import annotations

import argparse
import resource
import tempfile
import time
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
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--archives", type=int, default=1_000_000)
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--output", type=Path)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = arguments.folder or Path(temporary)
        folder.mkdir(exist_ok=True)
        path = write(folder, arguments.archives)
        print(f"{arguments.archives} delayed archives, {path.stat().st_size / 2**20:.0f} MB of RIB, {FILES} files")
        begin, cpu = time.perf_counter(), time.process_time()
        scene = kanuka.load(path, on_demand=True)
        print(f"load    {time.perf_counter() - begin:6.1f} s (CPU {time.process_time() - cpu:.1f} s), {peak():.0f} MB")
        begin, cpu = time.perf_counter(), time.process_time()
        picture = kanuka.render(scene)
        print(f"render  {time.perf_counter() - begin:6.1f} s (CPU {time.process_time() - cpu:.1f} s), {peak():.0f} MB")
        count = picture.stats["count"]
        print(f"read    {count['procedurals_read']} of {count['procedurals']}")
        for message in scene.journal.messages:
            print(message)
        if arguments.output:
            picture.write(arguments.output)


if __name__ == "__main__":
    main()
