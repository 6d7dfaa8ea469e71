"""Every lobe's row of balls: the manual's pictures, small, against stored ones.

With KANUKA_WRITE_DOCS=1 the manual's pictures, docs/images/lobes, are drawn anew on the way.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

import doc_pictures
import kanuka
from pictures import expect_same, load

# A block of one render has longer tails than a normal distribution (kurtosis up to 7); the mean of some has not.
RENDERS = 8


@pytest.mark.parametrize("name", doc_pictures.lobes())
def test_a_row_of_balls(name: str, tmp_path: Path) -> None:
    if os.environ.get("KANUKA_WRITE_DOCS"):
        doc_pictures.draw_row(name)
    assert (doc_pictures.IMAGES / "lobes" / f"{name}.png").exists(), "run it with KANUKA_WRITE_DOCS=1"
    reference = load(f"lobes/{name}")
    rows = []
    for seed in range(4242, 4242 + RENDERS):
        picture = doc_pictures.render_row(name, seed)
        assert not list(picture.journal.messages)
        rows.append(doc_pictures.summary(picture)["rgb"].astype(np.float64))
    blocks = kanuka.Picture({"rgb": np.mean(rows, axis=0).astype(np.float32)})
    expect_same(reference, blocks, tmp_path, of=len(doc_pictures.lobes()), renders=RENDERS)
    errors = reference.mean_errors(blocks, RENDERS)
    assert (np.abs(errors) < 4).all(), errors


def test_another_lobe_is_found() -> None:
    """Four per cent less light, and a lobe next of kin."""
    reference, rows = load("lobes/OrenNayarBrdf"), len(doc_pictures.lobes())
    picture = doc_pictures.render_row("OrenNayarBrdf", seed=7)
    darker = kanuka.Picture({"rgb": picture["rgb"] * np.float32(0.96)})
    assert reference.z_test(doc_pictures.summary(picture), rows).passed
    assert not reference.z_test(doc_pictures.summary(darker), rows).passed
    assert not reference.z_test(doc_pictures.summary(doc_pictures.render_row("BurleyBrdf", seed=7)), rows).passed
