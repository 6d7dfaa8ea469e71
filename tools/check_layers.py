"""Checks the layer rule over the include graph of src/, include/ and plugins/.

A folder includes only from folders of a lower number, never from another one of its own number; files never include
each other in a circle; some third-party libraries are seen in one folder alone; what files call an option or attribute
is known to ingest alone. Prints "file:line: what, and what would
do" for every breach and exits 1; prints a summary and exits 0 otherwise.
"""

from __future__ import annotations

import argparse
import re
import sys
from dataclasses import dataclass
from pathlib import Path

LEVELS: dict[str, int] = {
    folder: level
    for level, folders in enumerate(
        (
            ("base",),
            ("color", "scene", "grid", "hierarchy"),
            ("geom", "sl", "ingest"),
            ("dice", "shade", "store"),
            ("bvh", "bsdf"),
            ("transport", "film"),
            ("render",),
            ("gpu", "python", "ri"),
        )
    )
    for folder in folders
}

# Plug-ins stand apart: they see the public headers and these folders, never each other.
PLUGIN_FOLDERS = ("bsdf", "transport")

# Third-party headers, by the first part of their path, and the folders under src/ that may see them.
RESTRICTED: dict[str, tuple[str, ...]] = {
    "llvm": ("sl/codegen",),
    "llvm-c": ("sl/codegen",),
    "embree3": ("bvh",),
    "embree4": ("bvh",),
    "OpenImageIO": ("shade", "film"),
    "nanobind": ("python",),
    "Python.h": ("python",),
}

SUFFIXES = {".h", ".hpp", ".cpp", ".cc", ".inl", ".cu"}
# Options and attributes that no table declares, by the names that files have.
USER_SETTING = re.compile(r'\buser\s*\.\s*(?:find|get_\w+)\(\s*"([^"]*)"')
INCLUDE = re.compile(r'^\s*#\s*include\s*(?:"([^"]+)"|<([^>]+)>)')


@dataclass(frozen=True)
class Include:
    path: str
    quoted: bool
    line: int


@dataclass(frozen=True)
class Breach:
    file: Path
    line: int
    message: str

    def __str__(self) -> str:
        return f"{self.file}:{self.line}: {self.message}"


def includes_of(file: Path) -> list[Include]:
    found = []
    for number, text in enumerate(file.read_text(encoding="utf-8", errors="replace").splitlines(), 1):
        if match := INCLUDE.match(text):
            found.append(Include(match[1] or match[2], match[1] is not None, number))
    return found


class Checker:
    def __init__(self, root: Path) -> None:
        self.root = root
        self.breaches: list[Breach] = []
        self.graph: dict[Path, list[tuple[Path, int]]] = {}

    def run(self) -> list[Breach]:
        for top in ("src", "include", "plugins"):
            for file in sorted((self.root / top).rglob("*")):
                if file.suffix in SUFFIXES and file.is_file():
                    self.check_file(file.relative_to(self.root))
        self.check_cycles()
        return sorted(self.breaches, key=lambda b: (b.file, b.line))

    def check_file(self, file: Path) -> None:
        edges = self.graph.setdefault(file, [])
        if file.parts[0] == "src" and len(file.parts) > 2 and file.parts[1] not in LEVELS:
            self.breach(
                file,
                1,
                f"folder src/{file.parts[1]} has no level; declare it in LEVELS of tools/check_layers.py",
            )
        self.check_settings(file)
        for include in includes_of(self.root / file):
            self.check_restricted(file, include)
            target = self.resolve(file, include)
            if target is not None:
                edges.append((target, include.line))
                self.check_edge(file, target, include.line)

    def resolve(self, file: Path, include: Include) -> Path | None:
        """The file of this repository that is meant, relative to its root; None = somebody else's."""
        tops = [Path("src"), Path("include")]
        for base in [file.parent, *tops] if include.quoted else tops:
            candidate = self.root / base / include.path
            if candidate.is_file():
                return Path(candidate.resolve().relative_to(self.root.resolve()))
        return None

    def check_restricted(self, file: Path, include: Include) -> None:
        allowed = RESTRICTED.get(include.path.split("/")[0])
        if allowed is None or any(file.is_relative_to(Path("src") / folder) for folder in allowed):
            return
        where = " and ".join(f"src/{folder}" for folder in allowed)
        self.breach(
            file,
            include.line,
            f"<{include.path}> may be seen in {where} only; go through that folder's header",
        )

    def check_settings(self, file: Path) -> None:
        if file.is_relative_to(Path("src/ingest")) or file.stem.endswith("_test"):
            return
        for number, text in enumerate((self.root / file).read_text(encoding="utf-8", errors="replace").splitlines(), 1):
            if match := USER_SETTING.search(text):
                self.breach(
                    file,
                    number,
                    f'"{match[1]}" is a name of RIB; read it in src/ingest/rib/dialects into a field of the scene, '
                    "or declare it in src/scene/schema",
                )

    def check_edge(self, file: Path, target: Path, line: int) -> None:
        if file.parts[0] == "plugins":
            self.check_plugin_edge(file, target, line)
            return
        if target.parts[0] == "plugins":
            self.breach(file, line, f"{target} is a plug-in; nothing includes a plug-in")
            return
        if file.parts[0] == "include":
            if target.parts[0] != "include":
                self.breach(file, line, f"a public header includes {target}; it may see include/ only")
            return
        if target.parts[0] == "include":
            return
        user, used = file.parts[1], target.parts[1]
        if user == used or user not in LEVELS or used not in LEVELS:
            return
        if LEVELS[used] > LEVELS[user]:
            self.breach(
                file,
                line,
                f"{user} ({LEVELS[user]}) includes {target} of {used} ({LEVELS[used]}), a higher level",
            )
        elif LEVELS[used] == LEVELS[user]:
            self.breach(file, line, f"{user} includes {target} of {used}, a folder of its own level {LEVELS[user]}")

    def check_plugin_edge(self, file: Path, target: Path, line: int) -> None:
        if target.parts[0] == "include" or target == file:
            return
        if target.parts[0] == "src" and target.parts[1] in PLUGIN_FOLDERS:
            return
        folders = " and ".join(f"src/{folder}" for folder in PLUGIN_FOLDERS)
        self.breach(file, line, f"a plug-in includes {target}; it may see include/, {folders} only")

    def check_cycles(self) -> None:
        """Depth-first search; a file found again while it is still open closes a circle."""
        state: dict[Path, int] = {}  # 1 = open, 2 = done

        def visit(file: Path, trail: list[Path]) -> None:
            state[file] = 1
            for target, line in self.graph.get(file, []):
                if state.get(target) == 1:
                    circle = [*trail[trail.index(target) :], target]
                    self.breach(file, line, "include circle: " + " -> ".join(map(str, circle)))
                elif target not in state:
                    visit(target, [*trail, target])
            state[file] = 2

        for file in self.graph:
            if file not in state:
                visit(file, [file])

    def breach(self, file: Path, line: int, message: str) -> None:
        self.breaches.append(Breach(file, line, message))


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("root", nargs="?", type=Path, default=Path(__file__).resolve().parent.parent)
    checker = Checker(parser.parse_args(arguments).root)
    breaches = checker.run()
    for breach in breaches:
        print(breach)
    edges = sum(len(targets) for targets in checker.graph.values())
    print(f"layers: {len(checker.graph)} files, {edges} includes, {len(breaches)} breaches")
    return 1 if breaches else 0


if __name__ == "__main__":
    sys.exit(main())
