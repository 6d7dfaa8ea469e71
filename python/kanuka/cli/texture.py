"""kanuka texture: a tiled, mip-mapped texture from a picture."""

from __future__ import annotations

import argparse

import kanuka

from . import exit_codes, files
from .exit_codes import ExitCode

EXAMPLES = """\
examples:
  kanuka texture wood.png wood.tx                        repeats in both directions
  kanuka texture label.png label.tx --wrap black         black around it
  kanuka texture sky.exr sky.env --latlong               a latitude-longitude environment
  kanuka texture px.exr nx.exr py.exr ny.exr pz.exr nz.exr room.env   from the faces of a cube

Textures are OpenEXR files of linear light, whatever their names. Scenes can use plain pictures too, but only the
tiles of a texture that are needed are read.

"""


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    parser = subparsers.add_parser(
        "texture",
        help="make a tiled, mip-mapped texture from a picture",
        description="Makes a tiled, mip-mapped texture from a picture, or an environment from the six faces of a cube.",
        epilog=EXAMPLES + exit_codes.HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("pictures", metavar="IN", nargs="+", help="one picture, or six: px nx py ny pz nz")
    parser.add_argument("texture", metavar="OUT", help="texture to write")
    parser.add_argument(
        "--wrap",
        default="periodic",
        metavar="S[,T]",
        help="values beyond the picture: black, clamp, periodic or mirror (default: periodic)",
    )
    parser.add_argument("--filter", default="box", help="filter from each level to the next (default: box)")
    parser.add_argument(
        "--filter-width",
        default="0",
        metavar="S[,T]",
        help="width of the filter, in texels of the smaller level (default: the filter's own)",
    )
    parser.add_argument("--latlong", action="store_true", help="the picture is a latitude-longitude environment")
    parser.add_argument("--fov", type=float, default=90, help="field of view of cube faces, in degrees (default: 90)")
    parser.set_defaults(run=run, parser=parser)


def run(arguments: argparse.Namespace) -> int:
    if len(arguments.pictures) not in (1, 6):
        arguments.parser.error(f"one picture or six cube faces, not {len(arguments.pictures)}")
    for picture in arguments.pictures:
        files.check_input(picture, "a picture")
    files.check_output(arguments.texture)
    s, _, t = arguments.wrap.partition(",")
    s_width, _, t_width = arguments.filter_width.partition(",")
    try:
        widths = (float(s_width), float(t_width or s_width))
    except ValueError:
        arguments.parser.error(f"--filter-width: expected one number or two, not {arguments.filter_width}")
    kanuka.make_texture(
        arguments.pictures,
        arguments.texture,
        wrap=(s, t or s),
        filter=arguments.filter,
        filter_width=widths,
        latlong=arguments.latlong,
        fov=arguments.fov,
    )
    return ExitCode.OK
