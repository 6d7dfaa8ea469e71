"""Where figures come from: the machine, and what ran on it."""

from __future__ import annotations

import os
import platform
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FLAGS = (("AVX-512", "avx512f"), ("AVX2", "avx2"), ("AVX", "avx"))


def cpuinfo() -> dict[str, str]:
    """Of the first processor."""
    first = Path("/proc/cpuinfo").read_text().split("\n\n")[0]
    return {key.strip(): value.strip() for key, _, value in (line.partition(":") for line in first.splitlines())}


def cores() -> int:
    return len(os.sched_getaffinity(0))


def describe() -> dict[str, object]:
    info = cpuinfo()
    flags = set(info.get("flags", "").split())
    family = "-".join(info[key] for key in ("cpu family", "model", "stepping") if key in info)
    return {
        "cpu": info.get("model name", platform.processor()),
        "family_model_stepping": family,
        "cores": cores(),
        "isa": next((name for name, flag in FLAGS if flag in flags), "SSE"),
        "memory_gib": round(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30, 1),
    }


def load() -> float:
    """Of the last minute: what else ran, and what we ran ourselves."""
    return round(os.getloadavg()[0], 2)


def commit() -> str:
    """Of what makes pictures: figures outlive changes of tests, pages and of the benchmark itself."""

    def git(*arguments: str) -> str:
        paths = ("src", "include", "shaders", "python", "CMakeLists.txt")
        done = subprocess.run(["git", *arguments, "--", *paths], cwd=ROOT, capture_output=True, text=True)
        return done.stdout.strip()

    return (git("log", "-1", "--format=%h") or "unknown") + ("-dirty" if git("status", "--porcelain") else "")
