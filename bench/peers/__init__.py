"""The renderers by name, and how one of them is asked for pictures."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import scenes

BENCH = Path(__file__).resolve().parent.parent
ROOT = BENCH.parent


class WorkerError(Exception):
    """A renderer that is not installed, cannot render the scene, or failed."""


@dataclass(frozen=True)
class Renderer:
    name: str
    worker: str
    environment: str = ""  # folder of its virtual environment; "" = this Python
    package: str = ""
    variant: str = ""

    def python(self) -> Path:
        return environments() / self.environment / "bin" / "python" if self.environment else Path(sys.executable)

    @property
    def installed(self) -> bool:
        return self.python().exists()

    def version(self) -> str:
        """Of its package, without starting it."""
        found = self.python().parent.parent.glob(f"lib/python*/site-packages/{self.package}-*.dist-info")
        return next((folder.name.removesuffix(".dist-info").split("-")[-1] for folder in found), "unknown")


def environments() -> Path:
    return Path(os.environ.get("KANUKA_PEERS") or ROOT / "build" / "peers").absolute()


RENDERERS = {
    r.name: r
    for r in (
        Renderer("kanuka", "kanuka_worker"),
        Renderer("mitsuba-llvm-spectral", "mitsuba_worker", "mitsuba", "mitsuba", "llvm_ad_spectral"),
        Renderer("mitsuba-llvm-rgb", "mitsuba_worker", "mitsuba", "mitsuba", "llvm_ad_rgb"),
        Renderer("mitsuba-scalar-spectral", "mitsuba_worker", "mitsuba", "mitsuba", "scalar_spectral"),
        Renderer("mitsuba-scalar-rgb", "mitsuba_worker", "mitsuba", "mitsuba", "scalar_rgb"),
        Renderer("cycles", "cycles_worker", "bpy", "bpy"),
        Renderer("luxcore", "luxcore_worker", "luxcore", "pyluxcore"),
    )
}
OURS = RENDERERS["kanuka"]


@dataclass(frozen=True)
class Answer:
    figures: dict[str, object]
    pictures: np.ndarray  # (seeds, height, width, 3), linear Rec.709; empty where none were asked for


def ask(
    renderer: Renderer,
    request: dict[str, object],
    *,
    pictures: bool = True,
    cold: bool = False,
    timeout_s: float = 1800,
) -> Answer:
    """Starts the renderer's worker and waits for its figures. `cold`: nothing that it compiled before is there."""
    if not renderer.installed:
        raise WorkerError(f"{renderer.name} is not installed: bench/setup.sh does it, or set KANUKA_PEERS")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "pictures.npy"
        given = {**request, "variant": renderer.variant, "picture": str(path) if pictures else ""}
        environment = {**os.environ, "KANUKA_BENCH_CACHE": str(scenes.cache_folder())}
        if cold:
            environment["KANUKA_SHADER_CACHE"] = folder
        if not renderer.environment:
            environment.setdefault("PYTHONPATH", str(ROOT / "python"))
        try:
            done = subprocess.run(
                [renderer.python(), "-m", f"peers.{renderer.worker}", json.dumps(given)],
                cwd=BENCH,
                capture_output=True,
                text=True,
                timeout=timeout_s,
                env=environment,
            )
        except subprocess.TimeoutExpired as error:
            raise WorkerError(f"{renderer.name} took more than {timeout_s:.0f} s for {request}") from error
        lines = done.stdout.strip().splitlines()
        # A library that crashes while its process ends has answered all the same.
        if not lines or not lines[-1].startswith("{"):
            tail = "\n".join(done.stderr.strip().splitlines()[-8:])
            raise WorkerError(f"{renderer.name} ended with {done.returncode} for {request}:\n{tail}")
        return Answer(json.loads(lines[-1]), np.load(path) if path.exists() else np.empty(0))
