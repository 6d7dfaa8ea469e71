"""kanuka paths: where what ships lies."""

from __future__ import annotations

import argparse
import shlex

from kanuka import paths

from .exit_codes import ExitCode

FOLDERS = {"shaders": paths.standard_shaders, "include": paths.include_dir, "library": paths.library_dir}


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    parser = subparsers.add_parser(
        "paths",
        help="say where shaders, ri.h and libkanuka are",
        description="Says where the standard shaders, ri.h and libkanuka are.",
        epilog="examples:\n  kanuka paths\n  ls $(kanuka paths shaders)\n  cc program.c $(kanuka paths flags) -lm\n",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "which", nargs="?", choices=(*FOLDERS, "flags"), help="this one alone; flags: those of a C compiler"
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    if arguments.which == "flags":
        print(shlex.join(paths.compiler_flags()))
    elif arguments.which:
        print(FOLDERS[arguments.which]())
    else:
        for name, folder in FOLDERS.items():
            print(f"{name:<10}{folder()}")
    return ExitCode.OK
