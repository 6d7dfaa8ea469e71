"""Attribute "kanuka" "shadowterminator": coarse polygons with smooth normals under light from the side."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import kanuka

SIZE = 48


def ball(columns: int, rows: int) -> str:
    """Facets of a unit ball, with the ball's own normals."""
    b, a = np.meshgrid(np.linspace(0, np.pi, rows + 1), np.linspace(0, 2 * np.pi, columns + 1), indexing="ij")
    p = np.stack([np.sin(b) * np.cos(a), np.sin(b) * np.sin(a), np.cos(b)], -1).round(6)
    p[:, -1] = p[:, 0]
    at = np.arange((rows + 1) * (columns + 1)).reshape(rows + 1, columns + 1)
    faces = np.stack([at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]], -1).reshape(-1, 4)
    numbers = " ".join(map(str, p.ravel()))
    corners = " ".join(map(str, faces.ravel()))
    return f'PointsPolygons [{"4 " * len(faces)}] [{corners}] "P" [{numbers}] "N" [{numbers}]'


def off_a_sphere(tmp_path: Path, attribute: str) -> float:
    """How far the light on the ball is from that on a sphere with its normals, over all of it."""
    path = tmp_path / "scene.rib"
    path.write_text(
        f'Format {SIZE} {SIZE} 1 PixelFilter "box" 1 1 Projection "perspective" "fov" 30 WorldBegin\n'
        'LightSource "distantlight" 1 "from" [1 0 0.25] "to" [0 0 0] Surface "matte" "Kd" 1\n'
        f"Translate 0 0 4.5 {attribute} {ball(12, 6)} WorldEnd\n"
    )
    picture = kanuka.render(kanuka.load(path), progressions=64, max_depth=1)
    assert not picture.journal.messages, [m.message for m in picture.journal.messages]
    normal = picture["N"]
    cosine = np.maximum(0, normal @ np.array([1, 0, 0.25]) / np.hypot(1, 0.25)) * picture["alpha"]
    light = picture["rgb"][..., 1]
    full = cosine > 0.7  # no facet turns away from the light here
    scale = light[full].sum() / cosine[full].sum()
    return float(np.abs(light / scale - cosine).sum() / cosine.sum())


def test_facets_are_rounded_unless_asked_not_to_be(tmp_path: Path) -> None:
    smooth = off_a_sphere(tmp_path, "")
    faceted = off_a_sphere(tmp_path, 'Attribute "kanuka" "integer shadowterminator" [0]')
    asked = off_a_sphere(tmp_path, 'Attribute "kanuka" "integer shadowterminator" [1]')
    assert asked == smooth
    assert smooth < 0.01
    assert faceted > 4 * smooth
