"""Scene files of all kinds: RIB, stages of USD, models."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import kanuka
from kanuka import models, usd

from . import files, frames

WHAT = "a RIB file, a USD stage or a model"
SUFFIXES = (".gz", ".rib", *usd.SUFFIXES, *models.SUFFIXES)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """How stages are read."""
    stage = add_choices(parser)
    stage.add_argument(
        "--camera",
        default="",
        metavar="PRIM",
        help="path or name; default: its product's or settings', else the first",
    )
    stage.add_argument(
        "--product",
        default="",
        metavar="PRIM",
        help="path or name of the RenderProduct to make; default: all of its settings', with -o the first",
    )
    stage.add_argument(
        "--purpose",
        action="append",
        choices=("default", "render", "proxy", "guide"),
        help="purposes of prims to read; repeatable; default: default and render",
    )


def add_choices(parser: argparse.ArgumentParser):
    """Which parts of a stage, for all that read one."""
    stage = parser.add_argument_group("USD stages", "see docs/usd.md")
    stage.add_argument(
        "--variant", action="append", default=[], metavar="PRIM{SET}=NAME", help="choose a variant; repeatable"
    )
    stage.add_argument(
        "--prim", action="append", default=[], metavar="PATH", help="read this prim and what is below; repeatable"
    )
    return stage


def check(arguments: argparse.Namespace, paths: list[str]) -> None:
    for path in paths:
        files.check_input(path, WHAT)
    stages, alone = [path for path in paths if usd.is_stage(path)], [path for path in paths if is_read_whole(path)]
    if alone and len(paths) > 1:
        arguments.parser.error(f"{alone[0]}: a stage or a model is rendered by itself, not with other files")
    for option in ("camera", "product", "variant", "prim", "purpose"):
        if getattr(arguments, option, None) and not stages:
            arguments.parser.error(f"--{option} is for USD stages")
    for choice in arguments.variant:
        if "=" not in choice:
            arguments.parser.error(f'--variant: expected PRIM{{SET}}=NAME, got "{choice}"')


def is_read_whole(path: str) -> bool:
    """Whether it is read into a scene by load(), before anything of it is rendered."""
    return usd.is_stage(path) or models.is_model(path)


def variants(arguments: argparse.Namespace) -> dict[str, str]:
    return dict(choice.rsplit("=", 1) for choice in arguments.variant)


def load(path: str, arguments: argparse.Namespace, number: int | None, products: Sequence[str] = ()) -> kanuka.Scene:
    """`products`, by path, go over the one that the arguments have."""
    resolution = getattr(arguments, "resolution", None)
    if models.is_model(path):
        return models.load(path, resolution=resolution or (960, 540), journal=kanuka.Journal())
    return usd.load(
        path,
        **choices(arguments, number) | ({"product": products} if products else {}),
        resolution=resolution,
        color_space=getattr(arguments, "color_space", None) or "",
        journal=kanuka.Journal(),
    )


def choices(arguments: argparse.Namespace, number: int | None) -> dict:
    """What of a stage is read, as kanuka.usd.load() takes it."""
    return {
        "frame": number,
        "camera": arguments.camera,
        "product": arguments.product,
        "variants": variants(arguments),
        "mask": arguments.prim,
        "purposes": arguments.purpose or (),
    }


def frames_of(choice: str | list[range], scenes: list[str]) -> list[frames.Frame]:
    """Of a stage: the numbers that are asked for; all: its time codes. A model has one."""
    file = scenes[-1]
    if not is_read_whole(file):
        return frames.frames(choice, scenes)
    known = usd.frames(file) if usd.is_stage(file) else [0]
    numbers = known if choice == frames.ALL else [n for r in choice for n in r]
    several, written = len(numbers) > 1, set()
    return [frames.Frame(n, of_several=several, written=written) for n in numbers]


def name_of(path: str) -> str:
    """A scene file's name without what says its kind."""
    name = Path(path).name
    for suffix in SUFFIXES:
        name = name.removesuffix(suffix)
    return name
