"""Models in files of OBJ, PLY, STL and glTF."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

trimesh = pytest.importorskip("trimesh")
import kanuka  # noqa: E402
import kanuka.models  # noqa: E402

QUAD = np.array([[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1]], np.float32)
FACES = np.array([[0, 1, 2], [0, 2, 3]])
UV = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)


def lit(path: Path) -> np.ndarray:
    """The floor from above, by a sun of irradiance pi: what is seen is the reflectance."""
    scene = kanuka.Scene()
    told = kanuka.Journal()
    kanuka.models.add_file(scene, path, journal=told)
    assert len(told) == 0
    scene.resolution = 16, 16
    scene.camera = kanuka.Camera((0, 4, 0), (0, 0, 0), up=(0, 0, -1), fov=2 * math.degrees(math.atan(1 / 4)))
    scene.add_light("distant", amount=math.pi * math.sqrt(2), direction=(1, -1, 0))  # beside the gloss
    return kanuka.render(scene, progressions=16, seed=3)["rgb"]


def quarters(mode: str = "RGB"):
    """Top left red, top right green, bottom left blue, bottom right white."""
    from PIL import Image

    rgb = np.zeros((32, 32, 3), np.uint8)
    rgb[:16, :16, 0] = rgb[:16, 16:, 1] = rgb[16:, :16, 2] = rgb[16:, 16:] = 255
    return Image.fromarray(rgb).convert(mode)


@pytest.mark.parametrize("suffix", ["obj", "glb", "gltf"])
def test_textures_are_upright(tmp_path: Path, suffix: str):
    material = trimesh.visual.material.PBRMaterial(baseColorTexture=quarters(), metallicFactor=0.0, roughnessFactor=1.0)
    if suffix == "obj":
        material = trimesh.visual.material.SimpleMaterial(image=quarters(), diffuse=[255, 255, 255], glossiness=0)
    visual = trimesh.visual.TextureVisuals(uv=UV, material=material)
    mesh = trimesh.Trimesh(QUAD, FACES, visual=visual, process=False)
    path = tmp_path / f"floor.{suffix}"
    mesh.export(path)
    rgb = lit(path)
    assert rgb[3, 3].argmax() == 0 and rgb[3, 12].argmax() == 1 and rgb[12, 3].argmax() == 2
    assert rgb[3, 3, 0] > 0.8 and rgb[3, 3, 1] < 0.1
    assert rgb[12, 12] == pytest.approx(np.full(3, rgb[12, 12].mean()), rel=0.02)


def test_vertices_of_a_ply_have_colours(tmp_path: Path):
    colors = np.tile(np.array([[188, 64, 255, 255]], np.uint8), (4, 1))
    trimesh.Trimesh(QUAD, FACES, vertex_colors=colors, process=False).export(tmp_path / "floor.ply")
    decoded = ((np.array([188, 64, 255]) / 255 + 0.055) / 1.055) ** 2.4
    rgb = lit(tmp_path / "floor.ply")[8, 8]
    assert decoded[1] / decoded[0] < rgb[1] / rgb[0] < 1.4 * decoded[1] / decoded[0]  # a gloss lies over it
    assert rgb[2] > rgb[0] > rgb[1]


def test_an_stl_is_grey(tmp_path: Path):
    trimesh.Trimesh(QUAD, FACES, process=False).export(tmp_path / "floor.stl")
    assert lit(tmp_path / "floor.stl")[8, 8] == pytest.approx([0.5] * 3, abs=0.06)


def test_nodes_place_their_meshes_and_share_them(tmp_path: Path):
    scene = trimesh.Scene()
    ball = trimesh.creation.icosphere(subdivisions=2, radius=1)
    for i in range(3):
        matrix = trimesh.transformations.translation_matrix((4 * i, 0, 0))
        if i == 0:
            scene.add_geometry(ball, geom_name="ball", node_name="n0", transform=matrix)
        else:
            scene.graph.update(frame_to=f"n{i}", matrix=matrix, geometry="ball")
    scene.export(tmp_path / "balls.glb")
    made = kanuka.models.load(tmp_path / "balls.glb")
    assert made.summary()["instances"] == 3
    other = kanuka.Scene()
    corners = kanuka.models.add_file(other, tmp_path / "balls.glb", transform=np.diag([2, 2, 2, 1]))
    assert corners.min(0) == pytest.approx([-2, -2, -2], abs=0.1)
    assert corners.max(0) == pytest.approx([18, 2, 2], abs=0.1)


def test_the_command_renders_a_model_on_a_neutral_stage(kanuka_command, tmp_path: Path):
    trimesh.creation.icosphere(subdivisions=3, radius=5).export(tmp_path / "ball.obj")
    result = kanuka_command(
        "render", tmp_path / "ball.obj", "-o", tmp_path / "a.exr", "--res", "96x54", "--progressions", "4"
    )
    assert result.returncode == 0, result.stderr
    rgb = kanuka.read(tmp_path / "a.exr")["rgb"]
    assert 0.2 < rgb[27, 48].mean() < 1.5  # the ball
    assert 0.2 < rgb[52, 4].mean() < 1.5  # the ground, beside it
    result = kanuka_command("info", tmp_path / "ball.obj")
    assert (result.returncode == 0 and "ground" in result.stdout) or "ball" in result.stdout


@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        ("a.obj", "", "no faces"),
        ("a.obj", "v 1 2 3\nf 1 2 9\n", "cannot be read"),
        ("a.glb", "glTF no more", "cannot be read"),
        ("a.gltf", "{", "cannot be read"),
        ("a.ply", "ply\nformat ascii 1.0\nelement vertex 9999999999\nend_header\n", "cannot be read|no faces"),
        ("a.stl", "solid", "cannot be read|no faces"),
    ],
)  # fmt: skip
def test_what_is_no_model_says_so(tmp_path: Path, name: str, text: str, says: str):
    (tmp_path / name).write_text(text)
    with pytest.raises(kanuka.Error, match=says):
        kanuka.models.load(tmp_path / name)


def test_points_that_are_no_numbers_cost_their_faces(tmp_path: Path):
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv nan 0 0\nf 1 2 3\nf 1 2 4\n")
    told = kanuka.Journal()
    kanuka.models.load(tmp_path / "a.obj", journal=told)
    assert "1 faces have points that are no numbers" in told.messages[0].message
