"""results.json: what was measured, part by part, each with its commit, machine, date and load.

Written after every part, so that a run that is stopped leaves what it had and the next goes on there. A part stays
until it is measured again: figures of an older commit are shown with that commit.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator
from pathlib import Path

Entry = dict[str, object]


class Results:
    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self.parts: dict[str, Entry] = json.loads(path.read_text())["parts"]
        except (OSError, json.JSONDecodeError, KeyError):
            self.parts = {}

    def has(self, name: str, taken: Entry) -> bool:
        """Measured with the same sources, on the same machine, as long as now?"""
        old = self.parts.get(name, {}).get("taken", {})
        return all(old.get(key) == taken[key] for key in ("commit", "machine", "rounds", "quick", "threads"))

    def put(self, name: str, taken: Entry, found: Entry) -> None:
        self.parts[name] = {"taken": taken, "found": found}
        self.write()

    def seconds(self, name: str) -> float | None:
        return self.parts.get(name, {}).get("taken", {}).get("seconds")

    def write(self) -> None:
        self.path.parent.mkdir(parents=True, exist_ok=True)
        replace(self.path, json.dumps({"parts": dict(sorted(self.parts.items()))}, indent=1) + "\n")

    # ---- for pages

    def of(self, measure: str) -> Iterator[tuple[str, Entry]]:
        """What a measure found, by what it is about."""
        for name, part in self.parts.items():
            kind, _, about = name.partition("/")
            if kind == measure:
                yield about, part["found"]

    def one(self, name: str) -> Entry | None:
        part = self.parts.get(name)
        return part["found"] if part else None

    def look_up(self, key: str) -> object:
        """`measure/about:name.name.0`; None where the part was not measured, KeyError where it has no such figure."""
        part, _, names = key.partition(":")
        found = self.one(part)
        if found is None:
            return None
        value: object = found
        for name in names.split("."):
            try:
                value = value[int(name)] if isinstance(value, list) else value[name]
            except (KeyError, IndexError, TypeError, ValueError) as error:
                raise KeyError(f"{key}: {part} has no figure {names}") from error
        return value


def replace(path: Path, text: str) -> None:
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    temporary.write_text(text)
    os.replace(temporary, path)


Say = Callable[[str], None]
