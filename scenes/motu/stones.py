"""Rocks and heads of coral: balls that noise pushes out, as fine as the scene is to be."""

from __future__ import annotations

import numpy as np

from kit import shapes
from kit.plants import Maker, Plant
from kit.sinks import Look

CORALS = (
    ((0.42, 0.3, 0.16), (0.6, 0.5, 0.3)),
    ((0.3, 0.17, 0.2), (0.5, 0.32, 0.36)),
    ((0.22, 0.24, 0.12), (0.45, 0.44, 0.24)),
    ((0.45, 0.36, 0.28), (0.66, 0.58, 0.46)),
)


def rock(make: Maker, seed: int, side: int) -> Plant:
    points, faces = shapes.ball(side)
    rng, noise = make.rng(seed, 1), shapes.Noise(seed)
    flat = points * rng.uniform([0.8, 0.5, 0.8], [1.3, 0.85, 1.3])
    cuts = rng.normal(size=(7, 3)) * [1, 0.7, 1]
    cuts /= np.linalg.norm(cuts, axis=1, keepdims=True)
    far = np.maximum((flat @ cuts.T) / rng.uniform(0.55, 0.95, 7), 1e-9).max(axis=1)  # planes that break pieces off
    grown = flat / np.maximum(far, 1)[:, None] ** 0.85
    bulges = 0.16 * noise.fractal(points * 1.7, 5) + 0.1 * noise.fractal(points * 3.1 + 7, 4, ridged=True)
    grown *= (1 + bulges)[:, None]
    plant = make.plant(f"rock {seed}")
    look = Look("stone", {})
    make.mesh(plant, grown, faces, look, normals=shapes.normals(grown, faces))
    return plant


def coral(make: Maker, seed: int, side: int) -> Plant:
    """By turns a head with furrows, a bush of knobs, and a table."""
    points, faces = shapes.ball(side)
    noise = shapes.Noise(seed + 500)
    kind = seed % 3
    coarse = noise.fractal(points * 1.6, 2)
    if kind == 0:
        furrows = np.abs(noise(points * 9 + 2 * coarse[:, None]))
        grown = points * (0.85 + 0.2 * coarse + 0.09 * np.minimum(furrows * 3, 1))[:, None]
        grown = grown * [1, 0.8, 1]
    elif kind == 1:
        knobs = np.clip(noise(points * 5.5), 0, 1) ** 1.3
        grown = points * (0.55 + 0.2 * coarse + 0.75 * knobs)[:, None]
    else:
        edge = 1 + 0.3 * noise.fractal(points * [2.2, 0, 2.2], 3)
        fine = 0.05 * noise(points * 14)
        grown = points * np.stack([1.4 * edge, 0.22 + 0 * edge, 1.4 * edge], axis=1) + [0, 0.55, 0]
        grown[:, 1] += fine
        stem = np.clip(-points[:, 1] - 0.55, 0, 1) / 0.45  # what is below becomes a foot
        grown[:, 1] -= 1.1 * stem**2
        grown[:, [0, 2]] *= (1 - 0.6 * stem)[:, None]
    plant = make.plant(f"coral {seed}")
    dark, pale = CORALS[seed % len(CORALS)]
    look = Look("stone", {"color dark": dark, "color pale": pale, "float scale": 3.0, "float moss": 0.0})
    make.mesh(plant, grown, faces, look, normals=shapes.normals(grown, faces))
    return plant
