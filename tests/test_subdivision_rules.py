"""How a subdivision surface follows its cage: OpenSubdiv's options, against closed forms and refinement in numpy."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka
import kanuka.usd
from kanuka.rib import RibScene
from usd_shapes import mesh
from usd_stages import CAMERA, SUN, read, stage

FLAT = np.array([[-0.75, 0, 0.75], [0.75, 0, 0.75], [0.75, 0, -0.75], [-0.75, 0, -0.75]], np.float32)
QUAD = np.array([[0, 1, 2, 3]], np.int32)
OCTAHEDRON = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], np.float32)
SIDES = np.array([[a, b, c] if flip > 0 else [a, c, b] for a in (0, 1) for b in (2, 3) for c in (4, 5)
                  for flip in [np.linalg.det(OCTAHEDRON[[a, b, c]])]], np.int32)  # fmt: skip


def from_above(scene):
    scene.resolution = 64, 64
    scene.options.filter, scene.options.filter_width = "box", (1, 1)
    scene.camera = kanuka.Camera((0, 4, 0), (0, 0, 0), up=(0, 0, -1), fov=2 * np.degrees(np.arctan(0.25)))
    return scene


def picture(*arguments, **options) -> kanuka.Picture:
    scene = from_above(kanuka.Scene())
    scene.options.geometry_tolerance = 0.02  # pixels
    scene.add_subdivision(*arguments, **options)
    return kanuka.render(scene, progressions=16, threads=1, integrator="facing")


def spline_area(corners: np.ndarray) -> float:
    """Within a closed uniform cubic B-spline: what is left of the border of one face whose corners are not sharp."""
    t = np.linspace(0, 1, 257)[:-1, None]
    weights = [(1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, -3 * t**3 + 3 * t**2 + 3 * t + 1, t**3]
    line = np.concatenate([sum(w * corners[(k + i) % 4] for i, w in enumerate(weights)) / 6 for k in range(4)])
    x, y = line.T
    return 0.5 * abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


AREAS = {"edge-and-corner": 1.5**2, "edge-only": spline_area(FLAT[:, ::2].astype(float))}


@pytest.mark.parametrize("boundary", AREAS)
def test_a_square_has_the_border_that_its_boundary_gives(boundary: str) -> None:
    seen = picture(FLAT, QUAD, boundary=boundary)["alpha"].mean() * 4
    assert seen == pytest.approx(AREAS[boundary], rel=0.01)
    assert AREAS["edge-only"] < 0.7 * AREAS["edge-and-corner"]


def test_without_a_boundary_faces_there_only_guide_the_others() -> None:
    x = np.linspace(-0.9, 0.9, 4, dtype=np.float32)
    points = np.stack([np.tile(x, 4), np.zeros(16, np.float32), np.repeat(-x, 4)], 1)
    corners = (np.arange(3)[:, None] * 4 + np.arange(3))[..., None] + np.array([0, 1, 5, 4])
    seen = picture(points, corners.reshape(-1, 4).astype(np.int32), boundary="none")["alpha"].mean() * 4
    assert seen == pytest.approx(0.6**2, rel=0.02)


@pytest.mark.parametrize(("facevarying", "middle"), [("corners-plus1", 16 / 36), ("none", 16 / 36), ("all", 1.0)])
def test_face_varying_values_go_linearly_where_they_should(facevarying: str, middle: float) -> None:
    """1 at the middle of four faces, 0 around. Smooth: Catmull and Clark's limit, n² / (n (n + 5)) with n = 4."""
    x = np.linspace(-0.9, 0.9, 3, dtype=np.float32)
    points = np.stack([np.tile(x, 3), np.zeros(9, np.float32), np.repeat(-x, 3)], 1)
    faces = np.array([[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6], [4, 5, 8, 7]], np.int32)
    values = (faces.reshape(-1, 1) == 4) * np.ones(3)
    seen = picture(points, faces, facevarying=facevarying, primvars={"facevarying color Cs": values})
    assert seen["albedo"][31:33, 31:33, 0].mean() == pytest.approx(middle, abs=0.04)


def refined(weight: float) -> tuple[np.ndarray, np.ndarray]:
    """One step of Catmull and Clark's refinement of the octahedron, in double. Between two triangles the middle of an
    edge takes `weight` of each face: a quarter by their rule; 0.47 by the smooth one of OpenSubdiv's documentation."""
    points = OCTAHEDRON.astype(float)
    middles = points[SIDES].mean(1)
    edges: dict[tuple[int, int], list[int]] = {}
    for face, side in enumerate(SIDES):
        for a, b in zip(side, np.roll(side, -1), strict=True):
            edges.setdefault((min(a, b), max(a, b)), []).append(face)
    at = {edge: 14 + k for k, edge in enumerate(edges)}
    on_edges = [
        weight * middles[faces].sum(0) + (0.5 - weight) * points[list(edge)].sum(0) for edge, faces in edges.items()
    ]
    kept = []
    for v in range(6):
        around = [points[b if a == v else a] for a, b in edges if v in (a, b)]
        faces = middles[(v == SIDES).any(1)]
        n = len(around)
        kept.append((n - 2) / n * points[v] + np.sum(around, 0) / n**2 + faces.sum(0) / n**2)
    quads = [
        [v, at[min(v, b), max(v, b)], 6 + face, at[min(v, a), max(v, a)]]
        for face, side in enumerate(SIDES)
        for v, b, a in zip(side, np.roll(side, -1), np.roll(side, 1), strict=True)
    ]
    return np.concatenate([kept, middles, on_edges]).astype(np.float32), np.array(quads, np.int32)


@pytest.mark.parametrize(("smooth", "weight"), [(False, 0.25), (True, 0.47)])
def test_triangles_are_as_smooth_as_their_rule(smooth: bool, weight: float) -> None:
    seen = picture(OCTAHEDRON, SIDES, smooth_triangles=smooth)
    wanted, other = picture(*refined(weight)), picture(*refined(0.72 - weight))
    inside = (seen["alpha"] == 1) & (wanted["alpha"] == 1) & (other["alpha"] == 1)
    error = np.abs(seen["P"] - wanted["P"])[inside].max()
    assert error < 2e-3
    assert np.abs(seen["P"] - other["P"])[inside].max() > 10 * error


def test_stages_and_their_ribs_have_these_rules(tmp_path: Path) -> None:
    corners = "point3f[] points = [(-.75, 0, .75), (.75, 0, .75), (.75, 0, -.75), (-.75, 0, -.75)]"
    text = mesh(f'{corners}\ntoken interpolateBoundary = "edgeOnly"\ntoken triangleSubdivisionRule = "smooth"\n'
                'token faceVaryingLinearInterpolation = "all"')  # fmt: skip
    text = text.replace('subdivisionScheme = "none"', 'subdivisionScheme = "catmullClark"')
    path = stage(tmp_path, CAMERA, SUN, text)
    scene, told = read(path)
    assert told == []
    kanuka.usd.convert(path, tmp_path / "a.rib", journal=kanuka.Journal())
    rib = (tmp_path / "a.rib").read_text()
    for tag in ("interpolateboundary", "facevaryinginterpolateboundary", "smoothtriangles"):
        assert tag in rib
    for each in (scene, kanuka.load(tmp_path / "a.rib")):
        seen = kanuka.render(from_above(each), progressions=16, threads=1)["alpha"].mean() * 4
        assert seen == pytest.approx(AREAS["edge-only"], rel=0.01)


def test_a_rule_that_is_none_is_told(tmp_path: Path) -> None:
    for argument in ("boundary", "facevarying"):
        with pytest.raises(ValueError, match=f'{argument}: expected "none"'):
            kanuka.Scene().add_subdivision(FLAT, QUAD, **{argument: "odd"})
        with pytest.raises(ValueError):
            RibScene().add_subdivision(FLAT, QUAD, **{argument: "odd"})
    text = mesh().replace('subdivisionScheme = "none"', 'subdivisionScheme = "catmullClark"')
    odd = text.replace("int[] faceVertexCounts", 'token interpolateBoundary = "odd"\nint[] faceVertexCounts')
    _, told = read(stage(tmp_path, CAMERA, SUN, odd))
    assert told == ['/m: there is no interpolateBoundary "odd"; it is taken for "edgeAndCorner"']
