"""NURBS of USD stages: against the circles, balls and rings that they are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka
from usd_shapes import OPEN, TIMED, TINT, alpha, exposure, from_above, geometry, listed, mesh, quarters
from usd_stages import CAMERA, SUN, TEXTURED, read, stage

HALF = np.sqrt(0.5)
# A circle of four quarters: a rational curve of order 3.
CIRCLE = np.array([(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)])
CIRCLE_WEIGHTS = np.array([1, HALF] * 4 + [1])
CIRCLE_KNOTS = [0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4]


def revolved(profile: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points and weights of a patch about z, u around it; the profile is (x, z)."""
    points = np.array([(x * a, x * b, z) for x, z in profile for a, b in CIRCLE])
    return points, np.array([w * c for w in weights for c in CIRCLE_WEIGHTS])


# From -z to +z, and around a circle of 0.25 at 0.6.
ARC = np.array([(0, -1), (1, -1), (1, 0), (1, 1), (0, 1)])
BALL = revolved(ARC, np.array([1, HALF, 1, HALF, 1])), [0, 0, 0, 1, 1, 2, 2, 2]
RING = revolved(0.25 * CIRCLE + (0.6, 0), CIRCLE_WEIGHTS), CIRCLE_KNOTS


def patch(shape, more: str = "") -> str:
    (points, weights), knots = shape
    return f"""
def NurbsPatch "p" {{
    int uVertexCount = 9
    int vVertexCount = {len(points) // 9}
    int uOrder = 3
    int vOrder = 3
    double[] uKnots = {CIRCLE_KNOTS}
    double[] vKnots = {knots}
    point3f[] points = {listed(points)}
    double[] pointWeights = {listed(weights)}
    {more}
}}
"""


def seen_from(text: str, tmp_path: Path) -> kanuka.Picture:
    """From the side of +y, which the middles of pixels see."""
    scene, told = read(stage(tmp_path, CAMERA, SUN, text))
    assert told == []
    from_above(scene).resolution = 99, 99
    scene.options.filter, scene.options.filter_width = "box", (1, 1)
    return kanuka.render(scene, progressions=4, threads=1, journal=kanuka.Journal())


def test_a_rational_ball_is_round(tmp_path: Path):
    """A pixel shows means over a part of 50 of the radius; grids are as fine."""
    picture = seen_from(patch(BALL), tmp_path)
    inside = (np.hypot(picture["P"][..., 0], picture["P"][..., 2]) < 0.8) & (picture["alpha"] == 1)
    assert inside.sum() > 4000
    assert np.linalg.norm(picture["P"][inside], axis=1) == pytest.approx(1, abs=2e-3)
    assert np.abs(picture["N"] - picture["P"])[inside].max() < 4e-3  # outwards


def test_a_rational_ring_is_a_torus(tmp_path: Path):
    picture = seen_from(patch(RING), tmp_path)
    inside = (np.abs(picture["P"][..., 2]) < 0.12) & (np.abs(picture["P"][..., 0]) < 0.4) & (picture["alpha"] == 1)
    assert inside.sum() > 300
    x, y, z = picture["P"][inside].T
    assert np.hypot(np.hypot(x, y) - 0.6, z) == pytest.approx(0.25, abs=3e-3)
    out = (np.stack([x, y, z]) - 0.6 * np.stack([x, y, 0 * z]) / np.hypot(x, y)) / 0.25
    assert np.abs(picture["N"][inside] - out.T).max() < 2e-2


def de_casteljau(control: np.ndarray, t: np.ndarray) -> np.ndarray:
    points = control[None] * np.ones((len(t), 1, 1))
    while points.shape[1] > 1:
        points = points[:, :-1] * (1 - t[:, None, None]) + points[:, 1:] * t[:, None, None]
    return points[:, 0]


def test_curves_become_bezier_curves():
    from kanuka.usd.nurbs import bezier, homogeneous
    from kanuka.usd.splines import direction

    def made(order, knots, points, weights=None):
        points = np.array(points, dtype=float)
        d = direction(order, len(points), np.array(knots, dtype=float), None)
        return bezier(d, homogeneous(points, weights), weights is not None)

    a, b, c, d = points = np.random.default_rng(3).normal(size=(4, 3))
    assert made(4, [0, 0, 0, 0, 1, 1, 1, 1], points) == pytest.approx(points)
    uniform = [(a + 4 * b + c) / 6, (2 * b + c) / 3, (b + 2 * c) / 3, (b + 4 * c + d) / 6]
    assert made(4, range(8), points) == pytest.approx(np.array(uniform))
    raised = [a, (a + 2 * b) / 3, (2 * b + c) / 3, c]  # a parabola, of higher degree
    assert made(3, [0, 0, 0, 1, 1, 1], points[:3]) == pytest.approx(np.array(raised))
    broken = made(2, [0, 0, 1, 2, 2], points[:3])
    assert broken[[0, 3, 6]] == pytest.approx(points[:3]) and broken[1] == pytest.approx((2 * a + b) / 3)
    circle = made(3, CIRCLE_KNOTS, CIRCLE, CIRCLE_WEIGHTS)
    for first in range(0, len(circle) - 1, 3):
        on = de_casteljau(circle[first : first + 4], np.linspace(0, 1, 9))
        assert np.linalg.norm(on, axis=1) == pytest.approx(1, abs=2e-5)


def test_patches_look_as_the_shapes_that_they_are(tmp_path: Path):
    for shape, own in ((BALL, lambda s: s.add_sphere(1)), (RING, lambda s: s.add_torus(0.6, 0.25))):
        scene, told = read(stage(tmp_path, CAMERA, SUN, patch(shape)))
        assert told == []
        other = kanuka.Scene()
        own(other)
        for each in (scene, other):
            each.camera = kanuka.Camera((3, 3, 4), (0, 0, 0), fov=20)
        assert np.abs(alpha(scene) - alpha(other)).mean() < 3e-3  # quadrics are diced too, to a quarter of a pixel
        scene.options.shutter = (0, 0)
        normals = [kanuka.render(s, progressions=16, threads=1, journal=kanuka.Journal())["N"] for s in (scene, other)]
        assert np.abs(normals[0] - normals[1]).mean() < 5e-3


def rings(size: int, sub: int = 8) -> np.ndarray:
    """How much of each pixel three tubes cover, as seen from 4 above: by the angles between which they are seen."""
    x = (np.arange(size * sub) + 0.5) * 2 / (size * sub) - 1
    far = np.hypot(x, x[:, None])
    covered = np.zeros(far.shape, dtype=bool)
    for radius, width, where in ((0.8, 0.1, True), (0.55, 0.1, x[:, None] > 0), (0.3, 0.2, True)):
        angle, half = np.arctan(radius / 4), np.arcsin(width / 2 / np.hypot(radius, 4))
        covered |= (far > 4 * np.tan(angle - half)) & (far < 4 * np.tan(angle + half)) & where
    return covered.reshape(size, sub, size, sub).mean((1, 3))


def test_curves_are_round(tmp_path: Path):
    """Two circles, and half of one between them: by ranges."""
    text = f"""
def NurbsCurves "c" {{
    int[] curveVertexCounts = [9, 9, 9]
    int[] order = [3, 3, 3]
    double[] knots = {CIRCLE_KNOTS * 3}
    double2[] ranges = [(0, 4), (0, 2), (0, 4)]
    point3f[] points = {listed([(r * x, 0, r * y) for r in (0.8, 0.55, 0.3) for x, y in CIRCLE])}
    double[] pointWeights = {listed(np.tile(CIRCLE_WEIGHTS, 3))}
    float[] widths = [0.1, 0.1, 0.2] (interpolation = "uniform")
}}
"""
    scene, told = read(stage(tmp_path, CAMERA, SUN, text))
    assert told == []
    seen, expected = alpha(scene, samples=64), rings(32)
    assert seen.mean() == pytest.approx(expected.mean(), rel=0.01)
    assert np.abs(seen - expected).mean() < 0.02
    # Four deviations of 64 samples, were they not stratified; but for the ends of the half.
    assert np.abs(seen - expected)[np.r_[:14, 18:32]].max() < 0.25


SHEET = """
def NurbsPatch "p" {
    int uVertexCount = 3
    int vVertexCount = 2
    int uOrder = 2
    int vOrder = 2
    double[] uKnots = [0, 0, 1, 3, 3]
    double[] vKnots = [0, 0, 1, 1]
    point3f[] points = [(-1, 0, 1), (0, 0, 1), (1, 0, 1), (-1, 0, -1), (0, 0, -1), (1, 0, -1)]
    MORE
}
"""
REDS = "[" + ", ".join(f"({r}, 0, 0)" for r in (0.1, 0.5, 0.9, 0.1, 0.5, 0.9)) + "]"


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        (f'{REDS} (interpolation = "vertex")', [0.2, 0.4, 0.6, 0.8]),
        (f'{REDS} (interpolation = "varying")', [0.2, 0.4, 0.6, 0.8]),
        ('[(0.2, 0, 0), (0.7, 0, 0)] (interpolation = "uniform")', [0.2, 0.2, 0.7, 0.7]),
        ("[(0.3, 0, 0)]", [0.3] * 4),
    ],
)
def test_primvars_go_over_patches(tmp_path: Path, values: str, expected: list[float]):
    text = SHEET.replace("MORE", f"color3f[] primvars:displayColor = {values}")
    scene, told = read(stage(tmp_path, CAMERA, SUN, text))
    assert told == []
    scene.resolution = 8, 8
    scene.options.filter, scene.options.filter_width = "box", (1, 1)
    red = kanuka.render(scene, progressions=16, threads=1)["albedo"][4, :, 0]
    # Means of pairs of pixels: a quarter of the patch each.
    assert red.reshape(4, 2).mean(1) == pytest.approx(expected, abs=TINT)


# Two spans of order 3, and an empty one between them; x = u - 1.
DOUBLED = SHEET.replace("uVertexCount = 3", "uVertexCount = 5").replace("uOrder = 2", "uOrder = 3")
DOUBLED = DOUBLED.replace("[0, 0, 1, 3, 3]", "[0, 0, 0, 1, 1, 2, 2, 2]").replace(
    "[(-1, 0, 1), (0, 0, 1), (1, 0, 1), (-1, 0, -1), (0, 0, -1), (1, 0, -1)]",
    listed([(x, 0, z) for z in (1, -1) for x in (-1, -0.5, 0, 0.5, 1)]),
)


@pytest.mark.parametrize(
    ("sheet", "reds", "storage", "more", "expected"),
    [
        (DOUBLED, (0.1, 0.3, 0.5, 0.7, 0.9) * 2, "vertex", "", [0.2, 0.4, 0.6, 0.8]),
        (DOUBLED, (0.2, 0.4, 0.7), "uniform", "", [0.2, 0.2, 0.7, 0.7]),
        (DOUBLED, (0.1, 0.5, 0.5, 0.9) * 2, "varying", "", [0.2, 0.4, 0.6, 0.8]),
        (SHEET, (0.1, 0.5, 0.9) * 2, "varying", "double2 uRange = (0, 2)", [0.2, 0.4, 0.6, 0]),
    ],
)
def test_primvars_go_over_spans_of_all_lengths(
    tmp_path: Path, sheet: str, reds, storage: str, more: str, expected: list[float]
):
    values = f'{listed([(r, 0, 0) for r in reds])} (interpolation = "{storage}")'
    text = sheet.replace("MORE", f"color3f[] primvars:displayColor = {values}\n{more}")
    scene, told = read(stage(tmp_path, CAMERA, SUN, text))
    assert told == []
    scene.resolution = 8, 8
    scene.options.filter, scene.options.filter_width = "box", (1, 1)
    red = kanuka.render(scene, progressions=16, threads=1)["albedo"][4, :, 0]
    assert red.reshape(4, 2).mean(1) == pytest.approx(expected, abs=TINT)


def test_patches_have_coordinates_of_their_own(tmp_path: Path):
    """u and v from 0 to 1, where nothing else is authored."""
    quarters(tmp_path, "quarters.exr")
    text = TEXTURED.replace("SPACE", "raw").replace("SCALE", "1").replace("quarters.png", "quarters.exr")
    bound = '(prepend apiSchemas = ["MaterialBindingAPI"]) {\n    rel material:binding = </matte>'
    # A material that reads st, and the primvar of that name is the patch's.
    text += SHEET.replace('"p" {', '"p" ' + bound).replace("MORE", "")
    scene, told = read(stage(tmp_path, CAMERA, SUN, text.replace('"map"', '"st"')))
    assert told == []
    scene.resolution = 12, 12
    seen = kanuka.render(scene, progressions=4, threads=1)["albedo"]
    # u = 1 of 3 is in the middle: what is left of it has the first third.
    assert seen[9, 3] == pytest.approx([0, 0, 0.5], abs=TINT) and seen[2, 10] == pytest.approx([0, 0.5, 0], abs=TINT)
    assert seen[9, 10] == pytest.approx([0.25] * 3, abs=TINT) and seen[9, 6] == pytest.approx([0, 0, 0.5], abs=TINT)


def test_velocities_move_patches(tmp_path: Path):
    more = "vector3f[] velocities.timeSamples = {1: [" + ", ".join(["(4, 0, 0)"] * 6) + "]}"
    text = SHEET.replace("point3f[] points = ", "point3f[] points.timeSamples = {1: ").replace("-1)]\n", "-1)]}\n")
    for a, b in (("(-1, 0, ", "(-0.75, 0, "), ("(0, 0, ", "(-0.5, 0, "), ("(1, 0, ", "(-0.25, 0, ")):
        text = text.replace(a, b)
    scene, told = read(stage(tmp_path, OPEN, SUN, text.replace("MORE", more), head=TIMED), frame=1)
    assert told == []
    assert np.abs(alpha(scene, samples=64)[15:17].mean(0) - exposure()).mean() < 0.02


@pytest.mark.parametrize(
    ("a", "b", "said"),
    [
        ("uOrder = 2", "uOrder = 4", "/p: u: an order of 4 for 3 vertices"),
        ("uOrder = 2", "uOrder = 1", "/p: u: an order of 1 for 3 vertices"),
        ("uOrder = 2", "uOrder = 0", "/p: u: an order of 0 for 3 vertices"),
        ("[0, 0, 1, 1]", "[0, 0, 1]", "/p: v: 3 knots; an order of 2 and 2 vertices need 4"),
        ("[0, 0, 1, 1]", "[0, 1, 0, 1]", "/p: v: knots that do not increase"),
        ("[0, 0, 1, 1]", "[0, 0, nan, 1]", "/p: v: knots that do not increase"),
        ("[0, 0, 1, 1]", "[0, 0, 0, 0]", "/p: v: a range from 0 to 0"),
        ("int vOrder = 2", "", "/p: no vOrder, vVertexCount or vKnots"),
        ("vVertexCount = 2", "vVertexCount = 3", "/p: v: 4 knots; an order of 2 and 3 vertices need 5"),
        ("(0, 0, 1)", "(nan, 0, 1)", "/p: some of its points are no numbers"),
        ("MORE", "double[] pointWeights = [1, 2]", "/p: 2 pointWeights for 6 points"),
        ("MORE", "double[] pointWeights = [1, 2, 1, 0, 1, 1]", "/p: some of its pointWeights are not positive"),
        ("MORE", "double2 uRange = (2, 2)", "/p: u: a range from 2 to 2"),
    ],
)
def test_patches_that_make_no_sense_are_told(tmp_path: Path, a: str, b: str, said: str):
    text = SHEET.replace(a, b, 1).replace("MORE", "")
    scene, told = read(stage(tmp_path, CAMERA, SUN, text, mesh()))
    assert told == [f"{said}. It is left out"]
    assert geometry(scene) == {"polygon mesh": 1}


@pytest.mark.parametrize(
    ("a", "b", "said"),
    [
        ("order = [3]", "order = [3, 3]", "/c: 2 orders for 1 curves"),
        ("[0, 0, 0, 1, 1, 1]", "[0, 0, 0, 1, 1]", "/c: 5 knots; its curves need 6"),
        ("[0, 0, 0, 1, 1, 1]", "[0, 0, 1, 0, 1, 1]", "/c: knots that do not increase"),
        ("[3]\n    int", "[4]\n    int", "/c: curveVertexCounts add up to 4, but there are 3 points"),
        ("order = [3]", "order = [4]", "/c: 6 knots; its curves need 7"),
    ],
)
def test_curves_that_make_no_sense_are_told(tmp_path: Path, a: str, b: str, said: str):
    text = """
def NurbsCurves "c" {
    int[] curveVertexCounts = [3]
    int[] order = [3]
    double[] knots = [0, 0, 0, 1, 1, 1]
    point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 0, 1)]
    float[] widths = [0.1]
}
"""
    assert a in text
    scene, told = read(stage(tmp_path, CAMERA, SUN, text.replace(a, b), mesh()))
    assert told == [f"{said}. It is left out"]
    assert geometry(scene) == {"polygon mesh": 1}
