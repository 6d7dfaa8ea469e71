"""The statistics file: time, count and bytes of a render, with the machine, the version and the command."""

from __future__ import annotations

import json
import os
import platform
import sys
from pathlib import Path

import kanuka

from .exit_codes import ExitCode, fail


def machine() -> dict[str, object]:
    model = ""
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                model = line.split(":", 1)[1].strip()
                break
    except OSError:
        pass
    return {
        "name": platform.node(),
        "system": platform.platform(),
        "processor": model or platform.processor(),
        "threads": len(os.sched_getaffinity(0)),
        "memory_bytes": os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"),
    }


OfShot = dict[str, object]


def of_shot(scene: kanuka.Scene, session: kanuka.Session) -> OfShot:
    """What a frame has of those before it."""
    shared = {"procedurals_shared": scene.procedurals_shared} if scene.procedurals_shared else {}
    return {"made_again": session.made_again, **shared}


def collect(picture: kanuka.Picture, total_s: float, of_shot: OfShot) -> dict[str, object]:
    stats = picture.stats or {}
    stats["time"]["total_s"] = total_s  # with start, reading and writing
    return {**stats, **of_shot, "machine": machine(), "version": kanuka.__version__, "arguments": sys.argv[1:]}


def describe(picture: kanuka.Picture, total_s: float, of_shot: OfShot) -> str:
    """Times, counts and bytes in a few lines, for -v."""
    stats = collect(picture, total_s, of_shot)
    time, count, bytes_ = stats["time"], stats["count"], stats["bytes"]
    stages = ", ".join(f"{name.removesuffix('_s')} {time[name]:.2f} s" for name in time if name != "total_s")
    counts = ", ".join(f"{value} {name.replace('_', ' ')}" for name, value in count.items() if value)
    sizes = ", ".join(f"{name.replace('_', ' ')} {value / 1e6:.1f} MB" for name, value in bytes_.items())
    whys = [f"{r['why']} {r['primitives']} ({r['name'] or r['id']})" for r in of_shot.get("made_again", ())]
    shared = of_shot.get("procedurals_shared", {})
    whys += [f"{r['why']} {r['procedurals']} ({r['name']})" for r in shared.get("again", ())]
    again = f"\nagain   {'; '.join(whys)}" if whys else ""
    if shared.get("asked") or shared.get("kept") or shared.get("ahead"):
        again += f"\nshared  {shared['kept']} procedurals kept, {shared['asked']} asked, {shared['ahead']} read ahead"
    return f"time    {stages}, total {time['total_s']:.2f} s\ncounts  {counts}\nmemory  {sizes}{again}"


def write(path: Path, picture: kanuka.Picture, total_s: float, of_shot: OfShot) -> None:
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        temporary.write_text(json.dumps(collect(picture, total_s, of_shot), indent=2) + "\n")
        os.replace(temporary, path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        fail(ExitCode.OUTPUT, f"{path}: {error.strerror}")
