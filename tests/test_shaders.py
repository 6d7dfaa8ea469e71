"""One small shader for each feature, with what it gives beside it: the same on every lane count, optimised or not."""

from __future__ import annotations

from pathlib import Path

import pytest

import kanuka
import shader_bench as bench

FLAGS = set(Path("/proc/cpuinfo").read_text().split())
AVX512 = {f"avx512{part}" for part in ("f", "bw", "cd", "dq", "vl")} <= FLAGS
LANES = [1, 8, pytest.param(16, marks=pytest.mark.skipif(not AVX512, reason="16 lanes of shaders need AVX-512"))]


@pytest.mark.parametrize("lanes", LANES)
@pytest.mark.parametrize("name", bench.names())
def test_shader(name: str, lanes: int) -> None:
    expected = bench.parse((bench.SHADERS / f"{name}.txt").read_text())
    for opt_level in (0, 2):
        problem = bench.difference(bench.outcome(name, lanes, opt_level), expected)
        assert not problem, f"O{opt_level}: {problem}"


@pytest.mark.parametrize("lanes", LANES)
def test_as_many_lanes_run_as_are_asked_for(lanes: int) -> None:
    text = kanuka.emit_shader(bench.SHADERS / "for_loop.sl", "llvm", lanes=lanes)
    assert {n for n in (8, 16) if f"<{n} x float>" in text} == {lanes} - {1}


@pytest.mark.parametrize("name", bench.names())
def test_published_shader_gives_the_same(name: str, tmp_path: Path) -> None:
    path = tmp_path / f"{name}.slo"
    path.write_bytes(kanuka.publish_shader(bench.SHADERS / f"{name}.sl"))
    assert bench.text(bench.outcome(name, path=path)).replace(f"{name}.slo:", f"{name}.sl:") == bench.text(
        bench.outcome(name)
    )


def test_every_reference_has_its_shader() -> None:
    assert sorted(p.stem for p in bench.SHADERS.glob("*.txt")) == bench.names()
    assert len(bench.names()) >= 40


def test_the_bench_sees_what_is_wrong() -> None:
    right = bench.outcome("for_loop")
    text = bench.text(right)
    assert not bench.difference(right, bench.parse(text))
    assert "r at row 0, column 0" in bench.difference(right, bench.parse(text.replace("(10 ", "(10.001 ", 1)))
    assert "messages" in bench.difference(right, bench.parse(text + "warning: more\n"))
    assert "outputs" in bench.difference(right, bench.parse(text.replace("r:", "q:")))


@pytest.mark.parametrize("detail", ["uniform", "varying"])
def test_a_value_a_face_reaches_parameters_of_any_detail(tmp_path: Path, detail: str) -> None:
    (tmp_path / "faces.sl").write_text(
        f"surface faces({detail} float k = 0.5;) {{ uniform float twice = 2 * k; Ci = 0.5 * twice; Oi = 1; }}"
    )
    path = tmp_path / "faces.rib"
    path.write_text(
        'Format 16 8 1\nProjection "orthographic"\nWorldBegin\nSurface "faces"\nPointsPolygons [4 4] [0 1 2 3 1 4 5 2] '
        '"P" [-2 -1 1 0 -1 1 0 1 1 -2 1 1 2 -1 1 2 1 1] "uniform float k" [0.75 0.25]\nWorldEnd\n'
    )
    picture = kanuka.render(kanuka.load(path), progressions=64)["rgb"]
    assert picture[2:6, 2:6].mean() == pytest.approx(0.75, rel=0.02)
    assert picture[2:6, -6:-2].mean() == pytest.approx(0.25, rel=0.02)
