"""Makes docs/images/isles/: the island from three places, six frames of the flight through the forest, one
of autumn, 10^16 leaves.

    python tools/make_isle_pictures.py [shore beach dunes forest autumn nested] [--samples 64] [--width 1024]
        [--scale 0.01] [--trees 100000]

JPEG by Pillow, each below 400 kB.
"""

from __future__ import annotations

import argparse
import io
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

import kanuka

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "scenes"))

from forest import woods  # noqa: E402
from kit import sinks  # noqa: E402
from motu import scene as motu  # noqa: E402
from motu.cameras import CAMERAS  # noqa: E402
from nested import make as nested  # noqa: E402

IMAGES = ROOT / "docs" / "images" / "isles"
MOST_BYTES = 400_000
FRAMES = (1, 10, 20, 29, 38, 48)


def size_of(width: int) -> tuple[int, int]:
    return width, round(width * 429 / 1024)


def shown(picture: kanuka.Picture) -> np.ndarray:
    """As a PNG has it: (height, width, 3) of bytes."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.png"
        picture.write(path)
        return np.asarray(Image.open(path).convert("RGB"))


def write(name: str, pixels: np.ndarray) -> None:
    IMAGES.mkdir(parents=True, exist_ok=True)
    for quality in range(92, 40, -4):
        data = io.BytesIO()
        Image.fromarray(pixels).save(data, "JPEG", quality=quality, optimize=True)
        if len(data.getvalue()) < MOST_BYTES:
            break
    (IMAGES / name).write_bytes(data.getvalue())
    print(f"{IMAGES / name}: {len(data.getvalue()) // 1000} kB, quality {quality}", flush=True)


def island(camera: str, given: argparse.Namespace) -> np.ndarray:
    made = kanuka.Scene()
    motu.build(sinks.Live(made), given.scale)
    motu.staged(made, camera).resolution = size_of(given.width)
    return shown(kanuka.render(made, progressions=given.samples, threads=given.threads))


def autumn(given: argparse.Namespace) -> np.ndarray:
    made = kanuka.Scene()
    woods.build(sinks.Live(made), given.trees, autumn=True)
    woods.staged(made, 24)
    made.resolution = size_of(given.width)
    return shown(kanuka.render(made, progressions=given.samples, threads=given.threads))


def flight(given: argparse.Namespace) -> np.ndarray:
    made = kanuka.Scene()
    woods.build(sinks.Live(made), given.trees)
    woods.staged(made, FRAMES[0])
    made.resolution = size_of(given.width // 2)
    frames = []
    shot = [woods.camera(frame) for frame in FRAMES]
    session = kanuka.Session(made, shot=shot, progressions=given.samples, threads=given.threads)
    for view in shot:
        if frames:
            made.camera = view
            session.update()
        session.advance()
        frames.append(shown(session.picture()))
    framed = [np.pad(frame, ((2, 2), (2, 2), (0, 0)), constant_values=255) for frame in frames]
    return np.concatenate([np.concatenate(framed[k : k + 2], axis=1) for k in range(0, len(framed), 2)])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    names = [*CAMERAS, "forest", "autumn", "nested"]
    parser.add_argument("pictures", nargs="*", default=names)
    parser.add_argument("--samples", type=int, default=64)
    parser.add_argument("--width", type=int, default=1024, help="of a picture, or of two frames")
    parser.add_argument("--scale", type=float, default=0.01, help="of the island")
    parser.add_argument("--trees", type=int, default=100_000, help="of the forest")
    parser.add_argument("--threads", type=int)
    given = parser.parse_args()
    if unknown := set(given.pictures) - set(names):
        parser.error(f"{', '.join(sorted(unknown))}: there are {', '.join(names)}")
    for name in given.pictures:
        if name in CAMERAS:
            write(f"{name}.jpg", island(name, given))
        elif name == "forest":
            write("forest.jpg", flight(given))
        elif name == "autumn":
            write("autumn.jpg", autumn(given))
        else:
            size = size_of(given.width)
            picture = kanuka.render(nested.scene(), progressions=given.samples, threads=given.threads, resolution=size)
            write("nested.jpg", shown(picture))


if __name__ == "__main__":
    main()
