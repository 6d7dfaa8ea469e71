"""kanuka compare: how much two pictures differ."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import kanuka

from . import exit_codes, files
from .exit_codes import ExitCode


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    parser = subparsers.add_parser(
        "compare",
        help="show how much two pictures differ",
        description="Compares the colours of two EXR pictures of the same size. B is the reference.",
        epilog="examples:\n  kanuka compare a.exr reference.exr\n  kanuka compare a.exr b.exr --json -o flip.png\n\n"
        + exit_codes.HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("a", metavar="A.exr", type=Path)
    parser.add_argument("b", metavar="B.exr", type=Path)
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.add_argument("-o", "--output", type=Path, metavar="DIFF.png", help="write the FLIP map, .png or .exr")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    for picture in (arguments.a, arguments.b):
        files.check_input(picture, "a picture")
    if arguments.output:
        files.check_output(arguments.output, files.PICTURES, "pictures")
    result = kanuka.compare(kanuka.read(arguments.a), kanuka.read(arguments.b))
    figures = {
        "relative_mse": result.relative_mse,
        "flip": result.flip,
        "mean_a": result.mean_a,
        "mean_b": result.mean_b,
        "mean_ratio": result.mean_ratio,
        "max_error": result.max_error,
        "max_at": list(result.max_at),
    }
    if arguments.output:
        result.difference.write(arguments.output)
    if arguments.json:
        print(json.dumps(figures, indent=2))
    else:
        x, y = result.max_at
        print(f"relative MSE   {result.relative_mse:.6g}")
        print(f"FLIP           {result.flip:.6g}")
        print(f"mean           {result.mean_a:.6g} and {result.mean_b:.6g}, ratio {result.mean_ratio:.6g}")
        print(f"largest error  {result.max_error:.6g} at pixel ({x}, {y})")
    return ExitCode.OK
