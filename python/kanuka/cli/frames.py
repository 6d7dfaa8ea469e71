"""Which frames of a file are rendered, and what their pictures are called."""

from __future__ import annotations

import argparse
import re
from pathlib import Path

import kanuka

ALL = "all"
HELP = "of the file: N, A-B, several with commas between them, or all; default: the first that makes a picture"


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


def numbers(choice: str | list[range], scenes: list[str]) -> list[int]:
    """Those of the files' frames, in their order; a number that stands alone is asked for, whether there or not.

    Raises kanuka.Error where none is there.
    """
    if choice != ALL and len(choice) == 1 and len(choice[0]) == 1:
        return [choice[0][0]]
    if "-" in scenes:
        raise kanuka.Error("standard input is read once: name the file to render several of its frames")
    known = kanuka.frames(scenes[-1], before=scenes[:-1])
    if choice == ALL:
        wanted = [f["number"] for f in known if f["picture"]] or [f["number"] for f in known]
    else:
        wanted = [f["number"] for f in known if any(f["number"] in r for r in choice)]
    if not wanted:
        have = ", ".join(str(f["number"]) for f in known) or "none"
        raise kanuka.Error(f"{scenes[-1]}: there is no such frame; the frames are: {have}")
    return list(dict.fromkeys(wanted))


def numbered(path: Path, number: int) -> Path:
    """The file of one of several frames: a row of # or a %d, %04d stands for its number, else it goes before the
    suffix."""
    name, count = re.subn(r"#+", lambda m: f"{number:0{len(m[0])}d}", path.name)
    if not count:
        name, count = re.subn(r"%0?(\d*)d", lambda m: f"{number:0{m[1] or 1}d}", name)
    if not count:
        name = f"{path.stem}.{number:04d}{path.suffix}"
    return path.with_name(name)
