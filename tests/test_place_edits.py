"""Sessions whose places are edited: what is used again of the hierarchy shows in no picture."""

from __future__ import annotations

import numpy as np
import pytest

import kanuka
from test_sessions import same


@pytest.mark.parametrize("arguments", [{}, {"memory": "4G"}], ids=["Embree", "pages"])
def test_places_that_are_edited_one_after_the_other(arguments: dict) -> None:
    """The hierarchy of before is used again, and shows in no bit: of what moves, fades, or lets light through."""
    random = np.random.default_rng(5)
    scene = kanuka.Scene()
    scene.resolution = 40, 24
    scene.options.shutter = (0, 0.5)
    scene.camera = kanuka.Camera((0, 2, 9), (0, 0, 0), fov=45)
    scene.add_light("distant", amount=2, direction=(-1, -2, -1), angle=5)
    scene.add_light("environment", amount=0.3)
    inner, outer = scene.add_group("inner"), scene.add_group("outer")
    inner.add_sphere(0.3, material=kanuka.Material("plastic", opacity=(0.5, 0.7, 0.9)), name="ball")
    outer.add_instances(inner, places(random, 4, 0.6))
    outer.add_sphere(0.2, material="matte")
    crowd = places(random, 40, 3)
    shown = {
        "crowd": scene.add_instances(outer, crowd),
        "moving": scene.add_instances(inner, np.stack([places(random, 6, 3), places(random, 6, 3)])),
    }
    session = kanuka.Session(scene, progressions=2, instance_levels=0.5, **arguments)
    session.advance()
    for step in range(10):
        if step % 5 == 0:  # one moves
            crowd[random.integers(len(crowd)), :, 3] += random.uniform(-0.3, 0.3, 3)
        elif step % 5 == 1:  # all do
            crowd[:, :, 3] += random.uniform(-0.05, 0.05, (len(crowd), 3))
        elif step % 5 == 2:  # one is gone, or another is there
            crowd = crowd[:-1] if step < 5 else np.concatenate([crowd, places(random, 1, 3)])
        elif step % 5 == 3:
            scene.remove([shown["moving"]])
            shown["moving"] = scene.add_instances(inner, np.stack([places(random, 6, 3), places(random, 6, 3)]))
        else:  # a shape of a group
            scene.node("inner", "ball").place(np.diag([1, 1 + 0.1 * step, 1, 1]))
        scene.remove([shown["crowd"]])
        shown["crowd"] = scene.add_instances(outer, crowd)
        session.update(threads=1 + step % 2)
        session.advance()
        alone = kanuka.render(scene, progressions=2, instance_levels=0.5, **arguments)
        assert same(session.picture(), alone), step


def places(random: np.random.Generator, count: int, side: float) -> np.ndarray:
    all_ = np.tile(np.eye(4, dtype=np.float32)[:3], (count, 1, 1))
    all_[:, :, :3] *= random.uniform(0.6, 1.2, (count, 1, 1)).astype(np.float32)
    all_[:, :, 3] = random.uniform(-side, side, (count, 3))
    return all_
