"""Makes tests/references/*.npz: mean and variance over seeds of each scene of tests/scenes.py, and of the rows of
balls of tests/doc_pictures.py, as lobes/NAME.

Run it when a picture is meant to change, look at what it prints, and say why in the commit:

    .venv/bin/python tools/make_references.py [NAME …]
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

import kanuka

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests"))
import doc_pictures  # noqa: E402
import scenes  # noqa: E402

NAMES = [*scenes.ALL, *(f"lobes/{name}" for name in doc_pictures.lobes())]


def render(name: str, seed: int, progressions: int) -> kanuka.Picture:
    if name.startswith("lobes/"):  # their scenes say how many samples
        return doc_pictures.summary(doc_pictures.render_row(name.removeprefix("lobes/"), seed))
    return kanuka.render(scenes.ALL[name](), progressions=progressions, seed=seed)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", default=NAMES, metavar="NAME", help=", ".join(NAMES))
    parser.add_argument("--runs", type=int, default=256)
    parser.add_argument("--progressions", type=int, default=256)
    arguments = parser.parse_args()
    folder = ROOT / "tests" / "references"
    (folder / "lobes").mkdir(parents=True, exist_ok=True)
    for name in arguments.names:
        pictures = []
        for seed in range(1, arguments.runs + 1):
            pictures.append(render(name, seed, arguments.progressions)["rgb"].astype(np.float64))
            if sys.stderr.isatty():
                print(f"\r{name}: {seed} of {arguments.runs}", end="\r", file=sys.stderr, flush=True)
        stack = np.stack(pictures)
        mean, variance = stack.mean(axis=0), stack.var(axis=0, ddof=1)
        np.savez_compressed(
            folder / f"{name}.npz",
            mean=mean.astype(np.float32),
            variance=variance.astype(np.float32),
            runs=arguments.runs,
            progressions=arguments.progressions,
        )
        noise = np.sqrt(variance).mean() / mean.mean()
        print(f"{name}: mean {mean.mean(axis=(0, 1)).round(4)}, noise of one run {noise:.2%}")


if __name__ == "__main__":
    main()
