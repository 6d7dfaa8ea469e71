"""The dicing oracle: less where no ray looks closely, finer where something magnifies, the same picture."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka
from test_sessions import same

SHADERS = Path(__file__).resolve().parent.parent / "bench/shaders"


def moved(x: float, y: float, z: float, size: float = 1) -> np.ndarray:
    matrix = np.diag([size, size, size, 1.0])
    matrix[:3, 3] = x, y, z
    return matrix


def hall(sun: float = 0.4) -> kanuka.Scene:
    """Before the camera three lumpy balls, a dozen behind it, one below the floor. A low sun throws shadows forward."""
    scene = kanuka.Scene()
    scene.resolution = 192, 108
    scene.options.shader_path = [str(SHADERS)]
    scene.camera = kanuka.Camera((0, 1, 8), (0, 0.5, 0), fov=40)
    lumps = kanuka.Shader("rough", swell=0.2, frequency=2, grain=0.02, fineness=20)
    clay = kanuka.Material("matte", color=(0.6, 0.5, 0.4), displacement=lumps, displacement_bound=0.3)
    for i in range(3):
        scene.add_sphere(0.8, transform=moved(2 * i - 2, 0, 0), material=clay, name=f"seen{i}")
    for i in range(12):
        scene.add_sphere(1.2, transform=moved(4 * (i % 4) - 6, 0, 14 + 4 * (i // 4)), material=clay, name=f"behind{i}")
    group = scene.add_group("stone")
    group.add_sphere(0.3, material=clay, name="stone")
    scene.add_instances(group, np.stack([moved(0.8 * k - 4, -0.6, 12 + k % 3) for k in range(10)]))
    scene.add_sphere(1, transform=moved(0, -5, 0), material=clay, name="buried")
    points = np.array([[-20, -1, -20], [-20, -1, 40], [20, -1, 40], [20, -1, -20]], np.float32)
    scene.add_mesh(points, np.array([[0, 1, 2, 3]], np.int32), material="matte", name="floor")
    scene.add_light("distant", amount=2, direction=(0, -sun, -1), angle=1)
    scene.add_light("environment", amount=0.5)
    return scene


def of_means(scene: kanuka.Scene, batches: int = 8, **options: object) -> tuple[np.ndarray, np.ndarray]:
    """Means of blocks of 12 by 12 pixels, and their variances over batches of other seeds."""
    found = []
    for seed in range(batches):
        rgb = np.asarray(kanuka.render(scene, progressions=8, seed=seed + 1, **options)["rgb"], np.float64)
        found.append(rgb.reshape(rgb.shape[0] // 12, 12, rgb.shape[1] // 12, 12, 3).mean((1, 3)))
    return np.mean(found, 0), np.var(found, 0, ddof=1) / batches


def test_what_is_out_of_sight_costs_less_and_the_picture_is_the_same(tmp_path: Path) -> None:
    scene, file = hall(), tmp_path / "hall.oracle"
    counts = kanuka.write_oracle(scene, file)
    assert counts["primitives"] == 18
    assert counts["seen"] == 17
    plain = kanuka.render(scene, progressions=1)
    asked = kanuka.render(scene, progressions=1, oracle=file)
    before, after = (p.stats["count"]["micropolygons"] for p in (plain, asked))
    assert after < 0.6 * before
    # Means of blocks: normal scores have an r.m.s. of 1 where there is noise alone.
    (a, of_a), (b, of_b) = of_means(scene), of_means(scene, oracle=file)
    z = (a - b) / np.sqrt(of_a + of_b + 1e-12)
    assert np.sqrt(np.mean(z**2)) < 1.4  # Student's t of 14 degrees, three channels that go together
    assert np.abs(a - b).max() < 0.05 * a.max()
    assert abs(a.mean() / b.mean() - 1) < 0.005


def test_what_throws_sharp_shadows_is_fine(tmp_path: Path) -> None:
    def of(sun: float) -> int:
        scene, file = hall(sun), tmp_path / f"{sun}.oracle"
        kanuka.write_oracle(scene, file)
        return kanuka.render(scene, progressions=1, oracle=file).stats["count"]["micropolygons"]

    assert of(0.1) > 1.5 * of(0.4)


def test_glass_magnifies(tmp_path: Path) -> None:
    def view(lens: bool) -> float:
        scene = kanuka.Scene()
        scene.resolution = 128, 128
        scene.options.shader_path = [str(SHADERS)]
        scene.camera = kanuka.Camera((0, 0, 10), (0, 0, 0), fov=20)
        lumps = kanuka.Shader("rough", swell=0.05, frequency=2, grain=0.02, fineness=20)
        clay = kanuka.Material("matte", color=(0.6, 0.5, 0.4), displacement=lumps, displacement_bound=0.1)
        scene.add_sphere(0.3, transform=moved(0, 0, -0.6), material=clay, name="bead")
        if lens:
            scene.add_sphere(1, transform=moved(0, 0, 1.2), material="glass", name="lens")
        scene.add_light("environment", amount=1)
        file = tmp_path / f"{lens}.oracle"
        kanuka.write_oracle(scene, file, progressions=16)
        of_bead = kanuka.render(scene, progressions=1, oracle=file).stats["count"]["micropolygons"]
        without = kanuka.render(scene, progressions=1).stats["count"]["micropolygons"]
        return of_bead / without

    assert view(lens=True) > 1.5 * view(lens=False)


def test_what_is_recorded_does_not_depend_on_threads_or_lanes(tmp_path: Path) -> None:
    files = []
    for threads, lanes in ((1, 8), (4, 8), (2, 1)):
        files.append(tmp_path / f"{threads}-{lanes}.oracle")
        kanuka.write_oracle(hall(), files[-1], threads=threads, lanes=lanes)
    assert files[0].read_bytes() == files[1].read_bytes() == files[2].read_bytes()
    pictures = [kanuka.render(hall(), progressions=1, oracle=files[0], threads=threads) for threads in (1, 3)]
    assert same(*pictures)


def test_what_is_called_otherwise_is_diced_for_the_camera(tmp_path: Path) -> None:
    file = tmp_path / "scene.oracle"

    def ball(name: str, oracle: Path | None) -> int:
        scene = kanuka.Scene()
        scene.resolution = 64, 64
        scene.options.shader_path = [str(SHADERS)]
        lumps = kanuka.Shader("rough", swell=0.05, frequency=2, grain=0.02, fineness=20)
        clay = kanuka.Material("matte", displacement=lumps, displacement_bound=0.1)
        scene.camera = kanuka.Camera((0, 0, 5), (0, 0, 0), fov=40)
        scene.add_sphere(1, transform=moved(0, 0, 12), material=clay, name=name)
        scene.add_light("environment")
        if not file.exists():
            kanuka.write_oracle(scene, file)
        picture = kanuka.render(scene, progressions=1, oracle=oracle)
        return picture.stats["count"]["micropolygons"]

    assert ball("behind", file) < ball("behind", None)
    assert ball("other", file) == ball("other", None)


def test_files_that_are_none(tmp_path: Path) -> None:
    scene, file = hall(), tmp_path / "scene.oracle"
    with pytest.raises(kanuka.Error, match="cannot be opened"):
        kanuka.render(scene, oracle=file)
    kanuka.write_oracle(scene, file)
    whole = file.read_bytes()
    for at, words in (
        (0, "no dicing oracle"),
        (4, "another version"),
        (8, "damaged"),
        (40, "checksum"),
        (-1, "checksum"),
    ):
        broken = bytearray(whole)
        broken[at] ^= 1
        file.write_bytes(broken)
        with pytest.raises(kanuka.Error, match=words):
            kanuka.render(scene, oracle=file)
    for length in (0, 10, 23, 30, len(whole) - 1):
        file.write_bytes(whole[:length])
        with pytest.raises(kanuka.Error, match="--write-oracle"):
            kanuka.render(scene, oracle=file)


def test_half_a_record_is_none(tmp_path: Path) -> None:
    def stop(phase: str, _: float) -> None:
        if phase == "progressions":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        kanuka.write_oracle(hall(), tmp_path / "half.oracle", progress=stop, progressions=4096)
    assert not list(tmp_path.iterdir())


def test_points_that_are_no_numbers(tmp_path: Path) -> None:
    """Middles of edges that overflow."""
    scene, file = hall(), tmp_path / "scene.oracle"
    huge = np.array([[3e38, 0, 0], [3e38, 1, 0], [-3e38, 1, 0]], np.float32)
    scene.add_mesh(huge, np.array([[0, 1, 2]], np.int32), material="matte", name="huge")
    kanuka.write_oracle(scene, file)
    picture = kanuka.render(scene, progressions=1, oracle=file)
    assert np.isfinite(picture["rgb"]).all()
