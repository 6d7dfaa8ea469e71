"""Pictures that are made step by step: looked at, stopped, saved, gone on with, and made again after edits."""

from __future__ import annotations

import shutil
import signal
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import kanuka
from conftest import COMMAND
from scenes import ball, grid, instances, quad
from test_interruption import wait_for_tracing

LAYERS = ("rgb", "alpha", "Z", "N", "albedo")


def pixels(picture: kanuka.Picture) -> list[np.ndarray]:
    return [np.asarray(picture[name]) for name in LAYERS if name in picture]


def same(a: kanuka.Picture, b: kanuka.Picture) -> bool:
    assert len(pixels(a)) >= 3
    return all(np.array_equal(x, y, equal_nan=True) for x, y in zip(pixels(a), pixels(b), strict=True))


def translated(x: float, y: float, z: float) -> np.ndarray:
    m = np.eye(4)
    m[:3, 3] = x, y, z
    return m


# ---- steps, stops, files --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("steps", [(16,), (1, 2, 16), (7, 9, 16), tuple(range(1, 17))])
def test_steps_make_the_same_picture(steps: tuple[int, ...]) -> None:
    whole = kanuka.render(instances(), progressions=16)
    session = kanuka.Session(instances(), progressions=16)
    assert session.progressions == 0 and session.wanted == 16
    for step in steps:
        assert session.advance(progressions=step)
        assert session.progressions == step
        assert session.picture().cancelled == (step < 16)
    assert same(session.picture(), whole)


def test_a_step_is_the_picture_of_so_many_progressions() -> None:
    session = kanuka.Session(ball(), progressions=16)
    session.advance(progressions=5)
    assert same(session.picture(), kanuka.render(ball(), progressions=5))


def test_time_that_is_up_is_no_loss(tmp_path: Path) -> None:
    whole = kanuka.render(instances(), progressions=64)
    session = kanuka.Session(instances(), progressions=64)
    stops = 0
    while not session.advance(seconds=0.005):  # stops among buckets: some have come further than others
        stops += 1
        assert stops < 10_000
        if stops == 3:
            session.save(tmp_path / "state")
            session = kanuka.Session(instances(), progressions=64, threads=1)
            session.resume(tmp_path / "state")
    assert same(session.picture(), whole)


@pytest.mark.parametrize("threads", [1, 3])
def test_a_saved_picture_goes_on(tmp_path: Path, threads: int) -> None:
    scene = ball()
    session = kanuka.Session(scene, progressions=16)
    session.advance(progressions=6)
    session.save(tmp_path / "state")
    other = kanuka.Session(ball(), progressions=24, threads=threads)  # more than were wanted
    other.resume(tmp_path / "state")
    assert other.progressions == 6
    assert other.advance()
    assert same(other.picture(), kanuka.render(ball(), progressions=24))


def change(of: Callable[[kanuka.Scene], object], **arguments: object) -> tuple:
    return of, arguments


@pytest.mark.parametrize(
    ("of", "arguments"),
    [
        change(lambda s: None, seed=1),
        change(lambda s: None, max_depth=3),
        change(lambda s: None, shading_rate=2),
        change(lambda s: None, resolution=(16, 24)),
        change(lambda s: s.add_light("point", amount=1e-3)),
        change(lambda s: s.node(1).place(translated(0.1, 0, 0))),
        change(lambda s: s.node("camera").set(fov=41)),
    ],
)
def test_a_file_is_of_one_picture(tmp_path: Path, of: Callable, arguments: dict) -> None:
    session = kanuka.Session(ball(), progressions=4)
    session.advance(progressions=2)
    session.save(tmp_path / "state")
    scene = ball()
    of(scene)
    other = kanuka.Session(scene, progressions=4, **arguments)
    with pytest.raises(kanuka.Error, match=r"state: the checkpoint is of another picture.*begin anew"):
        other.resume(tmp_path / "state")
    assert other.progressions == 0
    assert other.advance()
    assert same(other.picture(), kanuka.render(scene, progressions=4, **arguments))


def test_a_picture_of_the_sky_is_part_of_the_key(tmp_path: Path) -> None:
    def under(brightness: float) -> kanuka.Session:
        sky = np.full((8, 16, 3), brightness, np.float32)
        kanuka.Picture({"rgb": sky}).write(tmp_path / "sky.exr")
        scene = ball()
        scene.add_light("environment", texture=str(tmp_path / "sky.exr"))
        return kanuka.Session(scene, progressions=2)

    session = under(0.2)
    session.advance()
    session.save(tmp_path / "state")
    under(0.2).resume(tmp_path / "state")
    with pytest.raises(kanuka.Error, match="of another picture"):
        under(0.3).resume(tmp_path / "state")


def test_damaged_files_are_refused(tmp_path: Path) -> None:
    session = kanuka.Session(ball(), progressions=4)
    session.advance(progressions=2)
    session.save(tmp_path / "state")
    whole = (tmp_path / "state").read_bytes()
    rng = np.random.default_rng(5)
    damaged = [whole[:n] for n in (0, 3, 40, len(whole) // 2, len(whole) - 1)]
    for at in [0, 5, 9, 30, 45, 60, *rng.integers(0, len(whole), 30)]:
        damaged.append(whole[:at] + bytes([whole[at] ^ 0x10]) + whole[at + 1 :])
    other = kanuka.Session(ball(), progressions=4)
    for one in damaged:
        (tmp_path / "damaged").write_bytes(one)
        with pytest.raises(kanuka.Error, match=r"damaged: .*checkpoint"):
            other.resume(tmp_path / "damaged")
        assert other.progressions == 0
    for other_kind in (b"", b"abc", b"P6 1 1 255\n", whole[4:]):  # shorter than a checkpoint, or as long
        (tmp_path / "picture").write_bytes(other_kind)
        with pytest.raises(kanuka.Error, match=r"picture: this is no checkpoint; remove it, or name another"):
            other.resume(tmp_path / "picture")
    (tmp_path / "short").write_bytes(whole[:40])
    with pytest.raises(kanuka.Error, match=r"short: the checkpoint ends early"):
        other.resume(tmp_path / "short")
    with pytest.raises(kanuka.Error, match="cannot be opened"):
        other.resume(tmp_path / "none")
    other.resume(tmp_path / "state")
    assert other.progressions == 2


def test_an_interrupt_loses_nothing() -> None:
    session = kanuka.Session(ball(), progressions=8)

    def interrupt(phase: str, fraction: float) -> None:
        if phase == "progressions" and fraction > 0.2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        while not session.advance(progress=interrupt):
            pass
    assert session.advance()
    assert same(session.picture(), kanuka.render(ball(), progressions=8))


def test_what_cannot_be_is_said() -> None:
    session = kanuka.Session(ball(), progressions=2)
    with pytest.raises(ValueError, match="there is no picture yet"):
        session.picture()
    with pytest.raises(ValueError, match="progressions must be 1 or more"):
        session.advance(progressions=0)
    with pytest.raises(TypeError, match="did you mean progressions"):
        kanuka.Session(ball(), progresions=2)
    with pytest.raises(kanuka.Error, match="nothing to save yet"):
        session.save("state")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_command_goes_on_where_it_was_stopped(ball: Path, tmp_path: Path, number: int) -> None:
    def start(*arguments: object) -> subprocess.Popen[str]:
        command = [COMMAND, "render", ball, "--progressions", 400, "--checkpoint", "state", *arguments]
        return subprocess.Popen(
            list(map(str, command)), cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )

    process = start("-o", "a.exr", "--checkpoint-every", 0.05)
    wait_for_tracing(process)
    process.send_signal(number)
    output, told = process.communicate(timeout=60)
    assert (tmp_path / "state").exists()
    if process.returncode != 0:  # it was not too late
        assert process.returncode == 128 + number and output == "a.partial.exr\n"
        assert "the samples so far are in state" in told
    process = start("-o", "b.exr")
    output, told = process.communicate(timeout=60)
    assert process.returncode == 0 and output == "b.exr\n"
    assert "goes on from state" in told
    subprocess.run(
        [COMMAND, "render", ball, "-o", "whole.exr", "--progressions", "400", "-q"], cwd=tmp_path, check=True
    )
    assert same(kanuka.read(tmp_path / "b.exr"), kanuka.read(tmp_path / "whole.exr"))


# ---- edits ----------------------------------------------------------------------------------------------------------

STRIPES = "surface stripes(float n = 4) { Ci = Cs * (mod(s * n, 1) < 0.5 ? 1 : 0.3) * diffuse(N); Oi = Os; }"


def still_life(folder: Path) -> kanuka.Scene:
    """Fourteen primitives and a group of three, of several kinds and materials; lights of several kinds."""
    (folder / "stripes.sl").write_text(STRIPES)
    scene = kanuka.Scene()
    scene.resolution = 32, 24
    scene.options.shader_path = [str(folder)]
    scene.camera = kanuka.Camera((0, 1.5, 6), (0, 0, 0), fov=40)
    floor = grid(8, lambda x, z: 0 * x)
    scene.add_mesh(floor[0] * 4 - [0, 1, 0], floor[1], name="floor", material=kanuka.Material("stripes", n=9))
    for i in range(12):
        material = kanuka.Material(("matte", "plastic", "stripes")[i % 3], color=(0.3 + 0.05 * i, 0.5, 0.8 - 0.05 * i))
        scene.add_sphere(0.3, name=f"ball{i}", material=material, transform=translated(i % 4 - 1.5, -0.7, i // 4 - 1.5))
    cage = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float32) * 0.4
    faces = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]], np.int32)
    scene.add_subdivision(cage, faces, name="blob", material="matte", transform=translated(0, 0.8, 0))
    group = scene.add_group("tree")
    for i in range(3):
        group.add_sphere(0.1 + 0.02 * i, name=f"leaf{i}", material="plastic", transform=translated(0, 0.15 * i, 0))
    places = np.stack([translated(x, -1, -2) for x in (-2, -1, 1, 2)])
    scene.add_instances(group, places)
    panel = quad((-0.5, 3, -0.5), (0.5, 3, -0.5), (0.5, 3, 0.5), (-0.5, 3, 0.5))
    scene.add_mesh(*panel, name="panel", material="matte", area_light=(4, 4, 3))
    scene.add_light("environment", amount=0.2, name="sky")
    scene.add_light("distant", amount=1, direction=(-1, -1, -1), angle=3, name="sun")
    scene.add_light("point", amount=2, position=(2, 2, 2), name="lamp")
    return scene


def turned(degrees: float, place: np.ndarray) -> np.ndarray:
    turn = np.eye(4)
    a = np.radians(degrees)
    turn[:3, :3] = [[np.cos(a), 0, np.sin(a)], [0, 1, 0], [-np.sin(a), 0, np.cos(a)]]
    return place @ turn


def look_from(scene: kanuka.Scene, origin: tuple[float, float, float]) -> None:
    scene.camera = kanuka.Camera(origin, (0, 0, 0), fov=40)


def add_bush(scene: kanuka.Scene) -> None:
    group = scene.add_group("bush")
    group.add_sphere(0.2, material="matte")
    scene.add_instances(group, np.stack([translated(x, -0.8, 1.5) for x in (-1, 1)]))


PRIMITIVES = 18  # floor, balls, blob, leaves, panel
ALL = PRIMITIVES
# What is done, how many primitives are diced and shaded again, and is the hierarchy built.
EDITS: dict[str, tuple[Callable[[kanuka.Scene], object], int, bool]] = {
    "lamp brighter": (lambda s: s.node("lamp").set(amount=5), 0, False),
    "lamp elsewhere": (lambda s: s.node("lamp").place(translated(-1, 0, 0)), 0, False),
    "lamp soft": (lambda s: s.node("lamp").set(radius=0.2), 0, False),
    "sun wider": (lambda s: s.node("sun").set(angle=10), 0, False),
    "sky darker": (lambda s: s.node("sky").set(amount=0.05), 0, False),
    "a light more": (lambda s: s.add_light("spot", amount=3, position=(0, 3, 3), name="spot"), 0, False),
    "a light less": (lambda s: s.remove([s.node("sun")]), 0, False),
    "fewer bounces": (lambda s: setattr(s.options, "max_depth", 1), 0, False),
    "clamped": (lambda s: setattr(s.options, "clamp_indirect", 2.0), 0, False),
    "more light samples": (lambda s: setattr(s.options, "light_samples", 4), 0, False),
    "another seed": (lambda s: setattr(s.options, "seed", 9), 0, False),
    "another filter": (lambda s: setattr(s.options, "filter", "box"), 0, False),
    "another integrator": (lambda s: setattr(s.options, "integrator", "direct"), 0, False),
    "exposure": (lambda s: setattr(s.options, "exposure_gain", 2.0), 0, False),
    "not watertight": (lambda s: setattr(s.options, "watertight", False), 0, True),
    "a colour": (lambda s: s.node("ball0", "surface").set(Kd=0.5), 1, True),
    "a shader's number": (lambda s: s.node("ball2", "surface").set(n=7), 1, True),
    "the floor's stripes": (lambda s: s.node("floor", "surface").set(n=3), 1, True),
    "a ball moves": (lambda s: s.node("ball5").place(translated(-0.48, -0.7, -0.5)), 0, True),
    "a ball goes far": (lambda s: s.node("ball5").place(translated(0, -0.7, -3)), 1, True),
    "the blob moves": (lambda s: s.node("blob").place(translated(0, 0.85, 0)), 0, True),
    "a ball goes": (lambda s: s.remove([s.node("ball7")]), 0, True),
    "a ball comes": (lambda s: s.add_sphere(0.2, name="new", material="matte"), 1, True),
    "unseen by the camera": (lambda s: s.node("ball1").set(visible_camera=False), 1, True),
    "traced as it is diced": (lambda s: s.node("blob").set(dice_flatness=False), 1, True),
    "no terminator": (lambda s: s.node("ball3").set(shadow_terminator=False), 1, True),
    "unlit by the lamp": (lambda s: s.node("ball4").set(lights_off=["lamp"]), 1, True),
    "a leaf's gloss": (lambda s: s.node("tree", "leaf1", "surface").set(roughness=0.4), 1, True),
    "a bush more": (add_bush, 1, True),
    "the panel is brighter": (lambda s: s.node("panel", "area_light").set(intensity=2), 1, True),
    "a ball is turned": (lambda s: s.node("ball5").place(turned(30, translated(-0.5, -0.7, -0.5))), 1, True),
    # Floor and panel lie across the border of the picture.
    "the camera moves a little": (lambda s: look_from(s, (0.02, 1.5, 6)), 2, True),
    "the camera goes near": (lambda s: look_from(s, (0, 1, 3)), ALL, True),
    "the camera zooms": (lambda s: s.node("camera").set(fov=30), ALL, True),
    "coarser geometry": (lambda s: setattr(s.options, "geometry_tolerance", 1.0), ALL, True),
}


@pytest.mark.parametrize("name", EDITS)
def test_an_edit_makes_again_what_it_touches(tmp_path: Path, name: str) -> None:
    edit, again, builds = EDITS[name]
    scene = still_life(tmp_path)
    session = kanuka.Session(scene, progressions=2)
    session.advance()
    before = session.picture()
    try:
        edit(scene)
    except (TypeError, ValueError) as error:
        pytest.fail(f"{name}: {error}")
    session.update()
    assert session.progressions == 0
    session.advance()
    fresh = kanuka.render(scene, progressions=2)
    assert same(session.picture(), fresh)
    assert not same(before, fresh) or name in (
        "no terminator",
        "not watertight",
        "clamped",
        "exposure",
        "traced as it is diced",
    )
    kept = session.kept
    assert kept["primitives"] - kept["primitives_kept"] == again
    assert kept["hierarchies_kept"] == (not builds)


SHADERS = {
    "plain": "Ci = Cs * diffuse(N);",
    "object": 'Ci = Cs * noise(9 * transform("object", P)) * diffuse(N);',
    "world": 'Ci = Cs * noise(9 * transform("world", P)) * diffuse(N);',
    "camera": 'Ci = Cs * noise(9 * transform("camera", P)) * diffuse(N);',
    "rim": "Ci = Cs * pow(abs(normalize(I) . normalize(N)), 0.5) * diffuse(N);",
    "lights": "Ci = 0; illuminance(P, N, PI / 2) { Ci += Cs * Cl * step(0.5, mod(4 * length(L), 1)); }",
}
# What moves, of which the shader reads something: lights are placed in the world, and loops over them may ask for
# the camera.
READ = {name: {"world", "camera"} for name in ("camera", "rim", "lights")} | {"world": {"world"}}


@pytest.mark.parametrize("name", SHADERS)
@pytest.mark.parametrize("moves", ["world", "camera"])
def test_what_a_shader_read_of_its_place_decides(tmp_path: Path, name: str, moves: str) -> None:
    """A page stays as long as all that its shaders have read of where they stand has the same values."""
    (tmp_path / "looks.sl").write_text(f"surface looks() {{ Oi = 1; {SHADERS[name]} }}")
    scene = kanuka.Scene()
    scene.resolution = 24, 16
    scene.options.shader_path = [str(tmp_path)]
    look_from(scene, (0, 0, 6))
    scene.add_sphere(name="ball", material="looks", transform=translated(0.1, 0.1, 0))
    scene.add_light("point", amount=20, position=(3, 3, 3))
    scene.options.transport = "classic"  # loops that no lobe stands for gather light while they are shaded
    session = kanuka.Session(scene, progressions=2)
    session.advance()
    before = session.picture()
    if moves == "world":
        scene.node("ball").place(translated(0.12, 0.1, 0.01))
    else:
        look_from(scene, (0.02, 0, 6.01))
    session.update()
    session.advance()
    assert same(session.picture(), kanuka.render(scene, progressions=2))
    assert not same(session.picture(), before)
    assert session.kept["primitives_kept"] == (moves not in READ.get(name, ()))


def test_a_scene_that_moves_as_a_whole_has_the_same_pages(tmp_path: Path) -> None:
    (tmp_path / "lumps.sl").write_text(
        'displacement lumps() { P += 0.05 * noise(5 * transform("object", P)) * normalize(N); N = calculatenormal(P); }'
    )
    scene = kanuka.Scene()
    scene.resolution = 48, 32
    scene.options.shader_path = [str(tmp_path)]
    lumpy = kanuka.Material("matte", displacement=kanuka.Shader("lumps"), displacement_bound=0.1)
    places = {f"ball{i}": (0.9 * (i % 3) - 0.8, 0.7 * (i // 3) - 0.3, 0.4 * i - 1) for i in range(6)}
    for i, (name, place) in enumerate(places.items()):
        scene.add_sphere(0.4, name=name, material=lumpy if i % 2 else "plastic", transform=translated(*place))
    scene.add_light("distant", amount=2, direction=(-1, -1, -1), angle=5)
    scene.add_light("environment", amount=0.1)

    def look(offset: np.ndarray) -> None:
        scene.camera = kanuka.Camera(tuple(offset + np.array([0.3, 0.5, 5])), tuple(offset), fov=50)

    look(np.zeros(3))
    session = kanuka.Session(scene, progressions=64)
    session.advance()
    here = session.picture()
    offset = np.array([1e5, -1e5, 3e4])
    for name, place in places.items():
        scene.node(name).place(translated(*(offset + place)))
    look(offset)
    session.update()
    session.advance()
    assert session.kept["primitives_kept"] == session.kept["primitives"] == 6
    assert same(session.picture(), kanuka.render(scene, progressions=64))
    a, b = np.asarray(here["rgb"]), np.asarray(session.picture()["rgb"])
    assert np.abs(a - b).mean() < 2e-3 * a.mean()


def test_edits_follow_each_other(tmp_path: Path) -> None:
    """All of them on one session, in order, and nothing is left of what was before."""
    scene = still_life(tmp_path)
    session = kanuka.Session(scene, progressions=1)
    session.advance()
    for name, (edit, _, _) in EDITS.items():
        if name in ("another integrator", "exposure"):
            continue
        edit(scene)
        session.update()
        session.advance()
        assert same(session.picture(), kanuka.render(scene, progressions=1)), name


def test_textures_that_are_painted_anew_count(tmp_path: Path) -> None:
    def paint(value: float) -> None:
        picture = kanuka.Picture({name: np.full((4, 4), value, np.float32) for name in "RGB"})
        picture.write(tmp_path / "new.exr")
        shutil.move(tmp_path / "new.exr", tmp_path / "paint.exr")

    (tmp_path / "painted.sl").write_text(
        'surface painted(string map = "") { Ci = color texture(map, s, t) * diffuse(N); Oi = 1; }'
    )
    scene = ball()
    scene.options.shader_path = scene.options.texture_path = [str(tmp_path)]
    scene.add_sphere(0.3, material=kanuka.Material("painted", map="paint.exr"), transform=translated(0, 0, 1.2))
    paint(0.2)
    session = kanuka.Session(scene, progressions=2)
    session.advance()
    session.update()
    session.advance()
    kept = {"primitives": 2, "primitives_kept": 2, "hierarchies_kept": 1}
    assert session.kept == kept | {"primitives_evicted": 0, "primitives_stored": 0}
    paint(0.9)
    session.update()
    session.advance()
    assert session.kept["primitives_kept"] == 1
    assert same(session.picture(), kanuka.render(scene, progressions=2))


def test_keys_alone_keep_no_pages() -> None:
    session = kanuka.Session(ball(), keep_pages=False, progressions=1)
    session.advance()
    session.update()
    session.advance()
    assert session.kept["primitives_kept"] == 0
