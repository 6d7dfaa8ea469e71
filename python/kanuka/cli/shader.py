"""kanuka shader: the shader compiler by itself."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import kanuka

from . import exit_codes, messages
from .exit_codes import ExitCode

EXAMPLES = """\
examples:
  kanuka shader compile marble.sl
  kanuka shader compile marble.sl -I include -D DEBUG=1

"""


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    parser = subparsers.add_parser("shader", help="work with shaders", description="Works with shaders.")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    compile_parser = commands.add_parser(
        "compile",
        help="compile a shader, and say what it is",
        description="Compiles a shader as a render would, into the shader cache, and lists its parameters.",
        epilog=EXAMPLES + exit_codes.HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    compile_parser.add_argument("file", metavar="FILE.sl", type=Path)
    compile_parser.add_argument("-I", dest="include", action="append", default=[], metavar="DIR", help="for #include")
    compile_parser.add_argument("-D", dest="defines", action="append", default=[], metavar="NAME[=VALUE]", type=define)
    compile_parser.add_argument("--no-cache", action="store_true", help="compile even if the cache has it")
    compile_parser.set_defaults(run=run_compile)


def define(text: str) -> tuple[str, str]:
    name, separator, value = text.partition("=")
    if not name.isidentifier():
        raise argparse.ArgumentTypeError(f"expected NAME or NAME=VALUE, got {text!r}")
    return name, value if separator else "1"


def run_compile(arguments: argparse.Namespace) -> int:
    journal = kanuka.Journal()
    try:
        shader = kanuka.compile_shader(
            arguments.file,
            include=arguments.include,
            defines=dict(arguments.defines),
            use_cache=not arguments.no_cache,
            journal=journal,
        )
    except kanuka.Error as error:
        messages.Printer(journal).flush()
        if not journal.error_count:
            print(f"error: {error}", file=sys.stderr)
        return ExitCode.INPUT
    messages.Printer(journal).flush()
    print(f"{shader.kind} {shader.name}" + (" (from the cache)" if shader.from_cache else ""))
    for parameter in shader.parameters:
        print("  " + parameter_text(parameter))
    return ExitCode.OK


def parameter_text(parameter: dict) -> str:
    words = ["output"] * parameter["output"] + ["varying" if parameter["varying"] else "uniform", parameter["type"]]
    size = parameter["array_size"]
    text = " ".join(words) + " " + parameter["name"] + (f"[{size}]" if size else "")
    if parameter["default"] is not None:
        text += f" = {value_text(parameter['default'])}"
    return text + (f"  // {parameter['doc']}" if parameter["doc"] else "")


def value_text(value: object) -> str:
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, list):
        return "(" + ", ".join(map(value_text, value)) + ")"
    return f"{value:g}"
