"""How much is measured, and what every measure shares."""

from __future__ import annotations

import json
import statistics
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import scenes

ROOT = Path(__file__).resolve().parent.parent
Say = Callable[[str], None]
Found = dict[str, object]


@dataclass(frozen=True)
class Settings:
    """Quick runs say whether everything works, not how fast it is."""

    quick: bool = False
    rounds: int = 6
    threads: int = 0
    isle_scale: float = 0.1  # of the island; 1 is 28 million instances

    @property
    def scale(self) -> float:
        return 0.125 if self.quick else 1

    def request(self, scene: str, n: int = 0, samples: int = 0, **options: object) -> Found:
        if self.quick and scene in scenes.MAKERS:
            n = {"terrain": 300, "forest": 1000, "forest-million": 1000, "shading": 4}.get(scene, n)
        made = {"scene": scene, "n": n, "scale": self.scale, "samples": samples, "threads": self.threads}
        return made | {"options": list(options.items())}


def built(target: str, folder: str) -> Path:
    """A program of the build tree, made now."""
    done = subprocess.run(["ninja", "-C", ROOT / "build", target], capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"{target} does not build:\n{done.stdout[-1000:]}")
    return ROOT / "build" / "src" / folder / target


def median_lines(rounds: list[list[Found]], timed: tuple[str, ...]) -> list[Found]:
    """Of a program that ran several times: the same lines with medians, and what each round gave for what is timed."""
    made = []
    for same in zip(*rounds, strict=True):
        kept = {name: [float(line[name]) for line in same] for name in timed if name in same[0]}
        made.append({**same[0], **{name: statistics.median(v) for name, v in kept.items()}, "rounds": kept})
    return made


def rounds_of(settings: Settings, program: Path, *arguments: object, rounds: int) -> list[list[Found]]:
    """What a program prints, each time it is run; once where it is quick."""
    return [lines_of(program, *arguments) for _ in range(1 if settings.quick else rounds)]


def lines_of(program: Path, *arguments: object) -> list[Found]:
    """What a program prints: a line of JSON each."""
    done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"{program.name} ended with {done.returncode}:\n{done.stderr[-1000:]}")
    return [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
