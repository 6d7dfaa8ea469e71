"""The command: help, outputs, messages, exit codes, statistics."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path

import pytest

import conftest
import kanuka

COMMANDS = [[], ["render"], ["info"], ["convert"], ["compare"], ["shader"], ["shader", "compile"]]
COMMANDS += [["shader", name] for name in ("info", "publish", "cache", "run")]


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_help(kanuka_command, command: list[str]) -> None:
    result = kanuka_command(*command, "--help")
    assert result.returncode == 0
    assert result.stdout.startswith("usage: kanuka")
    assert result.stderr == ""


@pytest.mark.parametrize(
    "command", [["render"], ["info"], ["convert"], ["compare"], ["shader", "compile"]], ids=" ".join
)
def test_help_has_examples_and_exit_codes(kanuka_command, command: list[str]) -> None:
    text = kanuka_command(*command, "--help").stdout
    assert "examples:\n  kanuka " + " ".join(command) in text
    for code in (0, 2, 3, 4, 5, 70, 130, 143):
        assert re.search(rf"^ +{code}  ", text, re.MULTILINE), code


def test_version_is_that_of_the_project(kanuka_command, root: Path) -> None:
    version = tomllib.loads((root / "pyproject.toml").read_text())["project"]["version"]
    assert kanuka_command("--version").stdout == f"kanuka {version}\n"
    assert kanuka.__version__ == version


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        ([], "COMMAND"),
        (["render"], "SCENE"),
        (["paint", "a.rib"], "paint"),
        (["render", "a.rib", "--nonsense"], "--nonsense"),
        (["render", "a.rib", "--progressions", "0"], "whole number from 1 to 2147483647, got '0'"),
        (["render", "a.rib", "--progressions", "many"], "whole number from 1 to 2147483647, got 'many'"),
        (["render", "a.rib", "--resolution", "640"], "WIDTHxHEIGHT"),
        (["render", "a.rib", "--crop", "0,1,0"], "X0,X1,Y0,Y1"),
        (["render", "a.rib", "--crop", "0.5,0.5,0,1"], "xmin < xmax"),
        (["render", "a.rib", "--shading-rate", "-1"], "above 0"),
        (["render", "a.rib", "--shading-rate", "nan"], "expected a number"),
        (["render", "a.rib", "--lanes", "3"], "choose from 0, 1, 8, 16"),
        (["render", "a.rib", "--integrator", "magic"], 'unknown integrator "magic"'),
        (["render", "a.rib", "-o", "a.tif"], ".exr or .png"),
        (["shader", "compile", "a.sl", "-D", "1x"], "NAME=VALUE"),
    ],
)
def test_wrong_command_lines(kanuka_command, arguments: list[str], word: str) -> None:
    result = kanuka_command(*arguments)
    assert result.returncode == 2
    assert word.replace(", ", "").replace("'", "") in result.stderr.replace(", ", "").replace("'", "")
    assert result.stdout == ""


def test_convert_round_trip(kanuka_command, ball: Path, tmp_path: Path) -> None:
    for source, target, *options in (
        (ball, "text.rib"),
        ("text.rib", "binary.rib.gz", "--binary"),
        ("binary.rib.gz", "again.rib.zst"),
        ("again.rib.zst", "packed", "--gzip", "--binary"),
        ("packed", "last.rib"),
    ):
        result = kanuka_command("convert", source, target, *options)
        assert result.returncode == 0, result.stderr
    assert (tmp_path / "last.rib").read_bytes() == (tmp_path / "text.rib").read_bytes()
    assert (tmp_path / "packed").read_bytes()[:2] == b"\x1f\x8b"
    assert kanuka_command("convert", "packed", "-").stdout == (tmp_path / "text.rib").read_text()
    assert kanuka_command("convert", "packed", "no/where.rib").returncode == 5
    assert kanuka_command("convert", "packed", "x.rib", "--gzip", "--zstd").returncode == 2
    assert kanuka_command("convert", "none.rib", "x.rib").returncode == 4


@pytest.mark.parametrize("coat", [[], ["--gzip"], ["--zstd"], ["--binary", "--zstd"]], ids=" ".join)
def test_every_coat_comes_by_standard_input(kanuka_command, ball: Path, tmp_path: Path, coat: list[str]) -> None:
    assert kanuka_command("convert", ball, "packed", *coat).returncode == 0
    with open(tmp_path / "packed", "rb") as packed:
        result = kanuka_command("convert", "-", "-", stdin=packed)
    assert result.returncode == 0, result.stderr
    assert result.stdout == kanuka_command("convert", ball, "-").stdout


def test_render_reads_several_files_as_one(kanuka_command, ball: Path, tmp_path: Path) -> None:
    (tmp_path / "small.opt").write_text('Option "kanuka" "integrator" "facing"\nFormat 9 9 1\n')
    lines = [line for line in ball.read_text().splitlines() if not line.startswith("Format")]
    (tmp_path / "plain.rib").write_text("\n".join(lines) + "\n")
    result = kanuka_command("render", "small.opt", "plain.rib", "--progressions", 1)
    assert result.returncode == 0, result.stderr
    picture = kanuka.read(tmp_path / result.stdout.strip())
    assert (picture.width, picture.height) == (9, 9)
    assert kanuka_command("render", "none.opt", "plain.rib").returncode == 4


def test_render_writes_picture_png_and_statistics(kanuka_command, ball: Path, tmp_path: Path) -> None:
    result = kanuka_command("render", ball, "-o", "a.exr", "--png", "--stats", "a.json", "--progressions", 4)
    assert result.returncode == 0, result.stderr
    assert result.stdout.split() == ["a.exr", "a.png"]
    assert (tmp_path / "a.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    picture = kanuka.read(tmp_path / "a.exr")
    assert (picture.width, picture.height) == (48, 32)
    assert picture["rgb"].max() > 0.1, "the ball is lit"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.exr", "a.json", "a.png", "ball.rib"]

    stats = json.loads((tmp_path / "a.json").read_text())
    times = {"ingest_s", "dice_s", "shade_s", "bvh_s", "transport_s", "film_s", "total_s", "first_pixel_s"}
    counts = {"primitives", "grids", "vertices", "micropolygons", "instances", "shader_evaluations", "paths", "rays"}
    assert times <= stats["time"].keys()
    assert counts | {"nan_samples"} <= stats["count"].keys()
    assert {"grids", "lobe_inputs", "bvh", "textures", "peak_rss"} <= stats["bytes"].keys()
    assert {"machine", "version", "arguments"} <= stats.keys()
    assert stats["count"]["primitives"] == 1
    assert stats["count"]["paths"] == 48 * 32 * 4
    assert stats["count"]["nan_samples"] == 0
    assert stats["count"]["rays"] >= stats["count"]["paths"]
    assert stats["bytes"]["peak_rss"] > 10e6
    parts = [stats["time"][name] for name in times - {"total_s", "first_pixel_s"}]
    assert 0 < sum(parts) <= stats["time"]["total_s"] * 1.01
    assert 0 < stats["time"]["first_pixel_s"] <= stats["time"]["total_s"]
    assert stats["arguments"][0] == "render"


def test_progress_is_a_line_a_phase_and_quiet_is_silent(kanuka_command, ball: Path) -> None:
    loud = kanuka_command("render", ball, "--progressions", 1)
    for label in ("reading", "dicing", "building BVH", "tracing"):
        assert len(re.findall(rf"^{label} .*\d s$", loud.stderr, re.MULTILINE)) == 1, loud.stderr
    assert "\r" not in loud.stderr
    quiet = kanuka_command("render", ball, "--progressions", 1, "--quiet")
    assert quiet.stderr == ""


def test_default_output_is_the_display_then_the_scene(kanuka_command, ball: Path, tmp_path: Path) -> None:
    assert kanuka_command("render", ball, "--progressions", 1).stdout == "ball.exr\n"
    scene = tmp_path / "thing.rib"
    scene.write_text((conftest.HEADER + conftest.WORLD).replace('"ball.exr"', '"frames.0001.tif"'))
    assert kanuka_command("render", scene, "--progressions", 1).stdout == "frames.0001.exr\n"
    scene.write_text(re.sub(r"Display.*\n", "", conftest.HEADER) + conftest.WORLD)
    assert kanuka_command("render", scene, "--progressions", 1).stdout == "thing.exr\n"


def test_options_go_over_the_scene(kanuka_command, ball: Path, tmp_path: Path) -> None:
    arguments = ["render", ball, "-o", "a.exr", "--progressions", 1, "--resolution", "64x40"]
    assert kanuka_command(*arguments, "--crop", "0.5,1,0,0.5").returncode == 0
    picture = kanuka.read(tmp_path / "a.exr")
    assert (picture.width, picture.height) == (32, 20)
    assert picture.full_size == (64, 40)
    assert picture.offset == (32, 0)


def test_commands_run_only_where_they_are_allowed(kanuka_command, tmp_path: Path) -> None:
    made = tmp_path / "made"
    scene = tmp_path / "scene.rib"
    scene.write_text(f'Format 8 8 1 System "touch {made}"\nWorldBegin\nSphere 1 -1 1 360\nWorldEnd\n')
    command = ["render", scene, "-o", tmp_path / "a.exr", "--progressions", "1"]
    result = kanuka_command(*command)
    assert "was not run: a scene may run commands only if" in result.stderr
    assert not made.exists()
    kanuka_command(*command, "--allow-system")
    assert made.exists()


def test_scene_that_is_not_there(kanuka_command, tmp_path: Path) -> None:
    result = kanuka_command("render", "nowhere.rib")
    assert result.returncode == 4
    assert result.stderr.count("nowhere.rib") == 1
    assert "Traceback" not in result.stderr
    assert list(tmp_path.iterdir()) == []


def test_bad_requests_are_located_and_the_rest_renders(kanuka_command, tmp_path: Path) -> None:
    scene = tmp_path / "bad.rib"
    scene.write_text(conftest.HEADER + 'Frobnicate "x" [1 2]\n' + conftest.WORLD)
    result = kanuka_command("render", scene, "-o", "a.exr", "--progressions", 1)
    assert result.returncode in (0, 3)
    assert re.search(r"^(warning|error): .*bad\.rib:6(:\d+)?: .*Frobnicate", result.stderr, re.MULTILINE)
    assert kanuka.read(tmp_path / "a.exr")["rgb"].max() > 0.1


def test_missing_shader_is_replaced_and_fails_the_frame(kanuka_command, tmp_path: Path) -> None:
    scene = tmp_path / "a.rib"
    scene.write_text(conftest.HEADER + conftest.WORLD.replace('"matte"', '"mattte"'))
    result = kanuka_command("render", scene, "-o", "a.exr", "--progressions", 1)
    assert result.returncode == 3
    assert re.search(r"^error: .*a\.rib:9(:\d+)?: .*mattte", result.stderr, re.MULTILINE), result.stderr
    assert kanuka.read(tmp_path / "a.exr")["rgb"].max() > 0.1, "matte stands in"


def test_missing_texture_is_reported_and_fails_the_frame(kanuka_command, tmp_path: Path) -> None:
    (tmp_path / "textured.sl").write_text(
        'surface textured(string name = "";) { Ci = color texture(name) * diffuse(faceforward(normalize(N), I)); }\n'
    )
    scene = tmp_path / "a.rib"
    world = conftest.WORLD.replace('"matte"', '"textured" "string name" ["nowhere.tx"]')
    scene.write_text(conftest.HEADER + world)
    result = kanuka_command("render", scene, "-o", "a.exr", "--progressions", 1)
    assert result.returncode == 3, result.stderr
    assert re.search(r"^error: .*nowhere\.tx.*$", result.stderr, re.MULTILINE)
    assert (tmp_path / "a.exr").exists()


@pytest.mark.parametrize("output", ["no/such/folder/a.exr", "folder.exr"])
def test_output_that_cannot_be_written(kanuka_command, ball: Path, tmp_path: Path, output: str) -> None:
    (tmp_path / "folder.exr").mkdir()
    result = kanuka_command("render", ball, "-o", output)
    assert result.returncode == 5
    assert output in result.stderr
    assert result.stdout == ""


def test_info(kanuka_command, ball: Path) -> None:
    text = kanuka_command("info", ball)
    assert text.returncode == 0
    assert "48 × 32" in text.stdout
    assert "1 × sphere" in text.stdout
    assert "distantlight" in text.stdout
    summary = json.loads(kanuka_command("info", ball, "--json").stdout)
    assert summary["resolution"] == [48, 32]
    assert summary["shaders"]["surface"] == ["matte"]
    assert summary["fov"] == 40
    assert kanuka_command("info", "nowhere.rib").returncode == 4


def test_compare(kanuka_command, ball: Path, tmp_path: Path) -> None:
    for seed, name in ((1, "a.exr"), (1, "b.exr"), (2, "c.exr")):
        assert kanuka_command("render", ball, "-o", name, "--progressions", 2, "--seed", seed).returncode == 0
    same = json.loads(kanuka_command("compare", "a.exr", "b.exr", "--json").stdout)
    assert same["relative_mse"] == 0
    assert same["flip"] == 0
    assert same["mean_ratio"] == 1
    other = json.loads(kanuka_command("compare", "a.exr", "c.exr", "--json", "-o", "d.png").stdout)
    assert other["relative_mse"] > 0
    assert (tmp_path / "d.png").exists()
    text = kanuka_command("compare", "a.exr", "c.exr").stdout
    assert "relative MSE" in text
    assert kanuka_command("compare", "a.exr", "nowhere.exr").returncode == 4
    (tmp_path / "broken.exr").write_bytes(b"\x76\x2f\x31\x01 and then nothing of use")
    broken = kanuka_command("compare", "a.exr", "broken.exr")
    assert broken.returncode == 4
    assert "broken.exr" in broken.stderr


def test_shader_compile(kanuka_command, tmp_path: Path) -> None:
    (tmp_path / "good.sl").write_text(
        'surface good(float Kd = 0.5; color tint = color(1, 0.5, 0); string map = "a.tx";) '
        "{ Oi = Os; Ci = Os * tint * Kd * diffuse(faceforward(normalize(N), I)); }\n"
    )
    result = kanuka_command("shader", "compile", "good.sl")
    assert result.returncode == 0, result.stderr
    assert "surface good" in result.stdout
    assert "float Kd = 0.5" in result.stdout
    assert "color tint = (1, 0.5, 0)" in result.stdout
    assert 'string map = "a.tx"' in result.stdout

    (tmp_path / "bad.sl").write_text("surface bad() {\n    Ci = undefined_thing;\n}\n")
    result = kanuka_command("shader", "compile", "bad.sl")
    assert result.returncode == 4
    assert re.search(r"^error: .*bad\.sl:2:\d+: .*undefined_thing", result.stderr, re.MULTILINE)
    assert "^" in result.stderr, "a caret under the place"
    assert kanuka_command("shader", "compile", "nowhere.sl").returncode == 4


def test_black_pictures_say_why(kanuka_command, tmp_path: Path) -> None:
    def said(world: str) -> str:
        path = tmp_path / "black.rib"
        path.write_text(f"Format 16 16 1\nWorldBegin {world} WorldEnd\n")
        return kanuka_command("render", str(path), "-o", str(tmp_path / "a.exr"), "--progressions", "1").stderr

    ball = 'Surface "matte" Translate 0 0 5 Sphere 1 -1 1 360'
    assert "the picture is black: no light shines" in said(ball)
    behind = 'LightSource "distantlight" 1 "from" [0 0 1] "to" [0 0 0] '
    sheet = 'Surface "matte" Polygon "P" [-9 -9 5 -9 9 5 9 9 5 9 -9 5]'
    assert "the picture is black: no light reaches" in said(behind + sheet)
    assert "the picture is black: the camera sees nothing" in said(
        'LightSource "distantlight" 1 Translate 9 9 5 ' + ball
    )
    assert "black" not in said('LightSource "distantlight" 1 ' + ball)
    # A network without light: its shader could shine, and does not. Said once, with --quiet too.
    network = 'Bxdf "PxrDisney" "m" "color baseColor" [0.5 0.5 0.5] Translate 0 0 5 Sphere 1 -1 1 360'
    path = tmp_path / "network.rib"
    path.write_text(f"Format 16 16 1\nWorldBegin {network} WorldEnd\n")
    result = kanuka_command("render", path, "-o", str(tmp_path / "b.exr"), "--progressions", "1", "--quiet")
    assert result.stderr.count("the picture is black: no light shines") == 1
