"""What the large scenes are made with: cells, places, shapes, and folders of arrays."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

import kanuka

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "scenes"))

from kit import places, shapes, sinks


def test_cells_are_filled_where_they_are_liked_and_no_further_than_there_is_room() -> None:
    room, liked = np.array([[4.0, 4, 0, 4]]), np.array([[1.0, 0.01, 1, 0.1]])
    few = places.filled(room, liked, 0.01)
    np.testing.assert_allclose(few / few.sum(), [[1 / 1.11, 0.01 / 1.11, 0, 0.1 / 1.11]], rtol=0.01)
    many = places.filled(room, liked, 10.0)
    assert many.sum() == pytest.approx(10) and 3.9 < many[0, 0] < 4.01 and many[0, 2] == 0
    np.testing.assert_allclose(places.filled(room, liked, 1e4).sum(), 1e4)  # room grows where there is too little
    assert places.filled(room, liked, 0).sum() == 0


def test_things_fall_into_their_cells() -> None:
    cells = places.Cells((-2.0, 5.0), 2.0, np.array([[1.0, 0, 3], [0, 4, 0]]))
    xz = places.scattered(cells, 8000, np.random.default_rng(1))
    column, row = ((xz - (-2, 5)) // 2).T.astype(int)
    found = np.zeros((2, 3))
    np.add.at(found, (row, column), 1)
    np.testing.assert_allclose(found, 1000 * cells.many, atol=1)
    kept = places.apart(cells, 60, 0.15, np.random.default_rng(2))
    gaps = np.linalg.norm(kept[:, None] - kept, axis=2) + 9 * np.eye(60)
    assert len(kept) == 60 and gaps.min() >= 0.15
    assert len(places.apart(cells, 500, 5.0, np.random.default_rng(2))) == 500  # they come nearer, and are all there


def test_matrices_turn_lean_and_scale() -> None:
    rng = np.random.default_rng(3)
    where, turn, size = rng.normal(size=(50, 3)), rng.uniform(0, 6, 50), rng.uniform(0.5, 2, 50)
    up = rng.normal(size=(50, 3)) + np.array([0, 2.5, 0])
    m = places.matrices(where, turn, size, up=up).astype(float)
    linear = m[:, :, :3]
    np.testing.assert_allclose(linear.transpose(0, 2, 1) @ linear, np.eye(3) * size[:, None, None] ** 2, atol=1e-5)
    assert np.all(np.linalg.det(linear) > 0)
    np.testing.assert_allclose(linear[:, :, 1], up / np.linalg.norm(up, axis=1)[:, None] * size[:, None], atol=1e-5)
    np.testing.assert_allclose(m[:, :, 3], where, atol=1e-6)
    flat = places.matrices(where, turn, size)  # about y alone: x goes to (cos, 0, -sin)
    np.testing.assert_allclose(
        flat[:, :, 0], size[:, None] * np.stack([np.cos(turn), 0 * turn, -np.sin(turn)], 1), atol=1e-6
    )


def test_a_folder_holds_the_same_picture(tmp_path: Path) -> None:
    def fill(sink: object) -> None:
        points, faces = shapes.ball(3)
        leaf = sink.group("leaf")
        leaf.mesh(points.astype(np.float32), faces, sinks.Look("matte", {"color": (0.2, 0.6, 0.1)}))
        twig = sink.group("twig")
        twig.instances(leaf, np.float32([[[0.3, 0, 0, k - 0.5], [0, 0.3, 0, 0], [0, 0, 0.3, 0]] for k in range(2)]))
        stood = np.float32([[[1, 0, 0, 0], [0, 1, 0, k - 0.5], [0, 0, 1, 0]] for k in range(2)])
        sink.instances(twig, stood, tint=np.float32([[1, 0.5, 0.5], [0.5, 0.5, 1]]))
        lines = np.float32([[-1, 0, 0], [0, 0.3, 0], [1, 0, 0]])
        sink.curves(lines, np.int32([3]), sinks.Look("matte"), widths=np.float32([0.1]))
        square = np.float32([[-2, -1, 2], [2, -1, 2], [2, -1, -2], [-2, -1, -2]])
        sink.mesh(square, np.int32([[0, 1, 2, 3]]), sinks.Look("plastic", {"float Ks": 0.3}), name="floor",
                  primvars={"vertex color Cs": np.float32(np.eye(4, 3))}, shadows_off=["lamp"])  # fmt: skip
        sink.close()

    live = kanuka.Scene()
    fill(sinks.Live(live))
    fill(sinks.Folder(tmp_path / "it", {"what": "a test"}))
    kept, about = sinks.read(tmp_path / "it")
    assert about == {"what": "a test"}
    pictures = []
    for scene in (live, kept):
        scene.camera = kanuka.Camera((0, 1, 4), (0, 0, 0), fov=50)
        scene.add_light("point", position=(2, 3, 2), amount=30, name="lamp")
        pictures.append(kanuka.render(scene, resolution=(24, 16), progressions=2)["rgb"])
    assert pictures[0].max() > 0 and np.array_equal(*pictures)


def test_a_folder_that_is_none_is_named(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"index\.json is missing"):
        sinks.read(tmp_path)
    (tmp_path / "index.json").write_text('{"version": 0}')
    with pytest.raises(ValueError, match="version 0, where 1 is read"):
        sinks.read(tmp_path)


def test_shapes_face_outwards() -> None:
    points, faces = shapes.ball(4)
    a, b, c, d = (points[faces[:, k]] for k in range(4))
    volume = np.sum(np.cross(c - a, d - b) * (a + b + c + d)) / 24  # of flat quads about the origin
    assert len(faces) == 6 * 16 and 3.5 < volume < 4 * np.pi / 3
    assert np.allclose(shapes.normals(points, faces), points, atol=0.06)
    x, z = np.meshgrid(np.linspace(0, 1, 4), np.linspace(0, 2, 5))
    plane = shapes.lattice_normals(np.stack([x, 0.5 * x - 0.25 * z, z], axis=-1))
    assert np.allclose(plane, np.array([-0.5, 1, 0.25]) / np.linalg.norm([-0.5, 1, 0.25]), atol=1e-6)
    course = np.stack([np.zeros(5), np.linspace(0, 2, 5), np.zeros(5)], axis=1)[None]
    points, normals, faces = shapes.tubes(course, np.full((1, 5), 0.5), 8)
    a, b, c, d = (points[faces[:, k]] for k in range(4))
    assert np.all(np.sum(np.cross(c - a, d - b) * normals[faces[:, 0]], axis=1) > 0)
    assert np.allclose(np.hypot(points[:, 0], points[:, 2]), 0.5) and len(faces) == 4 * 8
    blade, faces = shapes.blade(4, 0.5, 0.2, 0.3)
    a, b, c, d = (blade[faces[:, k]] for k in range(4))
    assert np.all(np.cross(c - a, d - b)[:, 1] > 0) and blade[:, 2].max() == 1
