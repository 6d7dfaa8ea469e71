"""kanuka render --part and kanuka merge: parts of a picture by the command, and what scripts read of them."""

from __future__ import annotations

import json
import signal
import subprocess
from pathlib import Path

import pytest

import kanuka
from conftest import COMMAND
from test_interruption import wait_for_tracing
from test_merge import same


def test_the_command_makes_the_picture_of_the_whole(ball: Path, tmp_path: Path, kanuka_command) -> None:
    common = ["render", ball, "--progressions", 192, "-q"]
    for part, name in (("0-63", "a.state"), ("64-191", "b.state")):
        done = kanuka_command(*common, "--part", part, "--checkpoint", name)
        assert (done.returncode, done.stdout, done.stderr) == (0, f"{name}\n", "")
    assert not list(tmp_path.glob("*.exr"))
    done = kanuka_command("merge", "b.state", "a.state", "-o", "a.exr", "--png", "--checkpoint", "all.state")
    assert (done.returncode, done.stdout, done.stderr) == (0, "all.state\na.exr\na.png\n", "")
    assert kanuka_command(*common, "-o", "whole.exr", "--png").returncode == 0
    assert (tmp_path / "a.exr").read_bytes() == (tmp_path / "whole.exr").read_bytes()
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "whole.png").read_bytes()
    done = kanuka_command("render", ball, "--progressions", 256, "--checkpoint", "all.state", "-o", "more.exr")
    assert "goes on from all.state: 192 of 256 progressions" in done.stderr
    kanuka_command("render", ball, "--progressions", 256, "-o", "whole.exr")
    assert same(kanuka.read(tmp_path / "more.exr"), kanuka.read(tmp_path / "whole.exr"))


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_a_part_that_is_killed_goes_on(ball: Path, tmp_path: Path, kanuka_command, number: int) -> None:
    common = ["render", ball, "--progressions", "1088", "--resolution", "120x80"]
    kanuka_command(*common, "--part", "0-63", "--checkpoint", "a")
    command = [*common, "--part", "64-1087", "--checkpoint", "b"]
    process = subprocess.Popen(
        [COMMAND, *map(str, command), "--checkpoint-every", "0.1"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    wait_for_tracing(process)
    try:
        process.wait(timeout=0.7)
    except subprocess.TimeoutExpired:
        process.send_signal(number)
    process.communicate(timeout=60)
    done = kanuka_command(*command)
    assert (done.returncode, done.stdout) == (0, "b\n"), done.stderr
    if (tmp_path / "b").exists():
        assert "goes on from b" in done.stderr
    assert kanuka_command("merge", "a", "b", "-o", "a.exr").returncode == 0
    kanuka_command(*common, "-o", "whole.exr")
    assert same(kanuka.read(tmp_path / "a.exr"), kanuka.read(tmp_path / "whole.exr"))


def test_json_tells_what_is_missing(ball: Path, kanuka_command) -> None:
    a, b, c = "abc"
    for part, name in (("0-127", a), ("128-191", b), ("192-319", c)):
        kanuka_command("render", ball, "--progressions", 320, "-q", "--part", part, "--checkpoint", name)
    done = kanuka_command("merge", "--json", c, a)
    report = json.loads(done.stdout)
    assert done.returncode == 0
    assert report["missing"] == ["128-191"]
    assert [(f["file"], f["part"], f["progressions"], f["under_way"]) for f in report["files"]] == [
        (c, "192-319", 128, False),
        (a, "0-127", 128, False),
    ]
    assert report["files"][0]["picture"] == report["files"][1]["picture"]
    done = kanuka_command("merge", "--json", c, a, "-o", "a.exr")
    report = json.loads(done.stdout)
    assert done.returncode == 4
    assert report["written"] == [] and "128 to 191" in report["error"]
    report = json.loads(kanuka_command("merge", "--json", c, a, b, "-o", "a.exr").stdout)
    assert report["written"] == ["a.exr"] and report["error"] is None and report["missing"] == []
    done = kanuka_command("merge", a, c)
    assert "0-127" in done.stdout and "missing: 128-191" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["render", "ball.rib", "--part", "0-63"], 2, "--part: where to?"),
        (["render", "ball.rib", "--part", "64", "--checkpoint", "a"], 2, "expected A-B"),
        (["render", "ball.rib", "--part", "9-70", "--checkpoint", "a"], 2, "The nearest: 0 to 63"),
        (["merge", "none"], 4, "none: there is no such file"),
        (["merge", "ball.rib", "-o", "a.exr"], 4, "ball.rib: this is no checkpoint"),
        (["merge", "ball.rib", "-o", "a.jpg"], 2, "a.jpg: pictures are written as"),
        (["merge", "ball.rib", "--png"], 2, "--png: beside which picture?"),
    ],
)
def test_wrong_commands(ball: Path, kanuka_command, arguments: list[str], code: int, words: str) -> None:
    done = kanuka_command(*arguments)
    assert done.returncode == code
    assert words in done.stderr


def test_imagers_take_the_scene(tmp_path: Path, kanuka_command) -> None:
    file = tmp_path / "a.rib"
    file.write_text(
        'Format 16 16 1\nImager "background" "background" [0 1 0]\nWorldBegin\nSphere 1 -1 1 360\nWorldEnd\n'
    )
    for part, name in (("0-63", "a"), ("64-127", "b")):
        done = kanuka_command("render", file, "--progressions", 128, "--part", part, "--checkpoint", name)
        assert done.returncode == 0, done.stderr
    done = kanuka_command("merge", "a", "b", "-o", "a.exr", "--checkpoint", "all")
    assert done.returncode == 4 and "has an imager" in done.stderr
    assert not (tmp_path / "a.exr").exists() and not (tmp_path / "all").exists()
    assert kanuka_command("merge", "a", "b", "--checkpoint", "all").returncode == 0
    done = kanuka_command("render", file, "--progressions", 128, "--checkpoint", "all", "-o", "a.exr")
    assert "128 of 128 progressions" in done.stderr
    kanuka_command("render", file, "--progressions", 128, "-o", "b.exr")
    assert same(kanuka.read(tmp_path / "a.exr"), kanuka.read(tmp_path / "b.exr"))
