"""Prints journal entries: `severity: file:line:column: message (×count)`."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from kanuka.messages import text

if TYPE_CHECKING:
    from kanuka import Journal


class Printer:
    """Prints what a journal holds, each message once, whenever it is asked to."""

    def __init__(self, journal: Journal, errors_only: bool = False) -> None:
        self.journal = journal
        self.errors_only = errors_only
        self.printed: set[tuple[str, str]] = set()

    def flush(self) -> None:
        for message in self.journal:
            key = (message.severity, str(message))
            if key not in self.printed and (message.severity == "error" or not self.errors_only):
                self.printed.add(key)
                print(f"{message.severity}: {text(message)}", file=sys.stderr)
