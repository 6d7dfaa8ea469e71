"""USD stages: `kanuka.usd.load("shot.usd")`. docs/usd.md."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from kanuka import Camera, Journal, Scene, picture_file
from kanuka import messages as _messages

from . import stage
from .stage import SUFFIXES, is_stage

if TYPE_CHECKING:
    from .render_products import Product

__all__ = ["SUFFIXES", "convert", "frames", "is_stage", "load", "products", "summary"]


def frames(path: str | os.PathLike) -> list[int]:
    """The numbers of a stage's frames: its time codes, or none but 0."""
    stage.require()
    opened = stage.open_stage(os.fspath(path), lambda severity, text: None, {}, ())
    if not opened.HasAuthoredTimeCodeRange():
        return [0]
    return list(range(math.ceil(opened.GetStartTimeCode()), math.floor(opened.GetEndTimeCode()) + 1))


def products(
    path: str | os.PathLike,
    *,
    frame: float | None = None,
    product: str | Sequence[str] = (),
    variants: Mapping[str, str] | None = None,
    journal: Journal | None = None,
) -> list[Product]:
    """The pictures that a stage's settings ask for, at a frame: their RenderProducts, or `product`, by path or name.

    Each has `path`, `name` (of its file), `settings`, `layers` (for Picture.write()) and `aovs` (for render()). What
    is in none of them is told: to `journal`, else as warnings. Nothing but the settings is read.
    Raises kanuka.Error where there is no stage or no such product, or USD is not installed.
    """
    stage.require()
    from .render_products import chosen, product_of
    from .settings import settings_of

    file, own = os.fspath(path), Journal() if journal is None else journal

    def say(severity: str, text: str) -> None:
        own.add(severity, text, file)

    wanted = _several(product)
    by_path = all(name.startswith("/") for name in wanted)
    opened = stage.open_stage(file, say, variants or {}, (), wanted, whole=not by_path)
    time = stage.first_frame(opened) if frame is None else frame
    settings = settings_of(opened, say)
    made = [product_of(prim, settings, time, say) for prim in chosen(opened, settings, wanted, say, file)]
    if journal is None:
        _messages.tell(own.messages)
    return made


def summary(
    path: str | os.PathLike,
    *,
    frame: float | None = None,
    depth: int | None = None,
    variants: Mapping[str, str] | None = None,
    mask: Sequence[str] = (),
    journal: Journal | None = None,
) -> dict[str, object]:
    """What a stage holds, as `kanuka info` shows it: prims down to a depth (None: such that about a hundred are named),
    instances, materials with what of them is not read, lights, cameras, settings, products, variants, textures that are
    not found. Nothing is made of it.

    Raises kanuka.Error where there is no stage, or USD is not installed.
    """
    stage.require()
    from .inventory import inventory

    file, own = os.fspath(path), Journal() if journal is None else journal

    def say(severity: str, text: str) -> None:
        own.add(severity, text, file)

    opened = stage.open_stage(file, say, variants or {}, mask)
    made = inventory(opened, stage.first_frame(opened) if frame is None else frame, depth, say, file)
    if journal is None:
        _messages.tell(own.messages)
    return {"file": file} | made


def _several(names: str | Sequence[str]) -> tuple[str, ...]:
    names = (names,) if isinstance(names, str) and names else names
    if not isinstance(names, Sequence) or not all(isinstance(name, str) for name in names):
        raise TypeError(f"product: expected a path or name, or several, got {names!r}")
    return tuple(names)


def load(
    path: str | os.PathLike,
    *,
    frame: float | None = None,
    camera: str = "",
    product: str | Sequence[str] = (),
    variants: Mapping[str, str] | None = None,
    mask: Sequence[str] = (),
    purposes: Sequence[str] = (),
    resolution: tuple[int, int] | None = None,
    color_space: str = "",
    journal: Journal | None = None,
) -> Scene:
    """A scene of a stage.

    frame: time code; default: the stage's first. camera: a path or name; default: the product's or its settings', else
    the first. product: path or name of the RenderProduct whose settings count; default: the first of its settings. Of
    several, the first one's settings count, and what any of them shows is read; products() tells their layers.
    variants: {"/prim{set}": "variant"} over the stage's own. mask: paths of prims; of others only the settings and what
    they name are read. purposes: "default", "render", "proxy", "guide"; default: its settings', else the first two.
    resolution: pixels, to which the camera's view is fitted; default: its settings', else by the camera's aperture.
    color_space: rec709, rec2020 or acescg, into which colours of other spaces are converted; default: its settings',
    else rec709. What cannot be read is told: to `journal`, else as warnings.
    Raises kanuka.Error where there is no stage, or USD is not installed.
    """
    made = Scene()
    _read(made, path, journal, frame, camera, product, variants, mask, purposes, resolution, color_space)
    if journal is None:
        _messages.tell(made.journal.messages)
    return made


def convert(
    path: str | os.PathLike,
    rib: str | os.PathLike,
    *,
    frame: float | None = None,
    camera: str = "",
    product: str | Sequence[str] = (),
    variants: Mapping[str, str] | None = None,
    mask: Sequence[str] = (),
    purposes: Sequence[str] = (),
    resolution: tuple[int, int] | None = None,
    color_space: str = "",
    binary: bool = False,
    packing: str = "auto",
    journal: Journal | None = None,
) -> None:
    """Writes a RIB of the same picture as load() makes with these arguments, which convert_rib() tells of, too. The
    shaders of its materials are written into the folder NAME_shaders beside it; textures are named where they lie.

    Raises kanuka.Error where there is no stage, USD is not installed, or a file cannot be written.
    """
    from kanuka.rib import RibScene

    made = RibScene()
    _read(made, path, journal, frame, camera, product, variants, mask, purposes, resolution, color_space, list)
    for first in products(path, frame=frame, product=product, variants=variants, journal=Journal())[:1]:
        made.picture, made.aovs = picture_file(first.name), first.aovs
    found = [*made.write(rib, binary=binary, packing=packing)]
    if journal is None:
        _messages.tell([*made.journal.messages, *found])
    else:
        for message in found:
            journal.add(message.severity, message.message, message.file)


def _read(
    made, path, journal, frame, camera, product, variants, mask, purposes, resolution, color_space, moving=Camera.moving
):
    """Into a scene, or what stands for one; what is to say goes to its journal, and to `journal`."""
    stage.require()
    from . import scene

    file = os.fspath(path)

    def say(severity: str, text: str) -> None:
        made.journal.add(severity, text, file)
        if journal is not None:
            journal.add(severity, text, file)

    scene.read(
        made,
        file,
        say,
        frame=frame,
        camera=camera,
        variants=variants or {},
        mask=mask,
        purposes=purposes,
        resolution=resolution,
        color_space=color_space,
        product=_several(product),
        moving=moving,
    )
