"""Simple models of scenes for other programs: `kanuka.proxies.export(scene, "shot.ply", faces=20000)`. docs/models.md.

What primitives are diced and displaced to, with fewer triangles, and a colour for each vertex: the albedo of materials.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from pathlib import Path

import kanuka
from kanuka import messages

from .meshes import Group, group_from, name_all
from .writers import WRITERS

__all__ = ["SUFFIXES", "export"]

SUFFIXES = tuple(WRITERS)
FACES = 100_000  # where nothing is said
MOST = 10_000_000  # with copies
COLOR = 4  # micropolygons that a surface may as well be off as a colour from black to white
Report = Callable[[str, float], object]


def export(
    scene: kanuka.Scene,
    path: str | os.PathLike,
    *,
    faces: int | None = None,
    error: float | None = None,
    most_faces: int = MOST,
    progress: Report | None = None,
    journal: kanuka.Journal | None = None,
    **options: object,
) -> dict[str, object]:
    """Writes the surfaces of a scene to a file of OBJ, PLY or USD (.usd, .usda), as triangles with colours.

    faces: so many at most (100000; 0: all of them). error: how far the surface may be off, in units of the world, in
    place of a number of faces. most_faces: OBJ and PLY have a copy for each instance; those that would bring the file
    beyond are left out. `options` are arguments of render(): `shading_rate` says how fine surfaces are before, `store`
    where they are kept. Returns what was written: 'faces_before', 'faces', 'error' (the largest distance),
    'primitives', 'instances', 'instances_left_out', 'vertices', 'bytes'. Raises ValueError for arguments that
    cannot be, and kanuka.Error where there is nothing to write, or it cannot be written.
    """
    file = Path(path)
    suffix = file.suffix.lower()
    if suffix not in WRITERS:
        raise ValueError(f'path: expected a file that ends in {", ".join(SUFFIXES)}, got "{path}"')
    if faces is not None and error is not None:
        raise ValueError("faces and error: choose one")
    if faces is not None and faces < 0:
        raise ValueError("faces must be 0 or more")
    if error is not None and not 0 < error < math.inf:
        raise ValueError("error must be above 0")
    told = kanuka.Journal() if journal is None else journal
    try:
        return _export(scene, file, faces, error, most_faces, progress, told, options)
    finally:
        if journal is None:
            messages.tell(told.messages)


def _export(scene, file: Path, faces, error, most_faces: int, progress, journal: kanuka.Journal, options) -> dict:
    made = kanuka.traced_surfaces(scene, progress=progress, journal=journal, **options)
    groups = [group_from(each) for each in made]
    del made
    flat = file.suffix.lower() not in (".usd", ".usda")
    place(groups)
    name_all(groups)
    meshes = [mesh for group in groups if group.copies for mesh in group.meshes]
    if not any(len(mesh.triangles) for mesh in meshes):
        raise failed("there are no surfaces in the scene to write", file)
    before = count(groups, flat)
    decimate(groups, faces if faces is not None or error is not None else FACES, error, flat, progress)
    left_out = leave_out(groups, most_faces) if flat else 0
    if left_out:
        journal.add(
            "warning",
            f"{left_out} instances are left out: with them there would be more than {most_faces} faces. Fewer faces, a "
            "larger limit or USD, which has instances, would do",
            str(file),
        )
    if progress:
        progress("film", 0)
    try:
        vertices = WRITERS[file.suffix.lower()](file, groups)
        size = file.stat().st_size
    except OSError as problem:
        raise failed(f"it cannot be written: {problem.strerror or problem}", file, 5) from None
    if progress:
        progress("film", 1)
    written = [group for group in groups if group.copies]
    return {
        "file": str(file),
        "faces_before": before,
        "faces": count(groups, flat),
        "error": max((mesh.error for mesh in meshes), default=0.0),
        "primitives": sum(len(group.meshes) for group in written),
        "instances": sum(group.copies for group in written[:-1]),
        "instances_left_out": left_out,
        "vertices": vertices,
        "bytes": size,
    }


def failed(text: str, file: Path, exit_code: int = 4) -> kanuka.Error:
    error = kanuka.Error(f"{file}: {text}")
    error.file, error.line, error.column, error.exit_code = str(file), 0, 0, exit_code
    return error


def place(groups: list[Group]) -> None:
    """How many there are of each in the world, and how large the largest is."""
    for group in groups:
        group.copies, group.scale = 0, 0.0
    groups[-1].copies, groups[-1].scale = 1, 1.0
    for group in reversed(groups):
        for instances in group.instances:
            child = groups[instances.group]
            child.copies += group.copies * len(instances.matrices)
            child.scale = max(child.scale, group.scale * instances.largest_scale())


def count(groups: list[Group], flat: bool) -> int:
    return sum(
        len(mesh.triangles) * (group.copies if flat else 1) for group in groups if group.copies for mesh in group.meshes
    )


def decimate(groups: list[Group], faces: int | None, error: float | None, flat: bool, progress: Report | None) -> None:
    """An error counts as the picture sees it: in micropolygons, of which there are more where things are near."""
    if faces == 0:
        return
    meshes, given = [], []
    for group in groups:
        for mesh in group.meshes if group.copies else ():
            scale = group.scale or 1.0
            each = max(mesh.area(), 1e-30) / max(mesh.micropolygons, 1)  # area of a micropolygon
            meshes.append(mesh)
            given.append(
                {
                    "points": mesh.points,
                    "colors": mesh.colors,
                    "triangles": mesh.triangles,
                    "copies": group.copies if flat else 1,
                    "scale": scale,
                    "weight": min(scale**2 / each, 1e30),
                    "color_length": COLOR * each**0.5,
                }
            )
    left = kanuka.decimate(given, faces=faces, error=error, progress=progress)
    for mesh, each in zip(meshes, left, strict=True):
        mesh.points, mesh.colors, mesh.triangles = each["points"], each["colors"], each["triangles"]
        mesh.error = each["error"]


def leave_out(groups: list[Group], most: int) -> int:
    """Instances of the world, from its first to its last, as long as there is room. Returns how many are not."""
    inner: list[int] = []  # faces of a group with all that is in it
    for group in groups:
        own = sum(len(mesh.triangles) for mesh in group.meshes)
        inner.append(own + sum(inner[i.group] * len(i.matrices) for i in group.instances))
    world = groups[-1]
    room, gone = most - sum(len(mesh.triangles) for mesh in world.meshes), 0
    for instances in world.instances:
        each = inner[instances.group]
        kept = len(instances.matrices) if each == 0 else max(0, min(len(instances.matrices), room // each))
        gone += len(instances.matrices) - kept
        room -= kept * each
        instances.matrices = instances.matrices[:kept]
    if gone:
        place(groups)
    return gone
