"""RIB files that stages and models become: what is in them, who writes them. Their pictures: test_usd_convert.py."""

from __future__ import annotations

import math
import re
import shutil
import time
from pathlib import Path

import numpy as np
import pytest

import kanuka
import kanuka.models
import kanuka.usd
from kanuka.cli import main
from kanuka.rib import RibScene
from kanuka.rib.scene import LOOKS
from test_usd_convert import GLOSSY, MESH, MOVES, SHAPES, SIZE
from usd_stages import CAMERA, FLOOR, MATTE, SUN, stage

PRODUCT = """
def RenderSettings "settings" {
    rel products = [</p>]
}
def RenderProduct "p" {
    token productName = "out.exr"
    rel orderedVars = [</color>, </heat>, </diffuse>]
}
def RenderVar "color" {
    string sourceName = "Ci"
}
def RenderVar "heat" {
    token dataType = "float"
    string sourceName = "primvars:heat"
}
def RenderVar "diffuse" {
    string sourceName = "lpe:C<RD>L"
}
"""


def test_what_readers_add_to_a_scene_can_be_written() -> None:
    package = Path(kanuka.__file__).parent
    sources = [package / "models.py", package / "standins.py", *(package / "usd").glob("*.py")]
    added = {name for source in sources for name in re.findall(r"\.(add_\w+)\(", source.read_text())}
    taken = {name for name in dir(kanuka.Scene) if name.startswith("add_")}
    assert len(added & taken) > 8
    assert added & taken <= set(dir(RibScene))
    looks = re.findall(r"(\w+):", kanuka.Scene.add_sphere.__doc__.split("*, ")[1].split(") ->")[0])
    assert set(looks) >= LOOKS
    scene = RibScene()
    with pytest.raises(ValueError, match="radius"):
        scene.add_sphere(-1)
    with pytest.raises(TypeError, match="material"):
        scene.add_sphere(material=kanuka.Material("plastic"))
    with pytest.raises(TypeError, match="colour"):
        scene.add_mesh([[0, 0, 0]] * 3, [[0, 1, 2]], colour=3)


def test_the_file_has_what_it_was_worked_out_by_hand_to_have(tmp_path: Path) -> None:
    moved = """
def Sphere "b" {
    double radius = 0.5
    double3 xformOp:translate = (1, 2, 3)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
"""
    path = stage(tmp_path, CAMERA, SUN, moved)
    kanuka.usd.convert(path, tmp_path / "b.rib", resolution=(32, 16))
    text = " ".join((tmp_path / "b.rib").read_text().split())
    for line in (
        "Format 32 16 1",
        'Attribute "identifier" "string name" ["/b"] ConcatTransform [1 0 0 0 0 1 0 0 0 0 1 0 1 2 3 1]',
        "Sphere 0.5 -0.5 0.5 360",
        '"color lightcolor" [0.63661975 0.63661975 0.63661975]',  # an irradiance of 2, over pi
    ):
        assert line in text, line
    (fov,) = re.findall(r'Projection "perspective" "float fov" \[([0-9.]+)\]', text)
    # The aperture of 20 by 20 becomes one of 40 by 20, of a lens of 40: across the height.
    assert float(fov) == pytest.approx(math.degrees(2 * math.atan(10 / 40)), rel=1e-6)


def test_the_display_asks_for_the_products_layers(tmp_path: Path) -> None:
    heat = "float[] primvars:heat = [7]"
    path = stage(tmp_path, CAMERA, MATTE, SUN, FLOOR.replace("EXTRA", heat), PRODUCT)
    path.write_text(path.read_text().replace("(\n", '(\n    renderSettingsPrimPath = "/settings"\n', 1))
    kanuka.usd.convert(path, tmp_path / "a.rib", resolution=SIZE)
    scene = kanuka.load(tmp_path / "a.rib")
    assert {display["file"] for display in scene.options.displays} == {"out.exr"}
    picture = kanuka.render(scene, progressions=1, threads=1)
    assert picture["heat"][12, 12] == pytest.approx(7) and "lpe:C<RD>L" in picture


def test_encodings_are_the_same_picture_wherever_they_lie(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = stage(tmp_path, CAMERA, MATTE, SUN, FLOOR.replace("EXTRA", ""))
    pictures = []
    for name, binary in (("a.rib", False), ("b.rib", True), ("c.rib.gz", True)):
        kanuka.usd.convert(path, tmp_path / name, binary=binary)
        away = tmp_path / f"away-{name}"
        away.mkdir()
        for each in (tmp_path / name, tmp_path / f"{name[0]}_shaders"):
            shutil.move(each, away)
        monkeypatch.chdir(tmp_path)
        scene = kanuka.load(away / name)
        scene.resolution = SIZE
        pictures.append(kanuka.render(scene, progressions=2, threads=1)["rgb"])
    assert (tmp_path / "away-c.rib.gz" / "c.rib.gz").read_bytes()[:2] == b"\x1f\x8b"
    assert np.array_equal(pictures[0], pictures[1]) and np.array_equal(pictures[0], pictures[2])


def test_large_stages_are_written_by_arrays(tmp_path: Path) -> None:
    """Ten times as much takes less than a loop over it would."""
    from pxr import Usd, UsdGeom, Vt

    made, n = Usd.Stage.CreateNew(str(tmp_path / "big.usdc")), 300
    x, z = np.meshgrid(np.linspace(-1, 1, n, dtype=np.float32), np.linspace(-1, 1, n, dtype=np.float32))
    points = np.stack([x, np.zeros_like(x), z], -1).reshape(-1, 3)
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).reshape(-1)
    faces = np.stack([corner, corner + n, corner + n + 1, corner + 1], -1).astype(np.int32).reshape(-1)
    mesh = UsdGeom.Mesh.Define(made, "/grid")
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(faces))
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(corner), 4, np.int32)))
    many = UsdGeom.PointInstancer.Define(made, "/many")
    UsdGeom.Sphere.Define(made, "/many/ball").CreateRadiusAttr(0.002)
    many.CreatePrototypesRel().SetTargets(["/many/ball"])
    many.CreatePositionsAttr(Vt.Vec3fArray.FromNumpy(points))
    many.CreateProtoIndicesAttr(Vt.IntArray.FromNumpy(np.zeros(len(points), np.int32)))
    made.Save()
    started = time.process_time()
    kanuka.usd.convert(tmp_path / "big.usdc", tmp_path / "big.rib", binary=True, journal=kanuka.Journal())
    assert time.process_time() - started < 5
    found = kanuka.load(tmp_path / "big.rib", journal=kanuka.Journal()).summary()
    assert found["instances"] == n * n and found["points"] >= n * n


def test_what_cannot_be_read_is_told_and_left_out(tmp_path: Path) -> None:
    bad = MESH.replace("SCHEME", "none").replace("EXTRA", "").replace("(-.5,-.5,-.5)", "(nan, 0, 0)")
    path = stage(
        tmp_path,
        CAMERA,
        GLOSSY,
        SUN,
        bad,
        'def Sphere "b" {\ndouble radius = -1\n}\n',
        SHAPES["cone"].replace("it", "ok"),
    )
    journal = kanuka.Journal()
    kanuka.usd.convert(path, tmp_path / "a.rib", journal=journal)
    told = [m.message for m in journal if m.severity == "error"]
    assert len(told) == 2 and told[0].startswith("/b: ") and told[1].startswith("/it: ")
    assert kanuka.load(tmp_path / "a.rib").summary()["primitives"] == {"cone": 1, "disk": 1}


def test_the_command_converts_stages_and_models(kanuka_command, tmp_path: Path) -> None:
    path = stage(tmp_path, MOVES, SUN, MATTE, name="shot.usda")
    done = kanuka_command(
        "convert", path, "shot.rib", "--frame", "2", "--camera", "moving", "--prim", "/ball", "--prim", "/moving"
    )
    assert done.returncode == 0, done.stderr
    text = " ".join((tmp_path / "shot.rib").read_text().split())
    assert "0.5 0 0.2 1]" in text and "PointsPolygons" not in text
    assert len(list((tmp_path / "shot_shaders").glob("*.sl"))) == 1


@pytest.mark.parametrize("more", ["-", "b.rib --expand-archives", "b.rib --gzip --zstd", "b.rib --frame x"])
def test_wrong_commands_are_told(tmp_path: Path, more: str, capsys: pytest.CaptureFixture) -> None:
    path = stage(tmp_path, SUN)
    with pytest.raises(SystemExit) as ended:
        main(["convert", str(path), *more.split()])
    assert ended.value.code == 2 and "error: " in capsys.readouterr().err


def test_models_are_the_same(tmp_path: Path) -> None:
    pytest.importorskip("trimesh")
    (tmp_path / "a.obj").write_text("v -1 0 0\nv 1 0 0\nv 0 1.5 0.3\nv 0 0.5 -1\nf 1 2 3\nf 2 4 3\nf 4 1 3\n")
    kanuka.models.convert(tmp_path / "a.obj", tmp_path / "a.rib", resolution=SIZE)
    scenes = kanuka.models.load(tmp_path / "a.obj", resolution=SIZE), kanuka.load(tmp_path / "a.rib")
    a, b = (kanuka.render(scene, progressions=8, threads=1)["rgb"] for scene in scenes)
    assert a.std() > 0.02 and np.abs(a - b).mean() < 2e-3 * a.mean()
