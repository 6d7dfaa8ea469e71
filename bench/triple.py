"""What four wavelengths cost: our renderer against itself with three colours instead.

    python bench/triple.py [--rounds 6]

`triple.patch` makes of this very source a renderer whose spectra are one RGB triple: no uplift, no hero wavelength, no
sensor curves; everything else is the same code. It is built in a copy of the last commit; a test sees that it applies.
Both render the scenes of the benchmark in turn, from seeds of their own. Time is that of sampling; noise is that of
luminance, relative variance as noise² everywhere in the benchmark; their product is what equal noise costs.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from pathlib import Path

import numpy as np

import intervals
import peers
from settings import ROOT, Found, Say, Settings

PATCH = Path(__file__).resolve().with_suffix(".patch")
TREE = ROOT / "build" / "triple"
SCENES = ("cornell", "terrain", "still-life")
SAMPLES = 32
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # of Rec.709's primaries


def build(tree: Path = TREE) -> Path:
    def run(*command: str | Path, cwd: Path = tree) -> str:
        done = subprocess.run(command, cwd=cwd, capture_output=True, text=True)
        if done.returncode:
            raise RuntimeError(f"{' '.join(map(str, command))}:\n{done.stderr[-1000:]}")
        return done.stdout.strip()

    here = run("git", "rev-parse", "HEAD", cwd=ROOT)
    if not tree.exists():
        run("git", "clone", "-q", ROOT, tree, cwd=ROOT)
    if (tree / "made-of").exists() and (tree / "made-of").read_text() == here:
        return tree
    run("git", "fetch", "-q", "origin")
    run("git", "checkout", "-q", "-f", here)
    run("git", "apply", PATCH)
    run("cmake", "-S", ".", "-B", "build", "-G", "Ninja", f"-DPython_EXECUTABLE={sys.executable}")
    run("ninja", "-C", "build", "kanuka_native")
    (tree / "made-of").write_text(here)
    return tree


def render(tree: Path, scene: str, seed: int, settings: Settings) -> tuple[float, np.ndarray]:
    """Seconds of sampling and the picture, of half the usual size."""
    request = settings.request(scene, samples=4 if settings.quick else SAMPLES)
    request["scale"] = settings.scale / 2
    before = os.environ.get("PYTHONPATH")
    os.environ["PYTHONPATH"] = str(tree / "python")
    try:
        answer = peers.ask(peers.OURS, request | {"seeds": [seed]})
    finally:
        os.environ.pop("PYTHONPATH") if before is None else os.environ.update(PYTHONPATH=before)
    return float(answer.figures["render_s"][0]), answer.pictures[0]


def noise(pictures: list[np.ndarray]) -> float:
    luminance = np.stack(pictures) @ LUMINANCE
    return float(np.mean(luminance.var(0, ddof=1) / (luminance.mean(0) ** 2 + 0.01)))


def measure(settings: Settings, scene: str, say: Say) -> Found:
    trees = {"four_s": ROOT, "three_s": build()}
    rounds: dict[str, list[float]] = {name: [] for name in trees}
    pictures: dict[str, list[np.ndarray]] = {name: [] for name in trees}
    for number in range(settings.rounds):
        for name in list(trees) if number % 2 == 0 else reversed(list(trees)):
            seconds, picture = render(trees[name], scene, number, settings)
            rounds[name].append(seconds)
            pictures[name].append(picture)
    time = intervals.of_ratio(rounds["four_s"], rounds["three_s"])
    variance = noise(pictures["four_s"]) / noise(pictures["three_s"])
    say(f"  {scene:<11} time {time.value:.2f}×, noise² {variance:.2f}×, at equal noise {time.value * variance:.2f}×")
    return {"rounds": rounds, "noise": variance, "at_equal_noise": time.value * variance}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=6, help="pictures of each (default: %(default)s)")
    parser.add_argument("--threads", type=int, default=0, help="0 = all (default)")
    arguments = parser.parse_args()
    for scene in SCENES:
        measure(Settings(rounds=arguments.rounds, threads=arguments.threads), scene, print)


if __name__ == "__main__":
    main()
