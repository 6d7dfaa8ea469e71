"""The production integrator against the plain one, and what the other integrators promise."""

from __future__ import annotations

import importlib.util
import os
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import kanuka
import validation_scenes
from scenes import quad

SOURCE = Path(__file__).parent.parent / "bench" / "pictures.py"
SPEC = importlib.util.spec_from_file_location("bench_pictures", SOURCE)
pictures = sys.modules.setdefault(SPEC.name, importlib.util.module_from_spec(SPEC))
SPEC.loader.exec_module(pictures)

BATCHES = 8


def estimate(build: Callable[[], kanuka.Scene], integrator: str, samples: int) -> pictures.Estimate:
    renders = [kanuka.render(build(), progressions=samples, integrator=integrator, seed=1 + k) for k in range(BATCHES)]
    assert not any(r.stats["count"]["nan_samples"] for r in renders)
    return pictures.Estimate.of(np.stack([r["rgb"] for r in renders]), samples, block=8)


@pytest.mark.parametrize("name", validation_scenes.ALL)
def test_path_agrees_with_the_reference(name: str) -> None:
    build = validation_scenes.ALL[name]
    found = pictures.agreement(estimate(build, "path", 64), estimate(build, "reference", 384), level=False)
    # One wavelength at a time, the reference is noisy in colours; the means of all pixels are not.
    errors = [
        pictures.normal_score(abs(r - 1) / s, BATCHES - 1)
        for r, s in zip(found.mean_ratio, found.mean_sigma, strict=True)
    ]
    assert max(errors) < 4.5, found  # 1 in 150 000
    assert not found.structure, found


def test_a_light_that_is_too_bright_is_found() -> None:
    """The comparison above can fail: 3 % more light is more than noise."""

    def brighter() -> kanuka.Scene:
        scene = validation_scenes.matte_ball_under_a_panel()
        scene.add_light("environment", amount=(0.03, 0.03, 0.03))
        return scene

    found = pictures.agreement(
        estimate(brighter, "path", 64),
        estimate(validation_scenes.matte_ball_under_a_panel, "reference", 384),
        level=False,
    )
    assert found.structure


def corner(integrator: str, **keywords: object) -> np.ndarray:
    """A floor of albedo 1/2 with a wall at its back, a lamp overhead that shines on the floor alone."""
    scene = kanuka.Scene()
    scene.resolution = 16, 16
    scene.camera = kanuka.Camera((0, 2, 6), (0, 0, 0), fov=40)
    grey = kanuka.Material("matte", color=(0.5, 0.5, 0.5))
    scene.add_mesh(*quad((-50, 0, 50), (50, 0, 50), (50, 0, 0), (-50, 0, 0)), material=grey)
    scene.add_mesh(*quad((-50, 0, 0), (50, 0, 0), (50, 99, 0), (-50, 99, 0)), material=grey)
    scene.add_light("distant", amount=(2, 2, 2), direction=(0, -1, 0))
    return np.asarray(kanuka.render(scene, progressions=64, integrator=integrator, **keywords)["rgb"])


def test_direct_light_stops_at_the_first_rough_surface() -> None:
    direct, path = corner("direct"), corner("path")
    # A Lambertian floor under irradiance 2: radiance 2 * 0.5 / pi; the wall sees no lamp.
    assert direct[-2:].mean() == pytest.approx(1 / np.pi, rel=0.005)
    assert np.abs(direct[:3]).max() < 1e-5
    assert path[:3].mean() > 0.02


def test_direct_light_passes_mirrors() -> None:
    scene = validation_scenes.stage(sky=(0.5, 0.5, 0.5))
    scene.add_sphere(material=kanuka.Material("mirror"))
    found = kanuka.render(scene, progressions=16, integrator="direct")["rgb"]
    assert np.asarray(found)[16, 16].mean() > 0.3


def test_occlusion_of_a_corner() -> None:
    """Beside a wall without end a floor sees half of the sky, weighted by the cosine; within a distance, all of it."""
    assert corner("ao")[-2:].mean() == pytest.approx(0.52, abs=0.02)  # the wall ends 88 degrees up
    assert corner("ao:distance=0.1")[-4:].mean() == pytest.approx(1, abs=0.005)


def test_facing_is_the_cosine_times_the_colour() -> None:
    scene = kanuka.Scene()
    scene.resolution = 9, 9
    scene.camera = kanuka.Camera((0, 0, 5), (0, 0, 0), fov=10)
    scene.add_mesh(
        *quad((-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)), material=kanuka.Material("matte", color=(0.6, 0.3, 0.1))
    )
    found = np.asarray(kanuka.render(scene, progressions=64, integrator="facing")["rgb"])
    np.testing.assert_allclose(found.mean((0, 1)), (0.6, 0.3, 0.1), rtol=0.02, atol=0.004)


def test_the_manual_lists_all() -> None:
    page = SOURCE.parent.parent / "docs" / "integrators.md"
    begin, end = "<!-- integrators: made from src/transport/integrators -->\n", "<!-- end -->"
    rows = ["| integrator | shows | parameters |", "|---|---|---|"]
    for name, about in kanuka.integrators().items():
        settings = "; ".join(f"`{p}` ({default:g}): {text}" for p, (default, text) in about["parameters"].items())
        rows.append(f"| `{name}` | {about['help']} | {settings} |")
    before, rest = page.read_text().split(begin)
    made = before + begin + "\n" + "\n".join(rows) + "\n\n" + end + rest.split(end, 1)[1]
    if os.environ.get("KANUKA_WRITE_DOCS"):
        page.write_text(made)
    assert page.read_text() == made, "run this test with KANUKA_WRITE_DOCS=1"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("paht", "there are path, ao"),
        ("ao:radius=1", "there are distance"),
        ("ao:distance=far", "write distance=NUMBER"),
        ("ao:distance", "write distance=NUMBER"),
        ("direct:distance=1", "it has none"),
        ("path:distance=1", "there are roulette"),
    ],
)
def test_a_wrong_integrator_says_what_would_do(text: str, says: str) -> None:
    with pytest.raises(kanuka.Error, match=says):
        kanuka.check_integrator(text)
