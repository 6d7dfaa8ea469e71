"""Writes the parameter tables of docs/procedurals.md as kanuka.procedurals declares them; --pictures: and pictures."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import kanuka
from kanuka import procedurals
from kanuka.procedurals import parameters

ROOT = Path(__file__).resolve().parents[1]
PICTURES = ("fur", "grove", "cloth")


def write_tables() -> None:
    manual = ROOT / "docs" / "procedurals.md"
    text = manual.read_text()
    for name in procedurals.SHIPPED:
        begin, end = f"<!-- {name} -->\n", f"<!-- end of {name} -->"
        before, rest = text.split(begin, 1)
        after = rest.split(end, 1)[1]
        text = before + begin + parameters.markdown(procedurals.table(name)) + "\n" + end + after
    manual.write_text(text)


def three_for_four(pixels: np.ndarray, axis: int) -> np.ndarray:
    """Smaller by a quarter, by area: files of pictures with much detail are large."""
    rows = np.moveaxis(pixels, axis, 0)
    four = rows[: len(rows) // 4 * 4].reshape(-1, 4, *rows.shape[1:])
    weights = np.array([[3, 1, 0, 0], [0, 2, 2, 0], [0, 0, 1, 3]]) / 4
    three = np.einsum("ij,nj...->ni...", weights, four).reshape(-1, *rows.shape[1:])
    return np.moveaxis(three, 0, axis)


def write_pictures() -> None:
    for scene in PICTURES:
        loaded = kanuka.load(ROOT / "scenes" / "procedurals" / f"{scene}.rib", on_demand=True)
        write_small(kanuka.render(loaded), scene)


def write_small(picture: kanuka.Picture, scene: str) -> None:
    pixels = three_for_four(three_for_four(np.asarray(picture["rgb"]), 0), 1).astype(np.float32)
    kanuka.Picture({"rgb": np.ascontiguousarray(pixels)}).write(
        ROOT / "docs" / "images" / "procedurals" / f"{scene}.png"
    )


if __name__ == "__main__":
    write_tables()
    if "--pictures" in sys.argv[1:]:
        write_pictures()
