"""kanuka render --write-oracle: how finely each part of each primitive is looked at."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import kanuka

from . import messages
from .exit_codes import ExitCode
from .progress import ProgressBar


def write(
    scene: kanuka.Scene,
    options: dict[str, object],
    file: Path,
    arguments: argparse.Namespace,
    bar: ProgressBar,
    printer: messages.Printer,
) -> int:
    found = kanuka.write_oracle(scene, file, progress=bar.update, **options)
    bar.finish()
    printer.flush()
    if not arguments.quiet:
        print(f"{found['seen']} of {found['primitives']} primitives are seen", file=sys.stderr)
    print(file)
    return ExitCode.ERRORS if scene.journal.error_count else ExitCode.OK
