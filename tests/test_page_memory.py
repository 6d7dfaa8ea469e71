"""Pages that sessions keep in memory: within a bound, and for edits that are taken back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka
from scenes import ball
from test_sessions import same, still_life


@pytest.mark.parametrize("page_memory", [0, 0.005, 100, None])
def test_pages_beyond_the_memory_are_made_again(tmp_path: Path, page_memory: float | None) -> None:
    scene = still_life(tmp_path)
    session = kanuka.Session(scene, progressions=2, page_memory=page_memory)
    session.advance()
    assert session.kept["primitives_evicted"] == 0
    evicted = set()
    for amount in (1, 2):
        scene.add_light("point", amount=amount, position=(2, 2, 2))
        session.update()
        session.advance()
        assert same(session.picture(), kanuka.render(scene, progressions=2))
        kept = session.kept
        assert kept["primitives_kept"] + kept["primitives_evicted"] == kept["primitives"]
        evicted.add(kept["primitives_evicted"])
    (count,) = evicted
    assert (count > 0) == (page_memory in (0, 0.005))
    assert (count < kept["primitives"]) == (page_memory != 0)


def test_an_edit_that_is_taken_back_costs_nothing() -> None:
    scene = ball()
    session = kanuka.Session(scene, progressions=1)
    session.advance()
    first = session.picture()
    node = scene.node(1)
    for kept, transform in ((0, np.diag([1.5, 1, 1, 1])), (1, np.eye(4)), (1, np.diag([1.5, 1, 1, 1]))):
        node.place(transform)
        session.update()
        session.advance()
        assert session.kept["primitives_kept"] == kept
    node.place(np.eye(4))
    session.update()
    session.advance()
    assert same(session.picture(), first)


@pytest.mark.parametrize("page_memory", [-1, float("nan"), 1e300])
def test_memory_for_pages_is_a_size(page_memory: float) -> None:
    with pytest.raises(ValueError, match="page_memory must be 0 or more megabytes"):
        kanuka.Session(ball(), page_memory=page_memory)
