"""Procedurals of frames that are rendered together: programs and plug-ins are asked once for what is alike, what rays
of one frame have met is there in the next, and pictures are those of frames that are rendered by themselves."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

import kanuka

FRAMES = range(1, 5)
# Answers every line, and says in a log that it was asked: the colour is its argument's.
PROGRAM = """
import sys
for line in sys.stdin:
    detail, data = line.split(" ", 1)
    with open("asked.log", "a") as log:
        log.write(f"{data.strip()} {detail}\\n")
    print("Color [" + data.split()[1] + " 0.4 0.2] Sphere 0.5 -0.5 0.5 360")
    sys.stdout.write("\\377")
    sys.stdout.flush()
"""
PLUG_IN = """
import kanuka

@kanuka.procedural
def ring(request):
    with open("asked.log", "a") as log:
        log.write(f"ring {request.data}\\n")
    return f"Color [0.3 0.5 1] Torus 0.4 0.1 0 360 {request.data}"

def old(detail, data):
    with open("asked.log", "a") as log:
        log.write(f"old {data}\\n")
    return "Color [0.2 0.8 0.3] Sphere 0.3 -0.3 0.3 360"
"""
BOUND = "[-0.5 0.5 -0.5 0.5 -0.5 0.5]"
RUN = f'Procedural "RunProgram" ["{sys.executable} balls.py" "{{}}"]'


def write(folder: Path, body: str, options: str = "", frames: range = FRAMES, step: float = 0.3) -> Path:
    """The camera goes aside and nearer. `body`: has a {n} for the number of the frame."""
    (folder / "balls.py").write_text(PROGRAM)
    for name in ("ring", "old"):
        (folder / f"{name}.py").write_text(PLUG_IN)
    text = f"Format 48 32 1\nPixelSamples 2 2\n{options}\n"
    for n in frames:
        text += f"""FrameBegin {n}
            Display "shot.{n}.exr" "file" "rgba" Projection "perspective" "fov" 50
            Translate {-step * n} 0 {6 - step * n}
            WorldBegin LightSource "distantlight" 1 "from" [1 2 -1] "to" [0 0 0] "intensity" 2 Surface "plastic"
            Patch "bilinear" "P" [-9 -1 -9 9 -1 -9 -9 -1 9 9 -1 9]
            {body.replace("{n}", str(n))}
            WorldEnd FrameEnd
            """
    path = folder / "shot.rib"
    path.write_text(text.replace("\xff", ""))
    return path


def asked(folder: Path) -> Counter[str]:
    """What was asked for since the last call, without how detailed."""
    log = folder / "asked.log"
    lines = log.read_text().splitlines() if log.exists() else []
    log.unlink(missing_ok=True)
    return Counter(" ".join(line.split()[:2]) for line in lines)


def rendered(kanuka_command, file: Path, *flags: str) -> tuple[list[np.ndarray], list[dict]]:
    """Pictures and statistics of all frames."""
    folder = file.parent
    numbers = f"{FRAMES[0]}-{FRAMES[-1]}"
    arguments = ("--frame", numbers, "--progressions", 16, "-o", "a.exr", "--stats", "s.json", "--integrator", "facing")
    result = kanuka_command("render", file, *arguments, *flags, cwd=folder)
    assert result.returncode == 0, result.stderr
    pictures = [np.asarray(kanuka.read(folder / f"a.{n:04d}.exr")["rgb"], np.float64) for n in FRAMES]
    return pictures, [json.loads((folder / f"s.{n:04d}.json").read_text()) for n in FRAMES]


def shared(statistics: list[dict], name: str) -> list[int]:
    return [each["procedurals_shared"][name] for each in statistics]


def again(statistics: list[dict]) -> list[dict[str, int]]:
    return [{r["why"]: r["procedurals"] for r in each["procedurals_shared"]["again"]} for each in statistics]


SET = f"""
    AttributeBegin Translate -1.2 0 0 {RUN.format("waits 0.9")} {BOUND} AttributeEnd
    AttributeBegin Translate 0 1 0 {RUN.format("unbounded 0.1")} [-1e38 1e38 -1e38 1e38 -1e38 1e38] AttributeEnd
    ObjectBegin 1 {RUN.format("object 0.5")} {BOUND} ObjectEnd
    AttributeBegin Translate 1.2 0 0 ObjectInstance 1 AttributeEnd
    AttributeBegin Translate 1.2 1 0 ObjectInstance 1 AttributeEnd
    AttributeBegin Translate 0 0 0 Procedural "DynamicLoad" ["ring" "360"] {BOUND} AttributeEnd
    AttributeBegin Translate 0 0 1 Procedural "DynamicLoad" ["old" "x"] {BOUND} AttributeEnd
    AttributeBegin Translate -1.2 1 0 Procedural "DelayedReadArchive" ["house.rib"] {BOUND} AttributeEnd
    AttributeBegin Translate 0 0 -50 {RUN.format("hidden 0.5")} {BOUND} AttributeEnd
"""
ONCE = {"waits 0.9": 1, "unbounded 0.1": 1, "object 0.5": 1, "ring 360": 1, "old x": 1}


def archives(folder: Path) -> None:
    """One in another."""
    (folder / "house.rib").write_text(
        "Color [1 1 0] Cylinder 0.2 -0.3 0.3 360 "
        f'Translate 0 0.2 0 Procedural "DelayedReadArchive" ["roof.rib"] {BOUND}'
    )
    (folder / "roof.rib").write_text("Color [1 0 1] Sphere 0.3 -0.3 0.3 360")


def test_they_are_asked_once_for_all_frames(kanuka_command, tmp_path: Path) -> None:
    archives(tmp_path)
    file = write(tmp_path, SET)
    alone, _ = rendered(kanuka_command, file)
    assert asked(tmp_path) == {name: len(FRAMES) * count for name, count in ONCE.items()}
    together, statistics = rendered(kanuka_command, file, "--together")
    assert asked(tmp_path) == ONCE
    for a, b in zip(alone, together, strict=True):
        assert np.abs(a - b).mean() < 0.004 * a.mean()
    assert shared(statistics, "asked") == [5, 0, 0, 0]
    assert shared(statistics, "kept") == [0, 5, 5, 5]
    assert again(statistics) == [{}] * 4
    # To the bit those of frames that ask by themselves, and are diced for the same cameras.
    by_themselves, _ = rendered(
        kanuka_command, write(tmp_path, SET, 'Option "procedural" "int shared" 0'), "--together"
    )
    assert asked(tmp_path) == {name: len(FRAMES) * count for name, count in ONCE.items()}
    for a, b in zip(by_themselves, together, strict=True):
        assert np.array_equal(a, b)
    # Nobody has seen what is hidden, and the roof is seen once the house is there.
    counts = [each["count"] for each in statistics]
    assert [(count["procedurals"], count["procedurals_read"]) for count in counts] == [(6, 5)] * 4
    assert shared(statistics, "ahead") == [0, 5, 5, 5]
    assert [count["primitives"] - count["primitives_kept"] for count in counts[1:]] == [0, 0, 0]


def test_they_are_as_detailed_as_the_nearest_camera_asks_for(tmp_path: Path) -> None:
    """The camera comes nearer: the first frame asks for what the last one needs."""
    file = write(tmp_path, f"{RUN.format('a 1')} {BOUND}", step=1)
    os.chdir(tmp_path)

    def details() -> list[float]:
        found = [float(line.split()[2]) for line in Path("asked.log").read_text().splitlines()]
        Path("asked.log").unlink()
        return found

    for n in FRAMES:
        kanuka.load(file, frame=n)
    alone = details()
    assert alone == sorted(alone)
    assert alone[-1] > 2 * alone[0]
    cameras = [kanuka.load_camera(file, frame=n) for n in FRAMES]
    expansions = kanuka.Expansions(cameras)
    for n in FRAMES:
        scene = kanuka.load(file, frame=n, expansions=expansions)
        assert scene.procedurals_shared["asked"] == (n == 1)
    assert details() == pytest.approx(alone[-1:])


@pytest.mark.parametrize(
    ("body", "why", "per_frame"),
    [
        (RUN.format("a {n}") + BOUND, "arguments", 1),
        (RUN.format("a 1") + "[-0.5 0.5 -0.5 0.5 -0.5 0.5{n}]", "bound", 1),
        # What moves is another size in the picture, which programs are told.
        (f"Translate 0 0 0.{{n}} {RUN.format('a 1')} {BOUND}", "detail", 1),
        (f'Translate 0 0 0.{{n}} Procedural "DynamicLoad" ["old" "1"] {BOUND}', "detail", 1),
        # Nothing is, of a plug-in that does not ask.
        (f'Translate 0 0 0.{{n}} Procedural "DynamicLoad" ["ring" "360"] {BOUND}', None, 0),
        (
            'Procedural2 "DynamicLoad2" "SimpleBound" "string dsoname" "ring" "float[6] __bound" '
            '[-1 1 -1 1 -1 1] "string data" "360" "float size" {n}',
            "parameters",
            1,
        ),
    ],
)
def test_what_is_not_alike_is_asked_again(kanuka_command, tmp_path: Path, body: str, why: str, per_frame: int) -> None:
    file = write(tmp_path, body)
    alone, _ = rendered(kanuka_command, file)
    assert sum(asked(tmp_path).values()) == 4
    together, statistics = rendered(kanuka_command, file, "--together")
    assert sum(asked(tmp_path).values()) == 1 + 3 * per_frame
    assert again(statistics) == [{}, *[{why: 1} if why else {}] * 3]
    for a, b in zip(alone, together, strict=True):
        assert np.abs(a - b).mean() < 0.004 * a.mean()


def test_options_say_that_a_frame_asks_by_itself(kanuka_command, tmp_path: Path) -> None:
    file = write(tmp_path, f"{RUN.format('a 1')} {BOUND}", 'Option "procedural" "int shared" 0')
    _, statistics = rendered(kanuka_command, file, "--together")
    assert asked(tmp_path) == {"a 1": 4}
    assert shared(statistics, "asked") == [0] * 4


def plug_in(answers: list[str], calls: list[str]):
    """A function that gives one answer after the other."""

    @kanuka.procedural
    def function(request: kanuka.ProceduralRequest) -> str:
        calls.append(request.data)
        return answers[(len(calls) - 1) % len(answers)]

    return {"it": function}


def test_answers_to_the_same_request_stay_in_their_order(tmp_path: Path) -> None:
    """One that gives something else each time gives the frames after what it gave the first."""
    body = f'Procedural "DynamicLoad" ["it" ""] {BOUND} Translate 1 0 0 Procedural "DynamicLoad" ["it" ""] {BOUND}'
    file, calls = write(tmp_path, body), []
    procedurals = plug_in(["Sphere 1 -1 1 360", "Torus 1 0.1 0 360 360", "Disk 0 1 360"], calls)
    expansions = kanuka.Expansions([])
    kinds = [
        kanuka.load(file, frame=n, procedurals=procedurals, expansions=expansions).summary()["primitives"]
        for n in FRAMES
    ]
    assert len(calls) == 2
    assert kinds == [kinds[0]] * 4
    assert kinds[0] != kanuka.load(file, frame=1, procedurals=procedurals).summary()["primitives"]


def test_what_finds_no_room_is_asked_again(tmp_path: Path) -> None:
    file, calls = write(tmp_path, f'Procedural "DynamicLoad" ["it" ""] {BOUND}'), []
    procedurals = plug_in(["Sphere 1 -1 1 360 #" + "x" * (1 << 20)], calls)
    for memory, expected in ((0.5, 4), (2, 1)):
        calls.clear()
        expansions = kanuka.Expansions([], memory=memory)
        for n in FRAMES:
            scene = kanuka.load(file, frame=n, procedurals=procedurals, expansions=expansions)
        assert len(calls) == expected
        whys = [reason["why"] for reason in scene.procedurals_shared["again"]]
        assert whys == (["no room"] if expected == 4 else [])


def test_what_was_asked_long_ago_makes_room(tmp_path: Path) -> None:
    """Room for two answers; each frame asks for another."""
    file, calls = write(tmp_path, f'Procedural "DynamicLoad" ["it" "{{n}}"] {BOUND}', frames=range(1, 9)), []
    procedurals = plug_in(["Sphere 1 -1 1 360 #" + "x" * (1 << 20)], calls)
    expansions = kanuka.Expansions([], memory=2.5)
    for n in range(1, 9):
        for _ in range(2):
            kanuka.load(file, frame=n, procedurals=procedurals, expansions=expansions)
    assert calls == [str(n) for n in range(1, 9)]


def test_mistakes_are_told_in_every_frame(tmp_path: Path) -> None:
    body = f'Procedural "DynamicLoad" ["broken" ""] {BOUND} Procedural "DynamicLoad" ["wrong" ""] {BOUND}'
    file = write(tmp_path, body)

    def broken(detail: float, data: str) -> str:
        raise RuntimeError("it is broken")

    procedurals = {"broken": broken, "wrong": lambda detail, data: "Sphere 1 2"}
    expansions = kanuka.Expansions([])
    said = [
        [str(m) for m in kanuka.load(file, frame=n, procedurals=procedurals, expansions=expansions).journal.messages]
        for n in FRAMES
    ]
    for messages in said:
        assert sum("it is broken" in m for m in messages) == 1
        assert len(messages) == len(said[0]) > 1


def test_libraries_in_c_are_asked_once(root: Path, kanuka_command, tmp_path: Path) -> None:
    compiler = os.environ.get("CC") or shutil.which("cc") or shutil.which("gcc")
    assert compiler, "there is no C compiler"
    source = root / "tests/c/comb.c"
    command = [compiler, "-std=c99", "-shared", "-fPIC", "-I", str(root / "include"), str(source), "-o", "comb.so"]
    subprocess.run(command, cwd=tmp_path, check=True)
    options = 'Declare "wear" "uniform float"'
    body = 'Scale 0.3 0.3 0.3 Procedural "DynamicLoad" ["comb.so" "3 0.4"] [-1 9 -1 3 -1 1]'
    file = write(tmp_path, body, options)
    together, statistics = rendered(kanuka_command, file, "--together")
    assert shared(statistics, "asked")[1:] == [0, 0, 0]
    assert shared(statistics, "asked")[0] == shared(statistics, "kept")[1] > 0
    file = write(tmp_path, body, f'{options} Option "procedural" "int shared" 0')
    by_themselves, statistics = rendered(kanuka_command, file, "--together")
    assert shared(statistics, "kept") == [0] * 4
    for a, b in zip(by_themselves, together, strict=True):
        assert np.array_equal(a, b)


def test_why_something_is_made_again_goes_by_what_it_is(kanuka_command, tmp_path: Path) -> None:
    """Not by the order in which rays meet it: the second hides the first. Curves face the camera in each frame."""
    for name, x in (("wide", 1), ("thin", 0.3)):
        line = f'Curves "linear" [2] "nonperiodic" "P" [-{x} 0 0 {x} 0 0] "constantwidth" [{x}]'
        (tmp_path / f"{name}.rib").write_text(
            f'AttributeBegin Surface "{"matte" if x < 1 else "plastic"}" {line} AttributeEnd'
        )
    behind = "[-1 1 -1 1 0 0.1] TransformEnd TransformBegin Translate 0 0 -1"
    body = f"""TransformBegin Translate 0 0 1 Procedural "DelayedReadArchive" ["wide.rib"] {behind}
        Procedural "DelayedReadArchive" ["thin.rib"] [-1 1 -1 1 0 0.1] TransformEnd"""
    _, statistics = rendered(kanuka_command, write(tmp_path, body), "--together")
    assert [each["count"]["procedurals_read"] for each in statistics] == [2] * 4
    for each in statistics[1:]:
        assert {reason["why"] for reason in each["made_again"]} <= {"camera step"}
    assert statistics[1]["made_again"][0]["primitives"] == 2


def test_a_limit_of_memory_is_of_each_frame(kanuka_command, tmp_path: Path) -> None:
    """Nothing is read ahead: it might take the room of what a frame meets."""
    archives(tmp_path)
    file = write(tmp_path, SET, 'Option "limits" "int proceduralmemory" 100')
    _, statistics = rendered(kanuka_command, file, "--together")
    assert shared(statistics, "ahead") == [0] * 4
    assert [each["count"]["procedurals_read"] for each in statistics] == [5] * 4


def test_hierarchies_are_kept_and_threads_change_nothing(tmp_path: Path) -> None:
    """What frames have met is read in the order of the file from the second frame on: in the third nothing is new."""
    archives(tmp_path)
    file = write(tmp_path, SET)
    os.chdir(tmp_path)
    cameras = [kanuka.load_camera(file, frame=n) for n in FRAMES]
    pictures = {}
    for threads in (1, 4):
        expansions, session = kanuka.Expansions(cameras), None
        for n in FRAMES:
            scene = kanuka.load(file, frame=n, on_demand=True, expansions=expansions)
            if session is None:
                session = kanuka.Session(scene, shot=cameras, progressions=2, threads=threads)
            else:
                session.update(scene)
            session.advance()
            pictures.setdefault(threads, []).append(np.asarray(session.picture()["rgb"]))
            assert session.kept["hierarchies_kept"] or n < 3
    for one, four in zip(pictures[1], pictures[4], strict=True):
        assert np.array_equal(one, four)


def test_the_camera_of_a_frame_is_read_alone(tmp_path: Path) -> None:
    file = write(tmp_path, f"{RUN.format('a 1')} {BOUND}")
    for n in FRAMES:
        scene = kanuka.load(file, frame=n)
        wanted = kanuka.render(scene, progressions=1, integrator="facing")["Z"]
        scene.camera = kanuka.Camera((9, 9, 9), (0, 0, 0))
        scene.camera = kanuka.load_camera(file, frame=n)
        assert np.array_equal(kanuka.render(scene, progressions=1, integrator="facing")["Z"], wanted)
