"""The exit codes of the command; the numbers are those of base/error.h."""

from __future__ import annotations

import sys
from enum import IntEnum
from typing import NoReturn


class ExitCode(IntEnum):
    OK = 0
    USAGE = 2
    ERRORS = 3
    INPUT = 4
    OUTPUT = 5
    INTERNAL = 70
    INTERRUPTED = 130
    TERMINATED = 143


HELP = """\
exit codes:
    0  done; warnings alone do not fail a frame
    2  wrong command line
    3  done, but something was missing or replaced (a shader, a texture, a request): see the messages
    4  no picture: the scene or shader could not be read
    5  no picture: it could not be written
   70  a defect of Kanuka
  130  interrupted (Ctrl-C); the unfinished picture is NAME.partial.exr
  143  terminated (SIGTERM); likewise
"""


def fail(code: ExitCode, message: str) -> NoReturn:
    print(f"error: {message}", file=sys.stderr)
    raise SystemExit(code)
