"""What the workers share. A worker is a process of one renderer: it takes a request as JSON, renders the scene once for
each seed, keeps the pictures in a file, and prints its figures as the last line of standard output, as JSON.

Runs under each renderer's own Python, as `python -m peers.mitsuba_worker REQUEST` in bench/; NumPy alone.
"""

from __future__ import annotations

import contextlib
import json
import os
import resource
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

import scenes


@dataclass(frozen=True)
class Request:
    scene: str
    n: int = 0  # the scene's size; 0 = as usual
    scale: float = 1  # of the picture's sides
    samples: int = 0  # a pixel; 0 = as usual for the scene
    seeds: tuple[int, ...] = (1,)
    threads: int = 0  # 0 = all
    variant: str = ""  # of the renderer
    picture: str = ""  # .npy for the pictures, (seeds, height, width, 3)
    options: tuple[tuple[str, object], ...] = ()  # the renderer's own

    @staticmethod
    def read() -> Request:
        given = json.loads(sys.argv[1])
        given["seeds"] = tuple(given.get("seeds", (1,)))
        given["options"] = tuple(map(tuple, given.get("options", ())))
        return Request(**given)

    def option(self, name: str, default: object = None) -> object:
        return dict(self.options).get(name, default)

    def make_scene(self) -> scenes.Scene:
        return scenes.make(self.scene, self.n, self.scale)

    def thread_count(self) -> int:
        return self.threads or len(os.sched_getaffinity(0))


class Figures(dict):
    """Seconds and bytes by name."""

    @contextlib.contextmanager
    def time(self, name: str) -> Iterator[None]:
        start = time.perf_counter()
        yield
        self[name] = self.get(name, 0) + time.perf_counter() - start


def peak_bytes() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def claim_stdout() -> Callable[[str], None]:
    """Sends to standard error whatever a library prints; returns what still writes to standard output."""
    out = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)

    def say(line: str) -> None:
        print(line, file=out, flush=True)

    return say


def finish(say: Callable[[str], None], request: Request, figures: Figures, pictures: list[np.ndarray]) -> None:
    """`figures["render_s"]` is a list, a number for each seed."""
    if request.picture and pictures:
        np.save(request.picture, np.stack(pictures).astype(np.float32))
    figures.setdefault("peak_bytes", peak_bytes())
    say(json.dumps(figures))
