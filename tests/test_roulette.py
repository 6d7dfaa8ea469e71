"""Roulette that a pilot has learned: the same light, whoever traces it and in whichever parts, for less."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka
from scenes import quad


def room(size: int = 64, lamp: bool = False) -> kanuka.Scene:
    """A dark room that is open to a white sky on one side: long paths that bring little."""
    scene = kanuka.Scene()
    scene.resolution = size, size
    scene.options.max_depth = 24
    scene.camera = kanuka.Camera((0, 0, 3.5), (0, 0, 0), fov=45)
    grey = kanuka.Material("matte", color=(0.5, 0.4, 0.3))
    for a, b, c, d in (
        ((-1, -1, 1), (1, -1, 1), (1, -1, -1), (-1, -1, -1)),
        ((-1, 1, -1), (1, 1, -1), (1, 1, 1), (-1, 1, 1)),
        ((-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1)),
        ((-1, -1, 1), (-1, -1, -1), (-1, 1, -1), (-1, 1, 1)),
    ):
        scene.add_mesh(*quad(a, b, c, d), material=grey)
    scene.add_light("environment", amount=(1, 1, 1))
    if lamp:
        scene.add_light("point", amount=(0.1, 0.1, 0.1), position=(0, 0.5, 0))
    return scene


def rgb(picture: kanuka.Picture) -> np.ndarray:
    return np.asarray(picture["rgb"], dtype=np.float64)


def test_it_is_learned_before_the_second_progression() -> None:
    one, two = (kanuka.render(room(), progressions=n) for n in (1, 2))
    assert one.stats["roulette"] == []
    assert len(two.stats["roulette"]) == 8
    assert all(factor >= 1 for factor in two.stats["roulette"])
    fixed = kanuka.render(room(), progressions=2, integrator="path:roulette=0")
    assert fixed.stats["roulette"] == []
    assert np.any(rgb(fixed) != rgb(two))
    # The first is as ever, but where the sky is the only light: there the first bounce searches it twice.
    for lamp in (False, True):
        first, plain = (
            kanuka.render(room(lamp=lamp), progressions=1, integrator=i) for i in ("path", "path:roulette=0")
        )
        assert np.array_equal(rgb(first), rgb(plain)) == lamp
        assert (first.stats["count"]["rays"] > plain.stats["count"]["rays"]) != lamp


def test_the_light_is_the_same_for_less_noise_and_fewer_rays() -> None:
    """Noise is the variance of pixels over seeds."""
    pictures = {}
    cost = {}
    for name in ("path", "path:roulette=0"):
        batches = [kanuka.render(room(), progressions=64, seed=seed, integrator=name) for seed in range(6)]
        pictures[name] = np.array([rgb(one).mean((0, 1)) for one in batches])
        rays = sum(one.stats["count"]["rays"] for one in batches)
        cost[name] = rays * np.array([rgb(one) for one in batches]).var(0, ddof=1).mean()
    learned, fixed = pictures["path"], pictures["path:roulette=0"]
    error = np.sqrt((learned.var(0, ddof=1) + fixed.var(0, ddof=1)) / len(fixed))
    np.testing.assert_array_less(np.abs(learned.mean(0) - fixed.mean(0)), 5 * error + 1e-4)
    assert cost["path"] < 0.95 * cost["path:roulette=0"]


def test_the_sky_is_searched_in_pairs_where_it_is_hidden_in_part() -> None:
    stats = kanuka.render(room(), progressions=2).stats
    assert stats["sky_pairs"][:1] == [0]
    assert kanuka.render(room(), progressions=2, integrator="path:roulette=0").stats["sky_pairs"] == []
    floor = kanuka.Scene()
    floor.resolution = 64, 64
    floor.camera = kanuka.Camera((0, 3, 0.1), (0, 0, 0), fov=20)
    floor.add_mesh(*quad((-9, 0, 9), (9, 0, 9), (9, 0, -9), (-9, 0, -9)), material=kanuka.Material("matte"))
    floor.add_light("environment", amount=(1, 1, 1))
    assert kanuka.render(floor, progressions=2).stats["sky_pairs"] == []


@pytest.mark.parametrize("lanes", [1, 8])
def test_it_does_not_depend_on_who_traces(lanes: int) -> None:
    whole = kanuka.render(room(), progressions=4)
    same = kanuka.render(room(), progressions=4, threads=1, lanes=lanes)
    assert same.stats["roulette"] == whole.stats["roulette"]
    np.testing.assert_array_equal(rgb(same), rgb(whole))


def test_parts_crops_and_resumed_pictures_have_the_bits_of_the_whole(tmp_path: Path) -> None:
    scene = room()
    whole = kanuka.render(scene, progressions=6)
    session = kanuka.Session(scene)
    session.advance(progressions=1)
    session.save(tmp_path / "one.state")
    resumed = kanuka.Session(scene)
    resumed.resume(tmp_path / "one.state")
    for other in (session, resumed):
        other.advance(progressions=6)
        np.testing.assert_array_equal(rgb(other.picture()), rgb(whole))
    crop = kanuka.render(scene, progressions=6, crop=(0.25, 0.75, 0.5, 1))
    assert crop.stats["roulette"] == whole.stats["roulette"]
    np.testing.assert_array_equal(rgb(crop), rgb(whole)[32:, 16:48])
    part = kanuka.Session(scene, part=(64, 66), progressions=66)
    part.advance()
    assert part.picture().stats["roulette"] == whole.stats["roulette"]
