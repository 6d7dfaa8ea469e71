"""kanuka store export: simple models of scenes, for other programs."""

from __future__ import annotations

import argparse
import json
import sys
import time

import kanuka
from kanuka import proxies

from . import arguments as types
from . import exit_codes, files, messages, scenes
from .exit_codes import ExitCode
from .progress import ProgressBar, duration
from .shader_cache import bytes_text

EXAMPLES = """\
examples:
  kanuka store export shot.rib --proxy shot.ply --faces 20000      for a viewer, a layout
  kanuka store export shot.usd --proxy shot.usda --error 0.01      off by a hundredth; instances stay instances
  kanuka store export shot.rib --proxy shot.obj --store DIR        what renders have stored is not made again

"""


def add_parser(actions: argparse._SubParsersAction) -> None:
    about = "write the surfaces of a scene as a simple model with colours"
    parser = actions.add_parser(
        "export",
        help=about,
        description="Writes what a scene's primitives are diced and displaced to as OBJ, PLY or USD: triangles, as few "
        "as are asked for, with the albedo of the materials at each vertex. What is in the store is taken from there.",
        epilog=EXAMPLES + exit_codes.HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("scene", metavar="SCENE", help="RIB file, USD stage or model; - is standard input")
    parser.add_argument(
        "--proxy", metavar="OUT", required=True, help=f"file to write: {', '.join(f'*{s}' for s in proxies.SUFFIXES)}"
    )
    many = parser.add_mutually_exclusive_group()
    many.add_argument(
        "--faces", type=types.natural, metavar="N", help=f"so many at most; 0 = all; default: {proxies.FACES}"
    )
    many.add_argument(
        "--error", type=types.positive_float, metavar="E", help="in place of it: how far surfaces may be off, in units"
    )
    parser.add_argument(
        "--most-faces",
        type=types.positive_int,
        metavar="N",
        default=proxies.MOST,
        help="of OBJ and PLY, which have a copy for each instance: those beyond are left out; default: %(default)s",
    )
    parser.add_argument("--frame", type=types.natural, metavar="N", help="of the scene; default: its first")
    parser.add_argument(
        "--resolution", type=types.resolution, metavar="WxH", help="of the picture that surfaces are diced for"
    )
    parser.add_argument("--shading-rate", type=types.positive_float, metavar="R", help="factor for micropolygon areas")
    parser.add_argument("--threads", type=types.positive_int, metavar="N", help="default: all cores")
    parser.add_argument("--store", metavar="DIR", help="as of kanuka render; default: KANUKA_STORE")
    parser.add_argument("--store-mode", choices=("read", "write"), help="read: add nothing to it; default: write")
    parser.add_argument("--no-programs", action="store_true", help="do not run programs that make geometry")
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.add_argument("-q", "--quiet", action="store_true", help="no progress")
    scenes.add_arguments(parser)
    parser.set_defaults(run=run, parser=parser)


def run(arguments: argparse.Namespace) -> int:
    started = time.monotonic()
    scenes.check(arguments, [arguments.scene])
    files.check_output(arguments.proxy, proxies.SUFFIXES, "simple models")
    bar = ProgressBar(quiet=arguments.quiet)
    bar.update("ingest", 0)
    scene = load(arguments)
    printer = messages.Printer(scene.journal)
    bar.between = printer.flush
    bar.finish()
    try:
        done = proxies.export(
            scene,
            arguments.proxy,
            faces=arguments.faces,
            error=arguments.error,
            most_faces=arguments.most_faces,
            progress=bar.update,
            journal=scene.journal,
            resolution=arguments.resolution,
            shading_rate=arguments.shading_rate,
            threads=arguments.threads,
            store=arguments.store,
            store_mode=arguments.store_mode,
        )
    finally:
        bar.finish()
        printer.flush()
    if arguments.json:
        print(json.dumps(done, indent=2))
    else:
        size = bytes_text(done["bytes"])
        print(
            f"{done['faces']} of {done['faces_before']} faces, off by {done['error']:.3g} at most, of "
            f"{done['primitives']} primitives in {size}: {arguments.proxy}"
        )
        if not arguments.quiet:
            print(duration(time.monotonic() - started), file=sys.stderr)
    return ExitCode.ERRORS if scene.journal.error_count else ExitCode.OK


def load(arguments: argparse.Namespace) -> kanuka.Scene:
    if scenes.is_read_whole(arguments.scene):
        return scenes.load(arguments.scene, arguments, arguments.frame)
    return kanuka.load(
        arguments.scene,
        frame=arguments.frame or 0,
        run_programs=not arguments.no_programs,
        journal=kanuka.Journal(),
    )
