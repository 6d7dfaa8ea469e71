"""The `kanuka` command: one module for each subcommand, with add_parser(subparsers) and run(arguments)."""

from __future__ import annotations

import argparse
import os
import sys
import traceback

import kanuka

from . import (
    compare,
    completion,
    convert,
    doctor,
    exit_codes,
    info,
    merge,
    paths,
    render,
    shader,
    store,
    texture,
    texture_cache,
)
from .exit_codes import ExitCode

EXAMPLES = """\
examples:
  kanuka render scene.rib                      render to the scene's Display, or scene.exr
  kanuka render scene.rib -o a.exr --png       a.exr, and a.png beside it
  kanuka render scene.rib --progressions 16 --resolution 320x180   a quick look
  kanuka merge a.state b.state -o a.exr        one picture of what two hosts have rendered
  kanuka info scene.rib                        show what a scene contains
  kanuka convert scene.rib scene.rib.gz        the same scene, packed
  kanuka compare a.exr reference.exr           how much two pictures differ
  kanuka texture wood.png wood.tx              a mip-mapped texture of a picture
  kanuka shader compile marble.sl              check a shader
  kanuka store info DIR                        what `render --store DIR` has kept
  kanuka store export scene.rib --proxy a.ply  surfaces with colours, for other programs
  kanuka paths                                 where shaders, ri.h and libkanuka are
  kanuka doctor                                does this installation work?

"""


def make_parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="kanuka",
        description="Kanuka, a production renderer that shades before it traces.",
        epilog=EXAMPLES + exit_codes.HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"kanuka {kanuka.__version__}")
    subparsers = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for module in (
        render,
        merge,
        info,
        convert,
        compare,
        texture,
        texture_cache,
        shader,
        store,
        paths,
        doctor,
        completion,
    ):
        module.add_parser(subparsers)
    return parser


def main(arguments: list[str] | None = None) -> int:
    parsed = make_parser().parse_args(arguments)
    try:
        return parsed.run(parsed)
    except kanuka.Error as error:
        print(f"error: {error}", file=sys.stderr)
        return error.exit_code
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return ExitCode.INTERRUPTED
    except BrokenPipeError:  # the reader of our output went away
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return ExitCode.OUTPUT
    except Exception:
        traceback.print_exc()
        print("error: the above is a defect of Kanuka; please report it with the scene", file=sys.stderr)
        return ExitCode.INTERNAL
