"""kanuka shader: the shader compiler by itself."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

import kanuka

from . import exit_codes, shader_cache, shader_info, shader_run
from . import shader_source as sources
from .exit_codes import ExitCode, fail

EMITS = {
    "rsl": "the preprocessed source; for a graph, the shader made from it",
    "ast": "the syntax tree, with types",
    "ir": "the compiler's IR, uniform and varying, cut into regions",
    "c": "the same as C-like text",
    "llvm": "optimised LLVM IR",
    "asm": "assembly",
}
EXAMPLES = """\
examples:
  kanuka shader compile marble.sl
  kanuka shader compile marble.sl -I include -D DEBUG=1
  kanuka shader compile marble.sl --emit=c --stage prelighting     the code for each line
  kanuka shader compile graph.json --emit=rsl                      a network as a shader

"""
PUBLISH_EXAMPLES = """\
examples:
  kanuka shader publish marble.sl -I include           marble.slo, which needs no other file
  kanuka shader publish graph.json -o shaders/rust.slo

"""


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    parser = subparsers.add_parser("shader", help="work with shaders", description="Works with shaders.")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    compile_parser = commands.add_parser(
        "compile",
        help="compile a shader and list its parameters",
        description="Compiles a shader into the shader cache, as a render would, and lists its parameters. --emit "
        "shows the output of a stage of the compiler instead.",
        epilog=EXAMPLES + exit_codes.HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    sources.add_arguments(compile_parser)
    compile_parser.add_argument("--no-cache", action="store_true", help="compile even if the shader is in the cache")
    compile_parser.add_argument(
        "--emit", choices=EMITS, metavar="WHAT", help="; ".join(f"{name}: {text}" for name, text in EMITS.items())
    )
    compile_parser.add_argument(
        "--stage", choices=kanuka.shader_stages(), help="the stage that --emit shows; default: all"
    )
    sources.add_code_arguments(compile_parser)
    sources.add_language_arguments(compile_parser)
    compile_parser.add_argument(
        "-o", "--output", type=Path, metavar="FILE", help="for --emit; default: standard output"
    )
    compile_parser.set_defaults(run=run_compile, parser=compile_parser)

    publish_parser = commands.add_parser(
        "publish",
        help="make a .slo: a shader in one file",
        description="Writes a shader as NAME.slo: preprocessed, with all its includes, compressed. Scenes search for "
        "it like NAME.sl, and before it.",
        epilog=PUBLISH_EXAMPLES + exit_codes.HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    sources.add_arguments(publish_parser)
    publish_parser.add_argument("-o", "--output", type=Path, metavar="FILE.slo", help="default: beside the source")
    publish_parser.set_defaults(run=run_publish)
    for module in (shader_info, shader_run, shader_cache):
        module.add_parser(commands)


def run_compile(arguments: argparse.Namespace) -> int:
    if not arguments.emit and (arguments.stage or arguments.output):
        arguments.parser.error("--stage and -o belong to --emit")
    journal = kanuka.Journal()
    with sources.messages_shown(journal):
        given = sources.given(arguments)
        code = {"lanes": arguments.lanes, "opt_level": arguments.opt_level}
        if arguments.emit:
            text = kanuka.emit_shader(
                what=arguments.emit, stage=arguments.stage or "", **given, **code, journal=journal
            )
            write_text(arguments.output, text)
            return ExitCode.OK
        shader = kanuka.compile_shader(
            **given, **code, **sources.language(arguments), use_cache=not arguments.no_cache, journal=journal
        )
    print(f"{shader.kind} {shader.name}" + (" (from the cache)" if shader.from_cache else ""))
    for parameter in shader.parameters:
        print("  " + shader_info.parameter_text(parameter))
    return ExitCode.OK


def write_text(path: Path | None, text: str) -> None:
    if path is None:
        sys.stdout.write(text)
        return
    write_bytes(path, text.encode())


def write_bytes(path: Path, data: bytes) -> None:
    """Beside its name, then renamed: nobody sees half of it."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        temporary.write_bytes(data)
        os.replace(temporary, path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        fail(ExitCode.OUTPUT, f"{path}: {error.strerror}")


def run_publish(arguments: argparse.Namespace) -> int:
    output = arguments.output or arguments.file.with_suffix(".slo")
    if output == arguments.file:
        fail(ExitCode.USAGE, f"{output}: is published already; name another file with -o")
    journal = kanuka.Journal()
    with sources.messages_shown(journal):
        data = kanuka.publish_shader(**sources.given(arguments), journal=journal)
    write_bytes(output, data)
    print(output)
    return ExitCode.OK
