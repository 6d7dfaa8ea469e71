"""Checks that no source file is too long to be read at once.

Files of C++ and Python have up to MOST lines. Tables, which are looked up in and not read, may be longer: EXCEPT names
them with the reason. Functions of C++ are measured by clang-tidy (readability-function-size in .clang-tidy). Prints
"file:line: what, and what would do" for every breach and exits 1; prints a summary and exits 0 otherwise.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

MOST = 450
# A file that is within the limit, or gone, may not stand here.
EXCEPT = {
    "src/sl/ops/table.cpp": "the one table of shadeops: a row or some for each",
}
TOPS = ("src", "include", "plugins", "python", "tests", "tools", "bench")
SUFFIXES = {".h", ".hpp", ".cpp", ".cc", ".c", ".inl", ".cu", ".py"}


def lines_of(file: Path) -> int:
    return file.read_bytes().count(b"\n")


def breaches(root: Path, files: list[Path], exceptions: dict[str, str]) -> list[str]:
    lengths = {file.relative_to(root).as_posix(): lines_of(file) for file in files}
    found = [
        f"{name}:{MOST + 1}: {lines} lines, where {MOST} are the most: split it by concern"
        for name, lines in lengths.items()
        if lines > MOST and name not in exceptions
    ]
    found += [
        f"{name}:1: within the limit; take it out of EXCEPT of tools/check_sizes.py"
        for name in exceptions
        if lengths.get(name, 0) <= MOST
    ]
    return found


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    here = Path(__file__).resolve().parent.parent
    parser.add_argument("root", nargs="?", type=Path, default=here)
    root = parser.parse_args(arguments).root.resolve()
    files = [
        file
        for top in TOPS
        for file in sorted((root / top).rglob("*"))
        if file.suffix in SUFFIXES and file.is_file() and not file.is_symlink()
    ]
    found = breaches(root, files, EXCEPT if root == here else {})
    for breach in found:
        print(breach)
    print(f"sizes: {len(files)} files, {len(found)} breaches")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
