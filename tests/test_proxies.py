"""Simple models of scenes: kanuka.proxies, kanuka store export, kanuka.traced_surfaces, kanuka.decimate."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import kanuka
from conftest import ROOT
from kanuka import models, proxies, usd

RAMP = "surface ramp() { Ci = color(s, t, 0.25) * diffuse(normalize(N)); Oi = 1; }"
BUMPY = """displacement bumpy(float amount = 0.1) {
    P += amount * sin(14 * s) * sin(9 * t) * normalize(N);
    N = calculatenormal(P);
}"""
CUBE = (
    np.array([[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)], np.float32),
    np.array([[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]], np.int32),
)


@pytest.fixture
def scene(tmp_path: Path) -> kanuka.Scene:
    (tmp_path / "ramp.sl").write_text(RAMP)
    (tmp_path / "bumpy.sl").write_text(BUMPY)
    scene = kanuka.Scene()
    scene.options.shader_path = [str(tmp_path)]
    scene.resolution = 160, 120
    scene.camera = kanuka.Camera(origin=(0.5, 1, 7), target=(0, 0, 0), fov=40)
    return scene


def bumpy(surface: str = "matte", **parameters) -> kanuka.Material:
    return kanuka.Material(surface, displacement="bumpy", displacement_bound=0.1, **parameters)


def the_mesh(scene: kanuka.Scene) -> tuple[dict, np.ndarray]:
    """The only one of the world, and its points there."""
    world = kanuka.traced_surfaces(scene, journal=kanuka.Journal())[-1]
    (mesh,) = world["surfaces"]
    return mesh, mesh["points"] + np.array(world["origin"])


def faces_of_edges(triangles: np.ndarray) -> np.ndarray:
    edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    return np.unique(edges, axis=0, return_counts=True)[1]


def volume(points: np.ndarray, triangles: np.ndarray) -> float:
    corners = points.astype(float)[triangles]
    return float(np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6)


# ---- what is read


def test_surfaces_are_displaced(scene: kanuka.Scene) -> None:
    scene.add_sphere(material=bumpy(), name="ball")
    mesh, points = the_mesh(scene)
    assert (mesh["name"], mesh["kind"]) == ("ball", "Sphere")
    for error in (0, 0.02):
        if error:
            (left,) = kanuka.decimate([mesh], error=error)
            assert len(left["triangles"]) < len(mesh["triangles"]) / 4
            assert 0 < left["error"] <= error
            points = points.mean(0) * 0 + left["points"] + (points - mesh["points"])[0]
        radius = np.linalg.norm(points, axis=1)
        x, y, z = (points / radius[:, None]).T
        s = np.arctan2(y, x) / (2 * np.pi) % 1
        t = (np.arcsin(np.clip(z, -1, 1)) + np.pi / 2) / np.pi
        inner = (np.abs(z) < 0.98) & (s > 0.02) & (s < 0.98)  # the formula has a step at its seam
        off = np.abs(radius - (1 + 0.1 * np.sin(14 * s) * np.sin(9 * t)))[inner]
        assert off.max() < 0.006 + 1.5 * error


@pytest.mark.parametrize("shape", ["sphere", "torus", "subdivision", "cube"])
@pytest.mark.parametrize("displaced", [False, True])
def test_closed_surfaces_stay_closed(scene: kanuka.Scene, shape: str, displaced: bool) -> None:
    material = bumpy("ramp") if displaced else kanuka.Material("ramp")
    if shape in ("sphere", "torus"):
        getattr(scene, f"add_{shape}")(material=material)
    elif shape == "cube":
        scene.add_mesh(*CUBE, material=material)
    else:
        scene.add_subdivision(*CUBE, material=material)
    mesh, points = the_mesh(scene)
    assert (faces_of_edges(mesh["triangles"]) == 2).all()
    whole = volume(points, mesh["triangles"])
    assert whole > 0.5  # the outside is outside
    for limits in ({"faces": 800}, {"faces": 100}, {"error": 0.01}):
        (left,) = kanuka.decimate([mesh], **limits)
        assert (faces_of_edges(left["triangles"]) == 2).all()
        assert volume(left["points"], left["triangles"]) == pytest.approx(whole, rel=0.3 if "faces" in limits else 0.03)
        assert len(left["triangles"]) <= limits.get("faces", 1 << 30)


@pytest.mark.parametrize("name", ["shapes", "solids", "listings"])
def test_no_edge_has_more_than_two_faces(name: str) -> None:
    scene = kanuka.load(str(ROOT / "scenes" / f"{name}.rib"), journal=kanuka.Journal())
    groups = kanuka.traced_surfaces(scene, resolution=(240, 135), journal=kanuka.Journal())
    meshes = [mesh for group in groups for mesh in group["surfaces"]]
    assert len(meshes) > 4
    for mesh in (*meshes, *kanuka.decimate(meshes, faces=3000)):
        assert faces_of_edges(mesh["triangles"]).max() <= 2


def test_colors_are_those_of_the_shader(scene: kanuka.Scene) -> None:
    corners = np.array([[-2, -2, 0], [2, -2, 0], [2, 2, 0], [-2, 2, 0]], np.float32)
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)
    scene.add_mesh(corners, np.array([[0, 1, 2, 3]], np.int32), uv=uv, material="ramp")
    mesh, points = the_mesh(scene)
    assert len(mesh["triangles"]) > 1000  # a flat square, but not a plain one
    (left,) = kanuka.decimate([mesh], error=0.02)
    assert len(left["triangles"]) < 100
    shift = (points - mesh["points"])[0]
    for at, colors, slack in ((points, mesh["colors"], 0.012), (left["points"] + shift, left["colors"], 0.1)):
        wanted = np.column_stack([(at[:, 0] + 2) / 4, (at[:, 1] + 2) / 4, np.full(len(at), 0.25)])
        assert np.abs(colors - wanted).max() < slack
    assert np.allclose(left["points"].min(0) + shift, [-2, -2, 0], atol=1e-3)
    assert np.allclose(left["points"].max(0) + shift, [2, 2, 0], atol=1e-3)


@pytest.mark.parametrize("surface", ["matte", "plastic", "conductor", "lacquer"])
def test_colors_are_the_albedo_that_pictures_have(scene: kanuka.Scene, surface: str) -> None:
    scene.camera = kanuka.Camera(origin=(0, 0, 7), target=(0, 0, 0), fov=20)
    scene.resolution = 65, 65
    scene.add_disk(radius=3, material=kanuka.Material(surface, color=(0.7, 0.3, 0.2)))
    picture = kanuka.render(scene, progressions=256, journal=kanuka.Journal())
    head_on = picture["albedo"][31:34, 31:34].mean((0, 1))
    mesh, _ = the_mesh(scene)
    assert np.abs(mesh["colors"].mean(0) - head_on).max() < 0.012


def test_what_has_no_faces_is_told(scene: kanuka.Scene, tmp_path: Path) -> None:
    points = np.array([[0, 0, 0], [0, 1, 0], [1, 1, 0], [1, 2, 0]], np.float32)
    scene.add_curves(points, np.array([4], np.int32), widths=np.float32(0.005))
    journal = kanuka.Journal()
    with pytest.raises(kanuka.Error, match="no surfaces"):
        proxies.export(scene, tmp_path / "a.ply", journal=journal)
    assert any("left out" in m.message for m in journal)
    scene.add_sphere()
    assert proxies.export(scene, tmp_path / "a.ply", journal=journal)["primitives"] == 1


def test_procedurals_that_wait_are_told(tmp_path: Path) -> None:
    (tmp_path / "ball.rib").write_text("Sphere 1 -1 1 360\n")
    rib = tmp_path / "a.rib"
    rib.write_text(
        "Translate 0 0 5\nWorldBegin\nSphere 0.1 -0.1 0.1 360\n"
        f'Procedural "DelayedReadArchive" ["{tmp_path}/ball.rib"] [-1 1 -1 1 -1 1]\nWorldEnd\n'
    )
    for on_demand, primitives in ((True, 1), (False, 2)):
        journal = kanuka.Journal()
        scene = kanuka.load(str(rib), on_demand=on_demand, journal=kanuka.Journal())
        done = proxies.export(scene, tmp_path / "a.ply", resolution=(60, 40), journal=journal)
        assert done["primitives"] == primitives
        assert any("without on_demand" in m.message for m in journal) == on_demand


def test_what_moves_is_where_it_is_when_the_shutter_opens(tmp_path: Path) -> None:
    rib = tmp_path / "a.rib"
    rib.write_text(
        "Shutter 0 1\nTranslate 0 0 5\nWorldBegin\nMotionBegin [0 1]\nTranslate -1 0 0\nTranslate 1 0 0\nMotionEnd\n"
        "Sphere 0.5 -0.5 0.5 360\nWorldEnd\n"
    )
    proxies.export(kanuka.load(str(rib)), tmp_path / "a.obj", resolution=(60, 40))
    lines = (tmp_path / "a.obj").read_text().splitlines()
    points = np.array([line.split()[1:4] for line in lines if line.startswith("v ")], float)
    assert np.allclose([points.min(0), points.max(0)], [[-1.5, -0.5, -0.5], [-0.5, 0.5, 0.5]], atol=0.05)


def test_the_same_bits_for_any_number_of_threads(scene: kanuka.Scene, tmp_path: Path) -> None:
    scene.add_sphere(material=bumpy("ramp"))
    scene.add_torus(material="ramp")
    files = [tmp_path / f"{threads}.ply" for threads in (1, 2, 5)]
    for path, threads in zip(files, (1, 2, 5), strict=True):
        proxies.export(scene, path, faces=1000, threads=threads)
    assert len({path.read_bytes() for path in files}) == 1


# ---- files


def still_life(scene: kanuka.Scene) -> kanuka.Scene:
    """Two primitives of the world, and three copies of a group within which another stands, one of them mirrored."""
    scene.add_sphere(material=bumpy("ramp"), name="a ball")
    scene.add_mesh(CUBE[0] * 0.4 + np.float32([1.8, 0, 0]), CUBE[1], material="matte", name="a ball")
    inner = scene.add_group("knob")
    inner.add_sphere(radius=0.2, material=kanuka.Material("matte", color=(0.9, 0.1, 0.1)))
    outer = scene.add_group("post")
    outer.add_mesh(CUBE[0] * 0.2, CUBE[1], material="matte")
    up = np.eye(4, dtype=np.float32)
    up[1, 3] = 0.4
    outer.add_instances(inner, up[None])
    places = np.tile(np.eye(4, dtype=np.float32), (3, 1, 1))
    places[:, 0, 3] = -1.6, 1.2, 0.1
    places[:, 1, 3] = 1.2, -1.4, -1.5
    places[2, 0, 0] = -1.5
    scene.add_instances(outer, places)
    return scene


def looks(scene: kanuka.Scene) -> tuple[np.ndarray, np.ndarray]:
    """Silhouettes, and albedo where something is."""
    picture = kanuka.render(scene, progressions=16, integrator="facing", journal=kanuka.Journal())
    return picture["alpha"], picture["albedo"]


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".usda", ".usd"])
def test_files_show_the_same(scene: kanuka.Scene, tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"proxy{suffix}"
    done = proxies.export(still_life(scene), path, error=0.005, journal=kanuka.Journal())
    assert done["bytes"] == path.stat().st_size
    assert (done["primitives"], done["instances"], done["instances_left_out"]) == (4, 6, 0)
    assert done["faces"] < done["faces_before"] / 3
    assert 0 < done["error"] <= 0.005
    again = kanuka.Scene()
    again.resolution, again.camera = scene.resolution, scene.camera
    if suffix in (".obj", ".ply"):
        models.add_file(again, path)
    else:
        again = usd.load(path, resolution=scene.resolution, journal=kanuka.Journal())
        again.camera = scene.camera
    (mask, colors), (mask_again, colors_again) = looks(scene), looks(again)
    off = np.abs(mask - mask_again)
    assert mask.mean() > 0.1
    assert off.mean() < 0.004
    assert off.max() < 0.7
    whole = (mask > 0.99) & (mask_again > 0.99)
    assert np.abs(colors - colors_again)[whole].mean() < 0.03


def test_names_and_colors_are_in_files(scene: kanuka.Scene, tmp_path: Path) -> None:
    still_life(scene)
    texts = {}
    for suffix in (".obj", ".ply", ".usda"):
        proxies.export(scene, tmp_path / f"a{suffix}", faces=2000, journal=kanuka.Journal())
        texts[suffix] = (tmp_path / f"a{suffix}").read_bytes().decode("latin1")
    for name in ("a_ball", "a_ball_2"):
        assert f"\no {name}\n" in texts[".obj"]
        assert f" {name}\n" in texts[".ply"].split("end_header")[0]
        assert f'def Mesh "{name}"' in texts[".usda"]
    assert texts[".usda"].count("prepend references = </Prototypes/post>") == 3
    assert texts[".usda"].count("prepend references = </Prototypes/knob>") == 1
    assert texts[".obj"].count("\no ") == 2 + 2 * 3
    red = [line.split()[4:] for line in texts[".obj"].splitlines() if line.startswith("v ")]
    wanted = 1.055 * 0.9 ** (1 / 2.4) - 0.055  # sRGB
    assert min(abs(float(r) - wanted) for r, _, _ in red) < 0.005


def test_copies_beyond_the_limit_are_left_out(scene: kanuka.Scene, tmp_path: Path) -> None:
    still_life(scene)
    journal = kanuka.Journal()
    done = proxies.export(scene, tmp_path / "a.obj", faces=0, most_faces=10_000_000, journal=journal)
    assert (done["instances_left_out"], done["faces"], done["error"]) == (0, done["faces_before"], 0)
    one = (done["faces"] - proxies.export(scene, tmp_path / "b.obj", faces=0, most_faces=1)["faces"]) // 3
    done = proxies.export(scene, tmp_path / "a.obj", faces=0, most_faces=done["faces"] - one, journal=journal)
    assert (done["instances_left_out"], done["faces"]) == (1, done["faces_before"] - one)
    assert any("1 instances are left out" in m.message for m in journal)


def test_sharp_edges_stay_sharp(scene: kanuka.Scene, tmp_path: Path) -> None:
    scene.add_mesh(*CUBE, material="matte")
    proxies.export(scene, tmp_path / "a.obj", faces=12)
    lines = (tmp_path / "a.obj").read_text().splitlines()
    assert sum(line.startswith("v ") for line in lines) == 8
    normals = np.array([line.split()[1:] for line in lines if line.startswith("vn ")], float)
    assert len(normals) == 24
    assert np.allclose(np.abs(normals).max(1), 1)


def test_arguments_that_cannot_be(scene: kanuka.Scene, tmp_path: Path) -> None:
    scene.add_sphere()
    for given, text in (
        ({"path": "a.stl"}, "path"),
        ({"faces": 3, "error": 0.1}, "choose one"),
        ({"faces": -1}, "faces"),
        ({"error": 0}, "error"),
    ):
        with pytest.raises(ValueError, match=text):
            proxies.export(scene, **{"path": tmp_path / "a.obj"} | given)
    with pytest.raises(kanuka.Error, match="cannot be written") as refusal:
        proxies.export(scene, tmp_path / "none" / "a.obj")
    assert refusal.value.exit_code == 5
    good = {"points": np.zeros((3, 3)), "colors": np.zeros((3, 3)), "triangles": [[0, 1, 2]]}
    for bad, text in (
        ({"points": np.full((3, 3), np.nan)}, "not a number"),
        ({"colors": np.zeros((2, 3))}, "colors"),
        ({"triangles": [[0, 1, 3]]}, "no point 3"),
        ({"triangles": [[0, 1]]}, "triangles"),
        ({"scale": 0}, "scale"),
        ({"weight": -1}, "weight"),
        ({"color_length": -1}, "color_length"),
    ):
        with pytest.raises(ValueError, match=text):
            kanuka.decimate([good | bad], faces=1)
    with pytest.raises(ValueError, match='no "colors"'):
        kanuka.decimate([{"points": good["points"]}], faces=1)
    with pytest.raises(ValueError, match="error must be above 0"):
        kanuka.decimate([good], error=-1)
    assert len(kanuka.decimate([good], faces=1)[0]["triangles"]) == 1


# ---- the command


def command(*arguments: object) -> subprocess.CompletedProcess:
    return subprocess.run(
        [sys.executable, "-m", "kanuka", "store", "export", *map(str, arguments)], capture_output=True, text=True
    )


def test_the_command(tmp_path: Path) -> None:
    rib = tmp_path / "ball.rib"
    rib.write_text(
        'Format 160 120 1\nProjection "perspective" "fov" [40]\nTranslate 0 0 5\nWorldBegin\n'
        'Attribute "identifier" "string name" ["ball"]\nColor [0.8 0.2 0.1]\nSurface "matte"\n'
        "Sphere 1 -1 1 360\nWorldEnd\n"
    )
    out, store = tmp_path / "ball.ply", tmp_path / "store"
    first = command(rib, "--proxy", out, "--faces", 500, "--store", store, "--json")
    assert first.returncode == 0, first.stderr
    done = json.loads(first.stdout)
    assert (done["file"], done["primitives"]) == (str(out), 1)
    assert 400 < done["faces"] <= 500
    bytes_of_first = out.read_bytes()
    assert b"comment primitive 0 ball" in bytes_of_first
    assert kanuka.store_packs(store)[0]["pages"] == 1
    second = command(rib, "--proxy", out, "--faces", 500, "--store", store, "--store-mode", "read", "-q")
    assert second.returncode == 0, second.stderr
    assert "off by" in second.stdout
    assert out.read_bytes() == bytes_of_first
    for wrong, code in (
        ((rib, "--proxy", tmp_path / "a.stl"), 2),
        ((rib, "--proxy", out, "--faces", 5, "--error", 1), 2),
        ((tmp_path / "none.rib", "--proxy", out), 4),
        ((rib,), 2),
    ):
        assert command(*wrong).returncode == code
