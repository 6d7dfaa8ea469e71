"""clang-tidy over many sources at a time finds what it finds in each alone."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

ROOT = Path(__file__).parent.parent
SPEC = importlib.util.spec_from_file_location("tidy", ROOT / "tools" / "tidy.py")
tidy = importlib.util.module_from_spec(SPEC)
sys.modules[SPEC.name] = tidy
SPEC.loader.exec_module(tidy)

CLEAN = "namespace n { namespace { int helper() { return 1; } } int clean() { return helper(); } }\n"
# Of a name that another source has as well; 1 / 2 is rounded before it is added.
FAULT = (
    "namespace n {{ namespace {{ double helper() {{ return 2; }} }} double {0}() {{ return helper() + 1 / 2; }} }}\n"
)
BROKEN = "int broken() { return nothing; }\n"


def found(tmp_path: Path, sources: dict[str, str]) -> str:
    folder = tmp_path / "src"
    folder.mkdir(parents=True)
    for name, text in sources.items():
        (folder / name).write_text(text)
    return "\n".join(tidy.check(tmp_path, "unit", ("-std=gnu++20",), [folder / name for name in sources]))


def test_names_that_clash_hide_nothing(tmp_path: Path) -> None:
    said = found(tmp_path, {"a.cpp": CLEAN, "b.cpp": FAULT.format("b"), "c.cpp": FAULT.format("c")})
    assert "redefinition" not in said
    for name in ("b.cpp", "c.cpp"):
        assert said.count(f"{name}:1:") == 1, said
    assert said.count("bugprone-integer-division") == 2


def test_clean_sources_say_nothing_and_broken_ones_do(tmp_path: Path) -> None:
    assert not found(tmp_path / "clean", {"a.cpp": CLEAN}).strip()
    assert "clang-diagnostic-error" in found(tmp_path / "broken", {"a.cpp": CLEAN, "b.cpp": BROKEN})
