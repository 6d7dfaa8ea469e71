"""clang-tidy over all sources of src/ but tests, many of them at a time.

    tools/tidy.py [BUILD] [--jobs N] [FOLDER …]

What a source costs is its headers: parsed, and walked by each check. So the sources of a folder that are compiled alike
are included into one, and headers are paid for once. Sources whose private names clash go into another one; which they
are is found by parsing. Integrators' lanes are left out, instances of headers that other sources include. The static
analyser follows paths only through the source it is given: it runs over the folders in ANALYSED, one by one.
"""

from __future__ import annotations

import argparse
import json
import re
import shlex
import subprocess
import sys
import tempfile
from collections import defaultdict
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
ANALYSED = ("base", "grid", "scene", "store")
MANY = 32  # sources in one, at most: so that all cores have something to do
# Of a unit's flags, those that clang does not know, or that no check asks for.
DROPPED = re.compile(r"-O\w|-fno-gnu-unique|-mtls-dialect=.*|-fPI[CE]|-Winvalid-pch|-fpch-preprocess|-c|-o|-include")
# Beside what .clang-tidy names: paths do not go through what is included, and sources are included here.
UNITED, ALONE = "-clang-analyzer-*,-bugprone-suspicious-include", "-*,clang-analyzer-core.*,clang-analyzer-cplusplus.*"
Flags = tuple[str, ...]


def flags_of(command: str) -> Flags:
    words = shlex.split(command)
    compiler = next(i for i, word in enumerate(words) if re.fullmatch(r".*/(c|g|clang)\+\+\S*", word))
    del words[: compiler + 1]  # and ccache
    # Headers are read as each source names them: -include would bring the precompiled one.
    after = {words.index(option) + 1 for option in ("-o", "-c", "-include") if option in words}
    return tuple(word for i, word in enumerate(words) if i not in after and not DROPPED.fullmatch(word))


def compiled(entry: dict[str, str]) -> list[Path]:
    """The sources of a command: one, or those that CMake united (KANUKA_UNITY)."""
    path = Path(entry["file"])
    if not re.fullmatch(r"unity_\d+_cxx\.cxx", path.name):
        return [path]
    return [Path(name) for name in re.findall(r'#include "(.+)"', path.read_text())]


def sources(build: Path, folders: list[str]) -> dict[tuple[str, Flags], list[Path]]:
    """By folder and flags."""
    listed = subprocess.run(["git", "ls-files", "src/*.cpp"], cwd=ROOT, capture_output=True, text=True, check=True)
    ours = {ROOT / line for line in listed.stdout.split() if not line.endswith("_test.cpp")}
    found = defaultdict(list)
    for entry in json.loads((build / "compile_commands.json").read_text()):
        for path in compiled(entry):
            folder = path.relative_to(ROOT).parts[1] if path in ours else ""
            if folder and (not folders or folder in folders):
                ours.remove(path)
                found[folder, flags_of(entry["command"])].append(path)
    if not folders and ours:
        sys.exit(f"{build}: no command for {', '.join(str(path.relative_to(ROOT)) for path in sorted(ours))}")
    return found


class Unit:
    """Some sources included into one."""

    def __init__(self, folder: Path, name: str, flags: Flags, members: list[Path]) -> None:
        self.path, self.flags, self.members = folder / f"{name}.cpp", flags, members
        self.path.write_text("".join(f'#include "{path}"\n' for path in members))

    def clashing(self) -> list[Path]:
        """Those that do not compile after the ones before them."""
        command = ["clang++-19", "-fsyntax-only", "-w", "-ferror-limit=0", *self.flags, self.path]
        said = subprocess.run(command, capture_output=True, text=True).stderr
        bad, current = set(), ""
        for line in said.splitlines():
            if match := re.match(rf"In file included from {re.escape(str(self.path))}:(\d+):", line):
                current = self.members[int(match[1]) - 1]
            elif re.match(r"\S+:\d+:\d+: (fatal )?error:", line):
                bad.add(current)
        return [path for path in self.members[1:] if path in bad]


def tidy(path: Path, flags: Flags, checks: str) -> str:
    """What it finds."""
    command = ["clang-tidy-19", "--quiet", f"--config-file={ROOT / '.clang-tidy'}", f"--checks={checks}", path]
    done = subprocess.run([*command, "--", *flags], cwd=ROOT, capture_output=True, text=True)
    return done.stdout or (done.stderr if done.returncode else "")


def alone(path: Path, flags: Flags) -> list[str]:
    return [tidy(path, flags, ALONE)]


def check(folder: Path, name: str, flags: Flags, members: list[Path]) -> list[str]:
    found, rest = [], members
    while rest:
        unit, rest = Unit(folder, f"{name}_{len(rest)}", flags, rest), []
        while len(unit.members) > 1 and (bad := unit.clashing()):
            rest += bad
            unit = Unit(folder, f"{name}_{len(unit.members)}", flags, [m for m in unit.members if m not in bad])
        # What Python calls takes what nanobind made for it, by value.
        checks = f"{UNITED},-performance-unnecessary-value-param" if name.startswith("python") else UNITED
        found.append(tidy(unit.path, flags, checks))
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", nargs="?", type=Path, default=ROOT / "build")
    parser.add_argument("folders", nargs="*", metavar="FOLDER")
    parser.add_argument("--jobs", type=int, default=2)
    arguments = parser.parse_args()
    found = sources(arguments.build.absolute(), arguments.folders)
    with tempfile.TemporaryDirectory() as made, ThreadPoolExecutor(arguments.jobs) as pool:
        waiting = []
        for k, ((folder, flags), members) in enumerate(found.items()):
            for first in range(0, len(members), MANY):
                part = members[first : first + MANY]
                waiting.append(pool.submit(check, Path(made), f"{folder}{k}_{first}", flags, part))
            if folder in ANALYSED:
                waiting += [pool.submit(alone, path, flags) for path in members]
        said = [text for each in waiting for text in each.result()]
    # A header is in many units: each finding once.
    findings = dict.fromkeys(block for text in said for block in re.split(r"\n(?=/)", text.strip()) if block)
    for block in findings:
        print(block.replace(f"{ROOT}/", ""))
    count = sum(map(len, found.values()))
    print(f"clang-tidy: {count} sources, {len(findings)} findings")
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
