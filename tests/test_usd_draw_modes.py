"""Draw modes of USD models: against what is drawn by hand, and pictures that are upright."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

import kanuka
from usd_shapes import HIGH, LOW, TINT, VIEWS, alpha, geometry, looked_at, mesh, quarters
from usd_stages import CAMERA, SUN, read, stage

BOX = """
    def Mesh "m" {
        uniform token subdivisionScheme = "none"
        int[] faceVertexCounts = [3]
        int[] faceVertexIndices = [0, 1, 2]
        point3f[] points = [(-0.5, -0.25, -0.75), (0.5, -0.25, -0.75), (0.5, 0.25, 0.75)]
        float3[] extent = [(-0.5, -0.25, -0.75), (0.5, 0.25, 0.75)]
    }
"""


def model(values: str = "", kind: str = "component", more: str = "", api: str = "") -> str:
    return f"""
def Xform "car" (
    prepend apiSchemas = ["GeomModelAPI"]
    kind = "{kind}"
) {{
    {values}
    {BOX}
    {more}
}}
"""


def mode(name: str, more: str = "") -> str:
    return f'uniform token model:drawMode = "{name}"\n{more}'


GROUP = 'def Xform "set" (kind = "group") {{\n{}\n{}\n}}'
QUIET_CAR = "uniform bool model:applyDrawMode = 0"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (model(mode("bounds")), "curves"),
        (model(mode("default")), "polygon mesh"),
        (model(), "polygon mesh"),
        (GROUP.format(mode("bounds"), model()), "curves"),
        (GROUP.format(mode("bounds"), model(mode("default"))), "polygon mesh"),
        (GROUP.format(mode("bounds"), model(mode("inherited"))), "curves"),
        (GROUP.format(mode("bounds"), model(QUIET_CAR)), "polygon mesh"),
        (GROUP.format(mode("bounds") + "uniform bool model:applyDrawMode = 1", model(QUIET_CAR)), "curves"),
        (GROUP.format(mode("bounds"), model(kind="group")), "polygon mesh"),  # nothing applies it
        (model(mode("bounds"), kind=""), "polygon mesh"),  # no model
        (model(mode("bounds")).replace("(\n", "(\n    instanceable = true\n", 1), "curves"),
    ],
)
def test_draw_modes_apply_to_models(tmp_path: Path, text: str, expected: str):
    scene, told = read(stage(tmp_path, CAMERA, SUN, text))
    assert told == []
    assert list(geometry(scene)) == [expected]


def test_bounds_are_the_edges_of_a_box(tmp_path: Path):
    scene, told = read(stage(tmp_path, CAMERA, SUN, model(mode("bounds"))))
    assert told == []
    own = kanuka.Scene()
    for axis in range(3):
        for a, b in ((0, 0), (0, 1), (1, 0), (1, 1)):
            ends = np.empty((2, 3))
            ends[:, axis] = LOW[axis], HIGH[axis]
            ends[:, (axis + 1) % 3] = (LOW, HIGH)[a][(axis + 1) % 3]
            ends[:, (axis + 2) % 3] = (LOW, HIGH)[b][(axis + 2) % 3]
            own.add_curves(ends, [2], widths=[np.linalg.norm(HIGH - LOW) / 250])
    own.camera = scene.camera
    first, second = alpha(scene), alpha(own)
    assert second.sum() > 10
    assert np.abs(first - second).mean() < 1e-3


def test_origins_are_axes(tmp_path: Path):
    scene, told = read(stage(tmp_path, CAMERA, SUN, model(mode("origin"))))
    assert told == []
    seen = alpha(scene, 33, 256) > 0
    assert seen[16, 17:31].all() and seen[17:31, 16].all()  # +x to the right, +z downwards; +y towards the camera
    assert not seen[:15].any() and not seen[:, :15].any()


COLOR = "float3 model:drawModeColor = (0.25, 0.5, 0.75)"
OTHER = {"XPos": "XNeg", "XNeg": "XPos", "YPos": "YNeg", "YNeg": "YPos", "ZPos": "ZNeg", "ZNeg": "ZPos"}


def corners_of(rgb: np.ndarray) -> np.ndarray:
    n = len(rgb) // 4
    return np.array([[rgb[n, n], rgb[n, -n - 1]], [rgb[-n - 1, n], rgb[-n - 1, -n - 1]]])


@pytest.mark.parametrize("shape", ["cross", "box"])
@pytest.mark.parametrize("face", VIEWS)
def test_cards_are_upright_as_seen_from_where_they_face(tmp_path: Path, face: str, shape: str):
    expected = corners_of(quarters(tmp_path))
    values = mode(
        "cards", f'uniform token model:cardGeometry = "{shape}"\nasset model:cardTexture{face} = @quarters.exr@'
    )
    scene, told = read(stage(tmp_path, CAMERA, SUN, model(values)))
    assert told == []
    assert corners_of(looked_at(scene, face)) == pytest.approx(expected, abs=TINT)
    # The other side has the same picture, seen through: mirrored, with the same side up.
    behind = corners_of(looked_at(scene, OTHER[face], VIEWS[face][1]))
    assert behind == pytest.approx(expected[:, ::-1], abs=TINT)
    # Axes without pictures have no cards.
    assert geometry(scene) == {"polygon mesh": 2}


def test_cards_have_the_models_color_where_they_have_no_pictures(tmp_path: Path):
    scene, told = read(stage(tmp_path, CAMERA, SUN, model(mode("cards", COLOR))))
    assert told == []
    assert geometry(scene) == {"polygon mesh": 6}
    for view in VIEWS:
        assert looked_at(scene, view)[2, 2] == pytest.approx([0.25, 0.5, 0.75], abs=TINT)
    missing = mode("cards", COLOR + "\nasset model:cardTextureXPos = @none.png@")
    scene, told = read(stage(tmp_path, CAMERA, SUN, model(missing), name="b.usda"))
    assert told == ['/car: the card\'s file "none.png" is not found']
    assert looked_at(scene, "XPos")[2, 2] == pytest.approx([0.25, 0.5, 0.75], abs=TINT)


def test_simple_cards_leave_out_those_along_the_up_axis(tmp_path: Path):
    text = GROUP.format(mode("cards", 'uniform token model:cardVisibility = "simple"'), model())
    scene, told = read(stage(tmp_path, CAMERA, SUN, text))
    assert told == [] and geometry(scene) == {"polygon mesh": 4}
    assert looked_at(scene, "YPos").max() == 0 and looked_at(scene, "XPos").max() > 0


def with_matrix(path: Path, numbers: np.ndarray, kind: bytes = b"m44f") -> None:
    """An EXR's header with the matrix worldtoscreen: its chunks are further down by as much."""
    data = path.read_bytes()
    end = 8
    while data[end]:
        name_end = data.index(b"\0", end)
        type_end = data.index(b"\0", name_end + 1)
        end = type_end + 5 + struct.unpack_from("<i", data, type_end + 1)[0]
    more = b"worldtoscreen\0" + kind + b"\0" + struct.pack("<i", 64) + numbers.astype("<f4").tobytes()
    first = struct.unpack_from("<Q", data, end + 1)[0]
    offsets = np.frombuffer(data[end + 1 : first], dtype="<u8") + len(more)
    path.write_bytes(data[:end] + more + b"\0" + offsets.tobytes() + data[first:])


def test_cards_stand_where_their_pictures_were_taken(tmp_path: Path):
    """A picture taken from +z of what is 2 by 1 around (0.1, 0.2, 0), with x and y doubled and depths along -z."""
    expected = corners_of(quarters(tmp_path))
    matrix = np.array([[1, 0, 0, 0], [0, 2, 0, 0], [0, 0, -0.1, 0], [-0.1, -0.4, 0, 1]])
    with_matrix(tmp_path / "quarters.exr", matrix)
    values = 'uniform token model:cardGeometry = "fromTexture"\nasset model:cardTextureXPos = @quarters.exr@'
    scene, told = read(stage(tmp_path, CAMERA, SUN, model(mode("cards", values))))
    assert told == [] and geometry(scene) == {"polygon mesh": 1}
    for z in (4, -4):
        scene.camera = kanuka.Camera(
            (0.1, 0.2, z), (0.1, 0.2, 0), projection="orthographic", screen_window=(-1, 1, -0.5, 0.5)
        )
        scene.resolution = 12, 12
        seen = kanuka.render(scene, progressions=4, threads=1, journal=kanuka.Journal())["albedo"]
        assert corners_of(seen) == pytest.approx(expected if z > 0 else 0 * expected, abs=TINT)


@pytest.mark.parametrize("matrix", [None, np.zeros((4, 4)), np.full((4, 4), np.nan)])
def test_pictures_that_do_not_say_where_they_were_taken_are_told(tmp_path: Path, matrix: np.ndarray | None):
    quarters(tmp_path)
    if matrix is not None:
        with_matrix(tmp_path / "quarters.exr", matrix)
    values = 'uniform token model:cardGeometry = "fromTexture"\nasset model:cardTextureXPos = @quarters.exr@'
    scene, told = read(stage(tmp_path, CAMERA, SUN, model(mode("cards", values)), mesh()))
    assert len(told) == 1 and told[0].startswith("/car: ") and told[0].endswith("The card is left out")
    assert geometry(scene) == {"polygon mesh": 1}


@pytest.mark.parametrize("order", ["<", ">"])
def test_tiffs_say_where_they_were_taken(tmp_path: Path, order: str):
    from kanuka.usd.picture_headers import world_to_screen

    numbers = np.arange(16) + 0.5
    head = (b"II*\0" if order == "<" else b"MM\0*") + struct.pack(f"{order}I", 8)
    entries = struct.pack(f"{order}HHHII", 2, 256, 3, 1, 7) + struct.pack(f"{order}HHII", 33306, 11, 16, 40)
    path = tmp_path / "a.tif"
    path.write_bytes((head + entries).ljust(40, b"\0") + struct.pack(f"{order}16f", *numbers))
    assert world_to_screen(str(path)).reshape(-1) == pytest.approx(numbers)
    path.write_bytes(path.read_bytes()[:60])
    with pytest.raises(ValueError, match="no matrix"):
        world_to_screen(str(path))


def test_models_without_bounds_are_told(tmp_path: Path):
    empty = 'def Xform "car" (kind = "component") {\n uniform token model:drawMode = "bounds"\n}\n'
    scene, told = read(stage(tmp_path, CAMERA, SUN, empty, mesh()))
    assert told == ["/car: its draw mode is bounds, but it has no bounds. It is left out"]
    assert geometry(scene) == {"polygon mesh": 1}
