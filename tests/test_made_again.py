"""Why a session dices and shades primitives again: kanuka.Session.made_again."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import kanuka
from scenes import ball
from test_sessions import ALL, EDITS, still_life, translated

# Of the edits that make anything again: why, how many primitives, and the first of them.
WHY: dict[str, dict[str, tuple[int, str]]] = {
    "a colour": {"surface parameter Kd": (1, "ball0")},
    "a shader's number": {"surface parameter n": (1, "ball2")},
    "the floor's stripes": {"surface parameter n": (1, "floor")},
    "a ball goes far": {"camera step": (1, "ball5")},
    "a ball comes": {"new": (1, "new")},
    "unseen by the camera": {"attribute visible_camera": (1, "ball1")},
    "traced as it is diced": {"attribute dice_flatness": (1, "blob")},
    "no terminator": {"attribute shadow_terminator": (1, "ball3")},
    "unlit by the lamp": {"attribute lights_off": (1, "ball4")},
    "a leaf's gloss": {"surface parameter roughness": (1, "leaf1")},
    "a bush more": {"new": (1, "")},
    "the panel is brighter": {"area light parameter intensity": (1, "panel")},
    "a ball is turned": {"turned or scaled": (1, "ball5")},
    "the camera moves a little": {"camera step": (2, "floor")},
    "the camera goes near": {"camera step": (ALL, "leaf0")},
    "the camera zooms": {"lens or resolution": (ALL, "leaf0"), "camera step": (1, "panel")},
    "coarser geometry": {"rates and tolerances": (ALL, "leaf0")},
}


def made_again(session: kanuka.Session) -> dict[str, tuple[int, str]]:
    return {reason["why"]: (reason["primitives"], reason["name"]) for reason in session.made_again}


def edited(
    scene: kanuka.Scene, edit: Callable[[kanuka.Scene], object], **options: object
) -> dict[str, tuple[int, str]]:
    """Why, after the first making and an edit."""
    session = kanuka.Session(scene, progressions=1, **options)
    session.prepare()
    (first,) = session.made_again
    assert (first["why"], first["primitives"]) == ("first", session.kept["primitives"])
    session.update()
    session.prepare()
    assert made_again(session) == {}
    edit(scene)
    session.update()
    session.prepare()
    return made_again(session)


@pytest.mark.parametrize("name", EDITS)
def test_edits_have_their_reasons(tmp_path: Path, name: str) -> None:
    edit, again, _ = EDITS[name]
    why = edited(still_life(tmp_path), edit)
    assert why == WHY.get(name, {})
    assert bool(why) == bool(again)


def with_shader(folder: Path, text: str, **parameters: object) -> kanuka.Scene:
    (folder / "mine.sl").write_text(text)
    scene = ball()
    scene.options.shader_path = scene.options.texture_path = [str(folder)]
    scene.add_sphere(0.3, material=kanuka.Material("mine", **parameters), name="it", transform=translated(0, 0, 1.2))
    return scene


def test_what_shaders_read_of_what_is_around(tmp_path: Path) -> None:
    eye = with_shader(tmp_path, "surface mine() { Ci = Cs * abs(normalize(I) . normalize(N)) * diffuse(N); Oi = 1; }")
    why = edited(eye, lambda s: s.node("it").place(translated(0.001, 0, 1.2)))
    assert why == {"eye": (1, "it")}
    world = with_shader(tmp_path, 'surface mine() { Ci = Cs * noise(9 * transform("world", P)) * diffuse(N); Oi = 1; }')
    (reason,) = edited(world, lambda s: s.node("it").place(translated(0.001, 0, 1.2)))
    assert reason.startswith("space ")
    assert "world" in reason


def test_textures_and_shaders_that_change(tmp_path: Path) -> None:
    def paint(value: float) -> None:
        kanuka.Picture({"rgb": np.full((4, 4, 3), value, np.float32)}).write(str(tmp_path / "paint.exr"))

    paint(0.2)
    text = 'surface mine(string map = "") { Ci = color texture(map, s, t) * diffuse(N); Oi = 1; }'
    scene = with_shader(tmp_path, text, map="paint.exr")
    assert edited(scene, lambda _: paint(0.9)) == {"texture paint.exr": (1, "it")}
    scene = with_shader(tmp_path, text, map="paint.exr")
    (reason,) = edited(scene, lambda _: (tmp_path / "mine.sl").write_text(text.replace("Oi = 1", "Oi = 1; Ci *= 0.5")))
    assert reason.startswith("shader")


def test_a_shape_and_colours(tmp_path: Path) -> None:
    text = "surface mine() { Ci = Cs * diffuse(N); Oi = 1; }"
    scene = with_shader(tmp_path, text)
    session = kanuka.Session(scene, progressions=1)
    session.prepare()
    other = ball()
    other.options.shader_path = other.options.texture_path = [str(tmp_path)]
    other.add_sphere(0.31, material=kanuka.Material("mine"), name="it", transform=translated(0, 0, 1.2))
    session.update(other)
    session.prepare()
    assert made_again(session)["shape"] == (1, "it")
    assert set(edited(other, lambda s: setattr(s.options, "color_space", "acescg"))) == {"options of colour"}


def test_pages_without_room() -> None:
    session = kanuka.Session(ball(), page_memory=0, progressions=1)
    session.prepare()
    session.update()
    session.prepare()
    assert set(made_again(session)) == {"no room"}


def test_frames_that_are_rendered_together_tell_why(kanuka_command, tmp_path: Path) -> None:
    rib = tmp_path / "shot.rib"
    frames = "".join(
        f'FrameBegin {n}\nFormat 32 24 1\nDisplay "a.{n}.exr" "file" "rgba"\nTranslate 0 0 5\nWorldBegin\n'
        f'Attribute "identifier" "string name" ["it"]\nSurface "plastic" "float Ks" [{n}]\nSphere 1 -1 1 360\n'
        'Attribute "identifier" "string name" ["still"]\nTranslate 2 0 0\nSurface "matte"\nSphere 1 -1 1 360\n'
        "WorldEnd\nFrameEnd\n"
        for n in (1, 2)
    )
    rib.write_text(frames)
    done = kanuka_command(
        "render", rib, "--frame", "1-2", "--together", "--progressions", 1, "--stats", tmp_path / "s.json", "-v"
    )
    assert done.returncode in (0, 3), done.stderr
    first, second = (json.loads((tmp_path / f"s.000{n}.json").read_text())["made_again"] for n in (1, 2))
    assert [reason["why"] for reason in first] == ["first"]
    (reason,) = second
    assert (reason["why"], reason["primitives"], reason["name"]) == ("surface parameter Ks", 1, "it")
    assert reason["file"].endswith("shot.rib")
    assert reason["line"] > 0
    assert "surface parameter Ks 1 (it)" in done.stderr
