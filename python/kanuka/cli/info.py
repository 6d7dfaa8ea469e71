"""kanuka info: shows what a scene contains."""

from __future__ import annotations

import argparse
import json

import kanuka
from kanuka import models, usd

from . import arguments as types
from . import exit_codes, messages, scenes, stage_info
from .exit_codes import ExitCode

EXAMPLES = """\
examples:
  kanuka info scene.rib
  kanuka info scene.rib --json
  kanuka info shot.usd --depth 2

"""


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    parser = subparsers.add_parser(
        "info",
        help="show what a scene contains",
        description="Shows what a scene contains: picture, camera, geometry, lights, shaders. Of a USD stage, without "
        "making anything of it: its prims as a tree, instances, materials with what of them is not read, lights, "
        "cameras, products, variants, textures that are not found.",
        epilog=EXAMPLES + exit_codes.HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "scene", metavar="SCENE", help="RIB file, gzipped or not, USD stage or model; - is standard input"
    )
    parser.add_argument("--frame", type=types.natural, metavar="N", help="frame to read; default: the first")
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.add_argument(
        "--depth",
        type=types.natural,
        metavar="N",
        help="levels of a stage's tree; what is below is counted; default: such that it is about a hundred lines",
    )
    scenes.add_choices(parser)
    parser.set_defaults(run=run, parser=parser)


def run(arguments: argparse.Namespace) -> int:
    scenes.check(arguments, [arguments.scene])
    if usd.is_stage(arguments.scene):
        return show_stage(arguments)
    if arguments.depth is not None:
        arguments.parser.error("--depth is for USD stages")
    if scenes.is_read_whole(arguments.scene):
        scene = models.load(arguments.scene, journal=kanuka.Journal())
    else:
        scene = kanuka.load(arguments.scene, frame=arguments.frame or 0, journal=kanuka.Journal())
    summary = scene.summary() | {"file": arguments.scene}
    if arguments.json:
        print(json.dumps(summary, indent=2))
    else:
        print(text(summary))
    messages.Printer(scene.journal).flush()
    return ExitCode.ERRORS if scene.journal.error_count else ExitCode.OK


def show_stage(arguments: argparse.Namespace) -> int:
    journal = kanuka.Journal()
    summary = usd.summary(
        arguments.scene,
        frame=arguments.frame,
        depth=arguments.depth,
        variants=scenes.variants(arguments),
        mask=arguments.prim,
        journal=journal,
    )
    print(json.dumps(stage_info.plain(summary), indent=2) if arguments.json else stage_info.text(summary))
    messages.Printer(journal).flush()
    return ExitCode.ERRORS if journal.error_count else ExitCode.OK


def text(summary: dict) -> str:
    width, height = summary["resolution"]
    rows = [
        ("scene", summary["file"]),
        ("picture", f"{width} × {height}, filter {summary['filter']}"),
        ("camera", f"{summary['projection']}, {summary['fov']:g}° across the shorter side"),
        ("integrator", f"{summary['integrator']}, depth {summary['max_depth']}"),
    ]
    rows += [("display", f"{d['file']} ({d['driver']}, {d['mode']})") for d in summary["displays"]]
    rows += [("geometry", f"{count} × {kind}") for kind, count in summary["primitives"].items()]
    rows.append(("points", f"{summary['points']}"))
    if summary["groups"]:
        rows.append(("instances", f"{summary['instances']} of {summary['groups']} groups"))
    if summary["area_lights"]:
        rows.append(("area lights", f"{summary['area_lights']}"))
    rows.append(("lights", ", ".join(summary["lights"]) or "none"))
    for kind, names in summary["shaders"].items():
        if names:
            rows.append((f"{kind} shaders", ", ".join(names)))
    return "\n".join(f"{name:<22}{value}" for name, value in rows)
