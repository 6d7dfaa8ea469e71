"""Makes docs/images/orientation.png: an environment picture with its axes written on it, what a camera in its middle
sees of it, and a mirror ball; docs/python.md shows it."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

import kanuka

ROOT = Path(__file__).resolve().parents[1]
FONT = {
    "+": "00000 00100 00100 11111 00100 00100 00000",
    "-": "00000 00000 00000 11111 00000 00000 00000",
    "X": "10001 10001 01010 00100 01010 10001 10001",
    "Y": "10001 10001 01010 00100 00100 00100 00100",
    "Z": "11111 00001 00010 00100 01000 10000 11111",
}
COLORS = {"X": (0.85, 0.15, 0.1), "Y": (0.15, 0.6, 0.15), "Z": (0.12, 0.25, 0.85)}
SIZE = 300  # of a panel


def label(text: str) -> np.ndarray:
    letters = [np.array([[int(c) for c in row] for row in FONT[t].split()]) for t in text]
    return np.pad(np.hstack([np.pad(letter, ((0, 0), (0, 1))) for letter in letters])[:, :-1], 1)


def sky(width: int) -> np.ndarray:
    """By latitude and longitude as OpenEXR and USD's DomeLight have it: +y up, +z in the middle, +x left of it."""
    height = width // 2
    longitude = np.pi * (1 - 2 * (np.arange(width) + 0.5) / width)
    latitude = np.pi * (0.5 - (np.arange(height) + 0.5) / height)[:, None]
    flat, y = np.cos(latitude), np.broadcast_to(np.sin(latitude), (height, width))
    d = np.stack([np.sin(longitude) * flat, y, np.cos(longitude) * flat], -1)
    degrees = np.degrees(np.stack([longitude + 0 * latitude, latitude + 0 * longitude]))
    picture = np.where(y[..., None] > 0, (0.55, 0.7, 0.9), (0.45, 0.42, 0.38))
    lines = (np.abs((degrees + 15) % 30 - 15) < 0.5).any(0)
    picture[lines] *= 0.8
    for axis, color in COLORS.items():
        for sign in (1, -1):
            forward = sign * np.eye(3)["XYZ".index(axis)]
            up = np.array([0, 0, sign]) if axis == "Y" else np.array([0, 1, 0])
            right = np.cross(forward, up)
            text = label(("+" if sign > 0 else "-") + axis)
            rows, columns = text.shape
            ahead = np.maximum(d @ forward, 1e-3)
            column = np.floor(d @ right / ahead / 0.05 + columns / 2).astype(int)
            row = np.floor(rows / 2 - d @ up / ahead / 0.05).astype(int)
            inside = (d @ forward > 0) & (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
            picture[inside] = np.where(
                text[np.clip(row, 0, rows - 1), np.clip(column, 0, columns - 1)][inside][:, None] > 0, color, 0.92
            )
    return picture.astype(np.float32)


def render(camera: kanuka.Camera, texture: Path, width: int, ball: bool = False) -> np.ndarray:
    scene = kanuka.Scene()
    scene.resolution = width, SIZE
    scene.camera = camera
    if ball:
        scene.add_sphere(1, material=kanuka.Material("mirror"))
    scene.add_light("environment", texture=texture)
    return np.asarray(kanuka.render(scene, progressions=64)["rgb"])


def main() -> None:
    file = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs" / "images" / "orientation.png"
    with tempfile.TemporaryDirectory() as folder:
        texture = Path(folder) / "sky.exr"
        kanuka.Picture({"rgb": sky(4 * SIZE)}).write(texture)
        panels = [
            sky(2 * SIZE),
            render(kanuka.Camera((0, 0, 0), (0.6, 0.35, -1), fov=95), texture, SIZE * 4 // 3),
            render(kanuka.Camera((1.2, 0.8, 4), (0, 0, 0), fov=38), texture, SIZE * 4 // 3, ball=True),
        ]
    gap = np.ones((SIZE, 8, 3), np.float32)
    row = np.hstack([panels[0], gap, panels[1], gap, panels[2]]).astype(np.float32)
    kanuka.Picture({"rgb": np.ascontiguousarray(row)}).write(file)


if __name__ == "__main__":
    main()
