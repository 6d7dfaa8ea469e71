"""Procedurals that Python or a program expands."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

import kanuka

WORLD = 'Format 32 32 1\nProjection "perspective"\nWorldBegin\n{}\nWorldEnd\n'
BALL = "Translate 0 0 4 Sphere 1 -1 1 360\n"


def write(path: Path, body: str) -> Path:
    path.write_text(WORLD.format(body))
    return path


def messages(scene: kanuka.Scene) -> str:
    return "\n".join(str(message) for message in scene.journal.messages)


def test_a_plug_in_gives_rib(tmp_path: Path) -> None:
    asked: list[tuple[float, str]] = []

    def fur(detail: float, data: str) -> str:
        asked.append((detail, data))
        return BALL * int(data)

    path = write(tmp_path / "a.rib", 'Procedural "DynamicLoad" ["fur.so" "3"] [-1 1 -1 1 4 6]')
    scene = kanuka.load(path, procedurals={"fur": fur})
    assert not scene.journal.messages
    assert sum(scene.summary()["primitives"].values()) == 3
    assert len(asked) == 1
    assert asked[0][1] == "3"
    assert asked[0][0] == pytest.approx(64, rel=0.01)  # 2 units at distance 4, 90 degrees, 32 pixels


def test_what_a_plug_in_raises_is_reported_with_its_line(tmp_path: Path) -> None:
    def broken(detail: float, data: str) -> str:
        raise ValueError("no comb")

    path = write(tmp_path / "a.rib", BALL + 'Procedural "DynamicLoad" ["broken" ""] [-1 1 -1 1 4 6]')
    said = messages(kanuka.load(path, procedurals={"broken": broken}))
    assert "no comb" in said
    assert "a.rib:5" in said


def test_programs_run_unless_forbidden(tmp_path: Path) -> None:
    program = tmp_path / "balls.py"
    program.write_text(
        "import sys\n"
        "for line in sys.stdin:\n"
        "    detail, data = line.split(maxsplit=1)\n"
        f"    sys.stdout.write({BALL!r} * int(data) + chr(10))\n"
        "    sys.stdout.flush()\n"
        "    sys.stdout.buffer.write(bytes([255]))\n"
        "    sys.stdout.buffer.flush()\n"
    )
    path = write(tmp_path / "a.rib", f'Procedural "RunProgram" ["{sys.executable} balls.py" "2"] [-1 1 -1 1 4 6]')
    scene = kanuka.load(path)
    assert not scene.journal.messages
    assert sum(scene.summary()["primitives"].values()) == 2
    assert "forbidden" in messages(kanuka.load(path, run_programs=False))
