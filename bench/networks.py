"""Chains of noises as shaders: all counted, from an empty cache to the last pixel, beside Cycles."""

from __future__ import annotations

import numpy as np

import peers
from pictures import block_means
from settings import Found, Say, Settings

PEER = peers.RENDERERS["cycles"]
SAMPLES = 64
# Cycles shades anew at each sample: what it is asked for, so that a round stays within a minute. Its rate over these
# gives its time for 64, and a picture of as many samples of ours is timed beside it, with nothing multiplied.
PEER_SAMPLES = {16: 16, 100: 4, 1000: 2}
ROUNDS = 5


def whole(figures: Found) -> float:
    return figures["load_s"] + figures["build_s"] + figures["render_s"][0]


def look(picture: np.ndarray) -> Found:
    """What must be alike though noises are each renderer's own: colours, contrast, and how fine the pattern is."""
    below = picture[picture.shape[0] // 2 :]  # the plane, near
    fine, coarse = block_means(below, 4), block_means(below, 32)
    grain = (np.abs(np.diff(fine, axis=0)).mean() + np.abs(np.diff(fine, axis=1)).mean()) / fine.mean()
    return {
        "means": [float(c) for c in below.mean((0, 1))],
        "contrast": float(coarse.std((0, 1)).mean() / coarse.mean()),
        "grain": float(grain),
    }


def measure(settings: Settings, links: int, say: Say) -> Found:
    samples = 4 if settings.quick else SAMPLES
    few = min(samples, PEER_SAMPLES[links])
    rounds: dict[str, list[float]] = {name: [] for name in ("ours_s", "ours_few_s", "theirs_few_s", "theirs_s")}
    looks: Found = {}
    for number in range(1 if settings.quick else min(settings.rounds, ROUNDS)):
        turns = [("ours_s", peers.OURS, samples), ("ours_few_s", peers.OURS, few), ("theirs_few_s", PEER, few)]
        for name, renderer, count in turns if number % 2 == 0 else reversed(turns):
            if not renderer.installed:
                continue
            request = settings.request("shading", links, samples=count) | {"n": links, "seeds": [number + 1]}
            answer = peers.ask(renderer, request, cold=True)
            f = answer.figures
            rounds[name].append(whole(f))
            looks[renderer.name] = look(answer.pictures[0])
            if renderer is PEER:
                rounds["theirs_s"].append(f["load_s"] + f["build_s"] + f["render_s"][0] * samples / count)
            say(f"  {links} links, round {number + 1}: {renderer.name:<8} {count:3} samples {whole(f):8.2f} s")
    if not rounds["theirs_s"]:
        say(f"  not installed: {PEER.name}")
    return {
        "links": links,
        "samples": samples,
        "peer": PEER.name,
        "peer_samples": few,
        "rounds": {name: values for name, values in rounds.items() if values},
        "looks": looks,
    }
