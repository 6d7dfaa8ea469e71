"""Every figure of a page that a benchmark made is in results.json, of a known commit; the benchmark's own tools."""

from __future__ import annotations

import contextlib
import importlib
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

ROOT = Path(__file__).parent.parent
BENCH = ROOT / "bench"
NAMES = {path.stem for path in (*BENCH.glob("*.py"), *BENCH.glob("*/__init__.py"))} | {"peers"}
LOADED: dict[str, ModuleType] = {}


@contextlib.contextmanager
def bench_modules() -> Iterator[None]:
    """Modules of bench/ by their names; some of tests/ have the same ones, and are there again afterwards."""
    hidden = {name: sys.modules.pop(name) for name in NAMES if name in sys.modules}
    sys.modules.update(LOADED)
    sys.path.insert(0, str(BENCH))
    try:
        yield
    finally:
        sys.path.remove(str(BENCH))
        LOADED.update({name: sys.modules.pop(name) for name in NAMES if name in sys.modules})
        sys.modules.update(hidden)


@pytest.fixture(autouse=True)
def bench() -> Iterator[None]:
    with bench_modules():
        yield


with bench_modules():
    intervals, report, scenes, pictures = map(importlib.import_module, ("intervals", "report", "scenes", "pictures"))
    Results = importlib.import_module("results").Results

RESULTS = Results(ROOT / "bench" / "results.json")


@pytest.mark.parametrize("page", report.pages(), ids=lambda page: page.name)
def test_pages_say_what_was_measured(page: Path) -> None:
    text = page.read_text()
    assert report.renewed(text, RESULTS) == text, "bench/report.py --write-docs"


def test_the_results_page_is_of_today() -> None:
    assert (ROOT / "bench" / "RESULTS.md").read_text() == report.page(RESULTS), "bench/report.py"


def test_every_marker_is_closed() -> None:
    for page in report.pages():
        text = page.read_text()
        for kind, pattern in (("bench", report.TABLE), ("figure", report.FIGURE)):
            begun = re.findall(rf"^(?!.*`<!-- {kind}:).*<!-- {kind}: ", text, re.M)  # not where markers are explained
            assert len(pattern.findall(re.sub(r"`<!--[^`]*`", "", text))) == len(begun), page


@pytest.mark.parametrize("name", RESULTS.parts)
def test_commits_are_known(name: str) -> None:
    commit = RESULTS.parts[name]["taken"]["commit"]
    assert re.fullmatch("[0-9a-f]{7,40}", commit), f"{name}: taken at {commit!r}"
    shallow = subprocess.run(["git", "rev-parse", "--is-shallow-repository"], cwd=ROOT, capture_output=True, text=True)
    if shallow.stdout.strip() == "false":  # else old commits are not there to be found
        found = subprocess.run(["git", "cat-file", "-e", f"{commit}^{{commit}}"], cwd=ROOT, capture_output=True)
        assert found.returncode == 0, f"{name}: no commit {commit}"


def test_a_page_that_says_something_else_is_found() -> None:
    name = next(name for name, part in RESULTS.parts.items() if "mean_error" in part["found"])
    marker = f"<!-- figure: {name}:mean_error -->{{}}<!-- /figure -->"
    right = report.renewed(marker.format(""), RESULTS)
    assert right != marker.format("") and report.renewed(marker.format("12"), RESULTS) == right
    with pytest.raises(KeyError, match="no figure speed"):
        report.renewed(f"<!-- figure: {name}:speed -->1<!-- /figure -->", RESULTS)
    with pytest.raises(KeyError):
        report.renewed("<!-- bench: nothing -->\n<!-- /bench -->", RESULTS)


def test_what_was_not_measured_says_so() -> None:
    assert "(not measured)" in report.renewed("<!-- figure: nothing:at.all -->3<!-- /figure -->", RESULTS)


def test_a_stopped_run_goes_on(tmp_path: Path) -> None:
    taken = {"commit": "1234567", "machine": {"cpu": "a"}, "rounds": 6, "quick": False, "threads": 2}
    first = Results(tmp_path / "results.json")
    first.put("hair/linear", taken | {"seconds": 9, "load": [0, 1]}, {"peak_bytes": 3e9})
    again = Results(tmp_path / "results.json")
    assert again.has("hair/linear", taken) and not again.has("hair/cubic", taken)
    for key, other in {"commit": "7654321", "machine": {"cpu": "b"}, "rounds": 3, "quick": True, "threads": 1}.items():
        assert not again.has("hair/linear", taken | {key: other})
    assert again.seconds("hair/linear") == 9
    assert again.look_up("hair/linear:peak_bytes") == 3e9
    assert "3.00 GB" in report.renewed("<!-- figure: hair/linear:peak_bytes -->?<!-- /figure -->", again)


@pytest.mark.parametrize("fails", [False, True])
def test_a_run_names_what_it_leaves_out(
    fails: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    run, plan, peers = map(importlib.import_module, ("run", "plan", "peers"))

    def missing(_settings: object, _say: object) -> None:
        raise peers.NotInstalled("mitsuba is not there")

    def taken(_settings: object, _say: object) -> dict[str, list]:
        if fails:
            raise RuntimeError("of its own")
        return {"runs": []}

    parts = [plan.Part("agreement", "conductor", missing, 1), plan.Part("dice", "", taken, 1)]
    monkeypatch.setattr(plan, "parts", lambda _peers=None: parts)
    monkeypatch.setattr(sys, "argv", ["run.py", "--quick", "-o", str(tmp_path)])
    assert run.main() == fails
    said = capsys.readouterr().out
    assert "left out: agreement/conductor: mitsuba is not there" in said
    assert ("FAILED dice: of its own" in said) == fails
    assert ("dice" in Results(tmp_path / "results.json").parts) != fails


def test_parts_have_names_of_their_own() -> None:
    plan = importlib.import_module("plan")
    names = [part.name for part in plan.parts()]
    assert len(set(names)) == len(names)
    assert {part.measure for part in plan.parts()} == set(report.HEADINGS) - {"goals", "taken"}


def test_intervals_hold_the_truth_as_often_as_they_say() -> None:
    rng = np.random.default_rng(1)
    held = 0
    for _ in range(600):
        found = intervals.of(0.9 * np.exp(0.1 * rng.normal(size=5)))
        held += found.low < 0.9 < found.high
    assert 0.925 < held / 600 < 0.975
    assert intervals.t_quantile(4) == pytest.approx(2.776445, abs=1e-5)  # Student's table
    assert intervals.of([0.8, 0.9, 1.1, 1.2]).below(1) == "undecided"
    assert intervals.of([0.8, 0.81, 0.8, 0.79]).below(1) == "met"
    assert intervals.of([0.8, 0.81, 0.8, 0.79]).above(1) == "missed"
    assert intervals.of([0.8]).below(1) == "undecided"


def test_pairs_cancel_what_both_sides_share() -> None:
    load = np.array([1, 2, 0.7, 3, 1.4])
    found = intervals.of_ratio(list(0.8 * load), list(load))
    assert found.low == pytest.approx(0.8) and found.high == pytest.approx(0.8)


def test_the_error_of_a_picture_is_its_variance_plus_its_bias() -> None:
    rng = np.random.default_rng(2)
    truth = 0.3 + rng.random((96, 96, 3))
    converged = pictures.Estimate.of(truth * (1 + 0.1 * rng.normal(size=(8, 96, 96, 3))), 8)
    noisy = truth * (1 + 0.2 * rng.normal(size=truth.shape))
    weight = np.mean(truth**2 / (truth**2 + 0.01))
    assert pictures.relative_error(noisy, converged) == pytest.approx(0.04 * weight, rel=0.05)
    assert pictures.relative_error(1.1 * truth, converged) == pytest.approx(0.01 * weight, rel=0.1)


def test_a_round_is_held_against_the_others() -> None:
    """Its error is the variance of a picture, however few the others are, and one that is off has a larger one."""
    side_by_side, peers = importlib.import_module("side_by_side"), importlib.import_module("peers")
    rng = np.random.default_rng(3)
    truth = 0.3 + rng.random((96, 96, 3))
    turns = side_by_side.Turns(peers.OURS)
    for k in range(6):
        picture = truth * (1 + 0.2 * rng.normal(size=truth.shape)) * (1.2 if k == 5 else 1)
        figures = {name: 1.0 for name in ("load_s", "build_s", "first_picture_s", "peak_bytes")} | {"render_s": [2.0]}
        turns.add(peers.Answer(figures, picture[None]))
    found = turns.found()["rounds"]
    weight = np.mean(truth**2 / (truth**2 + 0.01))
    assert np.mean(found["error"][:5]) == pytest.approx(0.04 * weight, rel=0.1)
    assert found["error"][5] > 1.8 * 0.04 * weight
    assert found["error_x_time"] == [2 * error for error in found["error"]]


def test_files_are_named_after_what_made_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("KANUKA_BENCH_CACHE", str(tmp_path))

    def write(path: Path, value: int) -> None:
        path.write_text(str(value))

    def one(n: int) -> int:
        return n + 1

    def two(n: int) -> int:
        return n + 2

    made = [scenes.kept("number", ".txt", make, write, n) for make in (one, two) for n in (1, 5)]
    assert len(set(made)) == 4
    assert [path.read_text() for path in made] == ["2", "6", "3", "7"]
    assert scenes.kept("number", ".txt", one, write, 1) == made[0]
    box = scenes.make("cornell")
    assert scenes.content(box) == scenes.content(scenes.make("cornell")) != scenes.content(scenes.make("grey-cornell"))


def test_the_renderer_of_three_colours_can_still_be_made() -> None:
    done = subprocess.run(["git", "apply", "--check", "bench/triple.patch"], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
