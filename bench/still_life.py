"""Scenes of metal, glass and coats: how fast they converge, and whether two renderers agree on them."""

from __future__ import annotations

import os
import struct
from dataclasses import replace
from pathlib import Path

import numpy as np

from scenes import Camera, Finish, Mesh, Scene, ball, cache_folder, quad

GREY = (0.5, 0.5, 0.5)


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
    path = cache_folder() / f"{name}-{height}.exr"
    middles = (np.arange(height) + 0.5) / height
    for file, rows in ((path, middles), (from_pole(path), np.arange(height) / (height - 1))):
        if not file.exists():
            write_exr(file, sky(rows * np.pi, colored))
    return path


def from_pole(path: Path) -> Path:
    """The same environment, its first row at the pole and its last at the other."""
    return path.with_stem(path.stem + "-from-pole")


def sky(theta: np.ndarray, colored: bool) -> np.ndarray:
    """Radiance at angles from +y, a row each; columns are twice as many."""
    width = 2 * len(theta)
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


def grey_stage(name: str, finish: Finish | None) -> Scene:
    """One ball on a floor under an environment, all else of greys: spectra that no optimiser had a hand in."""
    meshes = [
        Mesh("floor", GREY, *quad((0, 0, 0), (8, 0, 0), (0, 0, -8))),
        Mesh("ball", GREY, *fine_ball(0, 1, 0), finish=finish),
    ]
    camera = Camera((0, 1.8, 5), (0, 0.8, 0), 42)
    return Scene(name, (256, 256), 64, camera, meshes, environment=environment("grey-sky", colored=False, height=1024))


def under_a_sky(_n: int) -> Scene:
    return grey_stage("environment", None)


def conductor(_n: int) -> Scene:
    return grey_stage("conductor", Finish("metal"))


def dielectric(_n: int) -> Scene:
    return grey_stage("dielectric", Finish("glass"))


BANDS = 24
SPAN = (360.0, 830.0)
DISPERSIVE = Finish("glass", ior=1.6, abbe=8)


def index_at(finish: Finish, nm: float) -> float:
    """Cauchy's n = A + B / wavelength², of the index at 587.6 nm and Abbe's number."""
    if not finish.abbe:
        return finish.ior
    b = (finish.ior - 1) / (finish.abbe * (486.1327**-2 - 656.2725**-2))
    return finish.ior + b * (nm**-2 - 587.5618**-2)


def dispersion(n: int) -> Scene:
    """Glass that disperses under a lamp; n > 0: its n-th band of wavelengths, at the index of the band's middle."""
    low = SPAN[0] + (SPAN[1] - SPAN[0]) / BANDS * (n - 1)
    band = (low, low + (SPAN[1] - SPAN[0]) / BANDS) if n else None
    finish = DISPERSIVE
    if band:
        finish = replace(finish, ior=index_at(DISPERSIVE, sum(band) / 2), abbe=0)
    meshes = [
        Mesh("floor", GREY, *quad((0, 0, 0), (4, 0, 0), (0, 0, -4))),
        Mesh("back", GREY, *quad((0, 2, -2), (4, 0, 0), (0, 2, 0))),
        Mesh("lamp", (0, 0, 0), *quad((0.6, 4, 0.5), (0.5, 0, 0), (0, 0, 0.5)), radiance=(12, 12, 12)),
        Mesh("ball", GREY, *fine_ball(0, 0.8, 0, y=0.3), finish=finish),
    ]
    return Scene("dispersion", (96, 96), 64, Camera((0, 1.6, 5), (0, 1, 0), 36), meshes, band=band)


MAKERS = {
    "still-life": (still_life, 0),
    "environment": (under_a_sky, 0),
    "conductor": (conductor, 0),
    "dielectric": (dielectric, 0),
    "dispersion": (dispersion, 0),
}
