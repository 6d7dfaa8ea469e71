"""Things scattered over a surface: instances of archives, evenly spaced or by chance."""

from __future__ import annotations

import numpy as np

from . import rib
from .parameters import Parameter, read
from .surface import Surface, across, spaced, unit

PARAMETERS = (
    Parameter("surface", "", "archive that they stand on, in the space of the Procedural"),
    Parameter("edge", 0.0, "length of the triangles' edges that the surface is cut into; 0 = a 200th of its size", 0),
    Parameter("archives", "", "what is scattered: archives, parted by commas; each becomes an object"),
    Parameter("shares", "", "how many of each there are, relatively: numbers parted by commas; empty = alike"),
    Parameter("density", 0.0, "things a unit of area; a primvar `density` of the surface multiplies it", 0),
    Parameter("count", 100, "things, where no density is given", 0, 100_000_000),
    Parameter("evenness", 0.8, "how evenly they are spaced: 0 by chance, 1 as even as can be", 0, 1),
    Parameter("distance", 0.0, "that they keep at least; leaves out those that find no room", 0),
    Parameter("scale", (0.8, 1.2), "smallest and largest size"),
    Parameter("turn", 360.0, "degrees of random turn about their up"),
    Parameter("tilt", 0.0, "degrees of random lean", 0, 180),
    Parameter("up", (0.0, 1.0, 0.0), "direction that things grow in, in their archive and in the world"),
    Parameter("align", 1.0, "1: they stand upright on the surface, 0: along `up`", 0, 1),
    Parameter("steepest", 180.0, "degrees of slope against `up` beyond which nothing stands", 0, 180),
    Parameter("sink", 0.0, "how deep they stand in the surface"),
    Parameter("seed", 1, "another seed, other places", 0),
)
NAMES = {p.name for p in PARAMETERS}
DARTS = 6  # for each thing that is to stay


def expand(request) -> bytes:
    p = read(PARAMETERS, request.data, {k: v for k, v in request.parameters.items() if k in NAMES})
    archives = [a for a in p.archives.split(",") if a]
    if not p.surface or not archives:
        raise ValueError("surface=ARCHIVE and archives=ARCHIVE,… are needed: what stands on what?")
    path = request.find(p.surface)
    if path is None:
        raise FileNotFoundError(f"{p.surface} is in none of {', '.join(f or '.' for f in request.folders)}")
    rng = np.random.default_rng(p.seed)
    up = unit(np.array(p.up))
    P, N = places(Surface(path, p.edge), p, up, rng)
    shares = np.array([float(x) for x in p.shares.split(",")]) if p.shares else np.ones(len(archives))
    if len(shares) != len(archives) or not np.all(shares >= 0) or not shares.sum() > 0:
        raise ValueError(f"shares={p.shares}: {len(archives)} numbers are needed, none of them below 0")
    kind = rng.choice(len(archives), size=len(P), p=shares / shares.sum())
    matrices = frames(P, N, p, up, rng)
    parts = []
    for i, archive in enumerate(archives):
        handle = f"scattered {i + 1}"
        parts.append(b"ObjectBegin " + rib.string(handle) + b"\nReadArchive " + rib.string(archive) + b"\nObjectEnd\n")
        parts.append(rib.instances(handle, matrices[kind == i]))
    return b"".join(parts)


def places(surface: Surface, p, up: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    weights = surface.weights("density")
    t = surface.triangles
    flat = unit(surface.N[t].mean(axis=1)) @ up
    weights = np.where(flat >= np.cos(np.radians(p.steepest)) - 1e-9, weights, 0)
    area = weights.sum()
    wanted = int(p.density * area + 0.5) if p.density > 0 else p.count
    # Discs that find no more room cover 0.547 of the plane: n = 0.696 area / distance^2. A little less is reached
    # with so many darts.
    radius = max(p.distance, p.evenness * 0.7 * np.sqrt(area / max(wanted, 1)))
    darts = surface.sample(wanted * DARTS if radius > 0 else wanted, rng, weights)
    if radius > 0 and len(darts.P):
        darts = darts.take(spaced(darts.P, radius, rng)[:wanted])
    return darts.P, darts.N


def frames(P: np.ndarray, N: np.ndarray, p, up: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    n = len(P)
    axis = unit(up + (N - up) * p.align)
    side, other = across(axis)
    lean, about = np.radians(p.tilt) * np.sqrt(rng.random((n, 1))), 2 * np.pi * rng.random((n, 1))
    axis = np.cos(lean) * axis + np.sin(lean) * (np.cos(about) * side + np.sin(about) * other)
    # The shortest turn from `up` to the axis, after a turn about `up`.
    turn = np.radians(p.turn) * (rng.random(n) - 0.5)
    matrices = np.zeros((n, 4, 4))
    matrices[:, 3, 3] = 1
    about_up = rotations(np.broadcast_to(up, (n, 3)), np.cos(turn), np.sin(turn))
    hinge = np.cross(up, axis)
    sine = np.linalg.norm(hinge, axis=1)
    hinge = np.where(sine[:, None] > 1e-9, hinge / np.maximum(sine, 1e-30)[:, None], across(up)[0])
    to_axis = rotations(hinge, axis @ up, sine)
    size = p.scale[0] + (p.scale[1] - p.scale[0]) * rng.random(n)
    matrices[:, :3, :3] = np.matmul(to_axis, about_up) * size[:, None, None]
    matrices[:, :3, 3] = P - axis * p.sink
    return matrices


def rotations(axis: np.ndarray, cosine: np.ndarray, sine: np.ndarray) -> np.ndarray:
    """Rodrigues' formula."""
    n = len(axis)
    K = np.zeros((n, 3, 3))
    x, y, z = axis.T
    K[:, 0, 1], K[:, 0, 2], K[:, 1, 2] = -z, y, -x
    K[:, 1, 0], K[:, 2, 0], K[:, 2, 1] = z, -y, x
    return np.eye(3) + sine[:, None, None] * K + (1 - cosine)[:, None, None] * np.matmul(K, K)
