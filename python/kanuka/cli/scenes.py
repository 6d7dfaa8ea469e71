"""Scene files of all kinds: RIB, stages of USD, models."""

from __future__ import annotations

import argparse
from pathlib import Path

import kanuka
from kanuka import models, usd

from . import files, frames

WHAT = "a RIB file, a USD stage or a model"
SUFFIXES = (".gz", ".rib", *usd.SUFFIXES, *models.SUFFIXES)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """How stages are read, for render and info alike."""
    stage = parser.add_argument_group("USD stages", "see docs/usd.md")
    stage.add_argument(
        "--camera",
        default="",
        metavar="PRIM",
        help="path or name; default: its settings', else the first",
    )
    stage.add_argument(
        "--variant", action="append", default=[], metavar="PRIM{SET}=NAME", help="choose a variant; repeatable"
    )
    stage.add_argument(
        "--prim", action="append", default=[], metavar="PATH", help="read this prim and what is below; repeatable"
    )
    stage.add_argument(
        "--purpose",
        action="append",
        choices=("default", "render", "proxy", "guide"),
        help="purposes of prims to read; repeatable; default: default and render",
    )


def check(arguments: argparse.Namespace, paths: list[str]) -> None:
    for path in paths:
        files.check_input(path, WHAT)
    stages, alone = [path for path in paths if usd.is_stage(path)], [path for path in paths if is_read_whole(path)]
    if alone and len(paths) > 1:
        arguments.parser.error(f"{alone[0]}: a stage or a model is rendered by itself, not with other files")
    if not stages and (arguments.camera or arguments.variant or arguments.prim or arguments.purpose):
        arguments.parser.error("--camera, --variant, --prim and --purpose are for USD stages")
    for choice in arguments.variant:
        if "=" not in choice:
            arguments.parser.error(f'--variant: expected PRIM{{SET}}=NAME, got "{choice}"')


def is_read_whole(path: str) -> bool:
    """Whether it is read into a scene by load(), before anything of it is rendered."""
    return usd.is_stage(path) or models.is_model(path)


def load(path: str, arguments: argparse.Namespace, number: int | None) -> kanuka.Scene:
    resolution = getattr(arguments, "resolution", None)
    if models.is_model(path):
        return models.load(path, resolution=resolution or (960, 540), journal=kanuka.Journal())
    return usd.load(
        path,
        frame=number,
        camera=arguments.camera,
        variants=dict(choice.rsplit("=", 1) for choice in arguments.variant),
        mask=arguments.prim,
        purposes=arguments.purpose or (),
        resolution=resolution,
        color_space=getattr(arguments, "color_space", None) or "",
        journal=kanuka.Journal(),
    )


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
