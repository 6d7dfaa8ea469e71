"""Writes the parameter tables of docs/procedurals.md as kanuka.procedurals declares them; --pictures: and pictures."""

from __future__ import annotations

import sys
from pathlib import Path

import kanuka
from kanuka import procedurals
from kanuka.procedurals import parameters

ROOT = Path(__file__).resolve().parents[1]
PICTURES = {"fur": "hair", "grove": "trees", "cloth": "cloth"}


def write_tables() -> None:
    manual = ROOT / "docs" / "procedurals.md"
    text = manual.read_text()
    for name in procedurals.SHIPPED:
        begin, end = f"<!-- {name} -->\n", f"<!-- end of {name} -->"
        before, rest = text.split(begin, 1)
        after = rest.split(end, 1)[1]
        text = before + begin + parameters.markdown(procedurals.table(name)) + "\n" + end + after
    manual.write_text(text)


def write_pictures() -> None:
    for scene in PICTURES:
        loaded = kanuka.load(ROOT / "scenes" / "procedurals" / f"{scene}.rib", on_demand=True)
        kanuka.render(loaded).write(ROOT / "docs" / "images" / "procedurals" / f"{scene}.png")


if __name__ == "__main__":
    write_tables()
    if "--pictures" in sys.argv[1:]:
        write_pictures()
