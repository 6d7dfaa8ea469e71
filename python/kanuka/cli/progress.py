"""Draws progress on the terminal: a bar for each phase, with the time left. Elsewhere, a line a phase; or nothing."""

from __future__ import annotations

import shutil
import sys
import time
from collections.abc import Callable

LABELS = {
    "ingest": "reading",
    "dice": "dicing",
    "shade": "shading",
    "build": "building BVH",
    "progressions": "tracing",
    "film": "writing",
    "compress": "compressing",
    "weld": "welding",
    "decimate": "decimating",
}
WIDTH = 24
BLOCKS = " ▏▎▍▌▋▊▉█"


def duration(seconds: float) -> str:
    if seconds < 10:
        return f"{seconds:.1f} s"
    if seconds < 60:
        return f"{seconds:.0f} s"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"


def bar(fraction: float) -> str:
    eighths = round(max(0.0, min(1.0, fraction)) * WIDTH * 8)
    full, rest = divmod(eighths, 8)
    return ("█" * full + (BLOCKS[rest] if rest else "")).ljust(WIDTH)


class ProgressBar:
    """Thread safety: none; kanuka.render calls back on the calling thread."""

    def __init__(self, quiet: bool, between: Callable[[], None] = lambda: None) -> None:
        self.quiet = quiet
        self.live = not quiet and sys.stderr.isatty()
        self.between = between  # called after each phase, while the line is empty
        self.phase = ""
        self.started = 0.0
        self.drawn = 0.0

    def update(self, phase: str, fraction: float) -> None:
        now = time.monotonic()
        if phase != self.phase:
            self.finish()
            self.phase, self.started, self.drawn = phase, now, 0.0
        if self.live and now - self.drawn > 0.05:
            self.drawn = now
            elapsed = now - self.started
            left = ""
            if fraction > 0 and elapsed > 1:
                left = f"  {duration(elapsed * (1 - fraction) / fraction)} left"
            self.draw(f"{self.label():<13}{bar(fraction)} {fraction:4.0%}{left}")

    def finish(self) -> None:
        """Ends the phase: one line stays, that says how long it took."""
        if self.phase:
            line = f"{self.label():<13}{duration(time.monotonic() - self.started)}"
            self.clear()
            if not self.quiet:
                print(line, file=sys.stderr)
            self.phase = ""
        self.between()

    def label(self) -> str:
        return LABELS.get(self.phase, self.phase)

    def draw(self, line: str) -> None:
        columns = shutil.get_terminal_size().columns
        sys.stderr.write("\r" + line[: columns - 1] + "\x1b[K")
        sys.stderr.flush()

    def clear(self) -> None:
        if self.live:
            sys.stderr.write("\r\x1b[K")
            sys.stderr.flush()
