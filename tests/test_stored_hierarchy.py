"""The ray tracer's hierarchy in the store: what one render has built, others map, and no picture changes by it."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import pytest

import kanuka
from conftest import COMMAND
from test_memory import hills, rendered, shaders  # noqa: F401 - a fixture
from test_sessions import same

BUDGET = "100G"  # with one, groups of any size lie in pages of our own


def files(store: Path) -> list[Path]:
    return sorted(store.glob("*.khierarchy"))


def sizes(picture: kanuka.Picture) -> tuple[int, int]:
    return picture.stats["bytes"]["hierarchy_built"], picture.stats["bytes"]["hierarchy_stored"]


@pytest.fixture
def cold(tmp_path: Path, shaders: Path) -> kanuka.Picture:  # noqa: F811
    """What a new store is filled by."""
    return rendered(shaders, memory=BUDGET, store=tmp_path / "store")


def test_the_second_render_builds_nothing_large(tmp_path: Path, shaders: Path, cold: kanuka.Picture) -> None:  # noqa: F811
    store = tmp_path / "store"
    without = rendered(shaders, memory=BUDGET)
    assert same(cold, without)
    assert sizes(cold) == sizes(without)
    built, stored = sizes(cold)
    assert stored == 0
    (file,) = files(store)
    small = built - file.stat().st_size + 128  # a stone
    assert 0 < small < 0.1 * built
    before = file.read_bytes()
    for options in ({}, {"threads": 1}, {"threads": 3}, {"lanes": 1}, {"memory": "1M"}, {"store_mode": "read"}):
        warm = rendered(shaders, store=store, **{"memory": BUDGET} | options)
        assert sizes(warm) == (small, built - small), options
        assert same(warm, cold), options
        assert warm.stats["bytes"]["bvh"] == cold.stats["bytes"]["bvh"]
    assert files(store) == [file]
    assert file.read_bytes() == before


def test_a_file_is_the_same_for_any_number_of_threads(tmp_path: Path, shaders: Path, cold: kanuka.Picture) -> None:  # noqa: F811
    rendered(shaders, memory=BUDGET, store=tmp_path / "other", threads=1)
    (a,), (b,) = files(tmp_path / "store"), files(tmp_path / "other")
    assert a.name == b.name
    assert a.read_bytes() == b.read_bytes()


def test_other_shapes_are_built(tmp_path: Path, shaders: Path, cold: kanuka.Picture) -> None:  # noqa: F811
    more = rendered(shaders, balls=7, memory=BUDGET, store=tmp_path / "store")
    assert sizes(more)[1] == 0
    assert len(files(tmp_path / "store")) == 2
    assert same(more, rendered(shaders, balls=7, memory=BUDGET))


def test_edits_of_a_session_are_not_written(tmp_path: Path, shaders: Path, cold: kanuka.Picture) -> None:  # noqa: F811
    scene = hills()
    scene.options.shader_path = [str(shaders)]
    session = kanuka.Session(scene, progressions=4, shading_rate=0.1, memory=BUDGET, store=tmp_path / "store")
    session.advance()
    assert same(session.picture(), cold)
    before = files(tmp_path / "store")
    scene.add_sphere(0.5, name="more")
    session.update()
    session.advance()
    assert files(tmp_path / "store") == before
    assert same(session.picture(), kanuka.render(scene, progressions=4, shading_rate=0.1, memory=BUDGET))


@pytest.mark.parametrize("mode", ["read", "write"])
def test_damage_is_told_and_built_again(tmp_path: Path, shaders: Path, cold: kanuka.Picture, mode: str) -> None:  # noqa: F811
    (file,) = files(tmp_path / "store")
    whole = file.read_bytes()
    flipped = whole[: len(whole) // 2] + bytes([whole[len(whole) // 2] ^ 1]) + whole[len(whole) // 2 + 1 :]
    for damaged in (whole[:-64], whole[:50], b"", flipped, b"something else " * 1000):
        file.write_bytes(damaged)
        with pytest.warns(kanuka.Warning, match="a page of the hierarchy in the store is damaged"):
            picture = rendered(shaders, memory=BUDGET, store=tmp_path / "store", store_mode=mode)
        assert same(picture, cold)
        assert sizes(picture) == sizes(cold)
        assert file.read_bytes() == (damaged if mode == "read" else whole)


def test_pruned_while_it_is_traced(tmp_path: Path, shaders: Path, cold: kanuka.Picture) -> None:  # noqa: F811
    for memory in (BUDGET, "1M"):  # pages that were given back come again from a file without a name
        scene = hills()
        scene.options.shader_path = [str(shaders)]
        rendered(shaders, memory=BUDGET, store=tmp_path / "store")
        session = kanuka.Session(
            scene, progressions=4, shading_rate=0.1, memory=memory, store=tmp_path / "store", store_mode="read"
        )
        session.advance(progressions=1)
        assert kanuka.store_prune(tmp_path / "store", 0) == 2
        assert not list((tmp_path / "store").iterdir())
        session.advance()
        assert same(session.picture(), cold)


def test_the_command(tmp_path: Path, cold: kanuka.Picture) -> None:
    def run(*arguments: str, code: int = 0) -> str:
        done = subprocess.run([COMMAND, "store", *arguments], capture_output=True, text=True, check=False)
        assert done.returncode == code, done.stderr
        return done.stdout

    store = str(tmp_path / "store")
    assert "and 1 of the hierarchy in" in run("info", store)
    kinds = [file["kind"] for file in json.loads(run("info", "--json", store))["packs"]]
    assert sorted(kinds) == ["hierarchy", "pages"]
    assert "0 of 2 files broken" in run("verify", store)
    assert "packs compressed" in run("compress", store, "--idle", "0")
    (file,) = files(tmp_path / "store")
    damaged = bytearray(file.read_bytes())
    damaged[-5000] ^= 1
    file.write_bytes(damaged)
    assert "its checksum does not match" in run("verify", store, code=3)
    assert json.loads(run("prune", store, "--size", "0", "--json"))["removed"] == 2
