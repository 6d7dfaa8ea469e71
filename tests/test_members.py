"""Members that a class shader's displacement sets, as its surface sees them in a picture."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka

SHADER = """
class carved() {
    varying float depth = 0;
    public void displacement(output point P; output normal N) {
        depth = 0.2 * (0.5 + 0.5 * sin(7 * zcomp(transform("object", P))));
        P += depth * normalize(N);
        N = calculatenormal(P);
    }
    public void surface(output color Ci, Oi) { Oi = 1; Ci = depth; }
}
"""
SCENE = """
Format 64 64 1
Projection "perspective" "fov" 30
Translate 0 0 5
WorldBegin
Attribute "displacementbound" "sphere" [0.3]
Surface "carved"
Rotate 40 1 0 0
%s
WorldEnd
"""


def ball_of_polygons(n: int) -> str:
    """A unit sphere of small quads, finer than the pixels."""
    theta, phi = np.meshgrid(np.linspace(0.01, np.pi - 0.01, n + 1), np.linspace(0, 2 * np.pi, n + 1), indexing="ij")
    points = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1).reshape(-1, 3)
    corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).reshape(-1, 1)
    faces = corner + np.array([0, n + 1, n + 2, 1])

    def text(values: np.ndarray) -> str:
        return "[" + " ".join(f"{v:.6g}" for v in values.reshape(-1)) + "]"

    return f'PointsPolygons {text(np.full(n * n, 4))} {text(faces)} "P" {text(points)} "N" {text(points)}'


@pytest.mark.parametrize("shape", ["Sphere 1 -1 1 360", ball_of_polygons(160)], ids=["grids", "mesh"])
def test_depth_of_a_displacement_colours_the_surface(tmp_path: Path, shape: str) -> None:
    (tmp_path / "carved.sl").write_text(SHADER)
    path = tmp_path / "scene.rib"
    path.write_text(SCENE % shape)
    picture = kanuka.render(kanuka.load(path), progressions=8)  # small pixels: P is a mean over each
    assert not picture.journal.messages, [e.message for e in picture.journal.messages]
    inside = picture["alpha"] == 1
    assert inside.sum() > 800
    depth = np.linalg.norm(picture["P"], axis=-1)[inside] - 1  # the ball lies in the world's middle
    shown = picture["rgb"].mean(-1)[inside]
    assert depth.max() - depth.min() > 0.1
    assert np.abs(shown - depth).mean() < 0.01
    assert abs((shown - depth).mean()) < 0.003
