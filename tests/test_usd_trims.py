"""Trim curves and closed forms of USD's NURBS patches, against areas."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from test_usd_convert import BOUND, GLOSSY, assert_same
from test_usd_nurbs import CIRCLE, CIRCLE_KNOTS, CIRCLE_WEIGHTS
from usd_shapes import alpha, geometry, listed
from usd_stages import CAMERA, SUN, read, stage

# All of the picture, seen from above: u goes right from 0 to 2, v up from 0 to 1.
SHEET = """
    int uVertexCount = 2
    int vVertexCount = 2
    int uOrder = 2
    int vOrder = 2
    double[] uKnots = [0, 0, 2, 2]
    double[] vKnots = [0, 0, 1, 1]
    point3f[] points = [(-1, 0, 1), (1, 0, 1), (-1, 0, -1), (1, 0, -1)]
"""


def ring(radius: float, backwards: bool = False) -> np.ndarray:
    """A circle in the middle of the picture, as homogeneous points."""
    flat = CIRCLE[::-1] if backwards else CIRCLE
    return (
        np.column_stack([(1 + 2 * radius * flat[:, 0]), (0.5 + radius * flat[:, 1]), np.ones(9)])
        * (CIRCLE_WEIGHTS[:, None])
    )


def box(half: float, u: float = 1) -> np.ndarray:
    at = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1)]) * half
    return np.column_stack([u + 2 * at[:, 0], 0.5 + at[:, 1], np.ones(5)])


ROUND, BOXED = (3, CIRCLE_KNOTS, (0, 4)), (2, [0, 0, 1, 2, 3, 4, 4], (0, 4))
LINE = (2, [0, 0, 1, 1], (0, 1))


def trimmed(*loops: list[tuple[np.ndarray, tuple]], head: str = 'def NurbsPatch "p" {') -> str:
    curves = [curve for loop in loops for curve in loop]
    return f"""{head}{SHEET}
    int[] trimCurve:counts = {[len(loop) for loop in loops]}
    int[] trimCurve:orders = {[kind[0] for _, kind in curves]}
    int[] trimCurve:vertexCounts = {[len(points) for points, _ in curves]}
    double[] trimCurve:knots = {[k for _, kind in curves for k in kind[1]]}
    double2[] trimCurve:ranges = {[kind[2] for _, kind in curves]}
    double3[] trimCurve:points = {listed(np.concatenate([points for points, _ in curves]))}
}}
"""


def part(kind: tuple, low: float, high: float) -> tuple:
    return (*kind[:2], (low, high))


def seen(tmp_path: Path, text: str) -> tuple[np.ndarray, list[str]]:
    scene, told = read(stage(tmp_path, CAMERA, SUN, text))
    return alpha(scene, samples=64), told


ACROSS = np.array([(0.2, 0.5, 1), (1.8, 0.5, 1)])  # a diameter of a circle of 0.4
CASES = {
    "a circle": (([(ring(0.4), ROUND)],), np.pi * 0.16),
    "a circle of two halves": (([(ring(0.4), part(ROUND, 0, 2)), (ring(0.4), part(ROUND, 2, 4))],), np.pi * 0.16),
    "half a circle and a line": (([(ring(0.4), part(ROUND, 0, 2)), (ACROSS, LINE)],), np.pi * 0.08),
    "a box with a hole": (([(box(0.4), BOXED)], [(ring(0.2, backwards=True), ROUND)]), 0.64 - np.pi * 0.04),
    "two boxes": (([(box(0.1, 1.5), BOXED)], [(box(0.1, 0.5), BOXED)]), 0.08),
}


@pytest.mark.parametrize("name", CASES)
def test_what_lies_within_trim_curves_stays(tmp_path: Path, name: str):
    loops, area = CASES[name]
    found, told = seen(tmp_path, trimmed(*loops))
    assert told == []
    # 64 samples of each of the 1024 pixels; where an edge crosses one, its share has a deviation of 1/16 at most.
    assert found.mean() == pytest.approx(area, abs=4 / 16 / 32)


def test_half_a_circle_is_the_upper_one(tmp_path: Path):
    found, _ = seen(tmp_path, trimmed(*CASES["half a circle and a line"][0]))
    assert found[16:].max() < 0.05 and found[15, 16] == 1


@pytest.mark.parametrize(
    ("a", "b", "said"),
    [
        ("trimCurve:orders = [3]", "trimCurve:orders = [3, 3]", "trimCurve:orders has 2 values; its 1 curves need 1"),
        ("vertexCounts = [9]", "vertexCounts = [8]", "trimCurve:points has 9 values; its 1 curves need 8"),
        ("vertexCounts = [9]", "vertexCounts = []", "trimCurve:vertexCounts has 0 values; its 1 curves need 1"),
        ("knots = [0, ", "knots = [", "trimCurve:knots has 11 values; its 1 curves need 12"),
        ("knots = [0, ", "knots = [nan, ", "knots that do not increase"),
        ("orders = [3]", "orders = [-3]", "trimCurve:knots has 12 values; its 1 curves need 6"),
        ("counts = [1]", "counts = [0]", "trimCurve:counts has loops of no curves"),
        ("counts = [1]", "counts = [-1]", "trimCurve:counts has loops of no curves"),
        ("ranges = [(0, 4)]", "ranges = [(3, 3)]", "a range from 3 to 3"),
        ("ranges = [(0, 4)]", "ranges = [(0, 4), (0, 4)]", "trimCurve:ranges has 2 values; its 1 curves need 1"),
        ("points = [(", "points = [(nan, 0, 1), (", "trimCurve:points has 10 values; its 1 curves need 9"),
        (", 1.0), ", ", 0.0), ", "trimCurve:points are not all finite, of positive weights"),
    ],
)
def test_bad_trims_are_told_and_the_patch_is_whole(tmp_path: Path, a: str, b: str, said: str):
    text = trimmed([(ring(0.4), ROUND)])
    assert a in text
    head, tail = text.split("int[] trimCurve:counts")
    found, told = seen(tmp_path, head + ("int[] trimCurve:counts" + tail).replace(a, b, 1))
    assert told == [f"/p: {said}. It is not trimmed"]
    assert found.mean() == pytest.approx(1, abs=1e-3)


def test_periodic_patches_are_closed(tmp_path: Path):
    """A band around the origin: of regular polygons of 12 corners, which a cubic B-spline rounds to (4 + 2 cos 30°) / 6
    of their radius at its knots, and to within a part in 1000 of that between them."""
    angles = np.radians(np.arange(15) * 30.0)  # the last three are the first ones
    points = [(r * np.cos(a), 0, -r * np.sin(a)) for r in (0.5, 0.9) for a in angles]
    text = f"""
def NurbsPatch "p" {{
    int uVertexCount = 15
    int vVertexCount = 2
    int uOrder = 4
    int vOrder = 2
    uniform token uForm = "periodic"
    double[] uKnots = {list(range(19))}
    double[] vKnots = [0, 0, 1, 1]
    double2 uRange = (3, 15)
    point3f[] points = {listed(points)}
}}
"""
    found, told = seen(tmp_path, text)
    assert told == []
    rounding = (4 + 2 * np.cos(np.radians(30))) / 6
    assert found.mean() == pytest.approx(np.pi * (0.81 - 0.25) * rounding**2 / 4, rel=0.01)
    quarters = found[:16, :16], found[:16, 16:], found[16:, :16], found[16:, 16:]
    assert [q.mean() for q in quarters] == pytest.approx([found.mean()] * 4, rel=0.02)


@pytest.mark.parametrize("more", ["", "double[] pointWeights = [1, 2, 3, 1]"])
def test_trimmed_patches_are_the_same_in_rib(tmp_path: Path, more: str):
    text = trimmed(*CASES["a box with a hole"][0], head=f'def NurbsPatch "it"{BOUND}{more}')
    path = stage(tmp_path, CAMERA, GLOSSY, SUN, text)
    assert_same(path)
    scene, _ = read(path)
    assert geometry(scene) == {"nu patch": 1}
