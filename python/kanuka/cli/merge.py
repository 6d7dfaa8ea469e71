"""kanuka merge: parts of a picture that several hosts have rendered become one."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import kanuka

from . import exit_codes, files
from .exit_codes import ExitCode, fail
from .shader_cache import bytes_text

EXAMPLES = """\
examples:
  kanuka render shot.rib --part 0-255 --checkpoint a.state        on one host
  kanuka render shot.rib --part 256-511 --checkpoint b.state      on another
  kanuka merge a.state b.state -o shot.exr                        the picture, as one host would have made it
  kanuka merge a.state b.state --checkpoint all.state             a checkpoint, which kanuka render goes on from
  kanuka merge *.state --json                                     what is there, and which parts are missing?

"""


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    parser = subparsers.add_parser(
        "merge",
        help="join parts of a picture that several hosts have rendered",
        description="Joins checkpoints of parts of one picture (kanuka render --part), in any order: the bits are as "
        "if one host had rendered all of it. The scene is not needed. Without --output and --checkpoint it tells what "
        "the files have and what is missing.",
        epilog=EXAMPLES + exit_codes.HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE", help="a checkpoint")
    parser.add_argument(
        "-o", "--output", type=Path, metavar="FILE.exr", help="the picture, .exr with all its layers or .png"
    )
    parser.add_argument("--png", action="store_true", help="write a PNG beside the EXR")
    parser.add_argument("--checkpoint", type=Path, metavar="FILE", help="write all samples to a checkpoint")
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    for path in arguments.files:
        files.check_input(path, "a checkpoint")
    if arguments.output:
        files.check_output(arguments.output, files.PICTURES, "pictures")
    if arguments.checkpoint:
        files.check_output(arguments.checkpoint)
    if arguments.png and not arguments.output:
        fail(ExitCode.USAGE, "--png: beside which picture? Name it by --output")
    parts = [kanuka.checkpoint_info(path) for path in arguments.files]
    report = {"files": [described(part) for part in parts], "missing": missing(parts), "written": [], "error": None}
    code = ExitCode.OK
    if arguments.output or arguments.checkpoint:
        try:
            report["written"] = [str(path) for path in merge(arguments)]
        except kanuka.Error as error:
            report["error"], code = str(error), error.exit_code
    if arguments.json:
        print(json.dumps(report, indent=2))
    elif report["written"]:
        print("\n".join(report["written"]))
    elif not report["error"]:
        print(table(report))
    if report["error"]:
        print(f"error: {report['error']}", file=sys.stderr)
    return code


def merge(arguments: argparse.Namespace) -> list[Path]:
    joined = kanuka.merge(arguments.files)
    # Of what cannot be a picture no file is written.
    picture = joined.picture() if arguments.output else None
    written = []
    if arguments.checkpoint:
        joined.save(arguments.checkpoint)
        written.append(arguments.checkpoint)
    if picture:
        for path in [arguments.output, *([arguments.output.with_suffix(".png")] if arguments.png else [])]:
            if path not in written:
                picture.write(path)
                written.append(path)
    return written


def described(part: dict) -> dict:
    return {
        "file": part["file"],
        "part": text_of(part["first"], part["end"]),
        "progressions": part["end"] - part["first"],
        "under_way": part["under_way_to"] > part["end"],
        "picture": part["key"],
        "resolution": part["resolution"],
        "adaptive": part["adaptive"],
        "bytes": part["bytes"],
    }


def text_of(first: int, end: int) -> str:
    """As --part takes it; empty where there is none."""
    return f"{first}-{end - 1}" if end > first else ""


def missing(parts: list[dict]) -> list[str]:
    """Progressions from 0 to the last that is there, which are in no file."""
    gaps, end = [], 0
    for part in sorted(parts, key=lambda part: part["first"]):
        if part["end"] > part["first"]:
            gaps += [text_of(end, part["first"])] if part["first"] > end else []
            end = max(end, part["end"])
    return gaps


def table(report: dict) -> str:
    pictures = {part["picture"] for part in report["files"]}
    lines = [
        f"{part['part'] or 'nothing':>12}  {bytes_text(part['bytes']):>10}  {part['file']}"
        + (f"  picture {part['picture'][:8]}" if len(pictures) > 1 else "")
        for part in report["files"]
    ]
    if len(pictures) > 1:
        lines.append(f"these are of {len(pictures)} pictures")
    else:
        lines.append("missing: " + (", ".join(report["missing"]) or "nothing up to the last"))
    return "\n".join(lines)
