"""The check of sizes finds files that are too long, says where, and passes this repository."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest


def check(root: Path, tree: Path) -> subprocess.CompletedProcess[str]:
    script = root / "tools" / "check_sizes.py"
    return subprocess.run([sys.executable, script, tree], capture_output=True, text=True)


def write(tree: Path, name: str, lines: int) -> Path:
    path = tree / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n" * lines)
    return path


def test_this_repository_is_clean(root: Path) -> None:
    result = check(root, root)
    assert result.returncode == 0, result.stdout
    files = int(result.stdout.split("sizes: ")[1].split(" files")[0])
    assert files > 500, "the check must have read the sources"


def test_files_of_other_kinds_and_up_to_the_limit_pass(root: Path, tmp_path: Path) -> None:
    write(tmp_path, "src/base/a.cpp", 450)
    write(tmp_path, "python/kanuka/a.py", 450)
    write(tmp_path, "src/color/data.csv", 10000)
    write(tmp_path, "docs/a.py", 10000)
    result = check(root, tmp_path)
    assert result.returncode == 0, result.stdout
    assert "sizes: 2 files, 0 breaches" in result.stdout


@pytest.mark.parametrize("name", ["src/base/a.cpp", "src/base/a_test.cpp", "include/a.h", "tools/a.py", "tests/c/a.c"])
def test_long_files_are_found(root: Path, tmp_path: Path, name: str) -> None:
    write(tmp_path, name, 451)
    result = check(root, tmp_path)
    assert result.returncode == 1
    assert f"{name}:451: 451 lines" in result.stdout
    assert "1 breaches" in result.stdout


def test_exceptions_are_only_for_files_that_need_them(root: Path, tmp_path: Path) -> None:
    spec = importlib.util.spec_from_file_location("check_sizes", root / "tools" / "check_sizes.py")
    sizes = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(sizes)
    long, short = write(tmp_path, "src/a.cpp", 500), write(tmp_path, "src/b.cpp", 10)
    reasons = {"src/a.cpp": "a table", "src/b.cpp": "was one", "src/gone.cpp": "was there"}
    found = sizes.breaches(tmp_path, [long, short], reasons)
    assert len(found) == 2
    assert "src/b.cpp:1:" in found[0] and "src/gone.cpp:1:" in found[1]
