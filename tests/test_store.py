"""The store on disk: what one render has diced and shaded, others find, and no picture changes by it."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import time
import warnings
from pathlib import Path

import numpy as np
import pytest

import kanuka
from conftest import COMMAND, ROOT
from scenes import ball, instances
from test_sessions import look_from, same, still_life, translated


def render(scene: kanuka.Scene, store: Path, **arguments: object) -> tuple[kanuka.Picture, dict[str, int]]:
    picture = kanuka.render(scene, progressions=2, store=store, **arguments)
    assert picture.stats is not None
    return picture, picture.stats["count"]


def packs(store: Path) -> list[Path]:
    return sorted(store.glob("*.kpack"))


def test_the_second_render_dices_and_shades_nothing(tmp_path: Path) -> None:
    scene = still_life(tmp_path)
    without = kanuka.render(scene, progressions=2)
    cold, first = render(scene, tmp_path / "store")
    assert first["primitives_stored"] == 0
    assert len(packs(tmp_path / "store")) == 1
    warm, second = render(still_life(tmp_path), tmp_path / "store")
    assert second["primitives_stored"] == second["primitives"] == first["primitives"]
    assert second["shader_evaluations"] == 0
    assert same(cold, without)
    assert same(warm, without)
    assert warm.stats is not None
    assert warm.stats["bytes"]["store_read"] > 1000
    assert warm.stats["bytes"]["store_written"] == 0


MOVING = """\
Format 48 32 1
Shutter 0 1
Projection "perspective" "fov" 40
Translate 0 0 5
WorldBegin
AreaLightSource "arealight" 1 "intensity" 3
Translate 0 2 0
Disk 0 0.5 360
Translate 0 -2 0
Surface "matte"
MotionBegin [0 1]
PointsPolygons [4] [0 1 2 3] "P" [-2 -1 1 2 -1 1 2 1 1 -2 1 1]
PointsPolygons [4] [0 1 2 3] "P" [-2 -1 1 2 -1 1 2 1 2 -2 1.5 1]
MotionEnd
MotionBegin [0 1]
Curves "linear" [2 2] "nonperiodic" "P" [0 0 0 0 1 0 1 0 0 1 1 0] "constantwidth" [0.1]
Curves "linear" [2 2] "nonperiodic" "P" [0 0 0 0 1 0 1 0 0 2 1 0] "constantwidth" [0.1]
MotionEnd
MotionBegin [0 1]
Translate -1 0 0
Translate -1 0.3 0
MotionEnd
Sphere 0.5 -0.5 0.5 360
WorldEnd
"""


@pytest.mark.parametrize("name", ["shapes", "solids", "volumes", "listings", "showcase", "moving"])
def test_pages_of_all_kinds_come_back(tmp_path: Path, name: str) -> None:
    """Quadrics, patches, meshes, curves, points, blobs, trimmed and moving things: every check lets them pass."""
    file = ROOT / "scenes" / f"{name}.rib"
    if name == "moving":
        file = tmp_path / "moving.rib"
        file.write_text(MOVING)
    pictures = []
    for stored in (None, 0, 1):
        store = "" if stored is None else tmp_path / "store"
        picture = kanuka.render(kanuka.load(file), progressions=1, resolution=(96, 54), store=store)
        assert picture.stats is not None
        count = picture.stats["count"]
        assert count["primitives_stored"] == (stored or 0) * count["primitives"]
        assert "store" not in " ".join(map(str, picture.journal))
        pictures.append(picture)
    assert count["primitives"] > 3
    assert same(pictures[0], pictures[1])
    assert same(pictures[0], pictures[2])


@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("lanes", [1, 8])
def test_the_store_is_the_same_for_any_number_of_threads_and_lanes(tmp_path: Path, threads: int, lanes: int) -> None:
    render(still_life(tmp_path), tmp_path / "a")
    render(still_life(tmp_path), tmp_path / "b", threads=threads, lanes=lanes)
    (a,), (b,) = packs(tmp_path / "a"), packs(tmp_path / "b")
    assert a.name == b.name
    assert a.read_bytes() == b.read_bytes()


def test_only_what_an_edit_touches_is_made_again(tmp_path: Path) -> None:
    scene = ball()
    scene.add_sphere(0.3, name="other", material="plastic", transform=translated(0, 0, 1.2))
    _, first = render(scene, tmp_path / "store")
    scene.add_light("point", amount=3, position=(2, 2, 2))
    lit, lights = render(scene, tmp_path / "store")
    assert lights["primitives_stored"] == first["primitives"] == 2
    assert same(lit, kanuka.render(scene, progressions=2))
    scene.node("other", "surface").set(Kd=0.3)
    green, count = render(scene, tmp_path / "store")
    assert count["primitives_stored"] == 1
    assert same(green, kanuka.render(scene, progressions=2))
    _, again = render(scene, tmp_path / "store")
    assert again["primitives_stored"] == 2


def test_what_shaders_read_of_their_place_counts(tmp_path: Path) -> None:
    (tmp_path / "looks.sl").write_text(
        'surface looks() { Oi = 1; Ci = Cs * noise(9 * transform("world", P)) * diffuse(N); }'
    )
    scene = kanuka.Scene()
    scene.resolution = 24, 16
    scene.options.shader_path = [str(tmp_path)]
    look_from(scene, (0, 0, 6))
    scene.add_sphere(name="ball", material="looks", transform=translated(0.1, 0.1, 0))
    scene.add_light("point", amount=20, position=(3, 3, 3))
    places = [(0.1, 0.1, 0.0), (0.12, 0.1, 0.01), (0.1, 0.1, 0.0)]
    for stored, place in zip([0, 0, 1], places, strict=True):
        scene.node("ball").place(translated(*place))
        picture, count = render(scene, tmp_path / "store")
        assert count["primitives_stored"] == stored
        assert same(picture, kanuka.render(scene, progressions=2))


@pytest.mark.parametrize("how", ['texture(concat(map, ".exr"), s, t)', 'color(size(concat(map, ".exr")))'])
def test_textures_whose_names_are_put_together_count(tmp_path: Path, how: str) -> None:
    def paint(value: float, width: int) -> None:
        picture = kanuka.Picture({name: np.full((4, width), value, np.float32) for name in "RGB"})
        picture.write(tmp_path / "new.exr")
        shutil.move(tmp_path / "new.exr", tmp_path / "paint.exr")

    (tmp_path / "painted.sl").write_text(
        'float size(string file) { float size[2]; textureinfo(file, "resolution", size); return size[0] / 20; }\n'
        f'surface painted(string map = "paint") {{ Ci = color {how} * diffuse(N); Oi = 1; }}'
    )
    scene = ball()
    scene.options.shader_path = scene.options.texture_path = [str(tmp_path)]
    scene.add_sphere(0.3, material="painted", transform=translated(0, 0, 1.2))
    paint(0.2, 4)
    for stored in (0, 2):
        before, count = render(scene, tmp_path / "store")
        assert count["primitives_stored"] == stored
    paint(0.9, 8)
    after, count = render(scene, tmp_path / "store")
    assert count["primitives_stored"] == 1
    assert same(after, kanuka.render(scene, progressions=2))
    assert not same(after, before)


def test_measured_spectra_are_looked_at(tmp_path: Path) -> None:
    """Pages name them by number: numbers that mean something else are found."""
    (tmp_path / "a.spd").write_text("400 0.2\n500 0.9\n600 0.1\n700 0.5\n")
    (tmp_path / "b.spd").write_text("400 0.9\n500 0.1\n600 0.6\n700 0.1\n")

    def scene(*names: str) -> kanuka.Scene:
        made = ball()
        for i, name in enumerate(names):
            made.add_sphere(
                0.3,
                material=kanuka.Material("matte", color=kanuka.Spectrum(str(tmp_path / name))),
                transform=translated(0.5 * i - 0.5, 0, 1.2),
            )
        return made

    for names in (("a.spd",), ("a.spd", "b.spd"), ("b.spd", "a.spd"), ("b.spd",)):
        made = scene(*names)
        for _ in range(2):
            picture, count = render(made, tmp_path / "store")
            assert same(picture, kanuka.render(made, progressions=2)), names
        assert count["primitives_stored"] == count["primitives"]


def test_sessions_find_what_found_no_room_in_memory(tmp_path: Path) -> None:
    scene = still_life(tmp_path)
    session = kanuka.Session(scene, progressions=2, store=tmp_path / "store", page_memory=0)
    session.advance()
    scene.add_light("point", amount=3, position=(2, 2, 2))
    session.update()
    session.advance()
    kept = session.kept
    assert kept["primitives_stored"] == kept["primitives"]
    assert kept["primitives_kept"] == kept["primitives_evicted"] == 0
    assert same(session.picture(), kanuka.render(scene, progressions=2))


def test_reading_adds_nothing(tmp_path: Path) -> None:
    with pytest.warns(kanuka.Warning, match="the store cannot be read .*the render goes on without it"):
        picture, _ = render(ball(), tmp_path / "none", store_mode="read")
    assert not (tmp_path / "none").exists()
    render(ball(), tmp_path / "store")
    before = [(p.name, p.stat().st_mtime_ns) for p in packs(tmp_path / "store")]
    other, count = render(instances(), tmp_path / "store", store_mode="read")
    assert count["primitives_stored"] == 0
    again, count = render(ball(), tmp_path / "store", store_mode="read")
    assert count["primitives_stored"] == count["primitives"]
    assert [(p.name, p.stat().st_mtime_ns) for p in packs(tmp_path / "store")] == before
    assert same(again, picture)
    assert same(other, kanuka.render(instances(), progressions=2))


def test_damage_is_told_and_made_again(tmp_path: Path) -> None:
    scene = still_life(tmp_path)
    whole, _ = render(scene, tmp_path / "store")
    (pack,) = packs(tmp_path / "store")
    damaged = bytearray(pack.read_bytes())
    rng = np.random.default_rng(3)
    for _ in range(20):
        intact = bytes(damaged)
        for at in rng.integers(0, len(damaged), 3):
            damaged[at] ^= 0x41
        pack.write_bytes(damaged)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", kanuka.Warning)
            picture, _ = render(scene, tmp_path / "store")
        assert same(picture, whole)
        shutil.rmtree(tmp_path / "store")
        (tmp_path / "store").mkdir()
        pack.write_bytes(intact)
        damaged = bytearray(intact)


# ---- several processes ----------------------------------------------------------------------------------------------

SCENE = """\
Format 40 30 1
Projection "perspective" "fov" 40
Option "searchpath" "string shader" ["{folder}:&"]
Translate 0 0 5
WorldBegin
LightSource "distantlight" 1 "intensity" 2
Surface "lumps"
ShadingRate 0.3
{balls}
WorldEnd
"""


def many_balls(folder: Path) -> Path:
    """Some hundred pages, each of a content of its own."""
    (folder / "lumps.sl").write_text(
        'surface lumps() { Oi = 1; Ci = (0.2 + noise(9 * transform("object", P))) * diffuse(N); }'
    )
    balls = "".join(
        f"TransformBegin Translate {(i % 16) / 4 - 2} {(i // 16) / 4 - 1.5} {i / 200} Sphere {0.1 + i / 3000} -1 1 360 "
        "TransformEnd\n"
        for i in range(200)
    )
    scene = folder / "balls.rib"
    scene.write_text(SCENE.format(folder=folder, balls=balls))
    return scene


def command(scene: Path, store: Path, output: Path, *more: str) -> list[str]:
    return [
        COMMAND,
        "render",
        str(scene),
        "--store",
        str(store),
        "-o",
        str(output),
        "--progressions",
        "1",
        "-q",
        *more,
    ]


def test_killed_at_any_moment(tmp_path: Path) -> None:
    scene = many_balls(tmp_path)
    whole = kanuka.render(kanuka.load(scene), progressions=1)
    began = time.monotonic()
    subprocess.run(command(scene, tmp_path / "other", tmp_path / "first.exr"), check=True)
    takes = time.monotonic() - began
    for k in range(8):
        process = subprocess.Popen(
            command(scene, tmp_path / "store", tmp_path / "killed.exr"), stderr=subprocess.DEVNULL
        )
        time.sleep(takes * (0.3 + 0.1 * k))
        process.send_signal(signal.SIGKILL)
        process.wait()
        with warnings.catch_warnings():
            warnings.simplefilter("error", kanuka.Warning)  # nothing half written is taken for a pack
            picture = (
                kanuka.render(kanuka.load(scene), progressions=1, store=tmp_path / "store", store_mode="read")
                if (tmp_path / "store").exists()
                else whole
            )
        assert same(picture, whole)
    _, count = render(kanuka.load(scene), tmp_path / "store")
    picture, count = render(kanuka.load(scene), tmp_path / "store")
    assert count["primitives_stored"] == count["primitives"] == 200


def test_compressed_packs_give_the_same_picture(tmp_path: Path) -> None:
    store = tmp_path / "store"
    cold, _ = render(still_life(tmp_path), store)
    before = sum(pack.stat().st_size for pack in packs(store))
    command = [COMMAND, "store", "compress", str(store)]
    done = subprocess.run([*command, "--json"], capture_output=True, text=True, check=True)
    assert json.loads(done.stdout)["packs"] == 0  # it was used today
    phases: list[str] = []
    told = kanuka.store_compress(store, idle_s=0, progress=lambda phase, _: phases.append(phase))
    assert set(phases) == {"compress"}
    after = sum(pack.stat().st_size for pack in packs(store))
    assert told == {"packs": 1, "bytes_before": before, "bytes_after": after}
    assert after < 0.7 * before
    assert all(pack["compressed_pages"] and not pack["problem"] for pack in kanuka.store_packs(store, verify=True))
    warm, count = render(still_life(tmp_path), store)
    assert count["primitives_stored"] == count["primitives"]
    assert same(warm, cold)
    done = subprocess.run([*command, "--idle", "0"], capture_output=True, text=True, check=True)
    assert done.stdout == "0 packs compressed\n"


def test_renders_share_a_store_while_another_prunes_it(tmp_path: Path) -> None:
    scene = many_balls(tmp_path)
    whole = kanuka.render(kanuka.load(scene), progressions=1)
    store = tmp_path / "store"
    store.mkdir()
    outputs = [tmp_path / f"{i}.exr" for i in range(4)]
    renders = [
        subprocess.Popen(command(scene, store, output, "--threads", "1"), stderr=subprocess.PIPE, text=True)
        for output in outputs
    ]
    pruned = 0
    while any(r.poll() is None for r in renders):
        pruned += kanuka.store_prune(store, 0)
        time.sleep(0.02)
    whole.write(tmp_path / "whole.exr")
    for r, output in zip(renders, outputs, strict=True):
        assert r.returncode == 0, r.stderr.read() if r.stderr else ""
        assert same(kanuka.read(output), kanuka.read(tmp_path / "whole.exr"))
        assert r.stderr is not None
        assert r.stderr.read() == ""
    assert pruned > 0


def test_the_command(tmp_path: Path) -> None:
    scene, store = many_balls(tmp_path), tmp_path / "store"

    def run(*arguments: str, code: int = 0, **environment: str) -> str:
        done = subprocess.run(
            [COMMAND, *arguments], capture_output=True, text=True, env=os.environ | environment, check=False
        )
        assert done.returncode == code, done.stderr
        return done.stdout + (done.stderr if code else "")

    run("render", str(scene), "-o", str(tmp_path / "a.exr"), "--progressions", "1", "-q", KANUKA_STORE=str(store))
    run(*command(scene, store, tmp_path / "b.exr", "--stats", str(tmp_path / "b.json"))[1:])
    assert json.loads((tmp_path / "b.json").read_text())["count"]["primitives_stored"] == 200
    assert (tmp_path / "a.exr").read_bytes() == (tmp_path / "b.exr").read_bytes()
    assert "200 pages in" in run("store", "info", str(store))
    about = json.loads(run("store", "info", "--json", KANUKA_STORE=str(store)))
    assert [pack["pages"] for pack in about["packs"]] == [200]
    assert about["packs"][0]["of_this_build"] is True
    assert "0 of 1 files broken" in run("store", "verify", str(store))
    (pack,) = packs(store)
    damaged = bytearray(pack.read_bytes())
    damaged[len(damaged) // 2] ^= 1
    pack.write_bytes(damaged)
    assert "its checksum does not match" in run("store", "verify", str(store), code=3)
    assert json.loads(run("store", "verify", "--json", str(store), code=3))["broken"][0]["file"] == str(pack)
    assert run("store", "prune", str(store), "--size", "100G") == "0 files removed\n"
    assert json.loads(run("store", "prune", str(store), "--size", "0", "--json"))["removed"] == 1
    assert "which folder?" in run("store", "info", code=2)
    assert "there is no such folder" in run("store", "info", str(tmp_path / "none"), code=4)
    assert "20Q" in run(*command(scene, store, tmp_path / "c.exr", "--store-size", "20Q")[1:], code=2)
    wrong = run(*command(scene, store, tmp_path / "c.exr")[1:], code=2, KANUKA_STORE_MODE="both")
    assert "KANUKA_STORE_MODE" in wrong


@pytest.mark.parametrize(
    ("arguments", "message"),
    [({"store_mode": "both"}, "store_mode: expected"), ({"store_size": "much"}, "store_size: expected a size")],
)
def test_wrong_settings(arguments: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        kanuka.render(ball(), progressions=1, **arguments)
