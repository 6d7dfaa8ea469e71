"""kanuka render --checkpoint: samples that are kept in a file, and gone on from."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import kanuka

from .progress import ProgressBar


def picture(
    scene: kanuka.Scene, options: dict[str, object], file: Path, arguments: argparse.Namespace, bar: ProgressBar
) -> kanuka.Picture:
    """Goes on from `file` if it is there, and keeps the samples in it."""

    def say(text: str) -> None:
        bar.finish()
        if not arguments.quiet:
            print(text, file=sys.stderr)

    session = kanuka.Session(scene, keep_pages=False, part=arguments.part, **options)
    if file.exists():
        session.resume(file, progress=bar.update)
        say(f"goes on from {file}: {session.progressions} of {session.wanted} progressions")
    try:
        while not session.advance(seconds=arguments.checkpoint_every, progress=bar.update):
            session.save(file)
        session.save(file)
    except KeyboardInterrupt:
        if not session.prepared:
            raise
        session.save(file)
        say(f"stopped; the samples so far are in {file}: the same command goes on from there")
    return session.picture()
