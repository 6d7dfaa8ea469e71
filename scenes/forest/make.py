"""A forest of any number of trees, and a flight of 48 frames through it.

python scenes/forest/make.py --trees 1000000 --count
python scenes/forest/make.py --trees 100000 --frames 1-48 -o out/forest.exr      writes out/forest.0001.exr …
python scenes/forest/make.py --autumn --frames 20      every tree in a colour of its own
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import asdict
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import kanuka
from forest import woods
from kit import sinks


def frames_of(text: str) -> range:
    first, _, last = text.partition("-")
    wanted = range(int(first), int(last or first) + 1)
    if not wanted or wanted[0] < 1 or wanted[-1] > woods.FRAMES:
        raise argparse.ArgumentTypeError(f"{text}: frames are 1 to {woods.FRAMES}, as 1-48 or 7")
    return wanted


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trees", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--autumn", action="store_true", help="leaves of five colours, trees of all between them")
    parser.add_argument("--count", action="store_true", help="print the numbers, and make nothing")
    parser.add_argument("--frames", type=frames_of, default=range(1, 2), help="as 1-48 or 7 (1)")
    parser.add_argument("-o", "--output", type=Path, default=Path("out/forest.exr"), help="EXR or PNG")
    parser.add_argument("--resolution", default="960x400", metavar="WxH")
    parser.add_argument("--progressions", type=int, default=16, help="paths a pixel")
    parser.add_argument("--threads", type=int)
    given = parser.parse_args(arguments)
    scene = kanuka.Scene()
    try:
        numbers = woods.build(
            sinks.Nothing() if given.count else sinks.Live(scene), given.trees, given.seed, given.autumn
        )
    except ValueError as error:
        parser.error(str(error))
    for name, value in asdict(numbers).items():
        print(f"{name:<12} {value:>20,}")
    if given.count:
        return 0
    woods.staged(scene, given.frames[0])
    width, height = (int(word) for word in given.resolution.split("x"))
    scene.resolution = width, height
    shot = [woods.camera(frame) for frame in given.frames]
    session = kanuka.Session(scene, shot=shot, progressions=given.progressions, threads=given.threads)
    for frame, view in zip(given.frames, shot, strict=True):
        if frame != given.frames[0]:
            scene.camera = view
            session.update()
        session.advance()
        given.output.parent.mkdir(parents=True, exist_ok=True)
        session.picture().write(given.output.with_suffix(f".{frame:04d}{given.output.suffix}"))
    return 0


if __name__ == "__main__":
    sys.exit(main())
