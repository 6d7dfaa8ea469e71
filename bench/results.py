"""results.json and RESULTS.md: written after every measure, so that a run that is stopped leaves what it had.

A run of a part takes the place of that part alone, if machine and sources are the same as before; else it starts anew.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path

import report

# By which key an entry of each list says what it is about; micropolygons have one entry at most.
ABOUT = {
    "ratios": "scene",
    "medians": "scene",
    "agreement": "scene",
    "tolerance": "kind",
    "micropolygons": "",
    "dice": "",
    "hair": "",
    "networks": "links",
    "shaders": "",
    "lights": "",
    "lanes": "",
}
SAME = ("commit", "quick", "repeats", "threads")
SAME_MACHINE = ("cpu", "family_model_stepping", "cores", "isa")


class Results:
    def __init__(self, folder: Path, header: dict[str, object], say: Callable[[str], None]) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        self.data = {**header, "commands": [], "failures": [], **{name: [] for name in ABOUT}}
        old = self._old()
        if old and self._is_of_now(old):
            self.data |= {name: old[name] for name in (*ABOUT, "commands")}
            say(f"adds to {folder / 'results.json'}")
        elif old:
            say(f"{folder / 'results.json'} is of other sources, another machine or other settings: starts anew")
        self.data["commands"] = list(dict.fromkeys([*self.data["commands"], header["command"]]))

    def _old(self) -> dict[str, object] | None:
        try:
            old = json.loads((self.folder / "results.json").read_text())
        except (OSError, json.JSONDecodeError):
            return None
        return old if all(name in old for name in (*ABOUT, *SAME, "machine", "commands")) else None

    def _is_of_now(self, old: dict[str, object]) -> bool:
        machines = old["machine"], self.data["machine"]
        return all(old[name] == self.data[name] for name in SAME) and all(
            machines[0].get(name) == machines[1].get(name) for name in SAME_MACHINE
        )

    def put(self, name: str, about: str, entries: list[dict[str, object]]) -> None:
        """Entries of a list that are about the same as these go."""
        self.data[name] = [entry for entry in self.data[name] if entry.get(ABOUT[name], "") != about] + entries
        self.write()

    def fail(self, line: str) -> None:
        if line not in self.data["failures"]:
            self.data["failures"].append(line)
        self.write()

    def write(self) -> None:
        self.data["goals"] = report.goals(self.data)
        for name, text in (
            ("results.json", json.dumps(self.data, indent=2) + "\n"),
            ("RESULTS.md", report.page(self.data)),
        ):
            temporary = self.folder / f".{name}.{os.getpid()}"
            temporary.write_text(text)
            os.replace(temporary, self.folder / name)
