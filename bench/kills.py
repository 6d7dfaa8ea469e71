"""Renders that are killed a hundred times at random moments, and go on each time: is the picture the same to the bit?

With a store and a checkpoint that is written five times a second, moments fall into all phases: start, reading, dicing,
shading, writing of packs, the hierarchy, samples, checkpoints, the picture.
"""

from __future__ import annotations

import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from settings import ROOT, Found, Say, Settings

SCENE = ROOT / "scenes" / "showcase.rib"
OPTIONS = ("--resolution", "240x135", "--progressions", "96", "-q")


def command(folder: Path, output: str) -> list[str]:
    kept = ["--store", str(folder / "store"), "--checkpoint", str(folder / "state"), "--checkpoint-every", "0.2"]
    return [sys.executable, "-m", "kanuka", "render", str(SCENE), "-o", str(folder / output), *OPTIONS, *kept]


def measure(settings: Settings, say: Say) -> Found:
    wanted = 4 if settings.quick else 100
    chance = random.Random(1)
    with tempfile.TemporaryDirectory(prefix="kanuka-kills-") as temporary:
        folder = Path(temporary)
        start = time.monotonic()
        subprocess.run(command(folder, "whole.exr"), check=True, env=os.environ)
        takes = time.monotonic() - start
        whole = (folder / "whole.exr").read_bytes()
        kills = pictures = wrong = 0
        left: list[str] = []
        while kills < wanted or pictures == 0:
            # A picture from nothing: killed until it has once come to its end.
            for name in ("store", "state"):
                path = folder / name
                shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)
            while True:
                process = subprocess.Popen(command(folder, "killed.exr"), env=os.environ)
                try:
                    code = process.wait(chance.uniform(0.05, 0.9) * takes if kills < wanted else None)
                except subprocess.TimeoutExpired:
                    process.send_signal(signal.SIGKILL)
                    process.wait()
                    kills += 1
                    continue
                if code != 0:
                    raise RuntimeError(f"after {kills} kills a render ended with {code}")
                break
            pictures += 1
            wrong += (folder / "killed.exr").read_bytes() != whole
            left = sorted(path.name for path in folder.iterdir())
    say(f"  {kills} kills, {pictures} pictures, {wrong} of them with other bits; a whole render takes {takes:.2f} s")
    return {"kills": kills, "pictures": pictures, "wrong": wrong, "seconds": takes, "files": left}
