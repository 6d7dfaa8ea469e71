"""The picture is a function of the scene alone: not of threads, runs or lanes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka
import scenes


def same(a: kanuka.Picture, b: kanuka.Picture) -> None:
    assert a.keys() == b.keys()
    for layer in a:
        np.testing.assert_array_equal(a[layer], b[layer], err_msg=layer, strict=True)


@pytest.mark.parametrize("name", scenes.ALL)
def test_threads_and_runs(name: str, tmp_path: Path) -> None:
    files = []
    for i, threads in enumerate((1, 1, 2, 2)):
        picture = kanuka.render(scenes.ALL[name](), progressions=4, threads=threads)
        files.append(tmp_path / f"{i}.exr")
        picture.write(files[-1])
    pictures = [kanuka.read(file) for file in files]
    for other in pictures[1:]:
        same(pictures[0], other)


@pytest.mark.parametrize("name", scenes.ALL)
@pytest.mark.parametrize("lanes", [1, 16])
def test_lanes(name: str, lanes: int) -> None:
    eight = kanuka.render(scenes.ALL[name](), progressions=2, lanes=8)
    same(eight, kanuka.render(scenes.ALL[name](), progressions=2, lanes=lanes))


def test_seeds_differ() -> None:
    a, b = (kanuka.render(scenes.ball(), progressions=2, seed=seed) for seed in (0, 1))
    assert (a["rgb"] != b["rgb"]).any()
