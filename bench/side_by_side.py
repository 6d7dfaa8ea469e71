"""Renderers on the same scene, in turn: times, memory, and the error of what they made."""

from __future__ import annotations

import statistics
from dataclasses import dataclass, field

import numpy as np

import peers
import scenes
import usd_scenes
from pictures import Estimate, relative_error
from settings import Found, Say, Settings

# Mitsuba's LLVM mode does not take 100 000 instances. Shaders are beside Cycles in networks.py: it alone has noises.
SCENES = {
    "cornell": ("mitsuba-llvm-spectral", "mitsuba-llvm-rgb", "cycles", "luxcore"),
    "terrain": ("mitsuba-llvm-spectral", "mitsuba-llvm-rgb", "cycles", "luxcore"),
    "forest": ("mitsuba-scalar-spectral", "cycles", "luxcore"),
    "forest-million": ("mitsuba-scalar-spectral", "cycles", "luxcore"),
    "still-life": ("mitsuba-llvm-spectral", "mitsuba-llvm-rgb", "cycles", "luxcore"),
}
SCENES |= {name: ("cycles",) for name in usd_scenes.there()}  # by its own reader of USD
SAMPLERS = ("independent", "stratified", "multijitter", "orthogonal", "ldsampler")  # Mitsuba's: the best counts
SAMPLER_SIZE = 0.25  # of the picture's sides, where samplers are tried
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

    def found(self) -> Found:
        """A picture's error is that against the mean of the other rounds, whose own noise is subtracted."""
        made: Found = {"name": self.renderer.name, **self.told, "rounds": self.rounds}
        if len(self.pictures) > 2:
            others = [Estimate.of(np.stack(self.pictures[:k] + self.pictures[k + 1 :]), 1) for k in self.numbers()]
            self.rounds["error"] = [relative_error(self.pictures[k], others[k]) for k in self.numbers()]
            pairs = zip(self.rounds["error"], self.rounds["render_s"], strict=True)
            self.rounds["error_x_time"] = [error * seconds for error, seconds in pairs]
        return made

    def numbers(self) -> range:
        return range(len(self.pictures))


def best_sampler(settings: Settings, renderer: peers.Renderer, request: Found, say: Say) -> tuple[str, Found]:
    """By noise² times time of small pictures, three each."""
    cost = {}
    for sampler in SAMPLERS[:2] if settings.quick else SAMPLERS:
        given = request | {
            "scale": settings.scale * SAMPLER_SIZE,
            "seeds": [7, 8, 9],
            "options": [("sampler", sampler)],
        }
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
    scenes.make(scene, int(request["n"]))  # files that it reads are made before the clock runs
    all_turns = [Turns(peers.OURS), *(Turns(renderer) for renderer in there)]
    samplers: Found = {}
    for turns in all_turns:
        name = turns.renderer.name
        if turns.renderer.worker == "mitsuba_worker":
            turns.options["sampler"], samplers[name] = best_sampler(settings, turns.renderer, request, say)
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
    found = [turns.found() for turns in all_turns]
    return {"renderers": found, "samplers": samplers, "missing": missing}
