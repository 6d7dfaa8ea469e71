"""Bad input ends in a sentence that says what to mend: never in a crash, a hang or all of the machine's memory."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import kanuka

sys.path.insert(0, str(Path(__file__).parent / "fuzz"))
from conftest import COMMAND

TRIANGLE = np.array([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], "float32")
FACE = np.array([[0, 1, 2]], "int32")
SMALL = {"resolution": (16, 12), "progressions": 1}


def scene() -> kanuka.Scene:
    s = kanuka.Scene()
    s.camera = kanuka.Camera((0, 0, 4), (0, 0, 0), (0, 1, 0), fov=45)
    s.add_light("distant", direction=(0, 0, -1))
    return s


def coverage(s: kanuka.Scene) -> float:
    return float(kanuka.render(s, resolution=(64, 64), progressions=4)["alpha"].mean())


# ---- arrays are the scene's own


def test_arrays_may_change_after_they_were_given() -> None:
    kept = scene()
    kept.add_mesh(TRIANGLE, FACE)
    s = scene()
    points, faces = TRIANGLE.copy(), FACE.copy()
    s.add_mesh(points, faces)
    points.resize(30_000_000, refcheck=False)  # moves it, and what lay there is given back
    faces[:] = 2_000_000_000
    del points, faces
    assert coverage(s) == coverage(kept) > 0.05


def test_memory_maps_may_be_truncated(tmp_path: Path) -> None:
    file = tmp_path / "points.bin"
    np.tile(TRIANGLE, (1000, 1)).tofile(file)
    points = np.memmap(file, "float32").reshape(-1, 3)
    s = scene()
    s.add_mesh(points, np.arange(3000, dtype="int32").reshape(-1, 3))
    os.truncate(file, 0)
    assert coverage(s) > 0.05


def test_a_scene_that_is_rendered_cannot_be_added_to() -> None:
    s, group = scene(), None
    s.add_mesh(TRIANGLE, FACE)
    group = s.add_group("g")
    refused: list[str] = []

    def add(*_: object) -> None:
        for call in (
            lambda: s.add_mesh(TRIANGLE, FACE),
            lambda: group.add_sphere(1),
            lambda: s.add_group("h"),
            lambda: s.add_light("point"),
            lambda: s.add_light_shader(kanuka.Shader("pointlight")),
            lambda: s.add_instances(group, np.eye(4)[None]),
            lambda: kanuka.render(s, **SMALL),
        ):
            with pytest.raises(RuntimeError, match="is being rendered"):
                call()
        refused.append("all")
        s.options.exposure_gain = 3  # of the next one

    thread = threading.Thread(target=lambda: kanuka.render(s, **SMALL, progress=add))
    thread.start()
    thread.join()
    assert refused
    s.add_mesh(TRIANGLE, FACE)
    assert s.options.exposure_gain == 3


# ---- what cannot fit


def test_threads_beyond_reason() -> None:
    s = scene()
    for threads in (2_000_000_000, -5):
        with pytest.raises(kanuka.Error, match=f"{threads} threads are asked for; there may be 1 to 4096"):
            kanuka.render(s, **SMALL, threads=threads)
    assert kanuka.render(s, **SMALL, threads=64).width == 16


def test_pictures_that_cannot_fit() -> None:
    memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGESIZE")
    if memory > 72e9:
        pytest.skip("such a picture may fit here")
    started = time.monotonic()
    with pytest.raises(kanuka.Error, match=r"30000 by 30000 pixels takes \d+\.\d GB of memory, and there are"):
        kanuka.render(scene(), resolution=(30000, 30000), progressions=1)
    assert time.monotonic() - started < 10


# ---- sentences


def test_integer_primvars() -> None:
    s = scene()
    s.add_mesh(TRIANGLE, FACE, primvars={"vertex int k": np.array([1, 2, 3])})
    s.add_mesh(TRIANGLE, FACE, primvars={"uniform int k": [7]})
    assert coverage(s) > 0.05


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda s: s.add_mesh(TRIANGLE, FACE, primvars={"vertex string k": [1, 2, 3]}), "one text"),
        (lambda s: kanuka.Material("matte", parameters={"string name": 3}), "expected a text"),
        (lambda s: s.add_mesh(TRIANGLE, FACE, primvars={"k": np.zeros((7, 1))}), "7 values fit nothing"),
        (lambda s: s.add_mesh(TRIANGLE, [[0, 1, 99]]), "index 99"),
        (lambda s: s.add_mesh("points", FACE), "not an array"),
        (lambda s: kanuka.Spectrum("nonsense"), "nonsense"),
    ],
)
def test_says_what_is_wrong(call: object, says: str) -> None:
    with pytest.raises((ValueError, TypeError, kanuka.Error), match=says):
        call(scene())
        kanuka.render(scene(), **SMALL)


def test_names_that_are_no_utf8(tmp_path: Path) -> None:
    file = tmp_path / "a.rib"
    file.write_bytes(
        b'Display "\xe9t\xe9.exr" "file" "rgba"\nTranslate 0 0 4\nWorldBegin\nAttribute "identifier" "name" "\xff"\n'
        b'Surface "papier\xe9"\nSphere 1 -1 1 360\n'
        b'Surface "paintedmatte" "texturename" "b\xe2t.tx"\nDisk 0 1 360\nWorldEnd\n'
    )
    out = tmp_path / "out.exr"
    run = [
        COMMAND,
        "render",
        file,
        "-o",
        out,
        "--resolution",
        "16x12",
        "--progressions",
        "1",
        "--stats",
        tmp_path / "s.json",
    ]
    done = subprocess.run(run, capture_output=True, text=True, errors="replace", check=False)
    assert done.returncode == 3, done.stderr
    assert r"papier\xe9" in done.stderr
    assert r"b\xe2t.tx" in done.stderr
    info = subprocess.run([COMMAND, "info", file, "--json"], capture_output=True, text=True, check=False)
    assert info.returncode in (0, 3), info.stderr


# ---- Ctrl-C


def test_an_interrupt_is_answered_while_dicing(tmp_path: Path) -> None:
    """A wave that needs 30 million micropolygons, all displaced and shaded by a shader that takes its time."""
    program = tmp_path / "long.py"
    program.write_text(f"""
import kanuka, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)  # in the background of a shell it is ignored
open({str(tmp_path / "slow.sl")!r}, "w").write('surface slow() {{ float x = 0, i; for (i = 0; i < 4000; i += 1)'
    ' x += noise(P * (i + 1)); Ci = color(x / 4000); }}')
s = kanuka.Scene()
s.options.shader_path = [{str(tmp_path)!r}]
s.camera = kanuka.Camera((0, 0, 4), (0, 0, 0), (0, 1, 0), fov=45)
s.add_sphere(1, material=kanuka.Material("slow"), shading_rate=0.02)
started = []
def progress(phase, fraction):
    if not started:
        started.append(1)
        print("started", flush=True)
kanuka.render(s, resolution=(800, 800), progressions=1, threads=1, progress=progress)
print("done")
""")
    run = subprocess.Popen([sys.executable, program], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    time.sleep(12)  # it is shaded for minutes
    assert run.poll() is None, run.communicate()
    asked = time.monotonic()
    run.send_signal(signal.SIGINT)
    try:
        out, err = run.communicate(timeout=120)
    finally:
        run.kill()
    answered = time.monotonic() - asked
    assert "KeyboardInterrupt" in err, out + err
    assert answered < 5  # a second where the machine does nothing else


# ---- the short form of tests/fuzz/python_fuzz.py


def test_random_calls() -> None:
    fuzz = Path(__file__).parent / "fuzz" / "python_fuzz.py"
    done = subprocess.run([sys.executable, fuzz, "--count", "60"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
