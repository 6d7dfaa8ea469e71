"""Writes tests/shaders/NAME.txt, what the shaders of the test bench give: all, or those that are named. Look at them:
the head of each shader says what is expected."""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "python")]

import shader_bench as bench  # noqa: E402

for name in sys.argv[1:] or bench.names():
    path = bench.SHADERS / f"{name}.txt"
    text = bench.text(bench.outcome(name))
    if not path.exists() or bench.difference(bench.outcome(name), bench.parse(path.read_text())):
        path.write_text(text)
        print(path.relative_to(ROOT))
