"""Files that a command names, looked at before the work: what is wrong with them, and what would do."""

from __future__ import annotations

import difflib
import os
from pathlib import Path

from .exit_codes import ExitCode, fail


def check_input(path: str | Path, what: str) -> None:
    """`what` is it: "a scene", "a picture". Standard input is -."""
    if str(path) == "-":
        return
    path = Path(path)
    if path.is_dir():
        fail(ExitCode.INPUT, f"{path}: is a folder; name {what} in it")
    if path.exists():
        if not os.access(path, os.R_OK):
            fail(ExitCode.INPUT, f"{path}: may not be read; its permissions forbid it")
        return
    if not path.parent.is_dir():
        fail(ExitCode.INPUT, f"{path}: there is no folder {path.parent}")
    names = sorted(entry.name for entry in path.parent.iterdir())
    near = [n for n in names if n.startswith(path.name + ".")] or difflib.get_close_matches(path.name, names, 1)
    hint = f"; did you mean {path.with_name(near[0])}?" if near else f"; name {what} that is there"
    fail(ExitCode.INPUT, f"{path}: there is no such file{hint}")


def check_output(path: str | Path, suffixes: tuple[str, ...] = (), what: str = "files") -> None:
    """A file that is to be written. `suffixes`: what there are; empty = any."""
    if str(path) == "-":
        return
    path = Path(path)
    if path.is_dir():
        fail(ExitCode.OUTPUT, f"{path}: is a folder; name a file in it")
    if suffixes and path.suffix not in suffixes:
        fail(ExitCode.USAGE, f"{path}: {what} are written as {' or '.join(suffixes)}")
    if not path.parent.is_dir():
        fail(ExitCode.OUTPUT, f"{path}: there is no folder {path.parent}; make it first")
    if not os.access(path.parent, os.W_OK):
        fail(ExitCode.OUTPUT, f"{path}: the folder {path.parent} may not be written to; name another one")


PICTURES = (".exr", ".png")
