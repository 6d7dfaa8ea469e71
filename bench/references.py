"""Converged pictures, kept outside the repository and added to batch by batch until they are long enough.

A picture's file is named after the renderer, its version, and a digest of all that makes it: the scene and the files
that it reads, the worker that hands it over, and for us the commit of the sources.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np

import machine
import peers
import scenes
from pictures import Estimate

AT_A_TIME = 32


def _path(renderer: peers.Renderer, request: dict[str, object]) -> Path:
    folder = scenes.cache_folder() / "references"
    folder.mkdir(exist_ok=True)
    scene = scenes.make(str(request["scene"]), int(request["n"]), float(request["scale"]))
    made_by = sorted((peers.BENCH / "peers").glob(f"{renderer.worker.split('_')[0]}_*.py"))
    metals = [scenes.metal_file(mesh.finish.metal) for mesh in scene.meshes if mesh.finish]
    read = [path.read_bytes() for path in (*made_by, *metals) if path.exists()]
    version = machine.commit() if renderer.name == "kanuka" else renderer.version()
    key = scenes.digest(scenes.content(scene), request["samples"], request["options"], *read)
    return folder / f"{renderer.name}-{version}-{request['scene']}-{key}.npz"


def _load(path: Path) -> Estimate | None:
    if not path.exists():
        return None
    with np.load(path) as data:
        return Estimate(data["total"], data["squares"], data["blocks"], int(data["samples"]))


def _save(path: Path, estimate: Estimate) -> None:
    temporary = path.with_suffix(f".{os.getpid()}.npz")
    arrays = {name: getattr(estimate, name) for name in ("total", "squares", "blocks", "samples")}
    np.savez(temporary, **arrays)
    os.replace(temporary, path)


def converged(
    renderer: peers.Renderer, request: dict[str, object], batches: int, say: Callable[[str], None]
) -> Estimate:
    """`batches` renders of `request`, each with a seed of its own; those made before are taken from the cache.

    Some at a time go to one process, so that it starts up and compiles seldom, and little is lost if it is stopped.
    """
    path = _path(renderer, request)
    estimate = _load(path)
    while (done := estimate.batches if estimate else 0) < batches:
        seeds = list(range(5000 + done, 5000 + min(batches, done + AT_A_TIME)))
        answer = peers.ask(renderer, {**request, "seeds": seeds})
        more = Estimate.of(answer.pictures, int(request["samples"]))
        estimate = estimate + more if estimate else more
        _save(path, estimate)
        say(f"  reference {renderer.name} {request['scene']}: {estimate.batches} of {batches} batches")
    return estimate
