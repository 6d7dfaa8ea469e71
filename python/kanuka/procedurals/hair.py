"""Hair and fur: curves that grow out of a surface, with a comb, weight, clumps, curls and frizz."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from . import rib
from .parameters import Parameter, read
from .surface import Samples, Surface, across, hashed, nearest_feature, unit

PARAMETERS = (
    Parameter("surface", "", "archive that it grows on, in the space of the Procedural"),
    Parameter("edge", 0.0, "length of the triangles' edges that the surface is cut into; 0 = a 200th of its size", 0),
    Parameter("density", 0.0, "hairs a unit of area; a primvar `density` of the surface multiplies it", 0),
    Parameter("count", 20000, "hairs, where no density is given", 0, 100_000_000),
    Parameter("length", 0.1, "of a hair; a primvar `length` of the surface multiplies it", 0),
    Parameter("lengthvariation", 0.25, "part of the length that varies from hair to hair", 0, 1),
    Parameter("segments", 7, "of a curve", 1, 64),
    Parameter("width", 0.001, "at the root", 0),
    Parameter("taper", 0.8, "part of the width that is gone at the tip", 0, 1),
    Parameter("comb", (0.0, 0.0, 0.0), "direction that hair leans to; its length is how strongly"),
    Parameter("gravity", (0.0, 0.0, 0.0), "direction that tips bend to; its length is how strongly"),
    Parameter("tilt", 0.2, "random lean away from the normal", 0),
    Parameter("clump", 0.0, "how far tips are drawn to the middle of their clump", 0, 1),
    Parameter("clumpsize", 0.05, "about the distance of clumps", 1e-9),
    Parameter("clumpshape", 1.2, "where clumps close: higher is nearer to the tips", 0.05, 20),
    Parameter("curl", 0.0, "radius of curls", 0),
    Parameter("curls", 3.0, "turns along a hair"),
    Parameter("frizz", 0.0, "how far a hair wanders off by itself", 0),
    Parameter("rootcolor", (0.10, 0.055, 0.03), "Cs at the root"),
    Parameter("tipcolor", (0.36, 0.21, 0.10), "Cs at the tip"),
    Parameter("colorvariation", 0.2, "part of the colour that varies from hair to hair", 0, 1),
    Parameter("seed", 1, "another seed, other hair", 0),
)


def expand(request) -> bytes:
    p = read(PARAMETERS, request.data, {k: v for k, v in request.parameters.items() if k in NAMES})
    if not p.surface:
        raise ValueError("surface=ARCHIVE is missing: what does it grow on?")
    path = request.find(p.surface)
    if path is None:
        raise FileNotFoundError(f"{p.surface} is in none of {', '.join(f or '.' for f in request.folders)}")
    surface = Surface(path, p.edge)
    rng = np.random.default_rng(p.seed)
    weights = surface.weights("density")
    count = int(p.density * weights.sum() + 0.5) if p.density > 0 else p.count
    roots = surface.sample(count, rng, weights)
    if not len(roots.P):
        return b""
    return b"".join(emit(grow(roots, p, rng), roots, p, rng))


NAMES = {p.name for p in PARAMETERS}


def grow(roots: Samples, p: SimpleNamespace, rng: np.random.Generator) -> np.ndarray:
    """Points of all hairs, (hairs, segments + 1, 3)."""
    n, points = len(roots.P), p.segments + 1
    t = np.linspace(0, 1, points)
    lengths = p.length * roots.factor("length") * (1 - p.lengthvariation * rng.random(n))

    # Directions turn from the skin's normal to the comb, and further to gravity; points are their sums.
    comb, gravity = np.array(p.comb), np.array(p.gravity)
    along = comb - roots.N * (roots.N @ comb)[:, None]  # in the surface, so that combed hair lies on it
    lean = rng.normal(size=(n, 3)) * p.tilt
    start = unit(roots.N + lean + along)
    bend = (t**1.5)[None, :, None] * (along[:, None] + gravity)
    directions = unit(start[:, None] + bend)
    steps = directions[:, 1:] * (lengths / p.segments)[:, None, None]
    # What gravity draws into the skin slides along it instead.
    depth = np.minimum(np.einsum("nkc,nc->nk", steps, roots.N), 0)
    steps -= 0.9 * depth[:, :, None] * roots.N[:, None]
    hair = np.concatenate([np.zeros((n, 1, 3)), np.cumsum(steps, axis=1)], axis=1) + roots.P[:, None]

    key = np.arange(n)
    if p.clump > 0:
        key, distance = nearest_feature(roots.P, p.clumpsize, p.seed)
        order = np.lexsort((distance, key))
        first = np.ones(n, bool)
        first[1:] = key[order][1:] != key[order][:-1]
        leader = np.empty(n, np.int64)
        leader[order] = order[first][np.cumsum(first) - 1]
        # Each keeps its own length: the clump's course, stretched.
        course = hair[leader] - hair[leader, :1]
        course *= (lengths / np.maximum(lengths[leader], 1e-30))[:, None, None]
        middle = hair[leader, :1] + course
        amount = p.clump * t**p.clumpshape * (0.75 + 0.25 * rng.random(n))[:, None]
        hair += (middle - hair) * amount[:, :, None]

    side, up = across(directions[:, 0])
    if p.curl > 0:
        phase = 2 * np.pi * hashed(key, p.seed + 11) + 0.6 * rng.normal(size=n)
        turns = p.curls * (0.85 + 0.3 * hashed(key, p.seed + 12))
        angle = phase[:, None] + 2 * np.pi * turns[:, None] * t
        radius = p.curl * np.minimum(1, 3 * t)
        hair += radius[:, None] * (np.cos(angle) - np.cos(phase)[:, None])[:, :, None] * side[:, None]
        hair += radius[:, None] * (np.sin(angle) - np.sin(phase)[:, None])[:, :, None] * up[:, None]
    if p.frizz > 0:
        for octave in (1.0, 2.3, 5.1):
            amount = (
                p.frizz
                / octave
                * t
                * np.sin(octave * np.pi * (t + rng.random((n, 1))) * (1 + 0.5 * rng.random((n, 1))))
            )
            turn = 2 * np.pi * rng.random((n, 1))
            hair += (amount * np.cos(turn))[:, :, None] * side[:, None]
            hair += (amount * np.sin(turn))[:, :, None] * up[:, None]
    return hair


def emit(hair: np.ndarray, roots: Samples, p: SimpleNamespace, rng: np.random.Generator):
    n, points = hair.shape[:2]
    t = np.linspace(0, 1, points)
    widths = np.broadcast_to(p.width * (1 - p.taper * t**1.5), (n, points))
    bright = 1 + p.colorvariation * (2 * rng.random((n, 1, 1)) - 1)
    warm = 1 + 0.3 * p.colorvariation * rng.normal(size=(n, 1, 1)) * np.array([1, 0, -1])
    root, tip = np.array(p.rootcolor), np.array(p.tipcolor)
    colors = np.clip((root + (tip - root) * t[:, None]) * bright * warm, 0, 1)
    values = {
        "varying float width": widths,
        "varying color Cs": colors,
        "uniform float hairid": hashed(np.arange(n), p.seed),
        "uniform float[2] rootst": roots.st,
    }
    yield from rib.curves(hair, values)
