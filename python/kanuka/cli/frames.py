"""Which frames of a file are rendered, and what their pictures are called."""

from __future__ import annotations

import argparse
import re
from dataclasses import dataclass, field
from pathlib import Path

import kanuka

ALL = "all"
HELP = (
    "frames to render: N, A-B, a list with commas, or all; default: the first that makes a picture. Frames that "
    "textures are made of keep the names of their displays and their size, whatever -o, --resolution and --crop say"
)


def chosen(text: str) -> str | list[range]:
    """The argument of --frame: ALL or ranges of numbers."""
    if text.strip() == ALL:
        return ALL
    ranges = []
    for part in text.split(","):
        match = re.fullmatch(r"\s*(-?\d+)\s*(?:-\s*(-?\d+))?\s*", part)
        first, last = (int(g if g is not None else match[1]) for g in match.groups()) if match else (1, 0)
        if last < first:
            raise argparse.ArgumentTypeError(
                f"expected a number, A-B with A <= B, commas between, or all, got {text!r}"
            )
        ranges.append(range(first, last + 1))
    return ranges


@dataclass
class Frame:
    """One of those that are rendered; number 0 = the first that makes a picture."""

    number: int = 0
    repeat: int = 0  # frames of that number that come before it
    source: bool = False  # of a texture of the file, which is looked for under the display's name
    of_several: bool = False
    written: set[Path] = field(default_factory=set)  # of those before it
    products: tuple = ()  # of a stage: kanuka.usd.Product
    of_several_products: bool = False  # its frame is rendered more than once

    @property
    def of_shot(self) -> tuple:
        """What the same picture has in each frame."""
        return self.source, tuple(product.path for product in self.products)

    def file(self, path: Path | None) -> Path | None:
        """What belongs to this render alone: the frame's number and the first product's name are in its name."""
        if path and self.of_several_products:
            path = path.with_name(f"{path.stem}.{self.products[0].path.rsplit('/', 1)[-1]}{path.suffix}")
        return numbered(path, self) if path and self.of_several else path

    def title(self) -> str:
        products = ", ".join(product.path for product in self.products) if self.of_several_products else ""
        return ", ".join(filter(None, (f"frame {self.number}" if self.of_several else "", products)))


def frames(choice: str | list[range], scenes: list[str]) -> list[Frame]:
    """Those of the files' frames, in their order; a number that stands alone is asked for, whether there or not.
    All are those that make pictures, and those whose pictures textures are made of.

    Raises kanuka.Error where none is there.
    """
    if choice != ALL and len(choice) == 1 and len(choice[0]) == 1:
        return [Frame(choice[0][0])]
    if "-" in scenes:
        raise kanuka.Error("standard input is read once: name the file to render several of its frames")
    known = kanuka.frames(scenes[-1], before=scenes[:-1])
    if choice == ALL:
        wanted = [f for f in known if f["picture"] or f["source"]] or known
    else:
        wanted = [f for f in known if any(f["number"] in r for r in choice)]
    if not wanted:
        have = ", ".join(str(f["number"]) for f in known) or "none"
        raise kanuka.Error(f"{scenes[-1]}: there is no such frame; the frames are: {have}")
    several, written = len(wanted) > 1, set()
    return [Frame(f["number"], f["repeat"], f["source"], several, written) for f in wanted]


def numbered(path: Path, frame: Frame) -> Path:
    """The file of one of several frames: a row of # or a %d, %04d stands for its number, else it goes before the
    suffix. The second of one number is 7-2."""

    def number(width: int) -> str:
        return f"{frame.number:0{width}d}" + (f"-{frame.repeat + 1}" if frame.repeat else "")

    name, count = re.subn(r"#+", lambda m: number(len(m[0])), path.name)
    if not count:
        name, count = re.subn(r"%0?(\d*)d", lambda m: number(int(m[1] or 1)), name)
    if not count:
        name = f"{path.stem}.{number(4)}{path.suffix}"
    return path.with_name(name)
