#!/usr/bin/env python3
"""Do the tests see a fault? Breaks the sources one place at a time and runs the tests that should notice.

    tools/mutate.py bsdf color                 # sample mutants of these folders, build them once, run all
    tools/mutate.py bsdf --count 40 --seed 7   # more of them, others
    tools/mutate.py --report                   # what the kept results say

All mutants of a folder are compiled into one build and switched on one at a time by an environment variable
(mutant schemata: Untch, Offutt and Harrold 1993), in a copy of the tree under build/mutants. Rules are the faults of
this trade: a sign, a dropped term, a factor of two, a constant doubled, a loop that ends one early, a condition the
other way round, a root or a bound that is missing. Results are kept in build/mutants/results.json after every mutant;
a run that was stopped goes on from there. Survivors that are known to change no result stand in tools/mutants.json,
each with its reason; those without one wait for a test.
"""

from __future__ import annotations

import argparse
import concurrent.futures
import hashlib
import json
import os
import random
import re
import shutil
import subprocess
import sys
import time
from collections import Counter, defaultdict
from dataclasses import asdict, dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
WORK = ROOT / "build" / "mutants"
TREE = WORK / "tree"
RESULTS = WORK / "results.json"
ACCEPTED = ROOT / "tools" / "mutants.json"
VARIABLE = "KANUKA_MUTANT"

# The tests that should notice, in this order: what passes the first is built anew for the next.
TESTS = {
    "color": ["kanuka_color_test"],
    "bsdf": ["kanuka_bsdf_test", "kanuka_transport_test"],
    "geom": ["kanuka_geom_test", "kanuka_dice_test"],
    "dice": ["kanuka_dice_test"],
    "transport": ["kanuka_transport_test"],
}
REFERENCE = ["tests/test_reference.py", "tests/test_lobe_pictures.py"]
SKIPPED = re.compile(r"_test\.cpp$|/test_\w+\.h$|/oracles/|make_tables\.cpp$|/data/")

# Sources of a program that makes tables while the library is built: it is run again for each of their mutants.
MAKES_TABLES = re.compile(r"src/bsdf/make_tables(_\w+\.cpp|\.h)$")
TABLES = TREE / "build/src/bsdf/generated/lobe_tables.bin"

# What the rules call. Values pass through functions, so that any type with the operator will do.
HEADER = """// Written by tools/mutate.py.
#pragma once
#include <cmath>
#include <cstdlib>
#include <type_traits>
namespace kanuka::mutants {
[[maybe_unused]] static const int active = [] {
    const char* text = std::getenv("KANUKA_MUTANT");
    return text ? std::atoi(text) : 0;
}();
template <int Id, class T> T pick(T a, T b) { return active == Id ? b : a; }
template <int Id> struct Sign {
    template <class T> friend auto operator*(Sign, T x) { return active == Id ? decltype(-x)(-x) : decltype(-x)(x); }
};
template <int Id> struct Term {
    template <class T> friend T operator*(Term, T x) { return active == Id ? T(x - x) : x; }
};
template <int Id> struct Twice {
    template <class T> friend T operator*(T x, Twice) { return active == Id ? T(x + x) : x; }
};
template <int Id, class T> auto negate(const T& c) {
    if constexpr (std::is_constructible_v<bool, T>)
        return (active == Id) != bool(c);
    else
        return active == Id ? T(!c) : c;
}
template <int Id, class T> T root(T x) {
    using std::sqrt;
    return active == Id ? x : T(sqrt(x));
}
template <int Id, class A, class B> auto larger(A a, B b) {
    using std::max;
    return active == Id ? decltype(max(a, b))(a) : max(a, b);
}
template <int Id, class A, class B> auto smaller(A a, B b) {
    using std::min;
    return active == Id ? decltype(min(a, b))(a) : min(a, b);
}
} // namespace kanuka::mutants
"""


@dataclass(frozen=True)
class Mutant:
    folder: str
    file: str
    line: int  # from 1
    column: int
    rule: str
    length: int  # of what is replaced
    template: str  # with {id}
    code: str  # the line as it stands
    nth: int = 0  # of lines alike in the file

    @property
    def key(self) -> str:
        """The same while the line and those like it before it stand as they are."""
        text = f"{self.file}|{self.code}|{self.column}|{self.rule}|{self.template}" + "|again" * self.nth
        return hashlib.sha256(text.encode()).hexdigest()[:16]


M = "kanuka::mutants::"
BINARY = re.compile(r"(?<=[\w)\]]) ([+-]) (?=[\w(])")
PRODUCT = re.compile(r"(?<=[\w)\]]) \* (?=[\w(])")
FLOAT = re.compile(r"(?<![\w.])(\d+\.\d+f?|\d+e-?\d+f?)(?![\w.])")
OFFSET = re.compile(r"(?<=[\w)\]] [+-] )([12])(?![\w.])")
PI = re.compile(r"(?<![\w.:])(InvPi|Pi)(?!\w)")
LOOP = re.compile(r"for \([^;]*; \w+ < ([\w.>()-]+);")
CONDITION = re.compile(r"\b(if|select)\(|\bif \(")
CALL = re.compile(r"(?<![\w.>:])(?:std::|kanuka::)?(sqrt|max|min)\(")


def argument_end(text: str, start: int, stops: str) -> int:
    """Where the argument that begins at `start` ends; -1 if not on this line."""
    depth = 0
    for i in range(start, len(text)):
        if text[i] in "([{":
            depth += 1
        elif text[i] in ")]}":
            if depth == 0:
                return i if text[i] in stops else -1
            depth -= 1
        elif depth == 0 and text[i] in stops:
            return i
    return -1


def sites_of_line(text: str) -> list[tuple[int, int, str, str]]:
    """(column, length, rule, replacement) of each place that a rule fits."""
    found = []
    for m in BINARY.finditer(text):
        found.append((m.start(), 3, "sign", f" {m[1]} {M}Sign<{{id}}>() * "))
        found.append((m.start(), 3, "dropped term", f" {m[1]} {M}Term<{{id}}>() * "))
    for m in PRODUCT.finditer(text):
        found.append((m.start(), 3, "factor 2", f" * {M}Twice<{{id}}>() * "))
    for m in FLOAT.finditer(text):
        value = float(m[1].rstrip("f"))
        if 0 < value < 1e-4:  # keeps from dividing by nothing; twice that is as good
            continue
        other = f"{2 * value if value else 1.0!r}{'f' if m[1].endswith('f') else ''}"
        found.append((m.start(), len(m[1]), "constant", f"{M}pick<{{id}}>({m[1]}, {other})"))
    for m in PI.finditer(text):
        found.append((m.start(), len(m[1]), "factor pi", f"{M}pick<{{id}}>({m[1]}, decltype({m[1]} + 0)(1))"))
    for m in OFFSET.finditer(text):
        found.append((m.start(), 1, "off by one", f"{M}pick<{{id}}>({m[1]}, {int(m[1]) - 1})"))
    for m in LOOP.finditer(text):
        found.append((m.start(1), len(m[1]), "off by one", f"{m[1]} - {M}pick<{{id}}>(0, 1)"))
    for m in CONDITION.finditer(text):
        name = "if" if m[0].startswith("if") else "select"
        end = argument_end(text, m.end(), ")" if name == "if" else ",")
        inner = text[m.end() : end]
        if end > 0 and not re.search(r";|[^=!<>]=[^=]|constexpr", inner):
            found.append((m.end(), len(inner), "condition", f"{M}negate<{{id}}>({inner})"))
    for m in CALL.finditer(text):
        end = argument_end(text, m.end(), ")")
        inner = text[m.end() : end]
        if end > 0 and "{" not in inner and inner:
            name = {"sqrt": "root", "max": "larger", "min": "smaller"}[m[1]]
            rule = {"sqrt": "root", "max": "bound", "min": "bound"}[m[1]]
            found.append((m.start(), end - m.start(), rule, f"{M}{name}<{{id}}>({inner}"))
    return found


NO_MUTANTS = re.compile(r'"|^\s*#|constexpr|static_assert|\btemplate\b|\bcase\b|\busing\b|\benum\b|\bassert\(|operator')
TABLE = re.compile(r"^[\s\d.,{}ef+/-]*$")


def sites(folder: str) -> list[Mutant]:
    found = []
    for path in sorted((ROOT / "src" / folder).rglob("*")):
        name = str(path.relative_to(ROOT))
        if path.suffix not in (".cpp", ".h") or SKIPPED.search(name):
            continue
        alike = Counter()
        for number, line in enumerate(path.read_text().splitlines(), 1):
            code = line.split("//")[0]
            nth = alike[line.strip()]
            alike[line.strip()] += 1
            if NO_MUTANTS.search(code) or TABLE.match(code):
                continue
            for column, length, rule, template in sites_of_line(code):
                found.append(Mutant(folder, name, number, column, rule, length, template, line.strip(), nth))
    return found


def sample(folder: str, count: int, seed: int) -> list[Mutant]:
    """At most one a line; files by how many places they have; rules as evenly as there are places."""
    by_rule = defaultdict(list)
    for m in sites(folder):
        by_rule[m.rule].append(m)
    dice = random.Random(f"{folder} {seed}")
    for group in by_rule.values():
        dice.shuffle(group)
    chosen, lines = [], set()
    while len(chosen) < count and any(by_rule.values()):
        for rule in sorted(by_rule):
            while by_rule[rule] and len(chosen) < count:
                m = by_rule[rule].pop()
                if (m.file, m.line) not in lines:
                    lines.add((m.file, m.line))
                    chosen.append(m)
                    break
    return chosen


def run(command: list[str], **more) -> subprocess.CompletedProcess:
    return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **more)


def write_tree(mutants: dict[int, Mutant]) -> None:
    """The tracked files as they stand, with the mutants in; files that did not change keep their times."""
    listed = run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"], cwd=ROOT).stdout
    by_file = defaultdict(list)
    for number, m in mutants.items():
        by_file[m.file].append((number, m))
    wanted = {"src/base/mutants.h": HEADER.encode()}
    for name in filter(None, listed.split("\0")):
        if (ROOT / name).is_file():
            wanted[name] = (ROOT / name).read_bytes()
    for name, inside in by_file.items():
        lines = wanted[name].decode().split("\n")
        for number, m in inside:
            line = lines[m.line - 1]
            lines[m.line - 1] = line[: m.column] + m.template.replace("{id}", str(number)) + line[m.column + m.length :]
        wanted[name] = ('#include "base/mutants.h"\n#line 1\n' + "\n".join(lines)).encode()
    for name, content in wanted.items():
        target = TREE / name
        if not target.exists() or target.read_bytes() != content:
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(content)
            shutil.copymode(ROOT / name, target) if (ROOT / name).exists() else None


def build(mutants: dict[int, Mutant], targets: list[str], jobs: int) -> dict[int, Mutant]:
    """Builds with all that compile; returns those."""
    folder = TREE / "build"  # as in a checkout, so that a compiler cache knows what did not change
    for _ in range(12):
        write_tree(mutants)
        if not (folder / "build.ninja").exists():
            options = ["-DCMAKE_BUILD_TYPE=Release", "-DKANUKA_FEW_LANES=ON"]
            made = run(["cmake", "-S", str(TREE), "-B", str(folder), "-G", "Ninja", *options])
            if made.returncode:
                sys.exit(made.stdout)
        made = run(["ninja", "-C", str(folder), "-k", "0", f"-j{jobs}", *targets])
        if made.returncode == 0:
            return mutants
        where = set(re.findall(r"(src/[\w/.]+):(\d+):\d+:", made.stdout))
        bad = {n for n, m in mutants.items() if (m.file, str(m.line)) in where}
        if not bad:
            sys.exit(made.stdout[-4000:] + "\nmutate: the build fails, and at no mutant's line")
        print(f"  {len(bad)} do not compile and are left out", flush=True)
        mutants = {n: m for n, m in mutants.items() if n not in bad}
    sys.exit("mutate: too many mutants do not compile")


def command_of(test: str) -> list[str]:
    if test == "reference":
        return [str(ROOT / ".venv" / "bin" / "python"), "-m", "pytest", "-xq", *REFERENCE]
    return [str(TREE / "build" / "src" / test.split("_")[1] / test), "--gtest_fail_fast", "--gtest_brief=1"]


def environment(number: int) -> dict[str, str]:
    return {**os.environ, VARIABLE: str(number), "PYTHONPATH": str(TREE / "python")}


def make_tables(number: int, target: str) -> bool:
    """Builds with the tables that the mutant makes; false where it makes none, or not within five minutes."""
    TABLES.unlink(missing_ok=True)
    command = ["timeout", "300", "ninja", "-C", str(TREE / "build"), target]
    return run(command, env=environment(number)).returncode == 0


def try_tables(number: int, target: str, command: list[str], limit: float) -> tuple[str, str]:
    try:
        return try_mutant(0, command, limit) if make_tables(number, target) else ("killed", "no tables")
    finally:
        make_tables(0, target)


def try_mutant(number: int, command: list[str], limit: float) -> tuple[str, str]:
    try:
        done = run(command, cwd=TREE, env=environment(number), timeout=limit)
    except subprocess.TimeoutExpired:
        return "killed", "time limit"
    if done.returncode == 0:
        return "survived", ""
    patterns = (r"\[  FAILED  \] ([\w/.]+)", r"^FAILED (\S+)", r"(\w+\.cpp:\d+): Failure")
    names = (m[1] for p in patterns if (m := re.search(p, done.stdout, re.M)))
    return "killed", next(names, f"{Path(command[0]).name}: exit {done.returncode}")


def load(path: Path) -> dict:
    return json.loads(path.read_text()) if path.exists() else {}


def keep(results: dict) -> None:
    RESULTS.parent.mkdir(parents=True, exist_ok=True)
    fresh = RESULTS.with_suffix(".new")
    fresh.write_text(json.dumps(results, indent=1, sort_keys=True))
    fresh.replace(RESULTS)


def ask(test: str, mutants: list[Mutant], results: dict, jobs: int) -> None:
    target = "kanuka_native" if test == "reference" else test
    built = build(dict(enumerate(mutants, 1)), [target], jobs)
    command = command_of(test)
    started = time.monotonic()
    whole = run(command, cwd=TREE, env=environment(0))
    if whole.returncode:
        sys.exit(whole.stdout[-4000:] + "\nmutate: the tests fail without a mutant")
    limit = 4 * (time.monotonic() - started) + 30
    print(f"{test}: {len(built)} mutants built; the tests take {(limit - 30) / 4:.0f} s", flush=True)
    done = 0

    def note(mutant: Mutant, verdict: str, by: str) -> None:
        nonlocal done
        done += 1
        passed = results.get(mutant.key, {}).get("passed", [])
        if verdict == "survived":
            passed = sorted({*passed, test})
        results[mutant.key] = {**asdict(mutant), "verdict": verdict, "by": by, "passed": passed}
        keep(results)
        print(f"  {done}/{len(built)} {verdict} {mutant.file}:{mutant.line} {mutant.rule} {by}", flush=True)

    makers = {n: m for n, m in built.items() if MAKES_TABLES.search(m.file)}
    for number, mutant in makers.items():
        note(mutant, *try_tables(number, target, command, limit))
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        waiting = {pool.submit(try_mutant, n, command, limit): m for n, m in built.items() if n not in makers}
        for future in concurrent.futures.as_completed(waiting):
            note(waiting[future], *future.result())


def go_through(folder: str, args: argparse.Namespace) -> None:
    results = load(RESULTS)
    chosen = {m.key: m for m in sample(folder, args.count, args.seed)}
    if args.again:
        results = {k: r for k, r in results.items() if k not in chosen or r["verdict"] == "killed"}
    for test in TESTS[folder] + (["reference"] if args.reference else []):
        known = {k: results.get(k, {}) for k in chosen}
        left = [
            m
            for k, m in chosen.items()
            if known[k].get("verdict") != "killed" and test not in known[k].get("passed", [])
        ]
        print(f"{folder}, {test}: {len(left)} of {len(chosen)} mutants", flush=True)
        if left:
            ask(test, left, results, args.jobs)


def report(folders: list[str], as_json: bool) -> int:
    """The table, and exit 1 where a survivor has no reason."""
    accepted = load(ACCEPTED)
    results = {k: r for k, r in load(RESULTS).items() if r["folder"] in folders}
    count = defaultdict(Counter)
    survivors = []
    for key, r in sorted(results.items(), key=lambda kr: (kr[1]["file"], kr[1]["line"])):
        reason = accepted.get(key, {}).get("reason", "")
        verdict = "accepted" if r["verdict"] == "survived" and reason else r["verdict"]
        count[r["folder"]][verdict] += 1
        if r["verdict"] == "survived":
            survivors.append({"key": key, **r, "reason": reason})
    if as_json:
        print(json.dumps({"folders": count, "survivors": survivors}, indent=1))
    else:
        print(f"{'folder':<12}{'killed':>8}{'accepted':>10}{'survived':>10}{'killed of those that matter':>30}")
        for folder, c in count.items():
            share = c["killed"] / max(c["killed"] + c["survived"], 1)
            print(f"{folder:<12}{c['killed']:>8}{c['accepted']:>10}{c['survived']:>10}{share:>29.0%}")
        for s in survivors:
            print(
                f"{s['key']} {s['file']}:{s['line']} {s['rule']}\n    {s['code']}\n    {s['reason'] or 'no reason yet'}"
            )
    return any(not s["reason"] for s in survivors)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="*", choices=[*TESTS, []], help="of src/; default: all")
    parser.add_argument("--count", type=int, default=25, help="mutants a folder (25)")
    parser.add_argument("--seed", type=int, default=1, help="another number, other mutants (1)")
    parser.add_argument("--reference", action="store_true", help="also the reference scenes; builds the Python module")
    parser.add_argument("--again", action="store_true", help="try survivors again")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="compilers, and mutants at a time")
    parser.add_argument("--list", action="store_true", help="print the mutants and do nothing")
    parser.add_argument("--report", action="store_true", help="print what is known and do nothing")
    parser.add_argument("--json", action="store_true", help="the report as JSON")
    args = parser.parse_args()
    folders = args.folders or list(TESTS)
    if args.list:
        for folder in folders:
            for m in sample(folder, args.count, args.seed):
                print(f"{m.key} {m.file}:{m.line}:{m.column} {m.rule}\n    {m.code}\n    {m.template}")
        return 0
    if not args.report:
        for folder in folders:
            go_through(folder, args)
    return report(folders, args.json)


if __name__ == "__main__":
    sys.exit(main())
