"""kanuka doctor: does this installation work?"""

from __future__ import annotations

import argparse
import importlib.metadata
import json
import os
import shutil
import tempfile
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import kanuka
from kanuka import paths

from . import exit_codes, statistics
from .exit_codes import ExitCode
from .shader_cache import bytes_text

BALL = """surface doctor() { Ci = Cs * diffuse(normalize(N)); }
"""


@dataclass
class Finding:
    """`state`: good, missing (what some scenes need), bad (renders fail)."""

    name: str
    state: str
    text: str
    mend: str = ""


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    parser = subparsers.add_parser(
        "doctor",
        help="check this installation",
        description="Checks that this installation works: the machine, shaders and their compiler, a small picture, "
        "folders of caches, packages for other formats. Exits with 3 where something is bad.",
        epilog=exit_codes.HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    found = [machine(), shaders(), compiler(), picture(), *map(cache, CACHES), *map(package, PACKAGES)]
    bad = any(finding.state == "bad" for finding in found)
    if arguments.json:
        told = {"version": kanuka.__version__, "good": not bad, "findings": [asdict(finding) for finding in found]}
        print(json.dumps(told, indent=2))
    else:
        print(f"kanuka {kanuka.__version__}, {Path(kanuka.__file__).parent}")
        for finding in found:
            print(f"{finding.state:>8}  {finding.name}: {finding.text}" + (f". {finding.mend}" if finding.mend else ""))
    return ExitCode.ERRORS if bad else ExitCode.OK


def machine() -> Finding:
    about = statistics.machine()
    memory = bytes_text(int(str(about["memory_bytes"])))
    text = f"{about['processor']}, {about['threads']} threads, {memory}, {about['system']}"
    return Finding("machine", "good", text)


def shaders() -> Finding:
    folder = Path(paths.standard_shaders())
    count = len(list(folder.glob("*.sl")))
    if count:
        return Finding("standard shaders", "good", f"{count} in {folder}")
    return Finding("standard shaders", "bad", f"there are none in {folder}", "Install again, or unset KANUKA_SHADERS")


def tried(name: str, mend: str, work: Callable[[Path], str]) -> Finding:
    with tempfile.TemporaryDirectory() as folder:
        try:
            return Finding(name, "good", work(Path(folder)))
        except Exception as error:  # whatever it is, the next check goes on
            return Finding(name, "bad", f"{type(error).__name__}: {error}", mend)


def compiler() -> Finding:
    def work(folder: Path) -> str:
        (folder / "doctor.sl").write_text(BALL)
        made = kanuka.compile_shader(folder / "doctor.sl", use_cache=False)
        return f"{made.kind} {made.name} compiles"

    return tried("shader compiler", "Report it with this text", work)


def picture() -> Finding:
    def work(folder: Path) -> str:
        (folder / "ball.rib").write_text(
            'Format 32 18 1 Projection "perspective" Translate 0 0 3 WorldBegin LightSource "distantlight" 1 '
            'Surface "matte" Sphere 1 -1 1 360 WorldEnd\n'
        )
        rendered = kanuka.render(kanuka.load(folder / "ball.rib"), progressions=2)
        rendered.write(folder / "ball.exr")
        if not 0.02 < float(kanuka.read(folder / "ball.exr")["rgb"].mean()) < 1:
            raise ValueError("a ball under a lamp does not look like one")
        return f"{rendered.width} × {rendered.height} pixels of a lit ball"

    return tried("picture", "Report it with this text", work)


CACHES = (
    ("shader cache", "KANUKA_SHADER_CACHE", lambda: kanuka.shader_cache_folder()),
    ("texture cache", "KANUKA_TEXTURE_CACHE", lambda: kanuka.texture_cache_folder()),
    ("store", "KANUKA_STORE", lambda: os.environ.get("KANUKA_STORE", "")),
)


def cache(which: tuple[str, str, Callable[[], str]]) -> Finding:
    name, variable, folder_of = which
    folder = folder_of()
    if not folder:
        return Finding(name, "good", f"none; {variable} names one")
    try:
        Path(folder).mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        return Finding(name, "missing", f"{folder} cannot be written ({error.strerror})", f"Set {variable}")
    return Finding(name, "good", f"{folder}, {bytes_text(shutil.disk_usage(folder).free)} free")


PACKAGES = (
    ("USD stages", "usd", ("usd-exchange", "MaterialX")),
    ("colour configurations", "usd", ("opencolorio",)),
    ("models", "models", ("trimesh", "pillow")),
)


def package(which: tuple[str, str, tuple[str, ...]]) -> Finding:
    name, extra, needed = which
    there, missing = [], []
    for distribution in needed:
        try:
            there.append(f"{distribution} {importlib.metadata.version(distribution)}")
        except importlib.metadata.PackageNotFoundError:
            missing.append(distribution)
    if missing:
        return Finding(name, "missing", f"no {', '.join(missing)}", f"pip install 'kanuka[{extra}]'")
    return Finding(name, "good", ", ".join(there))
