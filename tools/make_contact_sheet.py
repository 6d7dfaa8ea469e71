"""Renders every RIB of some folders small, and puts the pictures side by side in one PNG, in the order of their names.

python tools/make_contact_sheet.py out/sheet.png ../shared/scenes/rib/aqsis scenes
"""

from __future__ import annotations

import argparse
import struct
import sys
import zlib
from pathlib import Path

import numpy as np

import kanuka


def scenes(folders: list[Path]) -> list[Path]:
    """Files that hold a world; archives are what others read."""
    found = []
    for folder in folders:
        for path in sorted(folder.rglob("*.rib*")) if folder.is_dir() else [folder]:
            try:
                if kanuka.load(path).summary()["primitives"]:
                    found.append(path)
            except kanuka.Error as error:
                print(f"{path}: {error}", file=sys.stderr)
    return found


def thumbnail(path: Path, width: int, height: int, samples: int, shaders: list[Path]) -> np.ndarray:
    scene = kanuka.load(path)
    scene.options.shader_path = [*scene.options.shader_path, *map(str, shaders)]
    w, h = scene.resolution
    scale = min(width / w, height / h)
    size = max(1, round(w * scale)), max(1, round(h * scale))
    picture = kanuka.render(scene, resolution=size, progressions=samples)
    rgb = np.clip(np.asarray(picture["rgb"]), 0, 1)
    rgb = np.where(rgb < 0.0031308, 12.92 * rgb, 1.055 * rgb ** (1 / 2.4) - 0.055)
    cell = np.full((height, width, 3), 48, np.uint8)
    y, x = (height - size[1]) // 2, (width - size[0]) // 2
    cell[y : y + size[1], x : x + size[0]] = (rgb * 255 + 0.5).astype(np.uint8)
    print(f"{path}: {len(picture.journal.messages)} messages")
    return cell


def write_png(path: Path, pixels: np.ndarray) -> None:
    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    height, width, _ = pixels.shape
    rows = b"".join(b"\0" + row.tobytes() for row in pixels)
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    body = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b"")
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + body)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("output", type=Path)
    parser.add_argument("folders", type=Path, nargs="+")
    parser.add_argument("--columns", type=int, default=4)
    parser.add_argument("--size", default="240x180")
    parser.add_argument("--samples", type=int, default=64)
    parser.add_argument("--shaders", type=Path, action="append", default=[], help="folder of shaders that scenes name")
    arguments = parser.parse_args()
    width, height = map(int, arguments.size.split("x"))
    cells = [thumbnail(path, width, height, arguments.samples, arguments.shaders) for path in scenes(arguments.folders)]
    rows = -(-len(cells) // arguments.columns)
    sheet = np.full((rows * height, arguments.columns * width, 3), 48, np.uint8)
    for k, cell in enumerate(cells):
        y, x = k // arguments.columns * height, k % arguments.columns * width
        sheet[y : y + height, x : x + width] = cell
    write_png(arguments.output, sheet)


if __name__ == "__main__":
    main()
