"""USD stages: `kanuka.usd.load("shot.usd")`. docs/usd.md."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence

from kanuka import Journal, Scene
from kanuka import messages as _messages

from . import stage
from .stage import SUFFIXES, is_stage

__all__ = ["SUFFIXES", "frames", "is_stage", "load"]


def frames(path: str | os.PathLike) -> list[int]:
    """The numbers of a stage's frames: its time codes, or none but 0."""
    stage.require()
    opened = stage.open_stage(os.fspath(path), lambda severity, text: None, {}, ())
    if not opened.HasAuthoredTimeCodeRange():
        return [0]
    return list(range(math.ceil(opened.GetStartTimeCode()), math.floor(opened.GetEndTimeCode()) + 1))


def load(
    path: str | os.PathLike,
    *,
    frame: float | None = None,
    camera: str = "",
    variants: Mapping[str, str] | None = None,
    mask: Sequence[str] = (),
    purposes: Sequence[str] = (),
    resolution: tuple[int, int] | None = None,
    color_space: str = "",
    journal: Journal | None = None,
) -> Scene:
    """A scene of a stage.

    frame: time code; default: the stage's first. camera: a path or name; default: its settings', else the first.
    variants: {"/prim{set}": "variant"} over the stage's own. mask: paths of prims; nothing else is read. purposes:
    "default", "render", "proxy", "guide"; default: its settings', else the first two. resolution: pixels, to which the
    camera's view is fitted; default: its settings', else by the camera's aperture. color_space: rec709, rec2020 or
    acescg, into which colours of other spaces are converted; default: its settings', else rec709. What cannot be read
    is told: to `journal`, else as warnings.
    Raises kanuka.Error where there is no stage, or USD is not installed.
    """
    stage.require()
    from . import scene

    file = os.fspath(path)
    made = Scene()

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
    )
    if journal is None:
        _messages.tell(made.journal.messages)
    return made
