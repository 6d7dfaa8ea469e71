"""Flat shapes, solids and flat lights have their area in the picture."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import kanuka

HALF = 1.5  # of the screen window

FILM = """
Format 96 96 1
PixelFilter "box" 1 1
Projection "orthographic"
ScreenWindow -1.5 1.5 -1.5 1.5
Shutter 0 1
WorldBegin
Translate 0 0 5
Surface "constant"
%s
WorldEnd
"""


def covered(folder: Path, world: str, **options: object) -> float:
    """What the picture's alpha adds up to, in units of the scene."""
    path = folder / "shape.rib"
    path.write_text(FILM % world)
    picture = kanuka.render(kanuka.load(path), progressions=64, max_depth=16, **options)
    assert not picture.journal.messages, [e.message for e in picture.journal.messages]
    return float(picture["alpha"].mean()) * (2 * HALF) ** 2


def ring(corners: int, radius: float = 1.2, x: float = 0) -> str:
    turn = [2 * math.pi * (k + 0.2) / corners for k in range(corners)]
    return " ".join(f"{x + radius * math.cos(a):.6f} {radius * math.sin(a):.6f} 0" for a in turn)


def area(corners: int, radius: float = 1.2) -> float:
    return corners * radius**2 * math.sin(2 * math.pi / corners) / 2


@pytest.mark.parametrize("tolerance", [0, 0.25, 1000])
@pytest.mark.parametrize("corners", [3, 5, 6])
def test_polygons(tmp_path: Path, corners: int, tolerance: float) -> None:
    shape = f'Polygon "P" [{ring(corners)}]'
    assert covered(tmp_path, shape, geometry_tolerance=tolerance) == pytest.approx(area(corners), rel=0.004)
    # What lies twice lets less through.
    half = covered(tmp_path, "Opacity [0.5 0.5 0.5]\n" + shape, geometry_tolerance=tolerance)
    assert half == pytest.approx(area(corners) / 2, rel=0.004)


@pytest.mark.parametrize("corners", [3, 6])
def test_polygons_in_groups_and_moving(tmp_path: Path, corners: int) -> None:
    shape = f'Polygon "P" [{ring(corners, 0.6)}]'
    instances = "".join(
        f"TransformBegin\nTranslate {x} {y} 0\nObjectInstance 1\nTransformEnd\n"
        for x in (-0.7, 0.7)
        for y in (-0.7, 0.7)
    )
    group = f"ObjectBegin 1\n{shape}\nObjectEnd\n{instances}"
    assert covered(tmp_path, group) == pytest.approx(4 * area(corners, 0.6), rel=0.004)
    moving = f"MotionBegin [0 1]\nTranslate -0.4 0 0\nTranslate 0.4 0.3 0\nMotionEnd\n{shape}"
    assert covered(tmp_path, moving) == pytest.approx(area(corners, 0.6), rel=0.01)
    changing = f'MotionBegin [0 1]\nPolygon "P" [{ring(corners, 0.6)}]\nPolygon "P" [{ring(corners, 1.2)}]\nMotionEnd'
    mean = area(corners, 1) * (1.2**3 - 0.6**3) / (3 * 0.6)  # of r^2 between both
    assert covered(tmp_path, changing) == pytest.approx(mean, rel=0.01)


def test_solids(tmp_path: Path) -> None:
    fine = 0.05  # a quarter of a pixel would be 1 % of the rod
    ball = 'SolidBegin "primitive"\nSphere 1.2 -1.2 1.2 360\nSolidEnd\n'
    rod = 'SolidBegin "primitive"\nCylinder 0.5 -2 2 360\nDisk -2 0.5 360\nDisk 2 0.5 360\nSolidEnd\n'
    drilled = f'SolidBegin "difference"\n{ball}{rod}SolidEnd\n'
    assert covered(tmp_path, drilled, geometry_tolerance=fine) == pytest.approx(math.pi * (1.2**2 - 0.5**2), rel=0.005)
    both = f'SolidBegin "intersection"\n{ball}{rod}SolidEnd\n'
    assert covered(tmp_path, both, geometry_tolerance=fine) == pytest.approx(math.pi * 0.5**2, rel=0.005)
    aside = "TransformBegin\nTranslate %g 0 0\n" + ball.replace("1.2", "0.9") + "TransformEnd\n"
    pair = aside % -0.5 + aside % 0.5
    lens = 2 * 0.81 * math.acos(0.5 / 0.9) - 0.5 * math.sqrt(4 * 0.81 - 1)  # of two circles, 1 apart
    for kind, expected in (("intersection", lens), ("union", 2 * math.pi * 0.81 - lens)):
        solid = f'SolidBegin "{kind}"\n{pair}SolidEnd\n'
        assert covered(tmp_path, solid, geometry_tolerance=fine) == pytest.approx(expected, rel=0.005)


def lambert(light: np.ndarray, at: np.ndarray, normal: np.ndarray) -> float:
    """Irradiance from a polygon of radiance 1 (Lambert 1760; Baum et al. 1989, eq. 1)."""
    r = light - at
    r /= np.linalg.norm(r, axis=1)[:, None]
    total = 0.0
    for a, b in zip(r, np.roll(r, -1, 0), strict=True):
        n = np.cross(a, b)
        total += math.acos(float(a @ b)) * float(n / np.linalg.norm(n) @ normal)
    return abs(total) / 2


@pytest.mark.parametrize("corners", [3, 5])
def test_flux_of_a_flat_light(tmp_path: Path, corners: int) -> None:
    (tmp_path / "own.sl").write_text("light own() { illuminate(P, N, PI / 2) Cl = 1; }")
    p = np.array(ring(corners, 1, 1.6).split(), float).reshape(-1, 3)
    p = p + np.array([0.0, 0, 3])  # it shines away from the camera
    path = tmp_path / "light.rib"
    path.write_text(
        'Format 8 8 1\nProjection "orthographic"\nScreenWindow -0.01 0.01 -0.01 0.01\nWorldBegin\nAttributeBegin\n'
        f'AreaLightSource "own" 1\nPolygon "P" [{" ".join(f"{x:.6f}" for x in p.ravel())}]\nAttributeEnd\n'
        'Surface "matte" "Ka" 0 "Kd" 1\nPolygon "P" [-9 -9 5  9 -9 5  9 9 5  -9 9 5]\nWorldEnd\n'
    )
    picture = kanuka.render(kanuka.load(path), progressions=512, max_depth=1)
    seen = float(picture["rgb"].mean())
    expected = lambert(p, np.array([0.0, 0, 5]), np.array([0.0, 0, -1])) / math.pi
    assert seen == pytest.approx(expected, rel=0.01)
