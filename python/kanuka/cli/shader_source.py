"""What the shader commands have in common: a shader's file, how it is read, what is said of it."""

from __future__ import annotations

import argparse
import difflib
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import kanuka
from kanuka.paths import standard_shaders

from . import arguments as types
from . import files, messages
from .exit_codes import ExitCode, fail


def define(text: str) -> tuple[str, str]:
    name, separator, value = text.partition("=")
    if not name.isidentifier():
        raise argparse.ArgumentTypeError(f"expected NAME or NAME=VALUE, got {text!r}")
    return name, value if separator else "1"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    text = "NAME.sl, NAME.slo, a graph (NAME.json), or the name of a shader that ships"
    parser.add_argument("file", metavar="FILE", type=Path, help=text)
    parser.add_argument("-I", dest="include", action="append", default=[], metavar="DIR", help="folder for #include")
    parser.add_argument("-D", dest="defines", action="append", default=[], metavar="NAME[=VALUE]", type=define)


def add_code_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--lanes", type=int, choices=(0, 1, 8, 16), default=0, help="SIMD lanes; 0 = the widest")
    parser.add_argument(
        "-O", dest="opt_level", type=int, choices=(0, 1, 2, 3), default=2, help="optimisation; default: 2"
    )


def add_language_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--strict-directions",
        action="store_true",
        help="an operation that no material can represent is an error at its line; default: it is approximated",
    )
    parser.add_argument(
        "--array-room",
        type=types.positive_int,
        default=64,
        metavar="N",
        help="size of an array that grows in a loop of unknown length; default: 64",
    )
    parser.add_argument(
        "--coshader",
        action="append",
        default=[],
        metavar="HANDLE=FILE",
        type=coshader,
        help="a shader that this one may call",
    )
    parser.add_argument(
        "--connect",
        action="append",
        default=[],
        metavar="PARAMETER=HANDLE[,HANDLE]",
        type=connection,
        help="a parameter that names co-shaders; HANDLE.PARAMETER for a co-shader's parameter",
    )


def coshader(text: str) -> tuple[str, Path]:
    handle, separator, file = text.partition("=")
    if not separator or not handle:
        raise argparse.ArgumentTypeError(f"expected HANDLE=FILE, got {text!r}")
    return handle, find(Path(file))


def connection(text: str) -> tuple[str, list[str]]:
    parameter, separator, handles = text.partition("=")
    if not separator or not parameter:
        raise argparse.ArgumentTypeError(f"expected PARAMETER=HANDLE, got {text!r}")
    return parameter, handles.split(",")


def language(arguments: argparse.Namespace) -> dict[str, object]:
    """What kanuka.compile_shader takes of add_language_arguments()."""
    return {
        "strict_directions": arguments.strict_directions,
        "array_room": arguments.array_room,
        "coshaders": dict(arguments.coshader),
        "connections": dict(arguments.connect),
    }


def find(path: Path) -> Path:
    """The file itself; a name alone is NAME.slo or NAME.sl here, or a shader that ships."""
    if path.suffix or path.exists():
        return path
    candidates = [path.with_name(path.name + suffix) for suffix in (".slo", ".sl")]
    candidates.append(Path(standard_shaders()) / f"{path.name}.sl")
    return next((c for c in candidates if c.exists() and not is_foreign(c)), path)


def is_foreign(path: Path) -> bool:
    """Other renderers call their compiled shaders .slo, too."""
    if path.suffix != ".slo":
        return False
    with path.open("rb") as file:
        return file.read(6) != b"KNKSLO"


def given(arguments: argparse.Namespace) -> dict[str, object]:
    """The shader as kanuka.compile_shader and its like take it; a graph becomes its shader's text."""
    path = find(arguments.file)
    if not path.suffix and not path.exists():
        shipped = sorted(file.stem for file in Path(standard_shaders()).glob("*.sl"))
        near = difflib.get_close_matches(path.name, shipped, 1)
        hint = f"did you mean {near[0]}?" if near else "name a file, or one of " + ", ".join(shipped)
        fail(ExitCode.INPUT, f"{path}: there is no such shader, here or among those that ship; {hint}")
    files.check_input(path, "a shader")
    source = kanuka.ShaderGraph.load(path).to_rsl() if path.suffix == ".json" else None
    return {
        "path": path,
        "source": source,
        "include": arguments.include,
        "defines": dict(arguments.defines),
    }


@contextmanager
def messages_shown(journal: kanuka.Journal) -> Iterator[None]:
    """Prints what the compiler says; an error that it has told already is not told again."""
    try:
        yield
    except kanuka.Error as error:
        messages.Printer(journal).flush()
        if not journal.error_count:
            for line in getattr(error, "problems", [str(error)]):
                where = f"{error.file}: " if hasattr(error, "problems") and error.file else ""
                print(f"error: {where}{line}", file=sys.stderr)
        raise SystemExit(error.exit_code) from None
    messages.Printer(journal).flush()
