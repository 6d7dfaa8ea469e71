"""kanuka info of a USD stage, as text."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

MOST = 24  # lines of one kind
HEAD = 22  # characters of what a line is about


def text(stage: dict) -> str:
    """What kanuka.usd.summary() returns."""
    lines = list(head(stage))
    lines += ["", *branches(stage["tree"], "")]
    for title, found, line in SECTIONS:
        if stage[found]:
            lines += ["", title, *listed(stage[found], line)]
    return "\n".join(lines)


def plain(value: object) -> object:
    """For JSON, which has no words for what is no number: that is null."""
    if isinstance(value, dict):
        return {key: plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [plain(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def head(stage: dict) -> Iterator[str]:
    yield row("stage", stage["file"])
    yield row("space", f"up axis {stage['up_axis']}, a unit is {stage['meters_per_unit']:g} m")
    if stage["frames"]:
        first, last = stage["frames"]
        yield row("frames", f"{first:g} to {last:g}, {stage['frames_per_second']:g} a second")
    yield row("prims", counted(stage["prims"]) or "none")
    settings = stage["settings"]
    if settings["path"]:
        size = "{} × {}".format(*settings["resolution"]) if settings["resolution"] else "a size by the camera"
        yield row("settings", f"{settings['path']}: {size}, {settings['camera'] or 'the first camera'}")


def row(name: str, value: str) -> str:
    return f"{name:<{HEAD}}{value}"


def counted(counts: dict[str, int], most: int = 6) -> str:
    """As in "12: 8 Mesh, 4 Xform"."""
    most += len(counts) == most + 1
    named = [f"{n} {kind}" for kind, n in list(counts.items())[:most]]
    if len(counts) > most:
        named.append(f"{sum(list(counts.values())[most:])} of {len(counts) - most} other types")
    total = f"{sum(counts.values())}: " if len(counts) > 1 else ""
    return total + ", ".join(named)


def branches(node: dict, indent: str) -> Iterator[str]:
    children = node.get("children", [])
    for k, child in enumerate(children):
        last = k == len(children) - 1 and "more" not in node
        about = child["type"] + (", an instance" if child.get("instance") else "")
        if "below" in child:
            about += f"; below it {counted(child['below'], 3)}"
        start = indent + ("└─ " if last else "├─ ")
        yield f"{start + child['name']:<{HEAD + 10}} {about}"
        yield from branches(child, indent + ("   " if last else "│  "))
    if "more" in node:
        yield f"{indent}└─ … {counted(node['more'], 3)}"


def listed(found: list | dict, line: Callable[..., tuple[str, str]]) -> Iterator[str]:
    """Two columns: what it is about, what is to say."""
    every = list(found.items()) if isinstance(found, dict) else found
    rows = [line(each) for each in every[:MOST]]
    width = max(HEAD, *(min(len(name), 2 * HEAD) for name, _ in rows)) if rows else HEAD
    for name, value in rows:
        yield f"  {name:<{width}}  {value}"
    if len(every) > MOST:
        yield f"  … and {len(every) - MOST} more"


def instance(each: dict) -> tuple[str, str]:
    times = f"{each['count']} of one prototype" if each["count"] > 1 else "the only one of its prototype"
    return each["first"], f"{times}, which holds {counted(each['holds'], 3) or 'nothing'}"


def instancer(each: dict) -> tuple[str, str]:
    of_each = ", ".join(f"{n} of {path}" for path, n in list(each["prototypes"].items())[:4])
    more = f" and {len(each['prototypes']) - 4} prototypes more" if len(each["prototypes"]) > 4 else ""
    return each["path"], f"{each['count']}: {of_each or 'of nothing'}{more}"


def material(each: dict) -> tuple[str, str]:
    unsure = "" if each["looked_into"] else " (not looked into: there are many)"
    return each["path"], "\n      ".join([(each["surface"] or "no surface") + unsure, *each["not_read"]])


def light(each: dict) -> tuple[str, str]:
    color = ", ".join(f"{x:g}" for x in each["color"])
    exposure = f" at exposure {each['exposure']:g}" if each["exposure"] else ""
    return each["path"], f"{each['type']}: {each['intensity']:g}{exposure}, color {color}"


def camera(each: dict) -> tuple[str, str]:
    stop = f", f/{each['f_stop']:g}" if each["f_stop"] else ""
    across, up = each["aperture"]
    return each["path"], f"{each['projection']}: {each['focal_length']:g} over {across:g} × {up:g}{stop}"


def product(each: dict) -> tuple[str, str]:
    size = "{} × {}".format(*each["resolution"]) if each["resolution"] else "a size by the camera"
    layers = ", ".join(each["layers"]) or "all layers"
    return each["path"], f"{each['name']}: {size}, {each['camera'] or 'the first camera'}; {layers}"


def variant(each: dict) -> tuple[str, str]:
    path = f"{each['path']}{{{each['set']}}}"
    return path, f"{each['chosen'] or 'none'} of {', '.join(each['choices']) or 'none'}"


def texture(each: dict) -> tuple[str, str]:
    return each["path"], each["file"]


def unread(each: tuple[str, dict]) -> tuple[str, str]:
    kind, tally = each
    return kind, f"{tally['count']}, the first is {tally['first']}"


SECTIONS = (
    ("instances", "instances", instance),
    ("point instancers", "point_instancers", instancer),
    ("materials", "materials", material),
    ("lights", "lights", light),
    ("cameras", "cameras", camera),
    ("products", "products", product),
    ("variants", "variants", variant),
    ("textures that are not found", "missing_textures", texture),
    ("types that are not read", "unread", unread),
)
