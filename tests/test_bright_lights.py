"""Lights over ten decades of power: meshes, analytic lights and pictures shine as they are told, and agree."""

from __future__ import annotations

import math
import struct
from pathlib import Path

import numpy as np
import pytest

import kanuka

SIDE = 2.0
AREA = SIDE * SIDE
SQUARE = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32)
QUAD = np.array([[0, 1, 2, 3]], np.int32)
DECADES = [10.0**k for k in range(-2, 9)]


def seen(scene: kanuka.Scene, progressions: int = 64) -> float:
    """Luminance of the picture's middle, from two units in front."""
    scene.resolution = 8, 8
    scene.camera = kanuka.Camera((0, 0, 2), (0, 0, 0), fov=20)
    picture = kanuka.render(scene, progressions=progressions)
    assert [str(m) for m in picture.journal] == []
    return float(picture["rgb"][..., 1].mean(dtype=np.float64))


def write_floats(path: Path, rgb: np.ndarray) -> None:
    """An OpenEXR file of whole floats, uncompressed (the file layout document of openexr.com)."""
    height, width, _ = rgb.shape

    def attribute(name: str, kind: str, data: bytes) -> bytes:
        return f"{name}\0{kind}\0".encode() + struct.pack("<i", len(data)) + data

    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    channels = b"".join(c + b"\0" + struct.pack("<iB3xii", 2, 0, 1, 1) for c in (b"B", b"G", b"R")) + b"\0"
    head = struct.pack("<ii", 20000630, 2)
    head += attribute("channels", "chlist", channels) + attribute("compression", "compression", b"\0")
    head += attribute("dataWindow", "box2i", window) + attribute("displayWindow", "box2i", window)
    head += attribute("lineOrder", "lineOrder", b"\0") + attribute("pixelAspectRatio", "float", struct.pack("<f", 1))
    head += attribute("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0))
    head += attribute("screenWindowWidth", "float", struct.pack("<f", 1)) + b"\0"
    row = 8 + 12 * width
    table = struct.pack(f"<{height}Q", *(len(head) + 8 * height + row * y for y in range(height)))
    rows = b"".join(
        struct.pack("<ii", y, 12 * width) + rgb[y, :, ::-1].T.astype("<f4").tobytes() for y in range(height)
    )
    path.write_bytes(head + table + rows)


def mesh(lumen: float, *, varies: bool = False) -> kanuka.Scene:
    scene = kanuka.Scene()
    lamp = kanuka.Shader("arealight", intensity=lumen, unit="lumen")
    points, faces = SQUARE, QUAD
    if varies:  # of many triangles
        n = 17
        x, y = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n))
        points = np.stack([x, y, 0 * x], -1).reshape(-1, 3).astype(np.float32)
        a = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
        faces = np.stack([a, a + 1, a + n + 1, a + n], -1).astype(np.int32)
    scene.add_mesh(points, faces, area_light=lamp)
    return scene


def quad(lumen: float, texture: str = "") -> kanuka.Scene:
    scene = kanuka.Scene()
    scene.add_light("quad", amount=lumen, unit="lumen", direction=(0, 0, 1), width=SIDE, height=SIDE, texture=texture)
    return scene


@pytest.mark.parametrize("lumen", DECADES)
def test_lumen_of_a_square(lumen: float, tmp_path: Path) -> None:
    """Lambert's law: a square that gives F lumen has F / (pi A) nit, whatever it is made of."""
    expected = lumen / (math.pi * AREA)
    white = tmp_path / "white.exr"
    kanuka.Picture({"rgb": np.ones((4, 4, 3), np.float32)}).write(white)
    for scene in (mesh(lumen), mesh(lumen, varies=True), quad(lumen), quad(lumen, str(white))):
        assert seen(scene) == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("radiance", DECADES)
def test_radiance_of_a_sky(radiance: float, tmp_path: Path) -> None:
    """A picture is seen as bright as it is."""
    sky = tmp_path / "sky.exr"
    write_floats(sky, np.full((4, 8, 3), radiance, np.float32))
    scene = kanuka.Scene()
    scene.add_light("environment", amount=1, texture=str(sky))
    assert seen(scene) == pytest.approx(radiance, rel=0.01)


def test_what_is_no_light_in_a_picture_is_said_once(tmp_path: Path) -> None:
    sky = tmp_path / "sky.exr"
    texels = np.ones((4, 8, 3), np.float32)
    texels[0, 0, 0], texels[1, 0, 1], texels[2, 0, 2] = -1, np.inf, np.nan
    write_floats(sky, texels)
    scene = kanuka.Scene()
    scene.add_light("environment", amount=1, texture=str(sky))
    scene.resolution = 8, 8
    messages = [str(m) for m in kanuka.render(scene, progressions=1).journal]
    assert sum("1 of 96 values" in m and "negative" in m for m in messages) == 1
    assert sum("2 of 96 values" in m and "not finite" in m for m in messages) == 1
    assert len(messages) == 2
