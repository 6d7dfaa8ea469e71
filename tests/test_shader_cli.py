"""kanuka shader: compile --emit, info, publish, cache, run."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import kanuka

ROOT = Path(__file__).resolve().parent.parent
PAINT = """\
#include "paint.h"
class paint(
    color tint = color(0.5, 0.25, 0.75); // of the paint
    float rough = 0.3;
    string map = "";
) {
    public void mnk_init(output MnkObjectProperties o; output MnkMaterial m) {
        MnkMaterialBoundary b = CreateBoundary(m);
        AddLobe(b, "gloss", MicrofacetDielectricBrdf());
        AddLobe(b, "body", LambertBrdf());
        AddLayer(b, "all", "coat", "gloss", "body");
    }
    public void mnk_prelighting(output MnkMaterialBoundary b) {
        color c = tint * stripes(u);
        if (map != "") c *= color texture(map, s, t);
        SetLobe(b, "body", 1, LambertBrdf("diffuseReflectance", c));
        SetLobe(b, "gloss", 1, MicrofacetDielectricBrdf("roughness", rough));
        SetLayer(b, "all", 0);
    }
}
"""


@pytest.fixture
def paint(tmp_path: Path) -> Path:
    (tmp_path / "paint.h").write_text("float stripes(float x) { return step(0.5, x) * 0.5 + 0.5; }\n")
    path = tmp_path / "paint.sl"
    path.write_text(PAINT)
    return path


def test_emit(kanuka_command, paint: Path) -> None:
    shown = {what: kanuka_command("shader", "compile", paint, f"--emit={what}") for what in kanuka_emits()}
    for what, result in shown.items():
        assert result.returncode == 0 and len(result.stdout) > 200, (what, result.stderr)
    assert "// paint.sl:14: color c = tint * stripes(u);" in shown["c"].stdout
    assert "    SetLobe(" not in shown["c"].stdout, "what is left is arithmetic"
    assert "body.diffuseReflectance = " in shown["c"].stdout
    one = kanuka_command("shader", "compile", paint, "--emit=c", "--stage", "init").stdout
    assert "AddLayer(" in one and "diffuseReflectance" not in one
    assert kanuka_command("shader", "compile", paint, "--emit=c", "-o", "out.c").stdout == ""
    assert (paint.parent / "out.c").read_text() == shown["c"].stdout
    assert kanuka_command("shader", "compile", paint, "--stage", "init").returncode == 2
    assert kanuka_command("shader", "compile", paint, "--emit=tea").returncode == 2
    paint.write_text(PAINT.replace("stripes(u)", "stripes(q)"))
    broken = kanuka_command("shader", "compile", paint, "--emit=c")
    assert broken.returncode == 4 and "paint.sl:14:" in broken.stderr


def kanuka_emits() -> list[str]:
    from kanuka.cli.shader import EMITS

    return list(EMITS)


def test_info(kanuka_command, paint: Path) -> None:
    text = kanuka_command("shader", "info", paint).stdout
    for expected in (
        "class paint",
        "uniform color tint = (0.5, 0.25, 0.75)  // of the paint",
        "uniform float rough = 0.3\n",
        'coat "all": weight uniform',
        'LambertBrdf "body": diffuseReflectance varying',
        "bytes a vertex: 4, 8 if everything varies",
        "texture: named by map",
    ):
        assert expected in text, text
    info = json.loads(kanuka_command("shader", "info", paint, "--json").stdout)
    assert [n["op"] for n in info["material"]["nodes"]] == ["lobe", "lobe", "coat"]
    assert info["textures"] == [{"file": "", "parameter": "map", "environment": False}]
    assert info["material"]["bytes_per_vertex"] == 4
    assert 'MicrofacetDielectricBrdf "coat"' in kanuka_command("shader", "info", "lacquer").stdout, "one that ships"


def test_publish(kanuka_command, paint: Path, tmp_path: Path) -> None:
    result = kanuka_command("shader", "publish", paint)
    assert result.stdout == f"{tmp_path / 'paint.slo'}\n"
    plain = kanuka_command("shader", "info", paint).stdout
    (tmp_path / "paint.h").unlink()
    paint.unlink()
    slo = tmp_path / "paint.slo"
    assert kanuka_command("shader", "info", slo).stdout == plain
    about = json.loads(kanuka.published_metadata(slo))
    assert about["name"] == "paint" and len(about["parameters"]) == 3
    assert kanuka_command("shader", "publish", slo).returncode == 2
    assert kanuka_command("shader", "publish", slo, "-o", "nowhere/a.slo").returncode == 5
    slo.write_bytes(slo.read_bytes()[:300])
    broken = kanuka_command("shader", "compile", slo)
    assert broken.returncode == 4 and "paint.slo: the published shader is damaged" in broken.stderr


def test_scenes_find_published_shaders(kanuka_command, paint: Path, ball: Path) -> None:
    ball.write_text(ball.read_text().replace('Surface "matte"', 'Surface "paint" "tint" [0 1 0]'))
    source = kanuka_command("render", ball, "--progressions", 4, "-o", "a.exr")
    assert source.returncode == 0, source.stderr
    kanuka_command("shader", "publish", paint)
    paint.unlink()
    published = kanuka_command("render", ball, "--progressions", 4, "-o", "b.exr")
    assert published.returncode == 0, published.stderr
    a, b = (kanuka.read(ball.parent / name)["rgb"] for name in ("a.exr", "b.exr"))
    assert np.array_equal(a, b)


def test_run(kanuka_command, paint: Path, tmp_path: Path) -> None:
    result = kanuka_command(
        "shader", "run", paint, "--grid", "8x4", "--params", "tint=1 0.5 0.25", "rough=0.5", "-o", "a.exr"
    )
    assert result.returncode == 0, result.stderr
    assert result.stdout == "a.exr\n"
    picture = kanuka.read(tmp_path / "a.exr")
    assert picture["rgb"].shape == (4, 8, 3)
    assert picture["rgb"][0, 0] == pytest.approx([0.5, 0.25, 0.125])
    assert picture["rgb"][3, 7] == pytest.approx([1, 0.5, 0.25])
    assert np.all(picture["N"] == [0, 0, 1])
    assert picture["P"][3, 7] == pytest.approx([1, 1, 0])
    assert kanuka_command("shader", "run", paint, "--output", "gloss.roughness", "-o", "b.exr").returncode == 0
    assert np.allclose(kanuka.read(tmp_path / "b.exr")["rgb"], 0.3)
    everything = kanuka_command("shader", "run", paint, "--output", "all", "--grid", "2x2", "-o", "c.exr")
    assert everything.returncode == 0
    assert "body.diffuseReflectance" in kanuka.read(tmp_path / "c.exr").keys()  # noqa: SIM118
    assert kanuka_command("shader", "run", paint, "--grid", "4x4", "-o", "d.png").returncode == 0
    for wrong in (
        ["--params", "tin=1"],
        ["--params", "tint"],
        ["--params", "tint=1 2"],
        ["--params", "rough=x"],
        ["--output", "nothing"],
        ["--grid", "0x4"],
    ):
        assert kanuka_command("shader", "run", paint, *wrong, "-o", "a.exr").returncode == 2, wrong
    missing = kanuka_command("shader", "run", paint, "--params", "map=nowhere.png", "-o", "a.exr")
    assert "nowhere.png" in missing.stderr


def test_run_displaces(kanuka_command, tmp_path: Path) -> None:
    (tmp_path / "up.sl").write_text("displacement up() { P += 0.5 * u * N; N = calculatenormal(P); }\n")
    assert kanuka_command("shader", "run", "up.sl", "--grid", "5x5", "-o", "a.exr").returncode == 0
    picture = kanuka.read(tmp_path / "a.exr")
    assert np.allclose(picture["P"][..., 2], 0.5 * picture["P"][..., 0])
    assert np.all(picture["N"][..., 0] < 0)


def test_graphs_are_shaders_to_the_command(kanuka_command, tmp_path: Path) -> None:
    graph = kanuka.ShaderGraph("sums")
    two = graph.add("add", "two", a=0.25, b=0.5)
    graph.surface = graph.add("matte", "skin", color=two)
    graph.save(tmp_path / "sums.json")
    assert "class sums" in kanuka_command("shader", "compile", "sums.json").stdout
    assert "graphAddFloat" in kanuka_command("shader", "compile", "sums.json", "--emit=rsl").stdout
    assert kanuka_command("shader", "run", "sums.json", "--params", "two_b=0.75", "-o", "a.exr").returncode == 0
    assert np.allclose(kanuka.read(tmp_path / "a.exr")["rgb"], 1)
    assert kanuka_command("shader", "publish", "sums.json").returncode == 0
    assert (tmp_path / "sums.slo").exists()
    (tmp_path / "sums.json").write_text('{"nodes": {"a": {"type": "tea"}}}')
    broken = kanuka_command("shader", "compile", "sums.json")
    assert broken.returncode == 4 and broken.stderr.startswith(
        'error: sums.json: node "a": there is no node type "tea"'
    )


def test_cache(kanuka_command, paint: Path, tmp_path: Path) -> None:
    folder = tmp_path / "cache"
    environment = {**os.environ, "KANUKA_SHADER_CACHE": str(folder)}
    run = lambda *arguments: kanuka_command("shader", *arguments, env=environment)  # noqa: E731
    assert "from the cache" not in run("compile", paint).stdout
    assert "from the cache" in run("compile", paint).stdout
    assert "paint" in run("cache", "list").stdout and "in 1 entries" in run("cache", "list").stdout
    (entry,) = json.loads(run("cache", "list", "--json").stdout)["entries"]
    assert entry["shader"] == "paint" and entry["bytes"] > 1000
    assert run("cache", "verify").returncode == 0
    Path(entry["file"]).write_bytes(b"KNKCODE2 and nothing else")
    broken = run("cache", "verify")
    assert broken.returncode == 3 and "1 broken" in broken.stdout
    again = run("compile", paint)
    assert again.returncode == 0 and "from the cache" not in again.stdout
    assert run("cache", "verify").returncode == 0
    assert run("cache", "trim", "--size", "1G").stdout == "0 files removed\n"
    assert run("cache", "trim", "--size", "1").stdout == "1 files removed\n"
    run("compile", paint)
    assert run("cache", "clear").stdout == "1 files removed\n"
    assert "0 B in 0 entries" in run("cache", "list").stdout


def test_a_full_disk_costs_the_cache_alone(kanuka_command, paint: Path, tmp_path: Path) -> None:
    """/dev/full stands for a full disk: a cache folder that is none cannot be written either."""
    (tmp_path / "cache").write_text("in the way")
    result = kanuka_command("shader", "compile", paint, env={**os.environ, "KANUKA_SHADER_CACHE": "cache"})
    assert result.returncode == 0
    assert result.stderr.count("warning") == 1 and "cannot be written" in result.stderr


def compile_at_once(count: int, folder: Path, shader: Path) -> list[subprocess.CompletedProcess[str]]:
    """Processes that all wait for one moment, then compile the same shader into the same cache."""
    program = (
        "import sys, time, kanuka\n"
        "time.sleep(max(0, float(sys.argv[2]) - time.time()))\n"
        "shader = kanuka.compile_shader(sys.argv[1])\n"
        "out = shader.run(9, 5)['slots']\n"
        "print(sum(float(v.sum()) for v in out.values()))\n"
    )
    start = time.time() + 1 + 0.1 * count
    environment = {**os.environ, "KANUKA_SHADER_CACHE": str(folder), "PYTHONPATH": str(ROOT / "python")}
    children = [
        subprocess.Popen(
            [sys.executable, "-c", program, str(shader), str(start)],
            env=environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        )
        for _ in range(count)
    ]  # fmt: skip
    return [subprocess.CompletedProcess(c.args, c.wait(), *c.communicate()) for c in children]


@pytest.mark.parametrize("count", [20, pytest.param(200, marks=pytest.mark.slow)])
def test_many_processes_share_a_cache(count: int, paint: Path, tmp_path: Path) -> None:
    results = compile_at_once(count, tmp_path / "cache", paint)
    assert {(r.returncode, r.stderr) for r in results} == {(0, "")}
    assert len({r.stdout for r in results}) == 1
    entries = kanuka.shader_cache_entries(str(tmp_path / "cache"), verify=True)
    assert [e["problem"] for e in entries] == [""]
    assert [p.suffix for p in (tmp_path / "cache").iterdir()] == [".kso"]
