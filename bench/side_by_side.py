"""Renderers on the same scene, in turn: times, memory, and the error of what they made."""

from __future__ import annotations

import statistics
from dataclasses import dataclass, field

import numpy as np

import peers
import references
import scenes
from pictures import Estimate, relative_error
from settings import Found, Say, Settings

# Mitsuba's LLVM mode does not take 100 000 instances, and it has no procedural textures.
SCENES = {
    "cornell": ("mitsuba-llvm-spectral", "mitsuba-llvm-rgb", "cycles", "luxcore"),
    "terrain": ("mitsuba-llvm-spectral", "mitsuba-llvm-rgb", "cycles", "luxcore"),
    "forest": ("mitsuba-scalar-spectral", "cycles", "luxcore"),
    "still-life": ("mitsuba-llvm-spectral", "mitsuba-llvm-rgb", "cycles", "luxcore"),
    "shading": ("cycles", "luxcore"),
}
SAMPLERS = ("independent", "stratified", "multijitter", "orthogonal", "ldsampler")  # Mitsuba's: the best counts
SMOOTH, SMOOTH_BATCHES = 8, 3  # a converged picture has so many times the samples; quick: fewer batches
FIGURES = ("load_s", "build_s", "first_picture_s", "render_s", "error", "error_x_time", "peak_bytes")


@dataclass
class Turns:
    """What one renderer did in each round."""

    renderer: peers.Renderer
    options: dict[str, object] = field(default_factory=dict)
    rounds: dict[str, list[float]] = field(default_factory=dict)
    pictures: list[np.ndarray] = field(default_factory=list)
    told: dict[str, object] = field(default_factory=dict)

    def add(self, answer: peers.Answer) -> None:
        f = answer.figures | {"render_s": answer.figures["render_s"][0]}
        for name in ("load_s", "build_s", "first_picture_s", "render_s", "peak_bytes"):
            self.rounds.setdefault(name, []).append(float(f[name]))
        self.pictures.append(answer.pictures[0])
        self.told = {name: f[name] for name in ("version", "samples", "settings") if name in f}

    def found(self, converged: Estimate) -> Found:
        """With errors against the renderer's own converged picture, beside the noise of the rounds themselves."""
        self.rounds["error"] = [relative_error(picture, converged) for picture in self.pictures]
        pairs = zip(self.rounds["error"], self.rounds["render_s"], strict=True)
        self.rounds["error_x_time"] = [error * seconds for error, seconds in pairs]
        made: Found = {"name": self.renderer.name, **self.told, "rounds": self.rounds}
        if len(self.pictures) > 1:
            made["noise"] = Estimate.of(np.stack(self.pictures), 1).noise()
        made["converged_samples"] = converged.samples * converged.batches
        return made


def best_sampler(settings: Settings, renderer: peers.Renderer, request: Found, say: Say) -> tuple[str, Found]:
    """By noise² times time at half size, all of three pictures."""
    cost = {}
    for sampler in SAMPLERS[:2] if settings.quick else SAMPLERS:
        given = request | {"scale": settings.scale / 2, "seeds": [7, 8, 9], "options": [("sampler", sampler)]}
        answer = peers.ask(renderer, given)
        cost[sampler] = Estimate.of(answer.pictures, 1).noise() * statistics.median(answer.figures["render_s"])
    best = min(cost, key=cost.get)
    costs = ", ".join(f"{name} {value / cost['independent']:.2f}" for name, value in cost.items())
    say(f"  {renderer.name}: {best} ({costs})")
    return best, {name: value / cost["independent"] for name, value in cost.items()}


def measure(settings: Settings, scene: str, wanted: list[str] | None, say: Say) -> Found:
    names = [name for name in (wanted or SCENES[scene]) if name in SCENES[scene]] if wanted else SCENES[scene]
    there = [peers.RENDERERS[name] for name in names if peers.RENDERERS[name].installed]
    missing = [name for name in names if not peers.RENDERERS[name].installed]
    if missing:
        say(f"  not installed: {', '.join(missing)}")
    request = settings.request(scene, samples=4 if settings.quick else 0)
    made = scenes.make(scene, int(request["n"]))  # files that it reads are made before the clock runs
    all_turns = [Turns(peers.OURS), *(Turns(renderer) for renderer in there)]
    samplers: Found = {}
    converged: dict[str, Estimate] = {}
    for turns in all_turns:
        name = turns.renderer.name
        if turns.renderer.worker == "mitsuba_worker":
            turns.options["sampler"], samplers[name] = best_sampler(settings, turns.renderer, request, say)
        long = request | {"samples": int(request["samples"]) or made.samples}
        converged[name] = references.converged(turns.renderer, long, SMOOTH_BATCHES if settings.quick else SMOOTH, say)
    for number in range(settings.rounds):
        # Ours first in one round, last in the next: whoever follows a heavy neighbour does so as often as the others.
        for turns in all_turns if number % 2 == 0 else reversed(all_turns):
            given = request | {"seeds": [number + 1], "options": list(turns.options.items())}
            turns.add(peers.ask(turns.renderer, given))
            last = {name: values[-1] for name, values in turns.rounds.items()}
            say(
                f"  {scene} {number + 1}/{settings.rounds} {turns.renderer.name:<24} load {last['load_s']:7.3f}  build "
                f"{last['build_s']:7.3f}  render {last['render_s']:8.3f} s  {last['peak_bytes'] / 1e6:6.0f} MB"
            )
    found = [turns.found(converged[turns.renderer.name]) for turns in all_turns]
    return {"renderers": found, "samplers": samplers, "missing": missing}
