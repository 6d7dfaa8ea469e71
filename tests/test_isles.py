"""The scenes that prove instancing: what they hold, counted again; where things stand; what their pictures show."""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import kanuka

SCENES = Path(__file__).resolve().parent.parent / "scenes"
sys.path.insert(0, str(SCENES))

from forest import woods  # noqa: E402
from kit import sinks  # noqa: E402
from motu import make as motu_make  # noqa: E402
from motu import scene as motu  # noqa: E402
from motu.cameras import CAMERAS  # noqa: E402
from motu.island import Island  # noqa: E402
from nested import make as nested  # noqa: E402

# Of the public data set, as GPU-Motunui tells them.
MOANA = {"quads": 90_000_000, "curves": 5_000_000, "instances": 28_000_000, "primitives": 15_000_000_000}


@pytest.fixture(scope="module")
def isle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The island at a hundredth."""
    path = tmp_path_factory.mktemp("motu")
    assert motu_make.main(["--scale", "0.01", "-o", str(path)]) == 0
    return path


def calls(folder: Path, group: str | None = None) -> list[dict]:
    index = json.loads((folder / "index.json").read_text())
    number = 0 if group is None else 1 + index["groups"].index(group)
    return [call for call in index["calls"] if call["group"] == number]


def array(folder: Path, call: dict, name: str) -> np.ndarray:
    return np.load(folder / call["arrays"][name])


def recount(folder: Path) -> dict[str, int]:
    """Of what the files hold, by walking from the scene down to leaves; sizes are in the files' headers."""
    index = json.loads((folder / "index.json").read_text())
    groups = len(index["groups"]) + 1
    own = [{"quads": 0, "curves": 0, "rows": 0, "below": []} for _ in range(groups)]
    for call in index["calls"]:
        sizes = {name: np.load(folder / file, mmap_mode="r").shape for name, file in call.get("arrays", {}).items()}
        here = own[call["group"]]
        if call["call"] == "instances":
            assert sizes["transforms"][1:] == (3, 4)
            here["rows"] += sizes["transforms"][0]
            here["below"].append((call["words"]["of"], sizes["transforms"][0]))
        elif call["call"] == "curves":
            here["curves"] += sizes["counts"][0]
        else:
            assert sizes["faces"][1] == 4
            here["quads"] += sizes["faces"][0]
    known: dict[int, int] = {}

    def all_of(group: int) -> int:
        if group not in known:
            here = own[group]
            known[group] = here["quads"] + here["curves"] + sum(n * all_of(child) for child, n in here["below"])
        return known[group]

    told = {name: sum(here[name] for here in own) for name in ("quads", "curves", "rows")}
    return {"quads": told["quads"], "curves": told["curves"], "instances": told["rows"], "primitives": all_of(0)}


def depth_of(folder: Path) -> int:
    index = json.loads((folder / "index.json").read_text())
    deep = [0] * (len(index["groups"]) + 1)
    for call in index["calls"]:  # groups are filled before they are placed
        if call["call"] == "instances":
            deep[call["group"]] = max(deep[call["group"]], 1 + deep[call["words"]["of"]])
    return deep[0]


# ---- the island


@pytest.mark.parametrize("scale", [0.005, 0.1, 1])
def test_the_island_has_moanas_numbers_at_any_scale(scale: float) -> None:
    told = motu.count(scale).told()
    for name, whole in MOANA.items():
        assert told[name] == pytest.approx(whole * scale, rel=0.003), name
    assert told["instances"] == MOANA["instances"] * scale and told["curves"] == MOANA["curves"] * scale


def test_the_folder_holds_what_is_told(isle: Path) -> None:
    found = recount(isle)
    told = json.loads((isle / "index.json").read_text())["about"]["numbers"]
    assert {name: told[name] for name in found} == found
    for name, whole in MOANA.items():
        assert found[name] == pytest.approx(whole / 100, rel=0.003), name
    assert depth_of(isle) == 3  # leaves on boughs, boughs on trees, trees on the island
    assert told == motu.count(0.01).told()  # --count, which makes nothing


def digest(folder: Path) -> str:
    whole = hashlib.sha256()
    for file in sorted(folder.iterdir()):
        whole.update(file.name.encode() + b"\0" + file.read_bytes())
    return whole.hexdigest()


def test_the_same_seed_makes_the_same_bytes(isle: Path, tmp_path: Path) -> None:
    assert motu_make.main(["--scale", "0.01", "-o", str(tmp_path)]) == 0
    assert digest(tmp_path) == digest(isle)
    assert not np.array_equal(Island(7).base, Island(8).base)


class Lattice:
    """The ground's heights from the points of its tiles, whatever made them: flat triangles between them."""

    def __init__(self, folder: Path) -> None:
        tiles = [c for c in calls(folder) if c.get("words", {}).get("name", "").startswith("ground")]
        points = np.unique(np.concatenate([array(folder, c, "points") for c in tiles]), axis=0)
        self.x, self.z = np.unique(points[:, 0]), np.unique(points[:, 2])
        assert len(points) == len(self.x) * len(self.z)  # tiles have the same points where they meet
        self.y = points[np.lexsort((points[:, 0], points[:, 2])), 1].reshape(len(self.z), len(self.x)).astype(float)

    def corners(self, x: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest corner of the quad that each place is in."""
        i = np.clip(np.searchsorted(self.x, x) - 1, 0, len(self.x) - 2)
        j = np.clip(np.searchsorted(self.z, z) - 1, 0, len(self.z) - 2)
        four = np.stack([self.y[j, i], self.y[j, i + 1], self.y[j + 1, i], self.y[j + 1, i + 1]])
        return four, np.stack([(x - self.x[i]) / np.diff(self.x)[i], (z - self.z[j]) / np.diff(self.z)[j]])

    def heights(self, x: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Of both ways to cut a quad into two triangles, the lower and the higher."""
        (a, b, c, d), (u, v) = self.corners(x, z)
        one = np.where(u + v < 1, a + u * (b - a) + v * (c - a), d + (1 - u) * (c - d) + (1 - v) * (b - d))
        other = np.where(u > v, a + u * (b - a) + v * (d - b), a + v * (c - a) + u * (d - c))
        return np.minimum(one, other), np.maximum(one, other)


# How deep things stand in the ground for their size, and how large they may be: scenes/README.md.
SUNK = {"palm ": 0.15, "hau ": 0.1, "kamani ": 0.1, "ironwood ": 0.1, "shrub": 0.02, "fern": 0.02, "arum": 0.02,
        "tuft": 0.02, "pebble": 0.25, "shell": 0.25, "rubble": 0.25, "stick": None, "fallen": 0.0, "rock": 0.35,
        "coral": 0.45}  # fmt: skip


def test_nothing_hovers_and_nothing_sinks(isle: Path) -> None:
    ground = Lattice(isle)
    names = json.loads((isle / "index.json").read_text())["groups"]
    seen = set()
    for call in calls(isle):
        if call["call"] != "instances":
            continue
        name = names[call["words"]["of"] - 1]
        kind = next(kind for kind in SUNK if name.startswith(kind))
        m = array(isle, call, "transforms").astype(float)
        x, y, z = m[:, :, 3].T
        size = np.linalg.norm(m[:, :, 1], axis=1)
        low, high = ground.heights(x, z)
        shares = (0.0, 0.25) if SUNK[kind] is None else (SUNK[kind], SUNK[kind])
        assert np.all(y >= low - shares[1] * size - 1e-3), name
        assert np.all(y <= high - shares[0] * size + 1e-3), name
        seen.add(kind)
    assert seen == set(SUNK)


def test_grass_grows_from_the_ground(isle: Path) -> None:
    ground = Lattice(isle)
    blades = [c for c in calls(isle) if c["call"] == "curves"]
    roots = np.concatenate([array(isle, c, "points").reshape(-1, 6, 3)[:, 1] for c in blades]).astype(float)
    assert len(roots) > 45_000
    low, high = ground.heights(roots[:, 0], roots[:, 2])
    assert np.all(roots[:, 1] > low - 2e-3) and np.all(roots[:, 1] < high + 2e-3)


def test_what_is_flat_moves_by_less_than_things_sink(isle: Path) -> None:
    """The ground as it is traced, displaced, seen straight from above: ten metres of beach, a pixel for 12 cm."""
    made = kanuka.Scene()
    for call in calls(isle):
        if call.get("words", {}).get("name", "").startswith("ground"):
            given = {name: array(isle, call, name) for name in call["arrays"]}
            near = np.abs(given["points"] - (0, 0, 330))[:, [0, 2]].max(axis=1) < 20
            given["faces"] = given["faces"][near[given["faces"]].all(axis=1)]
            if len(given["faces"]):
                values = {name: np.load(isle / file) for name, file in call.get("primvars", {}).items()}
                made.add_mesh(**given, primvars=values, material=sinks.Look(**call["look"]).material())
    made.options.shader_path = [str(motu.SHADERS)]
    made.add_light("environment")
    made.camera = kanuka.Camera(
        (0, 300, 330), (0, 0, 330), (0, 0, -1), projection="orthographic", screen_window=(-5, 5, -5, 5)
    )
    picture = kanuka.render(made, resolution=(80, 80), progressions=1, filter="box", filter_width=(1, 1))
    x, y, z = picture["P"].reshape(-1, 3).T.astype(float)
    low, high = Lattice(isle).heights(x, z)
    assert np.abs(x).max() > 4.9 and np.ptp(y) > 0.3  # that beach
    off = y - 0.5 * (low + high)
    assert np.all(np.abs(off) < 0.05 + 0.5 * (high - low))
    assert off.std() > 0.003  # it is displaced


def test_the_shore_shows_sky_above_land_above_water(isle: Path) -> None:
    sink = sinks.Live(kanuka.Scene())
    made, about = sinks.read(isle, sink)
    assert about["scene"] == "motu"
    motu.staged(made)
    journal = kanuka.Journal()
    picture = kanuka.render(made, resolution=(160, 67), progressions=4, max_depth=4, journal=journal)
    assert [str(m) for m in journal if m.severity != "info"] == []  # nothing is left out
    assert picture.stats["count"]["instances"] == 280_000
    far, rgb = picture["Z"], picture["rgb"] * made.options.exposure_gain
    sky, sea = ~(far < 1e6), np.squeeze(picture["id"]) == sink.ids["sea"]
    third = len(sky) // 3
    assert sky[: third // 2].mean() > 0.5 and sky[third : 2 * third].mean() < 0.1 and not sky[2 * third :].any()
    assert sea[-third // 2 :].mean() > 0.95 and not sea[:third].any()
    land = ~sky & ~sea
    assert land[third : 2 * third].mean() > 0.8
    assert far[land].min() > 20 and np.median(far[land]) < 150
    above, water, ashore = (np.median(rgb[mask], axis=0) for mask in (sky, sea, land))
    assert above.mean() > 2.5 * ashore.mean() and 0.25 < above.mean() < 2
    assert water[2] > 1.15 * water[0]  # the lagoon is blue against the warm light
    sand = land & (np.arange(len(sky))[:, None] > 2 * third - 6)
    beach = np.median(rgb[sand], axis=0)
    assert beach[0] > 1.2 * beach[2] and beach.mean() > 2 * ashore.mean()


def test_every_camera_stands_in_the_open(isle: Path) -> None:
    ground = Lattice(isle)
    for name, view in CAMERAS.items():
        x, y, z = (np.array([v], float) for v in view.origin)
        high = max(0.0, float(ground.heights(x, z)[1][0]))
        assert 1 < y[0] - high < 6, name
    for call in calls(isle):
        if call["call"] == "instances":
            m = array(isle, call, "transforms")
            size = np.linalg.norm(m[:, :, 1], axis=1)
            for name, view in CAMERAS.items():
                away = np.hypot(m[:, 0, 3] - view.origin[0], m[:, 2, 3] - view.origin[2])
                assert not np.any((away < 2) & (size > 0.4)), name


def test_a_folder_is_rendered_as_it_is_and_made_where_it_is_not(isle: Path, tmp_path: Path) -> None:
    before = (isle / "index.json").stat().st_mtime_ns
    small = ["--resolution", "16x7", "--progressions", "1", "--render", str(tmp_path / "a.exr")]
    assert motu_make.main(["-o", str(isle), "--camera", "beach", *small]) == 0
    assert kanuka.read(tmp_path / "a.exr")["rgb"].shape == (7, 16, 3)
    assert (isle / "index.json").stat().st_mtime_ns == before
    for given, is_there in ((["--scale", "0.01"], True), (["--seed", "1"], True), (["--seed", "2"], False)):
        assert motu_make.there(motu_make.parse(["-o", str(isle), *given])) is is_there
    assert not motu_make.there(motu_make.parse(["-o", str(tmp_path)]))


@pytest.mark.parametrize("arguments", [["--scale", "2"], ["--scale", "0"], ["--scale", "nan"], ["--seed", "-1"]])
def test_what_no_island_has_is_refused(arguments: list[str], capsys: pytest.CaptureFixture) -> None:
    with pytest.raises(SystemExit):
        motu_make.main([*arguments, "--count"])
    assert arguments[0] in capsys.readouterr().err


# ---- the forest


def height_at(points: np.ndarray, x: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest corner about places, of a square lattice's points."""
    side = round(len(points) ** 0.5)
    axis, y = points[:side, 0].astype(float), points[:, 1].reshape(side, side)
    i, j = np.searchsorted(axis, x) - 1, np.searchsorted(axis, z) - 1
    four = np.stack([y[j, i], y[j, i + 1], y[j + 1, i], y[j + 1, i + 1]])
    return four.min(axis=0), four.max(axis=0)


def test_a_forest_has_the_trees_that_are_asked_for(tmp_path: Path) -> None:
    folder = sinks.Folder(tmp_path / "forest")
    told = woods.build(folder, 1000)
    folder.close()
    found = recount(folder.path)
    assert (told.trees, told.instances, told.primitives) == (1000, found["instances"], found["primitives"])
    trees = np.concatenate(
        [array(folder.path, c, "transforms") for c in calls(folder.path) if c["call"] == "instances"]
    )
    assert len(trees) == 1000 and depth_of(folder.path) == 3
    ground = next(c for c in calls(folder.path) if c["call"] == "mesh")
    low, high = height_at(array(folder.path, ground, "points"), trees[:, 0, 3], trees[:, 2, 3])
    assert np.all(trees[:, 1, 3] < high) and np.all(trees[:, 1, 3] > low - 0.5)
    million = woods.build(sinks.Nothing(), 100_000)
    assert million.leaves == pytest.approx(100 * told.leaves, rel=0.05) and told.leaves > 10_000 * told.trees


def test_the_flight_is_steady_and_meets_no_tree() -> None:
    way = np.array([woods.way(frame) for frame in range(1, woods.FRAMES + 1)])
    steps = np.linalg.norm(np.diff(way, axis=0), axis=1)
    assert steps.max() < 4 and steps.max() < 3 * steps.min()
    over = way[:, 1] - woods.height(way[:, 0], way[:, 2])
    assert over.min() > 4 and over.max() > 18
    trees = woods.places(2000, 1)
    assert np.hypot(*(trees[:, None] - way[:, [0, 2]]).transpose(2, 0, 1)).min() > 5
    for frame in (0, 49):
        with pytest.raises(ValueError, match="1 to 48"):
            woods.camera(frame)


def test_in_autumn_trees_differ_and_leaves_are_shaded_five_times() -> None:
    pictures, shaded = [], []
    for autumn in (False, True):
        made = kanuka.Scene()
        woods.build(sinks.Live(made), 300, autumn=autumn)
        woods.staged(made, 24)
        made.resolution = 72, 30
        picture = kanuka.render(made, progressions=8)
        assert picture.journal.error_count == 0
        pictures.append(np.asarray(picture["rgb"], np.float64))
        shaded.append(picture.stats["count"]["shader_evaluations"])
    green, turned = pictures
    red = [(p[..., 0] > 1.3 * p[..., 1]).mean() for p in pictures]
    assert red[1] > red[0] + 0.05
    assert turned.mean() == pytest.approx(green.mean(), rel=0.5)
    assert shaded[1] < 1.5 * shaded[0]  # ground, bark and needles are what they were


def test_two_frames_of_the_flight() -> None:
    made = kanuka.Scene()
    woods.build(sinks.Live(made), 1000)
    woods.staged(made)
    made.resolution = 96, 40
    shot = [woods.camera(frame) for frame in (1, 24)]
    session = kanuka.Session(made, shot=shot, progressions=2)
    frames = []
    for view in shot:
        made.camera = view
        session.update()
        session.advance()
        picture = session.picture()
        assert picture.stats["count"]["nan_samples"] == 0 and [m for m in picture.journal if m.severity != "info"] == []
        frames.append(picture)
    # From above there are crowns below and sky above; between the trees, crowns are near and hide the sky.
    skies = [~(picture["Z"] < 1e6) for picture in frames]
    assert skies[0][:8].mean() > 0.6 and not skies[0][24:].any()
    assert skies[1].mean() < 0.5 * skies[0].mean()
    assert frames[1]["Z"].min() < 0.7 * frames[0]["Z"].min()
    for picture, sky in zip(frames, skies, strict=True):
        crowns = np.median(picture["rgb"][~sky], axis=0)
        assert crowns[1] > crowns[0] > crowns[2] > 0  # green in the sun


# ---- 10^16


def test_ten_million_billion_leaves_in_little_memory(tmp_path: Path) -> None:
    """In a process of its own, whose peak is its own."""
    script = (
        "import sys, json; sys.path.insert(0, sys.argv[1])\n"
        "import kanuka, numpy as np\n"
        "from nested import make\n"
        "journal = kanuka.Journal()\n"
        "p = kanuka.render(make.scene(), resolution=(96, 40), progressions=2, journal=journal)\n"
        "far = p['Z'][p['Z'] < 1e30]\n"
        "status = dict(line.split(':', 1) for line in open('/proc/self/status'))\n"
        "peak = 1024 * int(status['VmHWM'].split()[0])\n"  # rusage counts what the process was before it became this
        "print(json.dumps({'peak': peak, 'nan': p.stats['count']['nan_samples'],\n"
        "    'rows': p.stats['count']['instances'], 'said': [str(m) for m in journal if m.severity != 'info'],\n"
        "    'far': float(far.max()), 'near': float(far.min()),\n"
        "    'green': np.median(p['rgb'][20:], axis=(0, 1)).tolist()}))\n"
    )
    done = subprocess.run([sys.executable, "-c", script, str(SCENES)], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["peak"] < 1e9 and found["nan"] == 0 and found["said"] == []
    assert found["rows"] == 100 + 100 + 3 * 10_000 + 1
    assert found["near"] < 200 and found["far"] > 2_000  # woods behind the first ones
    assert found["green"][1] > found["green"][0] > 0


def test_there_are_ten_million_billion(monkeypatch: pytest.MonkeyPatch) -> None:
    """By what is added to which group."""
    leaves: dict[int, int] = {}
    add = kanuka.Group.add_instances
    kept = []

    def counted(self: kanuka.Group, group: kanuka.Group, transforms: np.ndarray, **more: object) -> object:
        kept.extend((self, group))  # so that their ids stay theirs
        leaves[id(self)] = leaves.get(id(self), 0) + len(transforms) * leaves.get(id(group), 1)
        return add(self, group, transforms, **more)

    monkeypatch.setattr(kanuka.Group, "add_instances", counted)
    nested.scene()
    assert max(leaves.values()) == 10**16 == nested.LEAVES
    assert sorted(leaves.values()) == [10**2, 10**4, 10**8, 10**12, 10**16]
