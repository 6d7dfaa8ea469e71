"""What is measured. Each function asks renderers for pictures and returns plain figures."""

from __future__ import annotations

import statistics
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import reduce

import numpy as np

import peers
import references
import scenes
import still_life
from pictures import Estimate, agreement

OURS = peers.RENDERERS["kanuka"]
REFERENCE = peers.RENDERERS["mitsuba-llvm-spectral"]  # spectral as ours, and the fastest
# Samples of one batch; of the reference there are 32, of ours 16.
REFERENCE_SAMPLES = {"cornell": 64, "grey-cornell": 64, "terrain": 16, "environment": 64, "conductor": 64}
REFERENCE_SAMPLES |= {"dielectric": 64, "dispersion": 32}
OUR_SAMPLES = {"dispersion": 512}
Say = Callable[[str], None]


@dataclass(frozen=True)
class Settings:
    """How much of it: quick runs say whether everything works, not how fast it is."""

    quick: bool = False
    repeats: int = 3
    threads: int = 0

    @property
    def scale(self) -> float:
        return 0.25 if self.quick else 1

    def request(self, scene: str, n: int = 0, samples: int = 0, **options: object) -> dict[str, object]:
        if self.quick and scene in scenes.MAKERS:
            n = {"terrain": 300, "forest": 1000, "shading": 4}.get(scene, n)
        made = {"scene": scene, "n": n, "scale": self.scale, "samples": samples, "threads": self.threads}
        return made | {"options": list(options.items())}


def _median(values: list) -> object:
    if all(isinstance(value, int | float) for value in values):
        return statistics.median(values)
    return values[-1]


@dataclass
class Runs:
    """Several runs of one renderer, a process and a seed each."""

    renderer: peers.Renderer
    figures: list[dict[str, object]]
    pictures: list[np.ndarray]

    def flat(self) -> list[dict[str, object]]:
        """Figures with the one time of `render_s` as a number."""
        return [{**each, "render_s": each["render_s"][0]} for each in self.figures]

    def medians(self) -> dict[str, object]:
        runs = self.flat()
        return {name: _median([run[name] for run in runs]) for name in runs[0]}

    def noise(self) -> float | None:
        if len(self.pictures) < 2:
            return None
        return Estimate.of(np.stack(self.pictures), 1).noise()

    def summary(self, scene: str) -> dict[str, object]:
        medians = self.medians()
        noise = self.noise()
        if noise is not None:
            medians |= {"noise": noise, "noise_x_time": noise * medians["render_s"]}
        times = {name: [run[name] for run in self.flat()] for name in medians if name.endswith("_s")}
        return {"scene": scene, "renderer": self.renderer.name, "figures": medians, "runs": times}


def side_by_side(
    settings: Settings, scene: str, renderers: list[peers.Renderer], say: Say, failures: list[str]
) -> list[Runs]:
    """All renderers in turn, round after round, so that what disturbs the machine disturbs them all."""
    request = settings.request(scene, samples=4 if settings.quick else 0)
    scenes.make(scene, int(request["n"]))  # files that it reads are made before the clock runs
    runs = {r.name: Runs(r, [], []) for r in renderers}
    for repeat in range(settings.repeats):
        for renderer in list(renderers):
            if renderer.name not in runs:
                continue
            try:
                answer = peers.ask(renderer, {**request, "seeds": [repeat + 1]})
            except peers.WorkerError as error:
                failures.append(str(error))
                say(f"  {error}")
                del runs[renderer.name]
                continue
            runs[renderer.name].figures.append(answer.figures)
            runs[renderer.name].pictures.append(answer.pictures[0])
            f = answer.figures
            say(
                f"  {scene} {repeat + 1}/{settings.repeats} {renderer.name:<24} load {f['load_s']:7.3f}  "
                f"build {f['build_s']:7.3f}  render {f['render_s'][0]:8.3f} s  {f['peak_bytes'] / 1e6:6.0f} MB"
            )
    return list(runs.values())


FIGURES = ("load_s", "build_s", "first_picture_s", "render_s", "noise", "noise_x_time", "peak_bytes")


def ratios(summaries: list[dict[str, object]]) -> list[dict[str, object]]:
    """Ours over theirs: below 1, we take less."""
    ours = {s["scene"]: s["figures"] for s in summaries if s["renderer"] == OURS.name}
    found = []
    for summary in summaries:
        scene, peer, theirs = summary["scene"], summary["renderer"], summary["figures"]
        if peer == OURS.name or scene not in ours:
            continue
        for figure in FIGURES:
            a, b = ours[scene].get(figure), theirs.get(figure)
            if a is not None and b:
                found.append({"scene": scene, "peer": peer, "figure": figure, "ours": a, "theirs": b, "ratio": a / b})
    return found


def agrees(settings: Settings, scene: str, say: Say) -> dict[str, object]:
    """Our picture against Mitsuba's, both far longer than usual."""
    # Ours first: it leaves the spectra of metals for the other.
    batches, samples = (4, 16) if settings.quick else (16, OUR_SAMPLES.get(scene, 64))
    ours = None
    for batch in range(batches):
        answer = peers.ask(OURS, settings.request(scene, samples=samples) | {"seeds": [3000 + batch]})
        more = Estimate.of(answer.pictures, samples)
        ours = ours + more if ours else more
    # A peer without dispersion renders band by band of wavelengths, each at an index of its own.
    bands = range(1, 1 + (still_life.BANDS if scene == "dispersion" else 0)) or (0,)
    parts = [
        references.converged(
            REFERENCE, settings.request(scene, n, samples=REFERENCE_SAMPLES[scene]), 8 if settings.quick else 32, say
        )
        for n in bands
    ]
    theirs = reduce(Estimate.superposed, parts)
    # Where colours are spectra by two optimisers, structure is looked for after the means are made equal.
    found = agreement(ours, theirs, level=scene in ("cornell", "terrain"))
    say(
        f"  {scene}: means {', '.join(f'{100 * (r - 1):+.2f} %' for r in found.mean_ratio)} from {REFERENCE.name}; "
        f"blocks: z {found.rms_z:.2f} r.m.s., {100 * found.residual:.2f} % beyond noise"
    )
    return {
        "scene": scene,
        "peer": REFERENCE.name,
        "our_samples": samples * batches,
        "their_samples": theirs.samples * batches,
        **asdict(found),
        "mean_error": found.mean_error,
        "structure": found.structure,
    }


NETWORK_SAMPLES = {16: 16, 100: 4, 1000: 1}  # of the peer, which shades anew at each
NETWORK_PEER = peers.RENDERERS["cycles"]


def network(settings: Settings, n: int, say: Say) -> dict[str, object]:
    """A chain of n links at 64 samples, everything counted from an empty shader cache to the last pixel.

    The peer renders fewer samples; its time for 64 is that of reading and building, and 64 times its own rate.
    """
    samples = 4 if settings.quick else 64
    few = min(samples, NETWORK_SAMPLES[n])
    ours: list[dict[str, float]] = []
    theirs: list[dict[str, float]] = []
    for seed in range(1, settings.repeats + 1):
        for renderer, found, count in ((OURS, ours, samples), (NETWORK_PEER, theirs, few)):
            request = settings.request("shading", n, samples=count) | {"n": n, "seeds": [seed]}
            f = peers.ask(renderer, request, pictures=False, cold=True).figures
            whole = f["load_s"] + f["build_s"] + f["render_s"][0] * samples / count
            found.append({name: f[name] for name in ("load_s", "build_s")} | {"total_s": whole})
            turn = f"{n} links {seed}/{settings.repeats} {renderer.name:<10}"
            say(f"  {turn} {count:3} samples, for {samples}: {whole:8.2f} s")
    a, b = (statistics.median(run["total_s"] for run in runs) for runs in (ours, theirs))
    return {"links": n, "samples": samples, "peer": NETWORK_PEER.name, "peer_samples": few} | {
        "ours_s": a,
        "theirs_s": b,
        "faster": b / a,
        "ours": ours,
        "theirs": theirs,
    }


def micropolygons(settings: Settings, say: Say) -> dict[str, object]:
    """Dicing, shading and building some million micropolygons that no tolerance can simplify."""
    n = 250_000 if settings.quick else 4_000_000
    # The picture stays as it is: its size is part of what makes n.
    request = settings.request("micropolygons", n, samples=1) | {"scale": 1}
    runs = [
        peers.ask(OURS, {**request, "seeds": [k + 1]}, pictures=False).figures
        for k in range(max(settings.repeats, 2 if settings.quick else 3))
    ]
    names = ("dice_s", "shade_s", "bvh_s", "build_s", "peak_bytes", "grids_bytes", "lobe_inputs_bytes", "bvh_bytes")
    figures = {name: statistics.median(run[name] for run in runs) for name in (*names, "micropolygons")}
    count = figures["micropolygons"]
    figures["traced_polygons"] = runs[-1]["traced_polygons"]
    figures["bytes_each"] = (figures["grids_bytes"] + figures["bvh_bytes"]) / count
    figures["lobe_bytes_each"] = figures["lobe_inputs_bytes"] / count
    say(
        f"  {count / 1e6:.2f} M micropolygons: dice {figures['dice_s']:.2f} + shade {figures['shade_s']:.2f} + "
        f"build {figures['bvh_s']:.2f} = {figures['build_s']:.2f} s; {figures['bytes_each']:.1f} bytes each for "
        f"geometry and BVH, {figures['lobe_bytes_each']:.1f} for lobe inputs"
    )
    return figures


TOLERANCE_SCENES = {"flat": "cornell", "smooth": "smooth", "displaced": "displaced"}


def tolerance(settings: Settings, kind: str, say: Say) -> dict[str, object]:
    """The same scene traced at the geometry tolerance and micropolygon for micropolygon: picture, times, bytes."""
    batches = 4 if settings.quick else 8
    samples = 16 if settings.quick else 32
    request = settings.request(TOLERANCE_SCENES[kind], samples=samples)
    made: dict[str, Estimate] = {}
    sides: dict[str, list[dict[str, object]]] = {"on": [], "off": []}
    for batch in range(batches):
        for side, seed in (("on", 100), ("off", 200)):  # noise of their own: seeds differ
            given = {**request, "seeds": [seed + batch]}
            if side == "off":
                given["options"] = [("geometry_tolerance", 0.0)]
            answer = peers.ask(OURS, given)
            more = Estimate.of(answer.pictures, samples)
            made[side] = made[side] + more if side in made else more
            sides[side].append({**answer.figures, "render_s": answer.figures["render_s"][0]})
    found = agreement(made["on"], made["off"], level=False)
    names = ("dice_s", "shade_s", "bvh_s", "render_s", "grids_bytes", "lobe_inputs_bytes", "bvh_bytes", "peak_bytes")
    names += ("micropolygons", "traced_polygons")
    figures = {
        side: {name: statistics.median(run[name] for run in runs) for name in names} for side, runs in sides.items()
    }
    say(
        f"  {kind}: traced {figures['on']['traced_polygons']:.0f} of {figures['off']['traced_polygons']:.0f} polygons, "
        f"transport {figures['on']['render_s']:.3f} against {figures['off']['render_s']:.3f} s, means "
        f"{100 * found.mean_error:.2f} % apart, blocks' z {found.rms_z:.2f} r.m.s."
    )
    return {"kind": kind, **figures, **asdict(found), "mean_error": found.mean_error, "structure": found.structure}
