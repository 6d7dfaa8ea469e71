"""What Python users are told: what they must know are warnings, the rest goes to the logger "kanuka"."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from . import Message

logger = logging.getLogger("kanuka")
logger.addHandler(logging.NullHandler())


class Warning(UserWarning):
    """Something is missing, replaced or without effect: the picture is not what the scene asks for."""

    __module__ = "kanuka"


def text(message: Message) -> str:
    """ "file:line:column: what was found, and what would do (×count)"."""
    first, *rest = str(message).split("\n")
    count = f" (×{message.count})" if message.count > 1 else ""
    return "\n".join([first + count, *rest])


def warn(what: str) -> None:
    # The library's functions have no frames of their own: the one above is the caller's.
    warnings.warn(what, Warning, stacklevel=2)


def log(what: str) -> None:
    logger.info(what)


def tell(messages: Iterable[Message]) -> None:
    for message in messages:
        if message.severity == "info":
            logger.info(text(message))
        else:
            warnings.warn(text(message), Warning, stacklevel=2)
