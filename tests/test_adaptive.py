"""Adaptive sampling: pixels stop where their neighbourhood is settled, with the same bits however the work is done."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka

PATHS = 96
THRESHOLD = 0.012


def scene() -> kanuka.Scene:
    """A ball in soft light, half of the picture; the rest is a flat sky."""
    scene = kanuka.Scene()
    scene.resolution = 48, 32
    scene.camera = kanuka.Camera(origin=(0, 0, 5), target=(0.8, 0, 0), fov=40)
    scene.add_sphere(1.0, material="matte", name="ball")
    scene.add_light("environment", amount=0.4)
    scene.add_light("quad", amount=12, width=1.5, height=1.5, position=(2, 3, 2), direction=(-2, -3, -2))
    return scene


def render(**arguments) -> kanuka.Picture:
    return kanuka.render(
        scene(), **({"progressions": PATHS, "adaptive": THRESHOLD, "aovs": ["sample_count"]} | arguments)
    )


def same(a: kanuka.Picture, b: kanuka.Picture) -> bool:
    return all(np.array_equal(a[name], b[name], equal_nan=True) for name in ("rgb", "alpha", "Z", "sample_count"))


@pytest.fixture(scope="module")
def picture() -> kanuka.Picture:
    return render(lanes=8, threads=1)


@pytest.mark.parametrize(("threads", "lanes"), [(2, 8), (1, 1), (2, 16)])
def test_same_bits(picture: kanuka.Picture, threads: int, lanes: int) -> None:
    assert same(picture, render(lanes=lanes, threads=threads))


def test_samples_are_saved(picture: kanuka.Picture) -> None:
    counts = picture["sample_count"]
    assert counts.min() == 16, "the sky stops at the first decision"
    assert counts.max() > 32, "penumbras go on"
    assert set(np.unique(counts)) <= {16, 24, 32, 48, 64, 96}
    assert picture.stats["count"]["paths"] == counts.sum()
    assert counts.sum() < 0.7 * PATHS * counts.size
    # Where pixels go on is where noise is.
    ball = picture["alpha"] * (picture["Z"] < 10)
    assert counts[ball > 0.99].mean() > 1.3 * counts[ball == 0].mean()


def test_the_error_is_reached() -> None:
    converged = kanuka.render(scene(), progressions=2048, seed=5)["rgb"]
    luminance = np.array([0.2126, 0.7152, 0.0722])
    light = np.maximum(converged @ luminance, 1e-3)
    for threshold in (0.01, 0.02):
        picture = render(progressions=768, adaptive=threshold)
        assert (picture["sample_count"] == 768).mean() < 0.01
        error = ((picture["rgb"] - converged) @ luminance) / np.sqrt(light)
        assert np.sqrt((error**2).mean()) < threshold
        assert np.abs(error).max() < 6 * threshold


def test_a_kill_changes_nothing(picture: kanuka.Picture, tmp_path: Path) -> None:
    arguments = {"progressions": PATHS, "adaptive": THRESHOLD, "aovs": ["sample_count"]}
    for stops in ((16, 24), (5, 20, 33), (64,)):
        for k, stop in enumerate(stops):
            session = kanuka.Session(scene(), **arguments)
            if k > 0:
                session.resume(tmp_path / "state")
            session.advance(progressions=stop)
            session.save(tmp_path / "state")
        session = kanuka.Session(scene(), **arguments)
        session.resume(tmp_path / "state")
        session.advance()
        assert same(picture, session.picture()), stops


def test_another_threshold_is_another_picture(tmp_path: Path) -> None:
    session = kanuka.Session(scene(), progressions=4, adaptive=THRESHOLD)
    session.advance()
    session.save(tmp_path / "state")
    other = kanuka.Session(scene(), progressions=4, adaptive=2 * THRESHOLD)
    with pytest.raises(kanuka.Error, match="another picture"):
        other.resume(tmp_path / "state")


def test_off_and_never_are_the_same() -> None:
    off, never = render(adaptive=0, progressions=40), render(adaptive=1e-12, progressions=40)
    assert (off["sample_count"] == 40).all()
    assert same(off, never)


def test_rib(tmp_path: Path) -> None:
    file = tmp_path / "scene.rib"
    file.write_text('Option "kanuka" "float adaptive" [0.25]\nWorldBegin\nWorldEnd\n')
    assert kanuka.load(file).options.adaptive == 0.25
