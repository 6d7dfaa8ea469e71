"""Shapes of stages, and what is seen of them, that several tests of USD share."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import kanuka
from usd_stages import CAMERA, HEAD

TIMED = HEAD.replace("metersPerUnit = 1", "metersPerUnit = 1\n    timeCodesPerSecond = 4")
OPEN = CAMERA.replace("float focalLength", "double shutter:close = 1\n    float focalLength", 1)  # of a frame: 1/4 s
# A square half a unit wide, which goes one unit to the right while the shutter is open.
SQUARE = """
    uniform token subdivisionScheme = "none"
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    MORE
"""
CORNERS = "[(-0.75, 0, 0.5), (-0.25, 0, 0.5), (-0.25, 0, -0.5), (-0.75, 0, -0.5)]"
HELD = f"point3f[] points = {CORNERS}"


def mesh(more: str = HELD, name: str = "m") -> str:
    return f'def Mesh "{name}" {{{SQUARE.replace("MORE", more)}}}\n'


def instancer(values: str, inside: str = "", protos: str = "", more: str = "") -> str:
    return f"""
def PointInstancer "pi" {{
    rel prototypes = </pi/protos/it>
    int[] protoIndices = [0]
    {values}
    {more}
    def Scope "protos" {{
        def Xform "it" {{
            {protos}
            {mesh(inside or HELD)}
        }}
    }}
}}
"""


ZERO = "point3f[] positions = [(0, 0, 0)]"


def alpha(scene: kanuka.Scene, size: int = 32, samples: int = 16) -> np.ndarray:
    scene.resolution = (size, size)
    scene.options.filter, scene.options.filter_width = "box", (1, 1)
    return kanuka.render(scene, progressions=samples, threads=1, journal=kanuka.Journal())["alpha"]


def exposure(size: int = 32) -> np.ndarray:
    """The part of the time for which each column of pixels sees the square."""
    x = (np.arange(size * 16) + 0.5) / (size * 8) - 1
    t = (np.arange(256)[:, None] + 0.5) / 256
    return ((x > t - 0.75) & (x < t - 0.25)).mean(0).reshape(size, 16).mean(1)


def same(a: kanuka.Scene, b: kanuka.Scene) -> None:
    b.camera = a.camera
    b.options.shutter = a.options.shutter
    first, second = alpha(a), alpha(b)
    assert 0.02 < first.mean() < 0.98
    assert np.abs(first - second).mean() < 1e-3  # the same rays; rounding moves edges past few of them


LOW, HIGH = np.array((-0.5, -0.25, -0.75)), np.array((0.5, 0.25, 0.75))


def geometry(scene: kanuka.Scene) -> dict[str, int]:
    return scene.summary()["primitives"]


TINT = 0.05  # albedo has the reflections of a rough dielectric too
# From where each face is seen upright.
VIEWS = {
    "XPos": ((4, 0, 0), (0, 0, 1)),
    "XNeg": ((-4, 0, 0), (0, 0, 1)),
    "YPos": ((0, 4, 0), (0, 0, 1)),
    "YNeg": ((0, -4, 0), (0, 0, 1)),
    "ZPos": ((0, 0, 4), (0, 1, 0)),
    "ZNeg": ((0, 0, -4), (0, -1, 0)),
}


def looked_at(scene: kanuka.Scene, view: str, up=None) -> np.ndarray:
    """(12, 12, 3) of albedo: the model's box fills the picture."""
    place, upright = VIEWS[view]
    axis = np.flatnonzero(place)[0]
    right = np.cross(-np.array(place), up or upright) / 4
    half = abs(right) @ (HIGH - LOW) / 2, abs(np.array(up or upright)) @ (HIGH - LOW) / 2
    scene.camera = kanuka.Camera(
        place,
        (0, 0, 0),
        up=up or upright,
        projection="orthographic",
        screen_window=(-half[0], half[0], -half[1], half[1]),
    )
    assert right[axis] == 0
    scene.resolution = 12, 12
    scene.options.filter, scene.options.filter_width = "box", (1, 1)
    return kanuka.render(scene, progressions=4, threads=1, journal=kanuka.Journal())["albedo"]


def quarters(tmp_path: Path, name: str = "quarters.exr") -> np.ndarray:
    """Upper left red, upper right green, lower left blue, lower right grey."""
    texels = np.zeros((32, 32, 3), dtype=np.float32)
    texels[:16, :16], texels[:16, 16:] = (0.5, 0, 0), (0, 0.5, 0)
    texels[16:, :16], texels[16:, 16:] = (0, 0, 0.5), (0.25, 0.25, 0.25)
    kanuka.Picture({"rgb": texels}).write(tmp_path / name)
    return texels


def listed(values: np.ndarray) -> str:
    rows = np.asarray(values, dtype=float).tolist()
    return "[" + ", ".join(str(tuple(r)) if isinstance(r, list) else repr(r) for r in rows) + "]"


def from_above(scene: kanuka.Scene, size: int = 64, up=(0, 0, -1), place=(0, 4, 0)) -> kanuka.Scene:
    scene.camera = kanuka.Camera(place, (0, 0, 0), up=up, projection="orthographic", screen_window=(-1, 1, -1, 1))
    return scene


def ball(name: str, x: float, more: str = "") -> str:
    place = f'double3 xformOp:translate = ({x}, 0, 0)\nuniform token[] xformOpOrder = ["xformOp:translate"]'
    return f'def Sphere "{name}" {{\ndouble radius = 0.2\n{place}\n{more}\n}}\n'
