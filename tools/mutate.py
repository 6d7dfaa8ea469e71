#!/usr/bin/env python3
"""Breaks one line at a time and asks whether a folder's unit tests see it.

    tools/mutate.py src/bsdf --count 40            # forty mutants, the same ones for the same --seed
    tools/mutate.py src/color --count 40 --resume  # goes on where it stopped

Works in a worktree of its own (--worktree), of the commit that is checked out. Mutants that do not compile are invalid;
one that runs past --limit is killed. Writes out/mutants-FOLDER.json after every mutant, and a table at the end.
"""

from __future__ import annotations

import argparse
import json
import random
import re
import subprocess
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

# Name, what is looked for in a line of code, what stands in for it.
RULES: list[tuple[str, str, str]] = [
    ("sign", r"(?<=[\w\)\]]) \+ (?=[\w\(])", " - "),
    ("sign", r"(?<=[\w\)\]]) - (?=[\w\(])", " + "),
    ("dropped term", r"(?<=[\w\)\]]) \+ [\w.]+(\[\w+\])?(?=[;,\)])", ""),
    ("dropped factor", r"(?<=[\w\)\]]) \* [\w.]+(\[\w+\])?(?=[;,\)])", ""),
    ("product", r"(?<=[\w\)\]]) \* (?=[\w\(])", " / "),
    ("quotient", r"(?<=[\w\)\]]) / (?=[\w\(])", " * "),
    ("factor 2", r"(?<![\w.])0\.5f?(?![\w.])", "0.25"),
    ("factor 2", r"(?<![\w.])2\.0f(?![\w.])", "1.0f"),
    ("factor 2", r"(?<![\w.])4\.0f(?![\w.])", "2.0f"),
    ("factor pi", r"\bInvPi\b", "1.0f"),
    ("factor pi", r"(?<![\w:])Pi\b", "1.0f"),
    ("exponent", r"\bsqrt\((?=[^()]*\))", "("),
    ("exponent", r"\b(\w+2) \* \1\b", r"\1"),
    ("bound", r"\bmax\(", "min("),
    ("bound", r"\bmin\(", "max("),
    ("comparison", r" < ", " >= "),
    ("comparison", r" > ", " <= "),
    ("comparison", r" <= ", " < "),
    ("comparison", r" >= ", " > "),
    ("off by one", r"(?<=[\w\)]) - 1(?=[\);\],])", ""),
    ("off by one", r"(?<=[\w\)]) \+ 1(?=[\);\],])", ""),
    ("choice", r"\bselect\(([^,()]+), ([^,()]+), ([^,()]+)\)", r"select(\1, \3, \2)"),
    ("not", r"\(!(?=\w)", "("),
    ("sine", r"\br, c\b", "r, s"),
]
CODE = re.compile(r"^\s*(//|\*|#|template|static_assert|using|namespace|case|EXPECT|ASSERT|throw)|operator|\"")


@dataclass
class Mutant:
    file: str
    line: int
    column: int
    rule: str
    before: str
    after: str
    result: str = ""
    seconds: float = 0
    by: str = ""

    def key(self) -> tuple[str, str, str]:
        return self.file, self.before, self.after


def mutants_of(path: Path) -> list[Mutant]:
    found = []
    for number, line in enumerate(path.read_text().splitlines(), 1):
        code = line.split("//")[0]
        if CODE.search(code) or not code.strip():
            continue
        for rule, pattern, new in RULES:
            for match in re.finditer(pattern, code):
                after = code[: match.start()] + match.expand(new) + code[match.end() :]
                name = str(path.relative_to(ROOT))
                found.append(Mutant(name, number, match.start() + 1, rule, code.strip(), after.strip()))
    return found


def candidates(folder: Path) -> list[Mutant]:
    files = sorted(p for p in folder.rglob("*") if p.suffix in (".h", ".cpp"))
    files = [p for p in files if "test" not in p.name and p.parent.name != "oracles"]
    return [m for p in files for m in mutants_of(p)]


def run(command: list[object], limit: float, cwd: Path) -> tuple[int | None, str]:
    """Exit status and output; None where the limit passed."""
    try:
        done = subprocess.run(
            [str(c) for c in command], cwd=cwd, timeout=limit, capture_output=True, text=True, check=False
        )
    except subprocess.TimeoutExpired:
        return None, ""
    return done.returncode, done.stdout + done.stderr


class Copy:
    """The worktree that is broken and mended."""

    def __init__(self, path: Path, folder: str, jobs: int, limit: float) -> None:
        self.path, self.jobs, self.limit = path, jobs, limit
        self.target = f"kanuka_{Path(folder).name}_test"
        commit = subprocess.check_output(["git", "rev-parse", "HEAD"], cwd=ROOT, text=True).strip()
        if not path.exists():
            subprocess.run(["git", "worktree", "add", "--detach", str(path), commit], cwd=ROOT, check=True)
        subprocess.run(["git", "checkout", "-q", "--detach", "-f", commit], cwd=path, check=True)
        if not (path / "build/build.ninja").exists():
            options = ["-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release", "-DKANUKA_PYTHON=OFF"]
            subprocess.run(["cmake", "-S", ".", "-B", "build", *options], cwd=path, check=True, capture_output=True)
        status, output = run(self.build_command(), 3600, path)
        if status != 0:
            sys.exit(f"{self.target} does not build as it is:\n{output[-2000:]}")
        if self.test()[0] != "survived":
            sys.exit(f"{self.target} fails as it is")

    def build_command(self) -> list[object]:
        return ["ninja", "-C", "build", f"-j{self.jobs}", self.target]

    def test(self) -> tuple[str, str]:
        found = sorted((self.path / "build/src").rglob(self.target))
        status, output = run([found[0], "--gtest_brief=1", "--gtest_fail_fast"], self.limit, self.path)
        if status is None:
            return "killed", "time"
        failed = re.search(r"\[  FAILED  \] (\S+)", output)
        return ("survived", "") if status == 0 else ("killed", failed.group(1) if failed else f"exit {status}")

    def judge(self, mutant: Mutant) -> None:
        file = self.path / mutant.file
        text = file.read_text()
        lines = text.splitlines(keepends=True)
        lines[mutant.line - 1] = mutant.after + "\n"
        started = time.monotonic()
        try:
            file.write_text("".join(lines))
            status, _ = run(self.build_command(), 10 * self.limit, self.path)
            mutant.result, mutant.by = self.test() if status == 0 else ("invalid", "")
        finally:
            file.write_text(text)
        mutant.seconds = round(time.monotonic() - started, 1)


def table(mutants: list[Mutant]) -> str:
    lines = []
    for m in sorted(mutants, key=lambda m: (m.result, m.file, m.line)):
        lines.append(f"{m.result:9} {m.file}:{m.line}:{m.column} {m.rule} {m.by}\n    - {m.before}\n    + {m.after}")
    counts = {r: sum(m.result == r for m in mutants) for r in ("killed", "survived", "invalid")}
    return "\n".join(lines) + "\n" + ", ".join(f"{n} {r}" for r, n in counts.items())


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", help="src/bsdf, src/color, …")
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="files whose path contains this")
    parser.add_argument("--limit", type=float, default=120, help="seconds that the tests may take")
    parser.add_argument("--minutes", type=float, default=1e9, help="begins no mutant after so long")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--worktree", type=Path, default=ROOT / "build/mutants")
    parser.add_argument("--resume", action="store_true", help="keep what an earlier run found")
    given = parser.parse_args()

    started = time.monotonic()
    out = ROOT / "out" / f"mutants-{Path(given.folder).name}.json"
    out.parent.mkdir(exist_ok=True)
    chosen = [m for m in candidates(ROOT / given.folder) if given.only in m.file]
    random.Random(given.seed).shuffle(chosen)
    chosen = chosen[: given.count]
    known = [Mutant(**m) for m in json.loads(out.read_text())] if given.resume and out.exists() else []
    done = {m.key(): m for m in known}
    copy = Copy(given.worktree.resolve(), given.folder, given.jobs, given.limit)
    for i, mutant in enumerate(chosen):
        if mutant.key() in done or time.monotonic() - started > 60 * given.minutes:
            continue
        copy.judge(mutant)
        done[mutant.key()] = mutant
        out.write_text(json.dumps([asdict(m) for m in done.values()], indent=1))
        print(f"{i + 1}/{len(chosen)} {mutant.result} {mutant.by} ({mutant.seconds} s)", flush=True)
    print(table(list(done.values())))
    return 0


if __name__ == "__main__":
    sys.exit(main())
