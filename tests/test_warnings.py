"""What Python users are told: warnings at their own line, the rest by logging, in Python's words."""

from __future__ import annotations

import logging
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

import kanuka
import scenes

MISSING = 'WorldBegin Surface "nowhere" Sphere 1 -1 1 360 Shpere WorldEnd\n'


def small(**options) -> kanuka.Scene:
    scene = kanuka.Scene()
    scene.resolution = 8, 8
    scene.camera = kanuka.Camera((0, 0, 5), (0, 0, 0))
    scene.add_sphere(**options)
    return scene


def test_a_missing_environment_is_a_warning_at_the_callers_line() -> None:
    scene = small()
    scene.add_light("environment", texture="nowhere.exr")
    with pytest.warns(kanuka.Warning, match="nowhere.exr") as caught:
        picture = kanuka.render.__wrapped__(scene, progressions=1)
    assert caught[0].filename == __file__
    assert len(picture.journal) == 1


def test_a_missing_shader_is_told_in_pythons_words() -> None:
    with pytest.warns(kanuka.Warning) as caught:
        kanuka.render(small(material="plastik"), progressions=1)
    text = str(caught[0].message)
    assert 'did you mean "plastic"?' in text
    assert "scene.options.shader_path" in text
    assert "Option" not in text
    assert not text.startswith(":")


def test_a_missing_texture_is_told_in_pythons_words() -> None:
    scene = small(material=kanuka.Material("paintedplastic", texturename="nowhere.tx"))
    scene.add_light("distant")
    with pytest.warns(kanuka.Warning, match=r"scene\.options\.texture_path"):
        kanuka.render(scene, progressions=1)


def test_loading_warns_of_files_by_line(tmp_path: Path) -> None:
    path = tmp_path / "a.rib"
    path.write_text(MISSING)
    with pytest.warns(kanuka.Warning, match=r"a\.rib:1:\d+: unknown request Shpere") as caught:
        scene = kanuka.load(path)
    assert caught[0].filename == __file__
    with pytest.warns(kanuka.Warning) as caught:
        picture = kanuka.render(scene, progressions=1, resolution=(4, 4))
    assert ["Shpere" in str(w.message) for w in caught] == [False], "told once"
    assert 'Option "searchpath" "shader"' in str(caught[0].message), "a RIB's words for a RIB"
    assert picture.journal.error_count == 2, "the journal has both"


def test_a_journal_takes_them_instead(tmp_path: Path) -> None:
    path = tmp_path / "a.rib"
    path.write_text(MISSING)
    journal = kanuka.Journal()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene = kanuka.load(path, journal=journal)
        assert scene.journal.error_count == journal.error_count == 1
        kanuka.render(scene, progressions=1, resolution=(4, 4), journal=journal)
    assert journal.error_count == 2


def test_shaders_warn_when_they_compile() -> None:
    source = "surface s() { float x; Ci = x; }\n"
    with pytest.warns(kanuka.Warning, match=r"s\.sl:1:\d+"):
        kanuka.compile_shader("s.sl", source=source)


def test_warnings_may_be_made_errors() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error", kanuka.Warning)
        with pytest.raises(kanuka.Warning, match="plastik"):
            kanuka.render(small(material="plastik"), progressions=1)


def test_the_rest_is_logged(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO, logger="kanuka"), warnings.catch_warnings():
        warnings.simplefilter("error")
        kanuka.render(scenes.ball(), progressions=1, resolution=(8, 6))
    assert any("8 × 6 pixels" in record.getMessage() for record in caplog.records)


def test_the_command_prints_and_does_not_warn(tmp_path: Path) -> None:
    (tmp_path / "a.rib").write_text(MISSING)
    done = subprocess.run(
        [sys.executable, "-m", "kanuka", "render", "a.rib", "--resolution", "4x4", "--progressions", "1"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 3
    assert done.stderr.count("unknown request Shpere") == 1
    assert done.stderr.count('shader "nowhere" is not found') == 1
    assert "Warning:" not in done.stderr


def test_pictures_do_not_depend_on_who_listens() -> None:
    silent = kanuka.render(scenes.ball(), progressions=1, resolution=(8, 6), journal=kanuka.Journal())
    np.testing.assert_array_equal(silent["rgb"], kanuka.render(scenes.ball(), progressions=1, resolution=(8, 6))["rgb"])


def test_rendering_leaves_the_scene_as_it_was() -> None:
    scene = scenes.ball()
    before = scene.options.strict_directions, scene.resolution, scene.summary()
    kanuka.render(scene, progressions=1, resolution=(8, 6), strict_directions=True, shutter=(0, 1))
    assert (scene.options.strict_directions, scene.resolution, scene.summary()) == before
