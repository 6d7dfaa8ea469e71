"""kanuka render: from a scene file to a picture."""

from __future__ import annotations

import argparse
import signal
import sys
import time
from pathlib import Path

import kanuka

from . import arguments as types
from . import exit_codes, files, fireflies, frames, messages, statistics
from .exit_codes import ExitCode
from .progress import ProgressBar, duration

EXAMPLES = """\
examples:
  kanuka render scene.rib
  kanuka render scene.rib -o frames/a.exr --png --stats frames/a.json
  kanuka render scene.rib --progressions 4 --crop 0.4,0.6,0.4,0.6
  kanuka render options.rib scene.rib
  kanuka render walk.rib --frame all -o walk.####.exr

Of several frames each has its picture: in -o and --stats a row of # stands for the number, or it goes before the
suffix. A picture appears under its name complete or not at all. Ctrl-C (or SIGTERM) stops early and saves what is
there as NAME.partial.exr; a second one stops at once. Paths of the pictures go to standard output, all else to standard
error.

"""


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    parser = subparsers.add_parser(
        "render",
        help="render a scene to a picture",
        description="Renders a RIB scene to an OpenEXR picture.",
        epilog=EXAMPLES + exit_codes.HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "scenes",
        nargs="+",
        metavar="SCENE",
        help="RIB file, gzipped or not; - is standard input. Several are read one after another as one",
    )
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="FILE.exr",
        help="where the picture goes, .exr or .png; default: where the scene's Display says, or SCENE.exr",
    )
    parser.add_argument("--frame", type=frames.chosen, metavar="N", help=frames.HELP)
    parser.add_argument("--no-programs", action="store_true", help='Procedural "RunProgram" may start no process')
    parser.add_argument("--allow-system", action="store_true", help="System may have the shell do what the scene says")
    parser.add_argument("--png", action="store_true", help="write a PNG beside the EXR")
    parser.add_argument("--stats", type=Path, metavar="FILE.json", help="write times, counts and bytes")
    parser.add_argument(
        "--fireflies", action="store_true", help="list the samples that outshine their pixels most, and their paths"
    )
    parser.add_argument(
        "-q", "--quiet", action="count", default=0, help="no progress; messages still come; -qq: errors alone"
    )
    parser.add_argument("-v", "--verbose", action="store_true", help="say where time and memory went")
    picture = parser.add_argument_group("picture", "over what the scene says")
    picture.add_argument(
        "--progressions",
        type=types.positive_int,
        metavar="N",
        help="paths a pixel; default: the scene's PixelSamples, else 64",
    )
    picture.add_argument("--resolution", type=types.resolution, metavar="WxH", help="pixels")
    picture.add_argument("--crop", type=types.crop, metavar="X0,X1,Y0,Y1", help="fractions of the picture, y down")
    picture.add_argument("--shading-rate", type=types.positive_float, metavar="R", help="multiplies micropolygon areas")
    picture.add_argument(
        "--geometry-tolerance",
        type=types.non_negative_float,
        metavar="PX",
        help="pixels that traced geometry may be off the diced surface; 0 traces every micropolygon",
    )
    picture.add_argument("--max-depth", type=types.natural, metavar="N", help="scattering events of a path")
    picture.add_argument(
        "--strict-directions",
        action="store_true",
        default=None,
        help="what a surface shader does that no material can do is an error at its line, not approximated",
    )
    picture.add_argument(
        "--specular",
        choices=("prman", "rispec"),
        help="exponent of specular() in classic shaders: 8/roughness, as PRMan, Aqsis and 3Delight have it (default), "
        "or RISpec's 1/roughness",
    )
    picture.add_argument(
        "--transport",
        choices=("full", "classic", "auto"),
        help="light between surfaces and shadows of all lights; light of sources alone, with shadows where lights "
        "ask for them, as RISpec's renderers had it; or that where all shaders and lights are RISpec's, as scenes have "
        "it that say nothing",
    )
    picture.add_argument("--integrator", metavar="NAME[:PARAMETER=VALUE,...]", help=integrators_help())
    for name, what in (("direct", "light that reaches the first surface straight"), ("indirect", "all other light")):
        picture.add_argument(
            f"--clamp-{name}",
            type=types.non_negative_float,
            metavar="L",
            help=f"most radiance that one contribution of {what} brings to a sample; default 0: unbounded",
        )
    picture.add_argument(
        "--aov",
        action="append",
        default=[],
        metavar="NAME",
        help="output parameter of surface shaders, a layer more in the EXR; any number of times",
    )
    picture.add_argument("--seed", type=types.natural, metavar="N", help="another seed, another noise")
    picture.add_argument(
        "--shutter-interval", type=types.shutter, metavar="OPEN,CLOSE", help="of motion blur; twice the same = none"
    )
    color = parser.add_argument_group("colour", "over what the scene says; docs/color.md")
    color.add_argument("--color-space", metavar="NAME", help="of the scene's RGB: rec709, rec2020, acescg")
    color.add_argument("--output-space", metavar="NAME", help="of the picture: one of those, aces2065 or xyz")
    color.add_argument("--observer", choices=("1931", "1964"), help="CIE observer of 2 or 10 degrees")
    color.add_argument("--sensor", metavar="FILE", help="a camera's sensitivities: lines of nm, red, green, blue")
    color.add_argument("--white-balance", metavar="LIGHT", help="what is white: D65, A, F11, blackbody:3200, a file")
    color.add_argument("--exposure", type=types.number, metavar="STOPS", help="the picture times 2^STOPS")
    color.add_argument("--f-stop", type=types.positive_float, metavar="N", help="with --shutter: physical exposure")
    color.add_argument("--shutter", type=types.positive_float, metavar="S", help="seconds that light is gathered")
    color.add_argument("--iso", type=types.positive_float, metavar="S", help="sensitivity; default: 100")
    color.add_argument(
        "--display",
        choices=("srgb", "rec709", "linear"),
        help="encoding of the PNG, over a gamma that the scene's Exposure sets; rec709 is BT.1886; linear writes the "
        "values as they are, as renderers did that knew no curve",
    )
    machine = parser.add_argument_group("machine", "the picture does not depend on these")
    machine.add_argument("--threads", type=types.positive_int, metavar="N", help="default: all there are")
    machine.add_argument("--lanes", type=int, choices=(0, 1, 8, 16), default=0, help="SIMD lanes; 0 = the widest")
    parser.set_defaults(run=run, parser=parser)


def integrators_help() -> str:
    def words(name: str, about: dict) -> str:
        settings = "".join(f" :{p}={default:g} ({text})" for p, (default, text) in about["parameters"].items())
        return f"{name} ({about['help']}){settings}"

    return "; ".join(words(name, about) for name, about in kanuka.integrators().items())


def run(arguments: argparse.Namespace) -> int:
    started = time.monotonic()
    if arguments.integrator is not None:
        try:
            kanuka.check_integrator(arguments.integrator)
        except kanuka.Error as error:
            arguments.parser.error(f"--integrator: {error}")
    if arguments.output:
        check_picture(arguments.output)
    if arguments.stats:
        files.check_output(arguments.stats)
    for scene in arguments.scenes:
        files.check_input(scene, "a RIB file")
    interruption = Interruption()
    try:
        if arguments.frame is None:
            return render(arguments, frames.Frame(), started, interruption)
        wanted = frames.frames(arguments.frame, arguments.scenes)
        if len(wanted) == 1:
            return render(arguments, wanted[0], started, interruption)
        return render_frames(arguments, wanted, interruption)
    except KeyboardInterrupt:
        print("interrupted before there was a picture", file=sys.stderr)
        return interruption.exit_code


def render_frames(arguments: argparse.Namespace, wanted: list[frames.Frame], interruption: Interruption) -> int:
    """One after another; an error in one does not keep the others from being rendered."""
    worst = ExitCode.OK
    for k, frame in enumerate(wanted):
        if not arguments.quiet:
            print(f"frame {frame.number} ({k + 1} of {len(wanted)})", file=sys.stderr)
        code = render(arguments, frame, time.monotonic(), interruption)
        if code not in (ExitCode.OK, ExitCode.ERRORS):
            return code
        worst = worst or code
    return worst


def render(arguments: argparse.Namespace, frame: frames.Frame, started: float, interruption: Interruption) -> int:
    bar = ProgressBar(bool(arguments.quiet))
    bar.update("ingest", 0)
    scene = kanuka.load(
        arguments.scenes[-1],
        before=arguments.scenes[:-1],
        frame=frame.number,
        repeat=frame.repeat,
        run_programs=not arguments.no_programs,
        run_system=arguments.allow_system,
        on_demand=True,
        journal=kanuka.Journal(),
    )
    printer = messages.Printer(scene.journal, errors_only=arguments.quiet > 1)
    bar.between = printer.flush
    bar.finish()

    set_options(scene, arguments)
    named = None if frame.source else arguments.output
    output = frame.file(named) or default_output(arguments.scenes[-1], scene)
    if output in frame.written:  # frames whose displays have one name
        output = frames.numbered(output, frame)
    check_picture(output)
    frame.written.add(output)
    picture = kanuka.render(
        scene,
        progressions=arguments.progressions,
        threads=arguments.threads,
        resolution=None if frame.source else arguments.resolution,
        crop=None if frame.source else arguments.crop,
        shading_rate=arguments.shading_rate,
        geometry_tolerance=arguments.geometry_tolerance,
        max_depth=arguments.max_depth,
        integrator=arguments.integrator,
        seed=arguments.seed,
        aovs=arguments.aov,
        shutter=arguments.shutter_interval,
        lanes=arguments.lanes,
        strict_directions=arguments.strict_directions,
        progress=bar.update,
        journal=scene.journal,
    )
    bar.finish()

    if picture.cancelled:
        output = output.with_suffix(".partial.exr")
    written = write(picture, output, arguments.png and not picture.cancelled and not frame.source)
    if not picture.cancelled:
        folder = named.parent if named else Path()
        written += write_added(picture, scene, folder, frame, output)
    total = time.monotonic() - started
    if arguments.stats:
        statistics.write(frame.file(arguments.stats), picture, total)
    printer.flush()
    if arguments.verbose:
        print(statistics.describe(picture, total), file=sys.stderr)
    if arguments.fireflies:
        print(fireflies.describe(picture.stats), file=sys.stderr)
    if not arguments.quiet:
        classic = picture.metadata.get("kanuka.transport") == "classic" and arguments.transport is None
        light = ", with light as RISpec's renderers had it (--transport full traces all)" if classic else ""
        print(f"{picture.width} × {picture.height} pixels in {duration(total)}{light}", file=sys.stderr)
    for path in written:
        print(path)
    if picture.cancelled:
        return interruption.exit_code
    return ExitCode.ERRORS if scene.journal.error_count else ExitCode.OK


def set_options(scene: kanuka.Scene, arguments: argparse.Namespace) -> None:
    """Options of the command line over those of the scene; names are checked by the render, which reports them."""
    options = {
        "specular": arguments.specular,
        "transport": arguments.transport,
        "clamp_direct": arguments.clamp_direct,
        "clamp_indirect": arguments.clamp_indirect,
        "color_space": arguments.color_space,
        "output_space": arguments.output_space,
        "observer": arguments.observer,
        "sensor": arguments.sensor,
        "white_balance": arguments.white_balance,
        "exposure_stops": arguments.exposure,
        "f_stop": arguments.f_stop,
        "shutter_time": arguments.shutter,
        "iso": arguments.iso,
        "display": arguments.display,
    }
    if arguments.display is not None:
        scene.options.exposure_gamma = 1
    for name, value in options.items():
        if value is not None:
            setattr(scene.options, name, value)


def write(picture: kanuka.Picture, output: Path, png: bool) -> list[Path]:
    written = [output]
    picture.write(output)
    if png and output.suffix == ".exr":
        written.append(output.with_suffix(".png"))
        picture.write(written[-1])
    return written


def file_displays(scene: kanuka.Scene) -> list[dict]:
    return [d for d in scene.options.displays if d["driver"] != "framebuffer" and d["file"]]


def write_added(
    picture: kanuka.Picture, scene: kanuka.Scene, folder: Path, frame: frames.Frame, output: Path
) -> list[Path]:
    """Displays after the first have files of their own, in `folder`, with the layers that they ask for; the first one's
    has all layers, and stands for those of its name."""
    layers: dict[Path, list[str]] = {}
    for display in file_displays(scene)[1:]:
        path = folder / kanuka.picture_file(display["file"])
        if path != output:
            layers.setdefault(path, []).extend(name for name in display["layers"] if name in picture)
    written = []
    for path, names in layers.items():
        if not names:  # output variables that no shader has: told already
            continue
        file = frames.numbered(path, frame) if path in frame.written else path
        frame.written.add(file)
        check_picture(file)
        picture.write(file, layers=names)
        written.append(file)
    return written


def default_output(scene_file: str, scene: kanuka.Scene) -> Path:
    """The first Display that goes to a file, as an EXR; else the scene's own name, in this folder."""
    for display in file_displays(scene):
        return Path(kanuka.picture_file(display["file"]))
    if scene_file == "-":
        return Path("picture.exr")
    name = Path(scene_file).name
    for suffix in (".gz", ".rib"):
        name = name.removesuffix(suffix)
    return Path(name + ".exr")


def check_picture(path: Path) -> None:
    files.check_output(path, files.PICTURES, "pictures")


class Interruption:
    """Ctrl-C and SIGTERM alike raise KeyboardInterrupt once; the second time they have their usual effect."""

    def __init__(self) -> None:
        self.exit_code = ExitCode.INTERRUPTED
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self.handle)

    def handle(self, number: int, _frame: object) -> None:
        self.exit_code = ExitCode(128 + number)
        for each in (signal.SIGINT, signal.SIGTERM):
            signal.signal(each, signal.SIG_DFL)
        raise KeyboardInterrupt
