"""Pictures that a stage's RenderProducts ask for, as what is rendered one after another."""

from __future__ import annotations

import argparse
from collections import Counter
from dataclasses import replace
from pathlib import Path

import kanuka
from kanuka import usd

from . import scenes
from .frames import Frame, numbered


def pictures(arguments: argparse.Namespace, wanted: list[Frame]) -> list[Frame]:
    """Frames of a stage, one for each render: products of equal settings are made at once. With a name for the
    picture, it is that of the first product. What has no products is as it was."""
    file = arguments.scenes[-1]
    if not usd.is_stage(file):
        return wanted
    found = []
    for frame in wanted:
        number = None if arguments.frame is None else frame.number
        # What is wrong with them is told when the scene is read.
        products = usd.products(
            file, frame=number, product=arguments.product, variants=scenes.variants(arguments), journal=kanuka.Journal()
        )
        alike = groups(products[:1] if arguments.output else products)
        found += [replace(frame, products=tuple(g), of_several_products=len(alike) > 1) for g in alike] or [frame]
    return found if arguments.output else named_apart(found)


def groups(products: list) -> list[list]:
    """Those that one render makes: of equal settings, without layers of one name that are two things."""
    found: list[list] = []
    for product in products:
        for group in found:
            if product.settings == group[0].settings and not clash([*group, product]):
                group.append(product)
                break
        else:
            found.append([product])
    return found


def clash(products: list) -> bool:
    shown = {each for product in products for each in product.shown}
    return len({each.layer for each in shown}) < len(shown)


def named_apart(frames: list[Frame]) -> list[Frame]:
    """Files of one name get the frame's number, or the product's name where they are of one frame."""
    count = Counter(file_of(product) for frame in frames for product in frame.products)
    within = Counter((frame.number, file_of(product)) for frame in frames for product in frame.products)

    def apart(frame: Frame, product):
        path = file_of(product)
        if within[frame.number, path] > 1:
            path = path.with_name(f"{path.stem}.{product.path.rsplit('/', 1)[-1]}{path.suffix}")
        if frame.of_several and count[file_of(product)] > within[frame.number, file_of(product)]:
            path = numbered(path, frame)
        return replace(product, name=str(path))

    return [replace(frame, products=tuple(apart(frame, product) for product in frame.products)) for frame in frames]


def file_of(product) -> Path:
    return Path(kanuka.picture_file(product.name))


def outputs(frame: Frame, modes: list[str]) -> dict[Path, list[str] | None]:
    """Each product's file, with its layers and those of --aov; None = all."""
    added = [name for mode in modes for name in ([mode] if "lpe:" in mode else mode.split()[-1:])]
    return {file_of(each): [*each.layers, *added] if each.layers else None for each in frame.products}
