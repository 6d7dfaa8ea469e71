"""What a store of pages saves, and costs: the same scene without one, with a new one, and with what that holds."""

from __future__ import annotations

import shutil
import statistics
import tempfile
import time
from pathlib import Path

import intervals
import kanuka
import peers
from settings import Found, Say, Settings

# What is rendered, and how much: links of the chain of noises, micropolygons. A hierarchy of pages has so many.
SCENES = {
    "shading": ("shading", 100),
    "shading-heavy": ("shading", 1000),
    "micropolygons": ("micropolygons", 1_000_000),
    "two-lobes": ("two-lobes", 1_000_000),
    "hierarchy": ("micropolygons", 16_000_000),
    "still-life": ("still-life", 0),
}
KINDS = ("without", "new", "filled")
FIGURES = ("dice_s", "shade_s", "bvh_s", "build_s", "first_picture_s")


def seconds_to_open(store: Path) -> float:
    """Until all that is in it is known."""
    begin = time.perf_counter()
    kanuka.store_packs(store)
    return time.perf_counter() - begin


def measure(settings: Settings, name: str, say: Say) -> Found:
    """For run.py. What is read comes from the system's memory, as on a machine that has rendered before."""
    runs: dict[str, list[Found]] = {kind: [] for kind in KINDS}
    opened: list[float] = []
    folder = Path(tempfile.mkdtemp(prefix="kanuka-store-"))
    scene, n = SCENES[name]
    if settings.quick:
        n = {
            "shading": 4,
            "shading-heavy": 8,
            "micropolygons": 50_000,
            "two-lobes": 50_000,
            "hierarchy": 5_000_000,
        }.get(name, 0)
    try:
        for _ in range(settings.rounds):
            store = folder / "pages"
            shutil.rmtree(store, ignore_errors=True)
            for kind in KINDS:
                options = {} if kind == "without" else {"store": str(store)}
                asked = settings.request(scene, n, samples=1, **options) | {"seeds": [1]}
                runs[kind].append(peers.ask(peers.OURS, asked, pictures=False).figures)
            stored = sum(file.stat().st_size for file in store.iterdir())
            opened.append(seconds_to_open(store))
            of_hierarchy = sum(file.stat().st_size for file in store.glob("*.khierarchy"))
        compressed = kanuka.store_compress(store, idle_s=0)
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    rounds = {kind: {name: [float(run[name]) for run in of] for name in FIGURES} for kind, of in runs.items()}
    found: Found = {"rounds": rounds, "bytes": stored, "memory_bytes": runs["new"][0]["store_written_bytes"]}
    found |= {
        "opened_s": opened,
        "packs_bytes": compressed["bytes_before"],
        "compressed_bytes": compressed["bytes_after"],
        "lobe_bytes_each": runs["new"][0]["lobe_inputs_bytes"] / runs["new"][0]["vertices"],
    }
    for kind in KINDS:
        found[kind] = {name: statistics.median(values) for name, values in rounds[kind].items()}

    def ratio(name: str, kind: str) -> Found:
        return vars(intervals.of_ratio(rounds[kind][name], rounds["without"][name]))

    found["writing"] = ratio("build_s", "new")
    found["reading"] = ratio("build_s", "filled")
    found["first_picture"] = ratio("first_picture_s", "filled")
    if of_hierarchy:
        found |= {"hierarchy": ratio("bvh_s", "filled"), "hierarchy_bytes": of_hierarchy}
    say(
        f"  until rays can be traced: {found['without']['build_s']:.3f} s, {found['new']['build_s']:.3f} s that fill a "
        f"store of {stored / 1e6:.1f} MB, {found['filled']['build_s']:.3f} s with it"
    )
    return found
