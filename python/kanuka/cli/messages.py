"""Prints journal entries: `severity: file:line:column: message (×count)`."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from kanuka import Journal, Message


def text(message: Message) -> str:
    first, *rest = str(message).split("\n")
    count = f" (×{message.count})" if message.count > 1 else ""
    return "\n".join([f"{message.severity}: {first}{count}", *rest])


class Printer:
    """Prints what a journal holds, each message once, whenever it is asked to."""

    def __init__(self, journal: Journal) -> None:
        self.journal = journal
        self.printed: set[tuple[str, str]] = set()

    def flush(self) -> None:
        for message in self.journal:
            key = (message.severity, str(message))
            if key not in self.printed:
                self.printed.add(key)
                print(text(message), file=sys.stderr)
