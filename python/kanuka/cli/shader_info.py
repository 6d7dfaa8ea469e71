"""kanuka shader info: what a shader is, and what it costs."""

from __future__ import annotations

import argparse
import json

import kanuka

from . import exit_codes
from . import shader_source as sources
from .exit_codes import ExitCode


def add_parser(commands: argparse._SubParsersAction) -> None:
    parser = commands.add_parser(
        "info",
        help="show what a shader contains and what it costs",
        description="Shows parameters, lobes and layers with default parameters, bytes per vertex, stages, textures.",
        epilog="examples:\n  kanuka shader info marble.sl\n  kanuka shader info marble.slo --json\n\n"
        + exit_codes.HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    sources.add_arguments(parser)
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    journal = kanuka.Journal()
    with sources.messages_shown(journal):
        shader = kanuka.compile_shader(**sources.given(arguments), journal=journal)
        program = shader.run(1, 1, journal=journal)["program"]
    info = {
        "name": shader.name,
        "kind": shader.kind,
        "file": str(arguments.file),
        "stages": shader.stages,
        "parameters": shader.parameters,
        "textures": shader.textures,
        "material": program,
    }
    print(json.dumps(info, indent=2) if arguments.json else text(info))
    return ExitCode.OK


def text(info: dict) -> str:
    program = info["material"]
    lines = [f"{info['kind']} {info['name']}", f"stages: {', '.join(info['stages']) or 'none'}"]
    lines.append("parameters:" if info["parameters"] else "parameters: none")
    lines += ["  " + parameter_text(p) for p in info["parameters"]]
    if program["nodes"]:
        lines += ["material:", *tree(program)]
        presence = program["presence"]
        if presence:
            lines.append(f"  presence, {'uniform' if slot_of(program, presence)['uniform'] else 'varying'}")
        least, most = program["bytes_per_vertex"], program["bytes_per_vertex_at_most"]
        lines.append(f"bytes a vertex: {least}" + (f", {most} if everything varies" if most > least else ""))
    if program["interior"]:
        inside = program["interior"]
        lines.append(
            f"interior: ior {inside['ior']:g}, absorption {value_text(list(inside['absorption']))}, "
            f"scattering {value_text(list(inside['scattering']))}, {inside['phase']}, "
            f"priority {inside['priority']:g}"
        )
    for texture in info["textures"]:
        kind = "environment" if texture["environment"] else "texture"
        if texture["file"]:
            lines.append(f'{kind}: "{texture["file"]}"')
        else:
            lines.append(
                f"{kind}: " + (f"named by {texture['parameter']}" if texture["parameter"] else "named as it runs")
            )
    return "\n".join(lines)


def slot_of(program: dict, name: str) -> dict:
    return next(s for s in program["slots"] if s["name"] == name)


def tree(program: dict) -> list[str]:
    """The layers from the top, each with its lobes below it."""
    nodes = program["nodes"]
    lines: list[str] = []

    def show(index: int, indent: int) -> None:
        node = nodes[index]
        what = f"{node['lobe']} " if node["op"] == "lobe" else f"{node['op']} "
        slots = [node["weight"]] if node["weight"] else []
        if node["op"] == "lobe":
            slots += [i["slot"] for i in node["inputs"].values() if i["slot"]]
        inputs = [f"{s.rpartition('.')[2]} {'uniform' if slot_of(program, s)['uniform'] else 'varying'}" for s in slots]
        name = f'"{node["name"]}"' if node["name"] else "of the above"
        lines.append("  " * indent + what + name + (f": {', '.join(inputs)}" if inputs else ""))
        if node["op"] != "lobe":
            show(node["upper"], indent + 1)
            show(node["lower"], indent + 1)

    show(len(nodes) - 1, 1)
    return lines


def parameter_text(parameter: dict) -> str:
    words = ["output"] * parameter["output"] + ["varying" if parameter["varying"] else "uniform", parameter["type"]]
    size = parameter["array_size"]
    text = " ".join(words) + " " + parameter["name"] + (f"[{size or ''}]" if size or parameter["resizable"] else "")
    if parameter["type"] == "shader" and not parameter["default"]:
        return text + ("" if "[" in text else " = null") + (f"  // {parameter['doc']}" if parameter["doc"] else "")
    if parameter["default"] is not None:
        text += f" = {value_text(parameter['default'])}"
    return text + (f"  // {parameter['doc']}" if parameter["doc"] else "")


def value_text(value: object) -> str:
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, list):
        return "(" + ", ".join(map(value_text, value)) + ")"
    return f"{value:g}"
