"""kanuka shader run: a shader over the unit square, without a scene."""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import numpy as np

import kanuka

from . import arguments as types
from . import exit_codes
from . import shader_source as sources
from .exit_codes import ExitCode, fail
from .files import PICTURES, check_output

EXAMPLES = """\
examples:
  kanuka shader run marble.sl -o marble.exr                      its colour, presence, N, P
  kanuka shader run marble.sl --grid 512x512 -o marble.png       as a picture
  kanuka shader run marble.sl --params scale=8 "tint=1 0.5 0.2" -o a.exr
  kanuka shader run marble.sl --output skin.roughness -o a.exr   one value of the material
  kanuka shader run marble.sl --output all -o a.exr              all of them
  kanuka shader run layered.sl --coshader rust=rust.sl --connect base=rust --params rust.scale=4 -o a.exr

"""


def add_parser(commands: argparse._SubParsersAction) -> None:
    parser = commands.add_parser(
        "run",
        help="shade the unit square, without a scene",
        description="Shades a grid of vertices with P = (u, v, 0), N = +z, s = u, t = v, one for each pixel. Writes "
        "the layers `rgb` (the colour of the material, with all its layers), `presence`, `N`, `P`, or the values of "
        "the material by name.",
        epilog=EXAMPLES + exit_codes.HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    sources.add_arguments(parser)
    sources.add_code_arguments(parser)
    sources.add_language_arguments(parser)
    parser.add_argument("--grid", type=types.resolution, default=(256, 256), metavar="WxH", help="default: 256x256")
    parser.add_argument(
        "--params",
        nargs="+",
        action="extend",
        default=[],
        metavar="NAME=VALUE",
        help="values of parameters; numbers are separated by spaces or commas",
    )
    parser.add_argument("-o", "--picture", type=Path, required=True, metavar="FILE.exr", help="or .png: `rgb` only")
    parser.add_argument(
        "--output",
        action="append",
        default=[],
        metavar="NAME",
        help="a value of the material, P, N, look, or all; repeatable",
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    check_output(arguments.picture, PICTURES, "pictures")
    width, height = arguments.grid
    journal = kanuka.Journal()
    with sources.messages_shown(journal):
        code = {"lanes": arguments.lanes, "opt_level": arguments.opt_level}
        shader = kanuka.compile_shader(
            **sources.given(arguments), **code, **sources.language(arguments), journal=journal
        )
        values = parameter_values(shader, arguments.params)
        result = shader.run(width, height, values, journal=journal)
    layers = chosen_layers(result, arguments.output)
    if arguments.picture.suffix == ".png":
        there = layers.get("presence", 1.0)  # holes are black
        layers = {"rgb": as_rgb(next(iter(layers.values()))) * np.asarray(there)[..., None]}
    kanuka.Picture(layers).write(arguments.picture)
    print(arguments.picture)
    return ExitCode.ERRORS if journal.error_count else ExitCode.OK


def parameter_values(shader: kanuka.CompiledShader, given: list[str]) -> dict[str, object]:
    parameters = {p["name"]: p for p in shader.parameters}
    values: dict[str, object] = {}
    for text in given:
        name, separator, value = text.partition("=")
        if not separator:
            fail(ExitCode.USAGE, f"--params {text}: expected NAME=VALUE")
        parameter = parameters.get(name)
        if parameter is None:
            fail(
                ExitCode.USAGE,
                f'--params: the shader has no parameter "{name}"; it has {", ".join(parameters) or "none"}',
            )
        if parameter["type"] in ("string", "shader"):
            values[name] = value
            continue
        words = value.replace(",", " ").split()
        try:
            values[name] = [float(word) for word in words]
        except ValueError:
            fail(ExitCode.USAGE, f"--params {text}: expected numbers")
        wanted = {"float": 1, "matrix": 16}.get(parameter["type"], 3) * max(1, parameter["array_size"])
        if len(words) not in (wanted, 1) or not all(map(math.isfinite, values[name])):
            fail(ExitCode.USAGE, f"--params {text}: expected {wanted} numbers, found {len(words)}")
    return values


def chosen_layers(result: dict, names: list[str]) -> dict[str, np.ndarray]:
    slots = result["slots"]
    standard = {"rgb": look(result), "N": result["N"], "P": result["P"]}
    if "presence" in slots:
        standard["presence"] = slots["presence"]
    if not names:
        return standard
    if "all" in names:
        return {**standard, **slots}
    there = {"look": standard["rgb"], "P": result["P"], "N": result["N"], **slots}
    for name in names:
        if name not in there:
            fail(ExitCode.USAGE, f"--output {name}: the shader gives {', '.join(there)}, all")
    # The first is what viewers show.
    return {("rgb" if i == 0 else name): as_rgb(there[name]) if i == 0 else there[name] for i, name in enumerate(names)}


def as_rgb(values: np.ndarray) -> np.ndarray:
    return np.repeat(values[:, :, None], 3, axis=2) if values.ndim == 2 else values


def look(result: dict) -> np.ndarray:
    """The colour that a material shows about straight on, and what it emits: lobes weighted, layers summed up."""
    program, slots = result["program"], result["slots"]
    nothing = np.zeros_like(result["P"])
    if not program["nodes"]:
        return nothing

    def weight(node: dict) -> np.ndarray | float:
        return slots[node["weight"]][:, :, None] if node["weight"] else 1.0

    def color(index: int) -> np.ndarray:
        node = program["nodes"][index]
        if node["op"] == "lobe":
            value = nothing + 1
            for name, entry in node["inputs"].items():
                if isinstance(entry["default"], tuple) and name != "roughness":
                    value = slots[entry["slot"]] if entry["slot"] else nothing + np.float32(entry["default"])
                    break
            # Seen straight on, a dielectric reflects ((n - 1) / (n + 1))².
            if node["lobe"] == "MicrofacetDielectricBrdf":
                entry = node["inputs"]["ior"]
                ior = slots[entry["slot"]][:, :, None] if entry["slot"] else entry["default"]
                value = value * ((ior - 1) / (ior + 1)) ** 2
            return value * weight(node)
        upper, lower, w = color(node["upper"]), color(node["lower"]), weight(node)
        if node["op"] == "mix":
            return w * upper + (1 - w) * lower
        if node["op"] == "over":
            return w * upper + (1 - w * np.minimum(covers(node["upper"]), 1)) * lower
        if node["op"] in ("coat", "thick"):
            return w * upper + (1 - w * upper) * lower
        return upper + lower

    def covers(index: int) -> np.ndarray | float:
        node = program["nodes"][index]
        if node["op"] == "lobe":
            return weight(node)
        return covers(node["upper"]) + covers(node["lower"])

    return np.asarray(color(len(program["nodes"]) - 1), dtype=np.float32)
