"""What four wavelengths cost: our renderer against itself with three colours instead.

    python bench/triple.py [--rounds 3] [--samples 32] [--threads 0] [--tree build/triple]

`triple.patch` makes of this very source a renderer whose spectra are one RGB triple: no uplift, no hero wavelength, no
sensor curves; everything else is the same code. It is built in a copy of the last commit. Both render the scenes of the
benchmark in turn, from seeds of their own. Time is that of sampling; noise is that of luminance, relative variance as
noise² everywhere in the benchmark; their product is what equal noise costs.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
from pathlib import Path

import numpy as np

import peers

ROOT = Path(__file__).resolve().parent.parent
PATCH = Path(__file__).resolve().with_suffix(".patch")
SCENES = ("cornell", "terrain", "still-life")
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # of Rec.709's primaries


def build(tree: Path) -> None:
    def run(*command: str | Path, cwd: Path = tree) -> None:
        subprocess.run(command, cwd=cwd, check=True, capture_output=True)

    if not tree.exists():
        run("git", "clone", "-q", ROOT, tree, cwd=ROOT)
        run("git", "apply", PATCH)
        run("cmake", "-S", ".", "-B", "build", "-G", "Ninja", f"-DPython_EXECUTABLE={sys.executable}")
    run("ninja", "-C", "build", "kanuka_native")


def render(tree: Path, scene: str, seed: int, settings: argparse.Namespace) -> tuple[float, np.ndarray]:
    """Seconds of sampling and the picture, of half the usual size."""
    os.environ["PYTHONPATH"] = str(tree / "python")
    request = {"scene": scene, "n": 0, "scale": 0.5, "samples": settings.samples, "threads": settings.threads}
    answer = peers.ask(peers.RENDERERS["kanuka"], request | {"seeds": [seed], "options": []})
    return float(answer.figures["render_s"][0]), answer.pictures[0]


def noise(pictures: list[np.ndarray]) -> float:
    luminance = np.stack(pictures) @ LUMINANCE
    return float(np.mean(luminance.var(0, ddof=1) / (luminance.mean(0) ** 2 + 0.01)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=3, help="pictures of each (default: %(default)s)")
    parser.add_argument("--samples", type=int, default=32, help="a pixel (default: %(default)s)")
    parser.add_argument("--threads", type=int, default=0, help="0 = all (default)")
    parser.add_argument("--tree", type=Path, default=ROOT / "build" / "triple", help="where the other one is built")
    settings = parser.parse_args()
    build(settings.tree)
    for scene in SCENES:
        seconds: dict[Path, list[float]] = {ROOT: [], settings.tree: []}
        pictures: dict[Path, list[np.ndarray]] = {ROOT: [], settings.tree: []}
        for seed in range(settings.rounds):
            for tree in seconds:
                time, picture = render(tree, scene, seed, settings)
                seconds[tree].append(time)
                pictures[tree].append(picture)
        time = statistics.median(seconds[ROOT]) / statistics.median(seconds[settings.tree])
        variance = noise(pictures[ROOT]) / noise(pictures[settings.tree])
        print(
            f"{scene:<11} time {time:.2f}×, noise² {variance:.2f}×, at equal noise {time * variance:.2f}×", flush=True
        )


if __name__ == "__main__":
    main()
