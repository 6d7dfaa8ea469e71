"""Ten million billion leaves: 100 on a bough, 100 boughs on a tree, 10 000 trees in a wood, 10 000 woods in a land,
10 000 lands in a country. 30 200 matrices are stored.

    python scenes/nested/make.py -o out/nested.exr
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

import kanuka

SPACING = 6.0  # metres from tree to tree; a wood is 600 m wide, a land 60 km, the country 6000 km
LEAVES = 100 * 100 * 100**2 * 100**2 * 100**2


def turned(
    where: np.ndarray, turn: np.ndarray, scale: np.ndarray | float = 1, steep: np.ndarray | float = 0
) -> np.ndarray:
    """(N, 3, 4): scaled, tilted by `steep` from y towards x, turned about y, moved."""
    c, s, e, f = np.cos(turn), np.sin(turn), np.cos(steep) + 0 * turn, np.sin(steep) + 0 * turn
    x, y, z = np.stack([c * e, -f, -s * e], 1), np.stack([c * f, e, -s * f], 1), np.stack([s, 0 * s, c], 1)
    return np.concatenate([np.stack([x, y, z], 2) * np.reshape(scale, (-1, 1, 1)), where[:, :, None]], axis=2)


def square(spacing: float, jitter: float, rng: np.random.Generator) -> np.ndarray:
    """100 × 100 places about the origin, y = 0."""
    z, x = np.mgrid[0:100, 0:100].reshape(2, -1) - 49.5
    x, z = (v * spacing + rng.uniform(-jitter, jitter, v.size) for v in (x, z))
    return np.stack([x, 0 * x, z], axis=1)


def relief(x: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Of a wood's ground: nothing along its border, where the next one begins, whichever way that is turned."""
    a, b = (np.cos(np.pi * v / (100 * SPACING)) ** 2 for v in (x, z))
    return a * b * (22 + 40 * np.sin(x / 61 + 1) * np.cos(z / 53) + 9 * np.sin(x / 23 - z / 31))


def scene(seed: int = 1) -> kanuka.Scene:
    rng = np.random.default_rng(seed)
    made = kanuka.Scene()
    names = ("leaf", "bough", "tree", "wood", "land", "country")
    leaf, bough, tree, wood, land, country = (made.add_group(name) for name in names)

    green = kanuka.Material("leaf", front=(0.09, 0.17, 0.03), through=(0.25, 0.38, 0.04))
    bark = kanuka.Material("matte", color=(0.16, 0.12, 0.09))
    leaf.add_patches(
        np.array([[[-0.3, 0, 0.1], [0.3, 0, 0.1]], [[-0.3, 0.08, 0.6], [0.3, 0.08, 0.6]], [[0, 0, 1], [0, 0, 1]]]),
        basis="bilinear", material=green,
    )  # fmt: skip

    t = rng.random(100) ** 0.7  # along the bough, which is y from 0 to 1
    turn = 2.39996 * np.arange(100)
    out = 0.06 + 0.34 * np.sin(np.pi * np.clip(t, 0.1, 1) ** 1.2) * rng.random(100)
    where = np.stack([out * np.sin(turn), t, out * np.cos(turn)], axis=1)
    bough.add_instances(
        leaf, turned(where, turn + rng.normal(0, 0.5, 100), rng.uniform(0.11, 0.19, 100), rng.normal(0, 0.5, 100))
    )
    bough.add_cone(
        0.022, 1, transform=np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]]), material=bark
    )

    s = np.linspace(0.24, 1, 100)  # up the trunk; long boughs in the middle
    size = (0.7 + 1.9 * np.sqrt(np.clip(1 - ((s - 0.5) / 0.56) ** 2, 0.03, 1))) * rng.uniform(0.8, 1.1, 100)
    steep = 1.75 - 1.35 * s + rng.normal(0, 0.15, 100)
    tree.add_instances(bough, turned(s[:, None] * [0, 7.5, 0], 2.39996 * np.arange(100), size, steep))
    tree.add_cone(
        0.2, 8.2, transform=np.array([[1, 0, 0, 0], [0, 0, 1, -0.3], [0, -1, 0, 0], [0, 0, 0, 1]]), material=bark
    )

    where = square(SPACING, 2.7, rng)
    where[:, 1] = relief(where[:, 0], where[:, 2]) - 0.1
    wood.add_instances(tree, turned(where, rng.uniform(0, 6.28, 10_000), rng.uniform(0.6, 1.45, 10_000)))
    axis = np.linspace(-50 * SPACING, 50 * SPACING, 61)
    x, z = np.meshgrid(axis, axis[::-1])
    wood.add_patches(
        np.stack([x, relief(x, z), z], -1),
        basis="bilinear",
        material=kanuka.Material("matte", color=(0.1, 0.085, 0.04)),
    )

    quarter = np.pi / 2 * rng.integers(0, 4, 10_000)
    land.add_instances(wood, turned(square(100 * SPACING, 0, rng), quarter))
    country.add_instances(land, turned(square(1e4 * SPACING, 0, rng), quarter[::-1]))
    made.add_instances(country, np.eye(4)[None])

    sun = (-0.72, 0.3, 0.12)
    made.add_light("sky", sun=sun, turbidity=3)
    made.add_light("sun", sun=sun, turbidity=3)
    made.camera = kanuka.Camera((300, 92, 330), (190, 62, 0), fov=62, fov_axis="x")
    made.resolution = 1024, 429
    made.options.max_depth = 5
    made.options.clamp_indirect = 20
    made.options.exposure_gain = 0.085
    return made


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, default=Path("out/nested.exr"), help="EXR or PNG")
    parser.add_argument("--resolution", default="1024x429", metavar="WxH")
    parser.add_argument("--progressions", type=int, default=16, help="paths a pixel")
    given = parser.parse_args()
    width, height = (int(word) for word in given.resolution.split("x"))
    picture = kanuka.render(scene(), resolution=(width, height), progressions=given.progressions)
    given.output.parent.mkdir(parents=True, exist_ok=True)
    picture.write(given.output)
    print(f"{LEAVES:.0e} leaves, {picture.stats['bytes']['peak_rss'] / 1e6:.0f} MB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
