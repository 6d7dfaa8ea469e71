"""Parts of a picture, rendered apart and joined: the same bits as the whole, however they are shared out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka
from scenes import instances

PATHS = 320
AOVS = ["lpe:C<RD>L", "lpe:CL", "Pref", "sample_count"]


def same(a: kanuka.Picture, b: kanuka.Picture) -> bool:
    assert a.keys() == b.keys()
    return all(np.array_equal(np.asarray(a[name]), np.asarray(b[name]), equal_nan=True) for name in a)


def scene(**options: object) -> kanuka.Scene:
    made = instances()
    for name, value in options.items():
        setattr(made.options, name, value)
    return made


def render_part(file: Path, part: tuple[int, int], **arguments: object) -> Path:
    session = kanuka.Session(
        scene(), **({"progressions": PATHS, "part": part, "aovs": AOVS, "keep_pages": False} | arguments)
    )
    assert session.wanted == part[1] - part[0]
    assert session.advance()
    session.save(file)
    return file


@pytest.fixture(scope="module")
def whole() -> kanuka.Picture:
    return kanuka.render(scene(), progressions=PATHS, aovs=AOVS)


@pytest.fixture(scope="module")
def parts(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """0-127, 128-191 and 192-319, of different numbers of threads and lanes."""
    folder = tmp_path_factory.mktemp("parts")
    return [
        render_part(folder / "a.state", (0, 128), threads=1),
        render_part(folder / "b.state", (128, 192), threads=3, lanes=1),
        render_part(folder / "c.state", (192, PATHS), threads=2, lanes=8),
    ]


# ---- bits -----------------------------------------------------------------------------------------------------------


def test_parts_join_to_the_whole(parts: list[Path], whole: kanuka.Picture) -> None:
    joined = kanuka.merge([parts[2], parts[0], parts[1]])
    assert joined.part == (0, PATHS)
    assert joined.resolution == (24, 16)
    picture = joined.picture()
    assert same(picture, whole)
    assert picture.metadata == whole.metadata
    assert (picture["sample_count"] == PATHS).all()


@pytest.mark.parametrize("ends", [(64, 320), (256, 320), (64, 128, 192, 256, 320)])
def test_however_they_are_shared_out(tmp_path: Path, whole: kanuka.Picture, ends: tuple[int, ...]) -> None:
    firsts = (0, *ends[:-1])
    files = [render_part(tmp_path / f"{a}.state", (a, b)) for a, b in zip(firsts, ends, strict=True)]
    assert same(kanuka.merge(files).picture(), whole)


def test_the_last_part_ends_with_the_picture(tmp_path: Path) -> None:
    files = [
        render_part(tmp_path / "a.state", (0, 64), progressions=100),
        render_part(tmp_path / "b.state", (64, 100), progressions=100),
    ]
    assert same(kanuka.merge(files).picture(), kanuka.render(scene(), progressions=100, aovs=AOVS))


@pytest.mark.parametrize("steps", [(1, 64, 65, PATHS), (63, 128, 200, 201, PATHS), (100, 300, PATHS)])
def test_steps_beyond_a_block_change_no_bit(whole: kanuka.Picture, steps: tuple[int, ...]) -> None:
    session = kanuka.Session(scene(), progressions=PATHS, aovs=AOVS)
    for step in steps:
        session.advance(progressions=step)
    assert same(session.picture(), whole)


def test_a_step_in_the_middle_of_a_block_is_a_picture_of_so_many() -> None:
    session = kanuka.Session(scene(), progressions=PATHS, aovs=AOVS)
    session.advance(progressions=150)
    assert same(session.picture(), kanuka.render(scene(), progressions=150, aovs=AOVS, threads=1))


def test_weighted_filters(tmp_path: Path) -> None:
    more = {"filter": "sinc", "filter_width": (4, 4), "progressions": 128}
    files = [render_part(tmp_path / "a", (0, 64), **more), render_part(tmp_path / "b", (64, 128), **more)]
    assert same(kanuka.merge(files).picture(), kanuka.render(scene(), aovs=AOVS, **more))


def test_a_crop_window_and_exposure(tmp_path: Path) -> None:
    more = {"crop": (0.2, 0.9, 0.1, 0.8), "exposure_stops": 1.5, "output_space": "acescg", "progressions": 128}
    files = [render_part(tmp_path / "a", (0, 64), **more), render_part(tmp_path / "b", (64, 128), **more)]
    picture = kanuka.merge(files).picture()
    whole = kanuka.render(scene(), aovs=AOVS, **more)
    assert same(picture, whole)
    assert picture.space == whole.space == "acescg"
    picture.write(tmp_path / "a.png"), whole.write(tmp_path / "b.png")
    picture.write(tmp_path / "a.exr"), whole.write(tmp_path / "b.exr")
    for suffix in (".png", ".exr"):
        assert (tmp_path / f"a{suffix}").read_bytes() == (tmp_path / f"b{suffix}").read_bytes()


# ---- stops ----------------------------------------------------------------------------------------------------------


def test_a_part_stopped_among_buckets_goes_on(parts: list[Path], whole: kanuka.Picture, tmp_path: Path) -> None:
    state, stops = tmp_path / "state", 0
    session = kanuka.Session(scene(), progressions=PATHS, part=(192, PATHS), aovs=AOVS)
    while not session.advance(seconds=0.004):
        stops += 1
        assert stops < 10_000
        if stops % 3 == 1:
            before = session.progressions
            session.save(state)
            session = kanuka.Session(scene(), progressions=PATHS, part=(192, PATHS), aovs=AOVS, threads=1 + stops % 2)
            session.resume(state)
            assert session.progressions == before
    assert stops > 1
    session.save(state)
    assert same(kanuka.merge([*parts[:2], state]).picture(), whole)


def test_the_last_may_be_under_way(parts: list[Path], tmp_path: Path) -> None:
    session = kanuka.Session(scene(), progressions=PATHS, part=(192, PATHS), aovs=AOVS)
    session.advance(progressions=70)
    session.save(tmp_path / "state")
    joined = kanuka.merge([*parts[:2], tmp_path / "state"])
    assert joined.part == (0, 262)
    assert same(joined.picture(), kanuka.render(scene(), progressions=262, aovs=AOVS))
    assert kanuka.checkpoint_info(tmp_path / "state")["end"] == 262


def test_what_was_joined_goes_on(parts: list[Path], tmp_path: Path) -> None:
    kanuka.merge(parts[:2]).save(tmp_path / "state")
    session = kanuka.Session(scene(), progressions=400, aovs=AOVS)
    session.resume(tmp_path / "state")
    assert session.progressions == 192
    session.advance()
    assert same(session.picture(), kanuka.render(scene(), progressions=400, aovs=AOVS))
    # And a whole picture's checkpoint is a part.
    session.save(tmp_path / "more")
    session = kanuka.Session(scene(), progressions=320, aovs=AOVS)
    session.resume(tmp_path / "state")
    session.advance(progressions=192)
    session.save(tmp_path / "same")
    assert same(kanuka.merge([tmp_path / "same", parts[2]]).picture(), kanuka.merge(parts).picture())


def test_parts_in_the_middle_join_to_a_part(parts: list[Path], whole: kanuka.Picture, tmp_path: Path) -> None:
    middle = kanuka.merge(parts[1:])
    assert middle.part == (128, PATHS)
    with pytest.raises(kanuka.Error, match="progressions 128 to 319 of a picture: those from 0 on are missing"):
        middle.picture()
    middle.save(tmp_path / "middle")
    assert same(kanuka.merge([parts[0], tmp_path / "middle"]).picture(), whole)


def test_a_part_alone_can_be_looked_at() -> None:
    session = kanuka.Session(scene(), progressions=PATHS, part=(64, 128))
    assert not session.advance(seconds=1e-9)
    session.advance()
    assert session.progressions == 64
    picture = session.picture()
    assert picture.metadata["kanuka.part"] == "progressions 64 to 127"
    assert picture["id"].max() > 0
    first = np.asarray(kanuka.render(scene(), progressions=64)["rgb"])
    assert np.asarray(picture["rgb"]).mean() == pytest.approx(first.mean(), rel=0.02)
    assert not np.array_equal(picture["rgb"], first)


def test_fireflies_are_told_by_what_pixels_had_before() -> None:
    """The first samples of a block have no others of it beside them."""
    lists = [kanuka.render(scene(), progressions=n).stats["count"]["fireflies"] for n in (64, 640)]
    assert lists[1] <= 20 * lists[0] + 20


def test_procedurals_that_wait_for_rays(tmp_path: Path) -> None:
    """What is read while a block is under way begins the visit of a bucket anew, not the block."""
    (tmp_path / "pin.rib").write_text('Surface "plastic"\nSphere 0.02 -0.02 0.02 360\n')
    pins = "".join(
        f"TransformBegin Translate {x / 4:.3f} {y / 4:.3f} 1\n"
        'Procedural "DelayedReadArchive" ["pin.rib"] [-0.02 0.02 -0.02 0.02 -0.02 0.02]\nTransformEnd\n'
        for x in range(-6, 7)
        for y in range(-4, 5)
    )
    (tmp_path / "a.rib").write_text(
        'Format 20 14 1\nProjection "perspective" "fov" [40]\nTranslate 0 0 5\nWorldBegin\n'
        'LightSource "distantlight" 1 "from" [1 1 -1] "to" [0 0 0]\n' + pins + "WorldEnd\n"
    )
    waiting = kanuka.render(kanuka.load(tmp_path / "a.rib", on_demand=True), progressions=150, threads=1)
    session = kanuka.Session(kanuka.load(tmp_path / "a.rib", on_demand=True), progressions=150, threads=3)
    for step in (64, 65, 129, 150):
        session.advance(progressions=step)
    assert same(waiting, session.picture())


# ---- refusals -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("part", "words"),
    [
        ((10, 256), r"progressions 10 to 255 are no part: .* The nearest: 0 to 255"),
        ((64, 300), r"progressions 64 to 299 are no part: .* the picture, which has 320. The nearest: 64 to 319"),
        ((64, 64), "one or more"),
        ((-64, 64), "from 0 on"),
    ],
)
def test_parts_are_of_whole_blocks(part: tuple[int, int], words: str) -> None:
    with pytest.raises(kanuka.Error, match=words) as error:
        kanuka.Session(scene(), progressions=PATHS, part=part)
    assert error.value.exit_code == 2


def test_adaptive_pictures_have_no_parts(tmp_path: Path) -> None:
    with pytest.raises(kanuka.Error, match=r"sampled adaptively has no parts.*set adaptive to 0"):
        kanuka.Session(scene(), adaptive=0.01, part=(0, 64))
    session = kanuka.Session(scene(), adaptive=0.01, progressions=96)
    session.advance()
    session.save(tmp_path / "state")
    with pytest.raises(kanuka.Error, match=r"state: the picture is sampled adaptively"):
        kanuka.merge([tmp_path / "state", tmp_path / "state"])
    assert same(kanuka.merge([tmp_path / "state"]).picture(), session.picture())  # one is a picture


def test_gaps_overlaps_and_other_pictures_are_named(parts: list[Path], tmp_path: Path) -> None:
    a, b, c = parts
    with pytest.raises(kanuka.Error, match=r"a.state: progressions 128 to 191 .* missing between this and .*c.state"):
        kanuka.merge([c, a])
    with pytest.raises(kanuka.Error, match=r"b.state: progressions 128 to 191 are in .*b.state too"):
        kanuka.merge([a, b, b])
    other = render_part(tmp_path / "other.state", (128, 192), seed=4)
    with pytest.raises(kanuka.Error, match=r"other.state: the checkpoint is of another picture than .*a.state"):
        kanuka.merge([a, other])
    for name, bytes_of in (("short", b.read_bytes()[:-100]), ("damaged", b.read_bytes()[:-100] + bytes(100))):
        (tmp_path / name).write_bytes(bytes_of)
        with pytest.raises(kanuka.Error, match=rf"{name}: the checkpoint .*; remove it, or name another file"):
            kanuka.merge([a, tmp_path / name, c])
    with pytest.raises(kanuka.Error, match="no checkpoints"):
        kanuka.merge([])


def test_parts_are_not_gone_on_with_as_something_else(parts: list[Path]) -> None:
    session = kanuka.Session(scene(), progressions=PATHS, aovs=AOVS)
    with pytest.raises(kanuka.Error, match=r"begins at progression 128 .* kanuka merge joins it"):
        session.resume(parts[1])
    session = kanuka.Session(scene(), progressions=PATHS, aovs=AOVS, part=(64, 128))
    with pytest.raises(kanuka.Error, match="begins at progression 128"):
        session.resume(parts[1])
    session = kanuka.Session(scene(), progressions=PATHS, aovs=AOVS, part=(0, 64))
    with pytest.raises(kanuka.Error, match="has progressions 0 to 127, and the part is progressions 0 to 63"):
        session.resume(parts[0])
    with pytest.raises(kanuka.Error, match="the part has 64 progressions, not 65"):
        session.advance(progressions=65)


def test_older_checkpoints_are_refused(parts: list[Path], tmp_path: Path) -> None:
    older = bytearray(parts[0].read_bytes())
    older[4] = 2
    (tmp_path / "older").write_bytes(older)
    for attempt in (
        lambda: kanuka.merge([tmp_path / "older"]),
        lambda: kanuka.checkpoint_info(tmp_path / "older"),
        lambda: kanuka.Session(scene(), aovs=AOVS, progressions=PATHS).resume(tmp_path / "older"),
    ):
        with pytest.raises(kanuka.Error, match="older: the checkpoint is of another version of Kanuka; remove it"):
            attempt()
