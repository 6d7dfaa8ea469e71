"""Kanuka against itself: micropolygons, the geometry tolerance, and hits without gaps."""

from __future__ import annotations

import statistics
from dataclasses import asdict

import peers
from pictures import Estimate, agreement
from settings import Found, Say, Settings

MICROPOLYGON_FIGURES = (
    "dice_s",
    "shade_s",
    "bvh_s",
    "build_s",
    "peak_bytes",
    "grids_bytes",
    "lobe_inputs_bytes",
    "bvh_bytes",
)


def micropolygons(settings: Settings, say: Say) -> Found:
    """Dicing, shading and building some million micropolygons that no tolerance can simplify."""
    n = 250_000 if settings.quick else 4_000_000
    # The picture stays as it is: its size is part of what makes n.
    request = settings.request("micropolygons", n, samples=1) | {"scale": 1}
    runs = [
        peers.ask(peers.OURS, {**request, "seeds": [k + 1]}, pictures=False).figures for k in range(settings.rounds)
    ]
    rounds = {name: [float(run[name]) for run in runs] for name in MICROPOLYGON_FIGURES}
    found = {name: statistics.median(values) for name, values in rounds.items()}
    count = found["micropolygons"] = runs[0]["micropolygons"]
    found["traced_polygons"] = runs[-1]["traced_polygons"]
    found["bytes_each"] = (found["grids_bytes"] + found["bvh_bytes"]) / count
    found["lobe_bytes_each"] = found["lobe_inputs_bytes"] / count
    say(
        f"  {count / 1e6:.2f} M micropolygons: dice {found['dice_s']:.2f} + shade {found['shade_s']:.2f} + "
        f"build {found['bvh_s']:.2f} = {found['build_s']:.2f} s; {found['bytes_each']:.1f} bytes each for "
        f"geometry and BVH, {found['lobe_bytes_each']:.1f} for lobe inputs"
    )
    return found | {"rounds": rounds}


TOLERANCE_SCENES = {"flat": "cornell", "smooth": "smooth", "displaced": "displaced"}
TOLERANCE_FIGURES = (
    *MICROPOLYGON_FIGURES[:3],
    "render_s",
    *MICROPOLYGON_FIGURES[4:],
    "micropolygons",
    "traced_polygons",
)


def tolerance(settings: Settings, kind: str, say: Say) -> Found:
    """The same scene traced at the geometry tolerance and micropolygon for micropolygon: picture, times, bytes."""
    batches, samples = (4, 8) if settings.quick else (8, 32)
    request = settings.request(TOLERANCE_SCENES[kind], samples=samples)
    made: dict[str, Estimate] = {}
    sides: dict[str, list[Found]] = {"on": [], "off": []}
    for batch in range(batches):
        turns = [("on", 100), ("off", 200)]  # noise of their own: seeds differ
        for side, seed in turns if batch % 2 == 0 else reversed(turns):
            given = {**request, "seeds": [seed + batch]}
            if side == "off":
                given["options"] = [("geometry_tolerance", 0.0)]
            answer = peers.ask(peers.OURS, given)
            more = Estimate.of(answer.pictures, samples)
            made[side] = made[side] + more if side in made else more
            sides[side].append({**answer.figures, "render_s": answer.figures["render_s"][0]})
    found = agreement(made["on"], made["off"], level=False)
    figures = {
        side: {name: statistics.median(run[name] for run in runs) for name in TOLERANCE_FIGURES}
        for side, runs in sides.items()
    }
    say(
        f"  {kind}: traced {figures['on']['traced_polygons']:.0f} of {figures['off']['traced_polygons']:.0f} polygons, "
        f"transport {figures['on']['render_s']:.3f} against {figures['off']['render_s']:.3f} s, means "
        f"{100 * found.mean_error:.2f} % apart, blocks' z {found.rms_z:.2f} r.m.s."
    )
    return {**figures, **asdict(found), "mean_error": found.mean_error, "structure": found.structure}


def alternating(settings: Settings, request: Found, sides: dict[str, list], say: Say) -> dict[str, list[float]]:
    """Seconds of sampling by side, in turn and in both orders; `sides`: our options by name."""
    rounds: dict[str, list[float]] = {name: [] for name in sides}
    for number in range(settings.rounds):
        for name in list(sides) if number % 2 == 0 else reversed(list(sides)):
            given = request | {"seeds": [number + 1], "options": sides[name]}
            rounds[name].append(peers.ask(peers.OURS, given, pictures=False).figures["render_s"][0])
        say("  " + ", ".join(f"{name} {values[-1]:.2f} s" for name, values in rounds.items()))
    return rounds


def watertight(settings: Settings, scene: str, say: Say) -> Found:
    """Hits that leave no gap between polygons, and those that may."""
    request = settings.request(scene, samples=4 if settings.quick else 16)
    return {
        "rounds": alternating(settings, request, {"on": [("watertight", True)], "off": [("watertight", False)]}, say)
    }


def widths(settings: Settings, scene: str, say: Say) -> Found:
    """Eight lanes and sixteen, on whole pictures."""
    request = settings.request(scene, samples=4 if settings.quick else 16)
    return {"rounds": alternating(settings, request, {"8": [("lanes", 8)], "16": [("lanes", 16)]}, say)}
