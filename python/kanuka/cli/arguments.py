"""Types of command-line arguments. What they raise becomes argparse's usage error."""

from __future__ import annotations

import argparse
import math

import kanuka


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


def part(text: str) -> tuple[int, int]:
    """A-B, both included, as the package takes it."""
    first, separator, last = text.partition("-")
    if not separator or not first.strip().isdecimal() or not last.strip().isdecimal() or int(last) < int(first):
        raise argparse.ArgumentTypeError(f"expected A-B with A <= B, as in 0-255, got {text!r}")
    if int(last) >= 2**30:
        raise argparse.ArgumentTypeError(f"expected progressions below 2^30, got {text!r}")
    return int(first), int(last) + 1


METAVARS = {"int": "N", "float": "X", "str": "TEXT", "Spectrum | str": "LIGHT"}
FORMS = {"resolution": "WIDTHxHEIGHT", "crop": "X0,X1,Y0,Y1", "shutter": "OPEN,CLOSE", "filter_width": "X,Y"}


def add_option(group: argparse._ArgumentGroup, name: str, about: dict) -> None:
    """An option of scenes as the package declares it, under `name`; None = as the scene says."""
    flag, words = f"--{about['flag']}", about["help"].replace("%", "%%")
    unit = f"; {about['unit']}" if about["unit"] else ""
    default = "" if about["default"] in ("", (), []) else f"; default: {written(about['default'])}"
    if about["type"] == "bool":
        group.add_argument(flag, dest=name, action=argparse.BooleanOptionalAction, default=None, help=words + default)
        return
    form = FORMS.get(name) or METAVARS[about["type"]]
    group.add_argument(
        flag,
        dest=name,
        type=lambda text: option_value(name, about, form, text),
        metavar="|".join(about["choices"]) or form,
        help=words + unit + default,
    )


def written(value: object) -> str:
    if isinstance(value, tuple):
        return ("x" if isinstance(value[0], int) else ",").join(map(written, value))
    return f"{value:g}" if isinstance(value, float) else str(value)


def option_value(name: str, about: dict, form: str, text: str) -> object:
    """What the text stands for, looked at by the package."""
    try:
        if about["type"].startswith("tuple"):
            parts = text.lower().split("x") if form == "WIDTHxHEIGHT" else text.split(",")
            one = int if about["type"].startswith("tuple[int") else float
            value: object = tuple(one(part) for part in parts)
        else:
            value = {"int": int, "float": float}.get(about["type"], str)(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected {shape(about, form)}, got {text!r}") from None
    try:
        kanuka.check_option(name, value)
    except TypeError:
        raise argparse.ArgumentTypeError(f"expected {shape(about, form)}, got {text!r}") from None
    except ValueError as error:
        words = str(error).removeprefix(f"{name}: ").rsplit(", got ", 1)[0]
        raise argparse.ArgumentTypeError(f"{words}, got {text!r}") from None
    return value


def shape(about: dict, form: str) -> str:
    return f"{form}: {about['expected']}" if about["type"].startswith("tuple") else about["expected"]
