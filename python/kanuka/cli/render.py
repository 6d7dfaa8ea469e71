"""kanuka render: from a scene file to a picture."""

from __future__ import annotations

import argparse
import signal
import sys
import time
from pathlib import Path

import kanuka

from . import arguments as types
from . import checkpoints, exit_codes, files, fireflies, frames, messages, oracle, products, scenes, statistics
from .exit_codes import ExitCode
from .progress import ProgressBar, duration
from .shader_cache import size

EXAMPLES = """\
examples:
  kanuka render scene.rib
  kanuka render scene.rib -o frames/a.exr --png --stats frames/a.json
  kanuka render scene.rib --progressions 4 --crop 0.4,0.6,0.4,0.6
  kanuka render options.rib scene.rib
  kanuka render walk.rib --frame all -o walk.####.exr
  kanuka render shot.usd --camera /shot/cam --frame 1-24
  kanuka render shot.usd --product /Render/beauty
  kanuka render ball.obj                         on a neutral stage; .ply .stl .gltf .glb too
  kanuka render scene.rib --store ~/pages              # again, with other lights: nothing is diced or shaded
  kanuka render scene.rib --checkpoint scene.state     # stopped? the same command goes on
  kanuka render scene.rib --part 256-511 --checkpoint b.state   # another host makes 0-255: kanuka merge --help

Each frame has its own picture. In -o and --stats a row of # is replaced by the frame's number; without it the number
goes before the suffix. A picture appears under its name complete or not at all. Ctrl-C (or SIGTERM) stops early and
saves the unfinished picture as NAME.partial.exr. A second one stops at once. Paths of written pictures go to standard
output, everything else to standard error.

"""


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    parser = subparsers.add_parser(
        "render",
        help="render a scene to a picture",
        description="Renders a RIB scene, a USD stage or a model to an OpenEXR picture.",
        epilog=EXAMPLES + exit_codes.HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "scenes",
        nargs="+",
        metavar="SCENE",
        help="RIB file, gzipped or not, USD stage or model; - is standard input. Several RIB files are read one after "
        "another as one",
    )
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="FILE.exr",
        help="the picture to write, .exr or .png; default: the file of the scene's Display, or those of the stage's "
        "products, or SCENE.exr",
    )
    parser.add_argument("--frame", type=frames.chosen, metavar="N", help=frames.HELP)
    parser.add_argument(
        "--together",
        action="store_true",
        help="with several frames: what stands still is diced for the cameras of all of them, and what is alike in one "
        "and the next is neither diced nor shaded again. Programs and plug-ins are asked once for what is alike. "
        "Stages are read once more, for their cameras",
    )
    parser.add_argument("--no-programs", action="store_true", help="procedurals may not run programs or libraries")
    parser.add_argument("--allow-system", action="store_true", help="the request System may run shell commands")
    parser.add_argument("--png", action="store_true", help="write a PNG beside the EXR")
    parser.add_argument("--stats", type=Path, metavar="FILE.json", help="write times, counts and memory use")
    parser.add_argument(
        "--checkpoint",
        type=Path,
        metavar="FILE",
        help="keep the samples so far in FILE, once a minute and when stopped; if it is there, go on from it: the same "
        "picture, bit for bit. It stays, so that --progressions can be raised later. Procedurals are all read then",
    )
    parser.add_argument(
        "--checkpoint-every", type=types.positive_float, metavar="S", default=60.0, help="seconds; default: 60"
    )
    parser.add_argument(
        "--part",
        type=types.part,
        metavar="A-B",
        help="render these progressions of the picture alone, for kanuka merge: from a multiple of 64 to one before "
        "one, as 0-255, or to the last. Takes --checkpoint; with -o a picture of them is written too",
    )
    parser.add_argument(
        "--fireflies", action="store_true", help="list the samples that are brightest relative to their pixels"
    )
    parser.add_argument(
        "-q", "--quiet", action="count", default=0, help="no progress; -qq: no warnings either, only errors"
    )
    parser.add_argument("-v", "--verbose", action="store_true", help="show times, counts and memory use")
    picture = parser.add_argument_group("options", "override the settings of the scene; see docs/options.md")
    for name, about in kanuka.option_parameters().items():
        if about["flag"]:
            types.add_option(picture, name, about if name != "integrator" else about | {"help": integrators_help()})
    picture.add_argument("--shading-rate", type=types.positive_float, metavar="R", help="factor for micropolygon areas")
    picture.add_argument(
        "--aov",
        action="append",
        default=[],
        metavar="NAME",
        help="output parameter of surface shaders, variable of primitives, or a light path expression as "
        "'lpe:C<RD>L', added to the EXR as a layer; repeatable",
    )
    picture.add_argument(
        "--oracle",
        type=Path,
        metavar="FILE",
        help="dice by what --write-oracle found: less where no ray looks closely, finer where something magnifies",
    )
    picture.add_argument(
        "--write-oracle",
        type=Path,
        metavar="FILE",
        help="render no picture: record how finely each part of each primitive is looked at, by a few paths a pixel in "
        "coarse geometry (--progressions 4 and --shading-rate 16, if they are not given)",
    )
    machine = parser.add_argument_group("machine", "these do not change the picture")
    machine.add_argument("--threads", type=types.positive_int, metavar="N", help="default: all cores")
    machine.add_argument("--lanes", type=int, choices=(0, 1, 8, 16), default=0, help="SIMD lanes; 0 = the widest")
    machine.add_argument(
        "--memory",
        type=size,
        metavar="SIZE",
        help="the most that geometry may take of the memory, as 500M or 4G: the rest waits in a folder "
        "(KANUKA_SCRATCH, TMPDIR, /var/tmp) and comes where it is needed, and vertices lie on a lattice (a "
        "thirty-second of a micropolygon off at most); default: KANUKA_MEMORY, else no bound",
    )
    machine.add_argument(
        "--store",
        metavar="DIR",
        help="keep what is diced and shaded in DIR, which many renders and hosts may share: the next one does neither "
        "for what has not changed; default: KANUKA_STORE. See kanuka store --help",
    )
    machine.add_argument("--store-mode", choices=("read", "write"), help="read: add nothing to it; default: write")
    machine.add_argument(
        "--store-size",
        type=size,
        metavar="SIZE",
        help="its largest size, as 500M or 20G: what was not used for longest goes",
    )
    scenes.add_arguments(parser)
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
    for layer in arguments.aov:
        try:
            kanuka.check_layer(layer)
        except ValueError as error:
            arguments.parser.error(f"--aov: {str(error).removeprefix('text: ')}")
    if arguments.output:
        check_picture(arguments.output)
    if arguments.stats:
        files.check_output(arguments.stats)
    if arguments.checkpoint:
        files.check_output(arguments.checkpoint)
    scenes.check(arguments, arguments.scenes)
    if arguments.together and arguments.frame is None:
        arguments.parser.error("--together: of which frames? Name them by --frame")
    if arguments.together and arguments.checkpoint:
        arguments.parser.error("--together: a checkpoint is of one frame; render them one by one")
    if arguments.part and not arguments.checkpoint:
        arguments.parser.error("--part: where to? Name a file by --checkpoint, for kanuka merge")
    interruption = Interruption()
    try:
        asked = arguments.frame is not None
        wanted = scenes.frames_of(arguments.frame, arguments.scenes) if asked else [frames.Frame()]
        wanted = products.pictures(arguments, wanted)
        if len(wanted) == 1:
            return render(arguments, wanted[0], started, interruption)
        return render_frames(arguments, wanted, interruption)
    except KeyboardInterrupt:
        print("interrupted before there was a picture", file=sys.stderr)
        return interruption.exit_code


def render_frames(arguments: argparse.Namespace, wanted: list[frames.Frame], interruption: Interruption) -> int:
    """One after another; an error in one does not keep the others from being rendered."""
    worst = ExitCode.OK
    shots = shots_of(arguments, wanted) if arguments.together else {}
    for k, frame in enumerate(wanted):
        if not arguments.quiet:
            print(f"{frame.title()} ({k + 1} of {len(wanted)})", file=sys.stderr)
        code = render(arguments, frame, time.monotonic(), interruption, shots.get(frame.of_shot))
        if code not in (ExitCode.OK, ExitCode.ERRORS):
            return code
        worst = worst or code
    return worst


def shots_of(arguments: argparse.Namespace, wanted: list[frames.Frame]) -> dict[tuple, Shot]:
    """One for each picture that a stage's products ask for in every frame; none for what textures are made of."""
    cameras: dict[tuple, list[kanuka.Camera]] = {}
    for frame in wanted:
        if not frame.source:
            cameras.setdefault(frame.of_shot, []).append(camera_of(arguments, frame))
    return {key: Shot(of_frames) for key, of_frames in cameras.items()}


class Shot:
    """Frames that are rendered one after the other by one session, which keeps what is alike in them."""

    def __init__(self, cameras: list[kanuka.Camera]) -> None:
        self.cameras = cameras
        self.expansions = kanuka.Expansions(cameras)
        self.session: kanuka.Session | None = None

    def picture(self, scene: kanuka.Scene, options: dict[str, object], bar: ProgressBar) -> kanuka.Picture:
        if self.session is None:
            self.session = kanuka.Session(scene, shot=self.cameras, **options)
        else:
            self.session.update(scene, **options)
        try:
            self.session.advance(progress=bar.update)
        except KeyboardInterrupt:
            if not self.session.prepared:
                raise
        return self.session.picture()


def render(
    arguments: argparse.Namespace,
    frame: frames.Frame,
    started: float,
    interruption: Interruption,
    shot: Shot | None = None,
) -> int:
    bar = ProgressBar(bool(arguments.quiet))
    bar.update("ingest", 0)
    scene = load(arguments, frame, shot and shot.expansions)
    printer = messages.Printer(scene.journal, errors_only=arguments.quiet > 1)
    bar.between = printer.flush
    bar.finish()

    options = options_of(arguments, frame)
    named = None if frame.source else arguments.output
    outputs = products.outputs(frame, arguments.aov) or {default_output(arguments.scenes[-1], scene): None}
    if named:
        outputs = {frame.file(named): next(iter(outputs.values()))}
    outputs = {new_file(path, frame): layers for path, layers in outputs.items()}
    options |= {
        "threads": arguments.threads,
        "shading_rate": arguments.shading_rate,
        "aovs": [*arguments.aov, *(name for product in frame.products for name in product.aovs)],
        "lanes": arguments.lanes,
        "store": arguments.store,
        "store_mode": arguments.store_mode,
        "store_size": None if arguments.store_size is None else str(arguments.store_size),
        "oracle": arguments.oracle,
        "memory": None if arguments.memory is None else str(arguments.memory),
        "journal": scene.journal,
    }
    if arguments.write_oracle:
        return oracle.write(scene, options, frame.file(arguments.write_oracle), arguments, bar, printer)
    if arguments.checkpoint:
        picture = checkpoints.picture(scene, options, frame.file(arguments.checkpoint), arguments, bar)
    elif shot:
        picture = shot.picture(scene, options, bar)
    else:
        picture = kanuka.render(scene, progress=bar.update, **options)
    bar.finish()

    written = []
    if arguments.part:
        written.append(frame.file(arguments.checkpoint))
        outputs = outputs if named else {}
    for output, layers in outputs.items():
        if picture.cancelled:
            output = output.with_suffix(".partial.exr")
        written += write(picture, output, arguments.png and not picture.cancelled and not frame.source, layers)
    if not picture.cancelled and not arguments.part:
        folder = named.parent if named else Path()
        written += write_added(picture, scene, folder, frame, next(iter(outputs)))
    total = time.monotonic() - started
    of_shot = statistics.of_shot(scene, shot.session) if shot and shot.session else {}
    if arguments.stats:
        statistics.write(frame.file(arguments.stats), picture, total, of_shot)
    printer.flush()
    if arguments.verbose:
        print(statistics.describe(picture, total, of_shot), file=sys.stderr)
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


def camera_of(arguments: argparse.Namespace, frame: frames.Frame) -> kanuka.Camera:
    """Of what load() reads."""
    file = arguments.scenes[-1]
    if scenes.is_read_whole(file):
        return load(arguments, frame).camera
    return kanuka.load_camera(file, before=arguments.scenes[:-1], frame=frame.number, repeat=frame.repeat)


def load(
    arguments: argparse.Namespace, frame: frames.Frame, expansions: kanuka.Expansions | None = None
) -> kanuka.Scene:
    file = arguments.scenes[-1]
    if scenes.is_read_whole(file):
        number = None if arguments.frame is None else frame.number
        return scenes.load(file, arguments, number, [product.path for product in frame.products])
    return kanuka.load(
        file,
        before=arguments.scenes[:-1],
        frame=frame.number,
        repeat=frame.repeat,
        run_programs=not arguments.no_programs,
        run_system=arguments.allow_system,
        on_demand=not (arguments.checkpoint or arguments.oracle or arguments.write_oracle),
        expansions=expansions,
        journal=kanuka.Journal(),
    )


def options_of(arguments: argparse.Namespace, frame: frames.Frame) -> dict[str, object]:
    """Options that go over those of the scene. What textures are made of keeps its size."""
    options = {name: getattr(arguments, name, None) for name in kanuka.option_parameters()}
    if frame.source:
        options["resolution"] = options["crop"] = None
    if options["display"] is not None:
        options["exposure_gamma"] = 1
    options["progressions"] = options.pop("samples")
    return options


def write(picture: kanuka.Picture, output: Path, png: bool, layers: list[str] | None) -> list[Path]:
    """With those of `layers` that it has, or all; what it has not was told. A PNG is the picture's colour."""
    some = [name for name in layers or () if name in picture]
    layers = some if some and output.suffix == ".exr" else None
    written = [output]
    picture.write(output, layers=layers)
    if png and output.suffix == ".exr":
        written.append(output.with_suffix(".png"))
        picture.write(written[-1])
    return written


def new_file(path: Path, frame: frames.Frame) -> Path:
    """Not one that was written before: frames whose displays have one name."""
    if path in frame.written:
        path = frames.numbered(path, frame)
    check_picture(path)
    frame.written.add(path)
    return path


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
    return Path(scenes.name_of(scene_file) + ".exr")


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
