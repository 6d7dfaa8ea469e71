"""Whatever happens to the process, the final name never holds half a picture."""

from __future__ import annotations

import random
import signal
import subprocess
import time
from pathlib import Path

import pytest

import kanuka
from conftest import COMMAND


def start(ball: Path, tmp_path: Path, *arguments: object) -> subprocess.Popen[str]:
    command = [COMMAND, "render", ball, "-o", "a.exr", *map(str, arguments)]
    return subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def wait_for_tracing(process: subprocess.Popen[str]) -> None:
    """Phases print their line as they end; after the BVH's, rays are traced."""
    for line in process.stderr:
        if line.startswith("building BVH"):
            return
    pytest.fail("the render ended early")


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_interrupting_keeps_what_is_there(ball: Path, tmp_path: Path, number: int, code: int) -> None:
    process = start(ball, tmp_path, "--progressions", 10_000_000)
    wait_for_tracing(process)
    time.sleep(0.5)
    process.send_signal(number)
    output, _ = process.communicate(timeout=60)
    assert process.returncode == code
    assert output == "a.partial.exr\n"
    assert not (tmp_path / "a.exr").exists()
    picture = kanuka.read(tmp_path / "a.partial.exr")
    assert picture["rgb"].max() > 0.1


def test_killing_never_leaves_half_a_picture(ball: Path, tmp_path: Path) -> None:
    arguments = ["--resolution", "600x400", "--progressions", 1]
    started = time.monotonic()
    process = start(ball, tmp_path, *arguments)
    assert process.wait(timeout=120) == 0
    whole = time.monotonic() - started
    output = tmp_path / "a.exr"
    output.unlink()
    random.seed(7)
    complete = 0
    for moment in (random.uniform(0.3, 1.1) for _ in range(12)):
        process = start(ball, tmp_path, *arguments)
        time.sleep(moment * whole)
        process.kill()
        process.communicate()
        if output.exists():
            picture = kanuka.read(output)  # raises for a broken file
            assert (picture.width, picture.height) == (600, 400)
            complete += 1
            output.unlink()
    assert complete < 12, "some must have been killed before the end"
