"""The shaders and pictures of the tutorial."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

import kanuka

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tools"))
import make_tutorial  # noqa: E402

PAGE = make_tutorial.PAGE.read_text()
SHADERS = make_tutorial.blocks(PAGE, "shader")


@pytest.mark.parametrize("file", SHADERS)
def test_shaders_compile_without_a_word(file: str) -> None:
    journal = kanuka.Journal()
    kanuka.compile_shader(file, source=SHADERS[file], journal=journal).run(4, 4, journal=journal)
    assert not list(journal), [str(m) for m in journal]


def test_what_it_shows_is_what_comes() -> None:
    shown = make_tutorial.blocks(PAGE, "emit")
    assert shown
    for file, text in shown.items():
        assert kanuka.emit_shader(file, "c", "prelighting", source=SHADERS[file], lanes=8) == text, (
            "tools/make_tutorial.py"
        )


def test_pictures_are_there_and_small() -> None:
    pictures = re.findall(r"\]\((images/\S+)\)", PAGE)
    assert len(pictures) >= 5
    for picture in pictures:
        assert 0 < (ROOT / "docs" / picture).stat().st_size <= 200_000
