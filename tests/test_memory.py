"""Renders within a bound on memory: what is large waits on a disk, and the picture is the same."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import kanuka
from test_sessions import same

CGROUP = Path("/sys/fs/cgroup/memory")


def hills(balls: int = 6) -> kanuka.Scene:
    """Displaced balls beside each other, some 100 000 micropolygons each; some in instances, one of hairs."""
    scene = kanuka.Scene()
    scene.resolution = 320, 180
    scene.camera = kanuka.Camera((0, 2, 9), (0, 0, 0), fov=40)
    lumps = kanuka.Shader("rough", swell=0.2, frequency=2, grain=0.02, fineness=20)
    bark = kanuka.Material("matte", color=(0.5, 0.4, 0.3), displacement=lumps, displacement_bound=0.3)
    for i in range(balls):
        scene.add_sphere(1, transform=moved(2.1 * (i % 3) - 2.1, 0, 2.1 * (i // 3) - 2), material=bark)
    group = scene.add_group("stone")
    group.add_sphere(0.2, material=bark)
    scene.add_instances(group, np.stack([moved(0.5 * k - 2, 1.2, 1) for k in range(8)]))
    strands = np.array([[[0, 1, 0], [0.1 * k - 0.3, 1.8, 0.2]] for k in range(7)], np.float32)
    scene.add_curves(strands.reshape(-1, 3), [2] * 7, widths=0.02)
    scene.add_light("distant", amount=3, direction=(-1, -2, -1))
    scene.add_light("environment", amount=0.4)
    return scene


def moved(x: float, y: float, z: float) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix


@pytest.fixture
def shaders() -> Path:
    return Path(__file__).resolve().parent.parent / "bench/shaders"


def rendered(shaders: Path, balls: int = 6, rate: float = 0.1, **options: object) -> kanuka.Picture:
    scene = hills(balls)
    scene.options.shader_path = [str(shaders)]
    return kanuka.render(scene, progressions=4, shading_rate=rate, **options)


def test_pictures_are_the_same_for_every_budget(shaders: Path) -> None:
    pictures = [rendered(shaders, memory=memory) for memory in ("100G", "300M", "1M")]
    for picture in pictures[1:]:
        assert same(picture, pictures[0])
    assert pictures[0].stats["bytes"]["scratch"] > 20e6
    assert pictures[0].stats["bytes"]["given_back"] == 0
    assert pictures[2].stats["bytes"]["given_back"] > 0
    # Without a budget Embree has the small groups, and vertices stand where they were diced.
    free = rendered(shaders)
    assert free.stats["bytes"]["scratch"] == 0
    a, b = (np.asarray(p["rgb"], np.float64) for p in (free, pictures[0]))
    assert abs(a.mean() / b.mean() - 1) < 0.002
    assert np.abs(a - b).mean() < 0.1 * a.mean()


def test_threads_stops_and_edits_do_not_change_it(shaders: Path) -> None:
    whole = rendered(shaders, memory="1M", threads=1)
    assert same(rendered(shaders, memory="1M", threads=4), whole)
    scene = hills()
    scene.options.shader_path = [str(shaders)]
    session = kanuka.Session(scene, progressions=4, shading_rate=0.1, memory="1M")
    session.advance(progressions=1)
    scene.add_light("point", amount=1, position=(0, 5, 0), name="lamp")
    session.update()
    session.advance(progressions=2)
    scene.remove([scene.node("lamp")])
    session.update()
    session.advance()
    assert same(session.picture(), whole)


def test_a_budget_that_comes_later_counts(shaders: Path, tmp_path: Path) -> None:
    scene = hills()
    scene.options.shader_path = [str(shaders)]
    options = {"progressions": 4, "shading_rate": 0.1}
    session = kanuka.Session(scene, **options)
    session.advance()
    free = session.picture()
    session.save(tmp_path / "free.state")
    session.update(memory="100G", **options)
    with pytest.raises(kanuka.Error, match="another picture"):
        session.resume(tmp_path / "free.state")
    session.advance()
    assert same(session.picture(), rendered(shaders, memory="100G"))
    session.update(memory="0", **options)  # none: what update() does not say stays
    session.advance()
    assert same(session.picture(), free)


def test_more_than_the_budget_is_told(shaders: Path) -> None:
    with pytest.warns(kanuka.Warning, match="in memory at once, and its budget is 1"):
        rendered(shaders, memory="1M")


def test_budgets_are_sizes(monkeypatch: pytest.MonkeyPatch, shaders: Path) -> None:
    with pytest.raises(ValueError, match="memory: expected a size"):
        rendered(shaders, memory="much")
    monkeypatch.setenv("KANUKA_MEMORY", "much")
    with pytest.raises(kanuka.Error, match="KANUKA_MEMORY"):
        rendered(shaders)
    monkeypatch.setenv("KANUKA_MEMORY", "1G")
    assert rendered(shaders).stats["bytes"]["scratch"] > 0


@pytest.mark.parametrize("folder", ["/nowhere/at/all", "/dev/shm"])
def test_folders_that_cannot_serve(monkeypatch: pytest.MonkeyPatch, shaders: Path, folder: str) -> None:
    monkeypatch.setenv("KANUKA_SCRATCH", folder)
    with pytest.raises(kanuka.Error, match="KANUKA_SCRATCH"):
        rendered(shaders, memory="1G")


CHILD = """
import json, sys
sys.path.insert(0, sys.argv[1])
from pathlib import Path
import numpy as np
import test_memory
group = sys.argv[2]
if group:
    (Path(group) / "cgroup.procs").write_text("0")
picture = test_memory.rendered(Path(sys.argv[3]), balls=40, rate=0.01, **json.loads(sys.argv[4]))
np.save(sys.argv[5], picture["rgb"])
"""


def test_where_the_machine_has_no_more(tmp_path: Path, shaders: Path) -> None:
    """The system's own bound, what it keeps of files included: 17 M micropolygons that take twice as much."""
    group = CGROUP / f"kanuka-test-{os.getpid()}"
    try:
        group.mkdir()
        (group / "memory.limit_in_bytes").write_text(str(420 << 20))
    except OSError as error:
        pytest.skip(f"memory cannot be bounded here: {error}")

    def ends(name: str, bound: str, memory: str | None) -> int:
        arguments = [bound, str(shaders), json.dumps({"memory": memory}), str(tmp_path / name)]
        command = [sys.executable, "-c", CHILD, str(Path(__file__).parent), *arguments]
        return subprocess.run(command, timeout=500, env=os.environ | {"PYTHONWARNINGS": "ignore"}).returncode

    try:
        assert ends("killed", str(group), None) == -signal.SIGKILL
        assert ends("bound", str(group), "100M") == 0
        assert int((group / "memory.max_usage_in_bytes").read_text()) <= 420 << 20
        assert ends("free", "", "100G") == 0
    finally:
        group.rmdir()
    assert np.array_equal(np.load(tmp_path / "free.npy"), np.load(tmp_path / "bound.npy"))


def waves() -> kanuka.Scene:
    """A sheet, hair and spray that change while the shutter is open, at three times; the sheet in instances too."""
    scene = kanuka.Scene()
    scene.resolution = 160, 90
    scene.options.shutter = 0, 1
    scene.camera = kanuka.Camera((0, 5, 12), (0, 0, 0), fov=40)
    side = np.linspace(-4, 4, 60)
    x, z = np.meshgrid(side, side)
    times = np.array([0, 0.5, 1])[:, None, None]
    sheet = np.stack([x + 0.8 * times, 0.5 * np.sin(x - 2 * times) + 0.3 * times * z, z + 0 * times], -1)
    corner = (60 * np.arange(59)[:, None] + np.arange(59)).ravel()
    faces = np.stack([corner, corner + 60, corner + 61, corner + 1], 1).ravel()
    points = sheet.reshape(3, -1, 3).astype(np.float32)
    group = scene.add_group("sheet")
    for place in (scene, group):
        place.add_mesh(points, faces, np.full(59 * 59, 4), material=kanuka.Material("matte", color=(0.6, 0.5, 0.4)))
    scene.add_instances(group, np.stack([moved(0, 2, -3), moved(3, -1, 2)])[:, :3].astype(np.float32))
    strands = np.stack([points[:, ::40], points[:, ::40] + (0, 1, 0.2)], 2).reshape(3, -1, 3).astype(np.float32)
    scene.add_curves(strands, [2] * (strands.shape[1] // 2), widths=0.03)
    scene.add_points(points[:, ::7] + np.float32((0, 1.5, 0)), widths=0.04)
    scene.add_light("distant", amount=3, direction=(-1, -2, -1))
    scene.add_light("environment", amount=0.4)
    return scene


def test_what_changes_is_within_it() -> None:
    """Without a budget Embree has it."""
    free = kanuka.render(waves(), progressions=16)
    within = [kanuka.render(waves(), progressions=16, memory=memory) for memory in ("4G", "1M")]
    assert same(within[0], within[1])
    assert same(kanuka.render(waves(), progressions=16, memory="4G", threads=1), within[0])
    a, b = (np.asarray(p["rgb"], np.float64) for p in (free, within[0]))
    assert b.mean() == pytest.approx(a.mean(), rel=0.002)
    assert np.abs(a - b).mean() < 0.05 * a.mean()
    sharp = np.asarray(kanuka.render(waves(), progressions=16, shutter=(0, 0))["rgb"], np.float64)
    assert np.abs(sharp - a).mean() > 0.06 * a.mean()  # it moves


def cut() -> kanuka.Scene:
    """A ball with a hole through it, by itself and in ten places."""
    scene = kanuka.Scene()
    scene.resolution = 160, 90
    scene.camera = kanuka.Camera((0, 4, 10), (0, 0, 0), fov=40)
    group = scene.add_group("bored")
    for place in (scene, group):
        body = place.add_solid("difference")
        place.add_sphere(1, solid=body, material=kanuka.Material("matte", color=(0.6, 0.3, 0.2)))
        tool = body.add("primitive")
        place.add_cylinder(0.45, -2, 2, solid=tool, material=kanuka.Material("matte", color=(0.2, 0.3, 0.6)))
        for z in (-2, 2):
            lid = np.eye(4)
            lid[2, 3] = z
            place.add_disk(0.45, 0, transform=lid, solid=tool)
    around = [moved(3.5 * np.cos(a), 0.4 * np.sin(3 * a), 3.5 * np.sin(a)) for a in np.linspace(0, 6, 10)]
    scene.add_instances(group, np.stack(around)[:, :3].astype(np.float32))
    scene.add_mesh([(-9, -1, -9), (-9, -1, 9), (9, -1, 9), (9, -1, -9)], [0, 1, 2, 3], [4])
    scene.add_light("distant", amount=3, direction=(-1, -2, -1))
    scene.add_light("environment", amount=0.4)
    return scene


def test_solids_are_within_it() -> None:
    """Without a budget Embree has them."""
    free = kanuka.render(cut(), progressions=16)
    within = [kanuka.render(cut(), progressions=16, memory=memory) for memory in ("4G", "1M")]
    stats = within[0].stats["bytes"]
    assert 0 < stats["bvh"] - stats["hierarchy_built"] < 4000  # levels of eleven places, and nothing else
    assert same(within[0], within[1])
    assert same(kanuka.render(cut(), progressions=16, memory="4G", threads=1, lanes=1), within[0])
    a, b = (np.asarray(p["rgb"], np.float64) for p in (free, within[0]))
    assert b.mean() == pytest.approx(a.mean(), rel=0.002)
    assert np.abs(a - b).mean() < 0.05 * a.mean()


HELD = """
import ctypes, sys
from pathlib import Path
from test_memory import hills
import kanuka

def status(name):
    return [1024 * int(line.split()[1]) for line in Path("/proc/self/status").open() if line.startswith(name)][0]

scene = hills()
scene.options.shader_path = [sys.argv[1]]
session = kanuka.Session(scene, shading_rate=0.02)
session.prepare()
before = status("VmRSS")
ctypes.CDLL(None).malloc_trim(0)
print(status("VmHWM") - before, before - status("VmRSS"))
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="asks the heap of glibc")
def test_what_dicing_took_is_given_back(shaders: Path) -> None:
    """Else the heap keeps it, free, while rays are traced."""
    command = [sys.executable, "-c", HELD, str(shaders)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=Path(__file__).parent, check=True)
    given_back, held = map(int, done.stdout.split())
    assert given_back > 32e6
    assert held < 0.1 * given_back
