"""Types of command-line arguments. What they raise becomes argparse's usage error."""

from __future__ import annotations

import argparse
import math


def positive_int(text: str) -> int:
    try:
        value = int(text)
    except ValueError:
        value = 0
    if value < 1:
        raise argparse.ArgumentTypeError(f"expected a whole number from 1 on, got {text!r}")
    return value


def natural(text: str) -> int:
    try:
        value = int(text)
    except ValueError:
        value = -1
    if not 0 <= value < 2**32:
        raise argparse.ArgumentTypeError(f"expected a whole number from 0 on, got {text!r}")
    return value


def positive_float(text: str) -> float:
    value = number(text)
    if not value > 0:
        raise argparse.ArgumentTypeError(f"expected a number above 0, got {text!r}")
    return value


def non_negative_float(text: str) -> float:
    value = number(text)
    if not value >= 0:
        raise argparse.ArgumentTypeError(f"expected a number from 0 on, got {text!r}")
    return value


def number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"expected a number, got {text!r}")
    return value


def resolution(text: str) -> tuple[int, int]:
    width, separator, height = text.lower().partition("x")
    if not separator:
        raise argparse.ArgumentTypeError(f"expected WIDTHxHEIGHT, as in 640x360, got {text!r}")
    return positive_int(width), positive_int(height)


def crop(text: str) -> tuple[float, float, float, float]:
    values = [number(part) for part in text.split(",")]
    if len(values) != 4:
        raise argparse.ArgumentTypeError(f"expected X0,X1,Y0,Y1 as fractions of the picture, got {text!r}")
    x0, x1, y0, y1 = values
    if not (0 <= x0 < x1 <= 1 and 0 <= y0 < y1 <= 1):
        raise argparse.ArgumentTypeError(f"expected 0 <= X0 < X1 <= 1 and 0 <= Y0 < Y1 <= 1, got {text!r}")
    return x0, x1, y0, y1


def shutter(text: str) -> tuple[float, float]:
    values = [number(part) for part in text.split(",")]
    if len(values) != 2 or not values[0] <= values[1]:
        raise argparse.ArgumentTypeError(f"expected OPEN,CLOSE, rising times as in the scene, got {text!r}")
    return values[0], values[1]
