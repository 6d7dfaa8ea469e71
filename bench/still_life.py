"""Metal, glass and coats under a sky: how fast they converge; EXR files, skies and balls for other scenes."""

from __future__ import annotations

import os
import struct
from pathlib import Path

import numpy as np

from scenes import Camera, Finish, Mesh, Scene, ball, kept, quad


def write_exr(path: Path, rgb: np.ndarray) -> None:
    """Uncompressed scan lines of 32 bits: what every renderer reads."""
    height, width, _ = rgb.shape

    def attribute(name: str, kind: str, data: bytes) -> bytes:
        return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(data)) + data

    channels = b"".join(c + b"\0" + struct.pack("<iB3xii", 2, 0, 1, 1) for c in (b"B", b"G", b"R")) + b"\0"
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    header = struct.pack("<ii", 20000630, 2)
    header += attribute("channels", "chlist", channels) + attribute("compression", "compression", b"\0")
    header += attribute("dataWindow", "box2i", window) + attribute("displayWindow", "box2i", window)
    header += attribute("lineOrder", "lineOrder", b"\0") + attribute("pixelAspectRatio", "float", struct.pack("<f", 1))
    header += attribute("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0))
    header += attribute("screenWindowWidth", "float", struct.pack("<f", 1)) + b"\0"
    size = 12 * width
    first = len(header) + 8 * height
    offsets = struct.pack(f"<{height}Q", *(first + y * (8 + size) for y in range(height)))
    planes = np.ascontiguousarray(rgb[:, :, ::-1].transpose(0, 2, 1), "<f4")
    lines = b"".join(struct.pack("<ii", y, size) + planes[y].tobytes() for y in range(height))
    temporary = path.with_suffix(f".{os.getpid()}")
    temporary.write_bytes(header + offsets + lines)
    os.replace(temporary, path)


def environment(name: str, colored: bool, height: int = 256) -> Path:
    """A sky with a horizon, a window of light and a low sun; or its greys.

    Renderers do not agree on whether a picture's first row is at the pole or half a texel from it (Mitsuba), so the sky
    is drawn for either: from_pole() says where.
    """
    path = kept(name, ".exr", sky, write_exr, height, colored)
    if not from_pole(path).exists():
        write_exr(from_pole(path), sky(height, colored, at_poles=True))
    return path


def from_pole(path: Path) -> Path:
    """The same environment, its first row at the pole and its last at the other."""
    return path.with_stem(path.stem + "-from-pole")


def sky(height: int, colored: bool, at_poles: bool = False) -> np.ndarray:
    """Radiance; rows go from +y down, from the pole itself or from half a texel below it; columns are twice as many."""
    theta = np.pi * (np.arange(height) / (height - 1) if at_poles else (np.arange(height) + 0.5) / height)
    width = 2 * height
    phi = (np.arange(width) + 0.5) / width * 2 * np.pi
    up = np.cos(theta)[:, None]
    direction = np.stack(
        [np.sin(theta)[:, None] * np.sin(phi), up + 0 * phi, -np.sin(theta)[:, None] * np.cos(phi)], axis=-1
    )
    zenith, horizon, ground = np.array([0.25, 0.45, 0.9]), np.array([0.9, 0.85, 0.8]), np.array([0.15, 0.12, 0.1])
    mix = np.clip(up, 0, 1)[..., None] ** 0.6
    light = np.where(up[..., None] > 0, horizon * (1 - mix) + zenith * mix, ground)

    def spot(towards: tuple[float, float, float], degrees: float, radiance: np.ndarray, soft: float) -> np.ndarray:
        axis = np.array(towards) / np.linalg.norm(towards)
        angle = np.degrees(np.arccos(np.clip(direction @ axis, -1, 1)))
        return np.clip((degrees - angle) / soft + 0.5, 0, 1)[..., None] * radiance

    light = light + spot((1, 0.7, 0.6), 4, np.array([90, 75, 55]), 1.5)
    light = light + spot((-1, 0.5, 0.3), 22, np.array([5, 5.5, 6]), 4)
    if not colored:
        light = np.repeat(light.mean(-1, keepdims=True), 3, axis=-1)
    return light.astype(np.float32)


def fine_ball(x: float, radius: float, z: float, y: float = 0) -> tuple[np.ndarray, np.ndarray]:
    """On the plane y = 0, or above it."""
    points, faces = ball((0, 0, 0), 256, 128)
    return points * np.float32(radius) + np.array([x, radius + y, z], np.float32), faces


CAMERA = Camera((0, 2.0, 6.5), (0, 0.75, 0), 40)


def still_life(_n: int) -> Scene:
    """Rough metal, glass, lacquer and matte balls on a matte floor, lit by an environment with a sun."""
    meshes = [
        Mesh("floor", (0.45, 0.42, 0.4), *quad((0, 0, 0), (8, 0, 0), (0, 0, -8))),
        Mesh("metal", (1, 1, 1), *fine_ball(-1.7, 0.8, -0.3), finish=Finish("metal", alpha=0.09)),
        Mesh("glass", (1, 1, 1), *fine_ball(0.1, 0.75, 0.9), finish=Finish("glass")),
        Mesh("lacquer", (0.6, 0.05, 0.04), *fine_ball(1.8, 0.8, -0.2), finish=Finish("coated", alpha=0.01)),
        Mesh("matte", (0.2, 0.35, 0.6), *fine_ball(0.1, 0.7, -1.6)),
    ]
    sky = environment("sky", colored=True)
    return Scene("still-life", (480, 270), 64, CAMERA, meshes, environment=sky)


MAKERS = {"still-life": (still_life, 0)}
