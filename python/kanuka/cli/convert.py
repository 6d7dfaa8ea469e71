"""kanuka convert: a RIB in another encoding, or of a scene of another format."""

from __future__ import annotations

import argparse

import kanuka
from kanuka import models, usd

from . import arguments as types
from . import exit_codes, files, messages, scenes
from .exit_codes import ExitCode

EXAMPLES = """\
examples:
  kanuka convert scene.rib scene.rib.gz               packed; .zst packs with zstd
  kanuka convert scene.rib small.rib --binary         RISpec's binary encodings
  kanuka convert small.rib -                          as canonical text, to standard output
  kanuka convert scene.rib one.rib --expand-archives  archives replace their ReadArchive
  kanuka convert shot.usd shot.rib --frame 7          the same picture; shaders go into shot_shaders/
  kanuka convert ball.obj ball.rib.gz                 models too, on their neutral stage

Canonical text has one request on each line, and the same values, comments and structure hints as its source.
Converting it again changes no byte. Anything that cannot be read is reported and left out.

"""


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    parser = subparsers.add_parser(
        "convert",
        help="write a RIB as text or binary, packed or not",
        description="Converts a RIB to text or binary, packed or not, without changing its content. Of a USD stage or "
        "a model it writes a RIB of the same picture.",
        epilog=EXAMPLES + exit_codes.HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("input", metavar="IN", help="RIB in any encoding, USD stage or model; - is standard input")
    parser.add_argument(
        "output", metavar="OUT", help="RIB file, packed if it ends in .gz or .zst; - is standard output"
    )
    parser.add_argument("--binary", action="store_true", help="RISpec's binary encodings; default: text")
    parser.add_argument("--gzip", action="store_true", help="pack with gzip, whatever the suffix of OUT")
    parser.add_argument("--zstd", action="store_true", help="pack with zstd, whatever the suffix of OUT")
    parser.add_argument("--expand-archives", action="store_true", help="replace ReadArchive by the archive")
    parser.add_argument("--frame", type=types.natural, metavar="N", help="of a stage; default: its first")
    scenes.add_arguments(parser)
    parser.set_defaults(run=run, parser=parser)


def run(arguments: argparse.Namespace) -> int:
    if arguments.gzip and arguments.zstd:
        arguments.parser.error("--gzip and --zstd: choose one")
    scenes.check(arguments, [arguments.input])
    files.check_output(arguments.output)
    packing = "gzip" if arguments.gzip else "zstd" if arguments.zstd else "auto"
    if scenes.is_read_whole(arguments.input):
        return write_scene(arguments, packing)
    if arguments.frame is not None:
        arguments.parser.error("--frame is for USD stages: a RIB is converted whole")
    journal = kanuka.convert_rib(
        arguments.input,
        arguments.output,
        binary=arguments.binary,
        packing=packing,
        expand_archives=arguments.expand_archives,
    )
    messages.Printer(journal).flush()
    return ExitCode.ERRORS if journal.error_count else ExitCode.OK


def write_scene(arguments: argparse.Namespace, packing: str) -> int:
    if arguments.output == "-" or arguments.expand_archives:
        beside = "OUT: name a file: the shaders of a stage or a model are written beside it"
        arguments.parser.error("--expand-archives is for RIB files" if arguments.expand_archives else beside)
    journal = kanuka.Journal()
    if models.is_model(arguments.input):
        models.convert(arguments.input, arguments.output, binary=arguments.binary, packing=packing, journal=journal)
    else:
        usd.convert(
            arguments.input,
            arguments.output,
            **scenes.choices(arguments, arguments.frame),
            binary=arguments.binary,
            packing=packing,
            journal=journal,
        )
    messages.Printer(journal).flush()
    return ExitCode.ERRORS if journal.error_count else ExitCode.OK
