"""What a dicing oracle saves: a scene with much out of sight, with and without one."""

from __future__ import annotations

import statistics
import tempfile
import time
from pathlib import Path

import numpy as np

import intervals
from pictures import Estimate, agreement
from settings import Found, Say, Settings

BATCHES, SAMPLES = 8, 32


def town(houses: int) -> object:
    """A street between rough houses; what stands behind them, and behind the camera, is not seen from there."""
    import kanuka
    import own

    scene = kanuka.Scene()
    scene.resolution = 480, 208
    scene.options.shader_path = [str(own.SHADERS)]
    rough = kanuka.Shader("rough", swell=0.1, frequency=1, grain=0.03, fineness=10)
    for i in range(houses):
        color = tuple(0.3 + 0.4 * ((i * k) % 7) / 6 for k in (1, 2, 3))
        wall = kanuka.Material("matte", color=color, displacement=rough, displacement_bound=0.2)
        row, place = i % 8, i // 8
        x = (2.6 + 4 * (row % 4)) * (1 if row < 4 else -1)
        points, faces = house(1.5, 3 + (i * 5) % 4)
        matrix = np.eye(4)
        matrix[:3, 3] = x, 0, 6 - 4 * place
        scene.add_subdivision(points, faces, scheme="bilinear", transform=matrix, material=wall, name=f"house {i}")
    ground = kanuka.Shader("rough", swell=0.05, frequency=0.5, grain=0.01, fineness=8)
    points, faces = own.lattice(8, 40)
    scene.add_subdivision(
        points,
        faces,
        name="ground",
        material=kanuka.Material("matte", color=(0.35, 0.33, 0.3), displacement=ground, displacement_bound=0.1),
    )
    scene.camera = kanuka.Camera((0, 1.6, 2), (0, 1.6, -10), fov=60)
    own.daylight(scene)
    return scene


def house(half: float, height: float) -> tuple[np.ndarray, np.ndarray]:
    points = [[x, y, z] for y in (0, height) for x, z in ((-half, -half), (half, -half), (half, half), (-half, half))]
    faces = [[0, 4, 5, 1], [1, 5, 6, 2], [2, 6, 7, 3], [3, 7, 4, 0], [4, 7, 6, 5]]
    return np.array(points, np.float32), np.array(faces, np.int32)


def measure(settings: Settings, say: Say) -> Found:
    import kanuka

    scene = town(16 if settings.quick else 64)
    threads = settings.threads or None
    found: dict[str, list[float]] = {name: [] for name in ("record_s", "without_s", "with_s")}
    counts: dict[str, int] = {}
    with tempfile.TemporaryDirectory(prefix="kanuka-oracle-") as folder:
        file = Path(folder) / "town.oracle"
        for _ in range(1 if settings.quick else settings.rounds):
            start = time.perf_counter()
            seen = kanuka.write_oracle(scene, file, threads=threads)
            found["record_s"].append(time.perf_counter() - start)
            for name, oracle in (("without", None), ("with", file)):
                stats = kanuka.render(scene, progressions=1, threads=threads, oracle=oracle).stats
                found[f"{name}_s"].append(stats["time"]["total_s"] - stats["time"]["transport_s"])
                counts[name] = stats["count"]["micropolygons"]
        batches = 2 if settings.quick else BATCHES
        same = agreement(*(pictures(scene, oracle, batches, threads) for oracle in (file, None)), level=False)
    ratio = counts["with"] / counts["without"]
    say(
        f"  {counts['without']:,} micropolygons, {counts['with']:,} by the oracle, {ratio:.2f}×; "
        f"z {same.rms_z:.2f} r.m.s. (limit {same.rms_limit:.2f}), means {same.mean_error:.2%} apart"
    )
    return {
        "primitives": seen["primitives"],
        "seen": seen["seen"],
        "micropolygons": counts,
        "ratio": ratio,
        "rounds": found,
        **{name: statistics.median(values) for name, values in found.items()},
        "time": vars(intervals.of_ratio(found["with_s"], found["without_s"])),
        "agreement": vars(same) | {"structure": same.structure, "mean_error": same.mean_error},
    }


def pictures(scene: object, oracle: Path | None, batches: int, threads: int | None) -> Estimate:
    import kanuka

    made = [
        np.asarray(
            kanuka.render(scene, progressions=SAMPLES, seed=seed + 1, oracle=oracle, threads=threads)["rgb"], np.float32
        )
        for seed in range(batches)
    ]
    return Estimate.of(np.stack(made), SAMPLES)
