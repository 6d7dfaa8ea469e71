"""Pictures that are made of others, once: in another colour space, or of an environment in another layout.

They lie in the texture cache under names that their contents give, as tiled files: of half floats, or of floats where
they have more light than halfs can tell.
"""

from __future__ import annotations

import glob
import hashlib
import os
import struct
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TypeAlias

import numpy as np

import kanuka

from .colors import SRGB
from .files import writable

SUFFIX = ".tiled.exr"  # by which the texture cache knows what is its own
DECODED = b"kanuka:rec709\0int\0"  # in the head of a texture whose picture had sRGB's codes
CHROMATICITIES = b"chromaticities\0"
LARGEST_HEAD = 1 << 16
HALF_MAX = 65504.0
DAY = 24 * 3600
ROWS = 128  # that are converted together
TILE = "<UDIM>"


@dataclass(frozen=True)
class Numbers:
    """Of a file, as it has them."""

    rgb: np.ndarray  # (height, width, 3)
    alpha: np.ndarray | None = None
    codes: bool = False  # whether they are sRGB's
    space: str = ""  # Kanuka's name of the one that its head has chromaticities of
    wraps: tuple[str, str] = ("periodic", "periodic")


Make: TypeAlias = "Callable[[Numbers], np.ndarray]"


def folder() -> Path:
    return writable(Path(kanuka.texture_cache_folder()))


def made_of(file: str, key: str, make: Make, *, latlong: bool = False) -> str:
    """The picture that is made of a file, or of the tiles "a.<UDIM>.png", where `key` says all that it depends on
    beside the file. `latlong`: what is made is an environment by latitude and longitude.
    Raises kanuka.Error, OSError or ValueError where the file cannot be read."""
    head, tile, tail = file.partition(TILE)
    if not tile:
        return _made(file, _name(file, key), make, latlong)
    tiles = sorted(glob.glob(f"{glob.escape(head)}[0-9][0-9][0-9][0-9]{glob.escape(tail)}"))
    names = [_name(each, key) for each in tiles]
    together = hashlib.sha256("".join(names).encode()).hexdigest()[:16]
    for each in tiles:
        number = each[len(head) : len(head) + 4]
        _made(each, f"{Path(head).name}{together}.{number}", make, latlong)
    return str(folder() / f"{Path(head).name}{together}.{TILE}{SUFFIX}")


def _name(file: str, key: str) -> str:
    found = os.stat(file)
    content = _content(file, found.st_mtime_ns, found.st_size)
    return f"{Path(file).stem}.{hashlib.sha256((content + key).encode()).hexdigest()[:24]}"


@lru_cache(maxsize=4096)
def _content(file: str, written: int, size: int) -> str:
    """Many lights may have one picture, and so have the frames of a shot."""
    with open(file, "rb") as data:
        return hashlib.file_digest(data, "sha256").hexdigest()


def _made(file: str, name: str, make: Make, latlong: bool) -> str:
    path = folder() / (name + SUFFIX)
    if path.exists():
        # Those not used for longest go first. What renders know a texture by includes its date: not at every use.
        if time.time() - path.stat().st_mtime > DAY:
            path.touch()
        return str(path)
    with tempfile.TemporaryDirectory(prefix="kanuka-picture-") as own:
        given = read(file, own)
        made = make(given)
        if given.alpha is not None and given.alpha.shape == made.shape[:2]:
            made = np.concatenate([made, given.alpha[..., None]], axis=2)
        plain = os.path.join(own, "plain.exr")
        made = np.nan_to_num(made, copy=False, nan=0.0, posinf=HALF_MAX, neginf=-HALF_MAX)
        if made.min() >= -HALF_MAX and made.max() <= HALF_MAX:
            write_half(plain, made)
        else:  # the sun in a sky
            layers = {"rgb": made[..., :3], "alpha": made[..., 3]} if made.shape[2] == 4 else {"rgb": made}
            kanuka.Picture({name: np.ascontiguousarray(v, np.float32) for name, v in layers.items()}).write(plain)
        kanuka.make_texture([plain], str(path), latlong=latlong, wrap=given.wraps)
    return str(path)


def read(file: str, own: str) -> Numbers:
    """Of any file that textures are read from. Of what is no EXR the core makes a texture first, in the folder `own`,
    where codes are decoded."""
    source = file
    if file.lower().endswith(".exr"):
        picture = kanuka.read(file)
        if picture.full_size != (picture.width, picture.height) or picture.offset != (0, 0):
            raise ValueError(f"{file}: it shows another part of its canvas than all of it")
    else:
        source = os.path.join(own, "whole.exr")
        kanuka.make_texture([file], source)
        picture = kanuka.read(source)
    with open(source, "rb") as data:
        head = data.read(LARGEST_HEAD)
    layers = [name for name in picture if name != "alpha"]
    rgb = picture["rgb" if "rgb" in picture else layers[0]].reshape(picture.height, picture.width, -1)
    if rgb.shape[2] < 3:
        rgb = np.repeat(rgb[..., :1], 3, axis=2)
    alpha = picture["alpha"] if "alpha" in picture else None  # noqa: SIM401 — a picture has no get()
    codes = DECODED in head
    wraps = picture.metadata.get("wrapmodes", "").split(",")
    known = len(wraps) == 2 and set(wraps) <= {"black", "clamp", "periodic", "mirror"}
    return Numbers(
        coded(rgb) if codes else rgb,
        alpha,
        codes,
        picture.space if CHROMATICITIES in head else "",
        (wraps[0], wraps[1]) if known else Numbers.wraps,
    )


def by_rows(rgb: np.ndarray, convert: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """What convert() makes of (height, width, 3) numbers, without ever holding many of its own in memory."""
    made = np.empty(rgb.shape, np.float32)
    for row in range(0, len(rgb), ROWS):
        made[row : row + ROWS] = convert(rgb[row : row + ROWS])
    return made


def coded(light: np.ndarray) -> np.ndarray:
    """The codes that were decoded to half floats: exactly those of 8 bits, others as near as halfs are."""
    light = np.maximum(light, 0)
    found = np.where(light <= SRGB.knee / SRGB.slope, SRGB.slope * light, 1.055 * light ** (1 / SRGB.gamma) - SRGB.bias)
    steps = np.round(found * 255)
    return (steps / 255 if np.abs(found * 255 - steps).max(initial=0) < 0.1 else found).astype(np.float32)


def write_half(path: str, pixels: np.ndarray) -> None:
    """OpenEXR File Layout, "Scan lines", without compression: a head of attributes, where each line is, the lines; of
    each its number, its bytes, and channel by channel in the order of the alphabet."""
    height, width, count = pixels.shape
    halfs = pixels.astype("<f2")[..., ::-1]  # A B G R
    channels = b"".join(name + b"\0" + struct.pack("<i4xii", 1, 1, 1) for name in (b"A", b"B", b"G", b"R")[4 - count :])
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    attributes = (
        ("channels", "chlist", channels + b"\0"),
        ("compression", "compression", b"\0"),
        ("dataWindow", "box2i", window),
        ("displayWindow", "box2i", window),
        ("lineOrder", "lineOrder", b"\0"),
        ("pixelAspectRatio", "float", struct.pack("<f", 1)),
        ("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0)),
        ("screenWindowWidth", "float", struct.pack("<f", 1)),
    )
    head = b"\x76\x2f\x31\x01\x02\0\0\0" + b"".join(
        f"{name}\0{kind}\0".encode() + struct.pack("<i", len(data)) + data for name, kind, data in attributes
    )
    lines = np.empty(height, dtype=[("y", "<i4"), ("bytes", "<i4"), ("data", "<f2", (count, width))])
    lines["y"], lines["bytes"] = np.arange(height), 2 * count * width
    lines["data"] = halfs.transpose(0, 2, 1)
    start = len(head) + 1 + 8 * height
    with open(path, "wb") as file:
        file.write(head + b"\0")
        file.write((start + lines.itemsize * np.arange(height)).astype("<u8").tobytes())
        file.write(lines.tobytes())
