"""Pictures show themselves in notebooks."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import kanuka


def test_a_picture_is_a_png_to_notebooks(tmp_path: Path) -> None:
    rgb = np.linspace(0, 1, 8 * 4 * 3, dtype=np.float32).reshape(4, 8, 3)
    picture = kanuka.Picture({"rgb": rgb})
    picture.write(tmp_path / "a.png")
    assert picture._repr_png_() == (tmp_path / "a.png").read_bytes()
    assert picture._repr_png_().startswith(b"\x89PNG")
