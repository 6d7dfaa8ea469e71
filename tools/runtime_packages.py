#!/usr/bin/env python3
"""Which Debian packages an installed wheel needs: those of the libraries that the compiled parts name.

tools/runtime_packages.py prints the rows of PACKAGES in python/kanuka/system_libraries.py, for the module and libkanuka
of this checkout, or for the files given. Libraries that those libraries need come by their packages.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
OF_EVERY_PYTHON = {"libc6", "libstdc++6", "libgcc-s1"}  # what any compiled module needs


def output(*command: object) -> str:
    return subprocess.run([str(part) for part in command], capture_output=True, text=True, check=True).stdout


def built() -> list[Path]:
    build = Path(os.environ.get("KANUKA_BUILD", ROOT / "build"))
    return [*sorted((ROOT / "python/kanuka").glob("_native*.so")), *build.glob("src/ri/libkanuka.so")]


def package_of(library: str) -> str:
    real = os.path.realpath(library)  # first: a link may be of the package for developers
    for path in dict.fromkeys(
        (real, real.removeprefix("/usr"), library, library.removeprefix("/usr"), f"/usr{library}")
    ):
        found = subprocess.run(["dpkg-query", "--search", path], capture_output=True, text=True)
        if found.returncode == 0:
            return re.split(r"[:,]", found.stdout)[0]
    raise LookupError(f"{library} is of no Debian package")


def needed(files: list[Path]) -> dict[str, str]:
    """Library: package, for what the files themselves name."""
    packages = {}
    for file in files:
        names = re.findall(r"\(NEEDED\).*\[(.*)\]", output("readelf", "--dynamic", "--wide", file))
        places = dict(re.findall(r"^\s*(\S+) => (\S+)", output("ldd", file), re.MULTILINE))
        for name in names:
            if name in places and (package := package_of(places[name])) not in OF_EVERY_PYTHON:
                packages[name] = package
    return dict(sorted(packages.items()))


if __name__ == "__main__":
    for library, package in needed([Path(name) for name in sys.argv[1:]] or built()).items():
        print(f'    "{library}": "{package}",')
