"""Woven cloth: every yarn a curve that goes over and under the others, on a sheet or on any surface with (s, t)."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from . import rib
from .parameters import Parameter, read
from .surface import Surface, hashed, unit

# One repeat of each weave: 1 where the warp lies above the weft.
WEAVES = {
    "plain": [[1, 0], [0, 1]],
    "basket": [[1, 1, 0, 0], [1, 1, 0, 0], [0, 0, 1, 1], [0, 0, 1, 1]],
    "twill": [[1, 1, 0, 0], [0, 1, 1, 0], [0, 0, 1, 1], [1, 0, 0, 1]],
    "herringbone": [
        [1, 1, 0, 0], [0, 1, 1, 0], [0, 0, 1, 1], [1, 0, 0, 1],
        [0, 0, 1, 1], [0, 1, 1, 0], [1, 1, 0, 0], [1, 0, 0, 1],
    ],
    "satin": [[1, 1, 1, 1, 0], [1, 1, 0, 1, 1], [0, 1, 1, 1, 1], [1, 1, 1, 0, 1], [1, 0, 1, 1, 1]],
}  # fmt: skip

PARAMETERS = (
    Parameter("surface", "", "archive whose (s, t) from 0 to 1 the cloth is laid on; none = a sheet in x and y"),
    Parameter("edge", 0.0, "length of the triangles' edges that the surface is cut into; 0 = a 200th of its size", 0),
    Parameter("width", 1.0, "of the sheet, along x, from the origin", 1e-9),
    Parameter("height", 1.0, "of the sheet, along y", 1e-9),
    Parameter("folds", 0.0, "that the sheet hangs in", 0, 1000),
    Parameter("folddepth", 0.05, "how far folds come out along z", 0),
    Parameter("warps", 60, "yarns along t, or y", 1, 20000),
    Parameter("wefts", 60, "yarns along s, or x", 1, 20000),
    Parameter("weave", "plain", "how they cross", choices=tuple(WEAVES)),
    Parameter("thickness", 0.95, "of a yarn, as part of the room that it has", 0.01, 2),
    Parameter("crimp", 0.5, "how far yarns go up and down, as part of their thickness", 0, 2),
    Parameter("plies", 3, "that a yarn is twisted of; far away it has one", 1, 12),
    Parameter("twist", 0.6, "turns of plies from crossing to crossing", -10, 10),
    Parameter("uneven", 0.12, "part of a yarn's thickness and place that varies along it", 0, 1),
    Parameter("fibres", 0.0, "that stand off, for each crossing", 0, 100),
    Parameter("fibrelength", 1.5, "of those, in rooms of a yarn", 0),
    Parameter("warpcolor", (0.55, 0.50, 0.42), "Cs of warps"),
    Parameter("weftcolor", (0.12, 0.17, 0.30), "Cs of wefts"),
    Parameter("stripes", 0, "every so many yarns, as many again in the other's colour: a check; 0 = none", 0, 10000),
    Parameter("colorvariation", 0.12, "part of the colour that varies from yarn to yarn", 0, 1),
    Parameter("seed", 1, "another seed, other unevenness", 0),
)
NAMES = {p.name for p in PARAMETERS}


def expand(request) -> bytes:
    p = read(PARAMETERS, request.data, {k: v for k, v in request.parameters.items() if k in NAMES})
    ground = Mapped(request, p) if p.surface else Sheet(p)
    # Yarns of a few pixels need no plies, and those of less no more points than crossings.
    pixels = np.sqrt(min(request.detail, 1e30)) / max(p.warps, p.wefts)
    plies, cuts = (p.plies, 4) if pixels >= 3 else (1, 2) if pixels >= 1 else (1, 1)
    parts = []
    for warp in (True, False):
        parts += yarns(ground, p, warp, plies, cuts)
    if p.fibres > 0 and pixels >= 2:
        parts += fibres(ground, p)
    # As an object yarns are tubes, not ribbons that face the camera.
    if request.in_object:
        return b"".join(parts)
    return b'ObjectBegin "cloth"\n' + b"".join(parts) + b'ObjectEnd\nObjectInstance "cloth"\n'


class Sheet:
    """A plane, or hanging folds that open towards the hem."""

    def __init__(self, p: SimpleNamespace) -> None:
        self.p = p
        self.room = min(p.width / p.warps, p.height / p.wefts)

    def at(self, s: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        p = self.p
        z = np.zeros_like(s)
        if p.folds > 0:
            open_ = 0.55 + 0.45 * (1 - t)
            phase = 2 * np.pi * p.folds * (s + 0.02 * np.sin(7 * t + 3 * s))
            z = p.folddepth * open_ * (np.sin(phase) + 0.25 * np.sin(2.3 * phase + 2 * t))
        return np.stack([s * p.width, t * p.height, z], axis=-1), None


class Mapped:
    """Positions and normals of an archive's surface as pictures over (s, t)."""

    def __init__(self, request, p: SimpleNamespace, size: int = 768) -> None:
        path = request.find(p.surface)
        if path is None:
            raise FileNotFoundError(f"{p.surface} is in none of {', '.join(f or '.' for f in request.folders)}")
        surface = Surface(path, p.edge)
        self.size = size
        self.maps = np.full((size, size, 6), np.nan)
        values = np.concatenate([surface.P, surface.N], axis=1)
        corners = surface.st[surface.triangles].astype(np.float64) * (size - 1)
        low = np.floor(corners.min(axis=1)).astype(int)
        reach = np.minimum(np.ceil(corners.max(axis=1)).astype(int) - low, 64)
        a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
        det = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (c[:, 0] - a[:, 0]) * (b[:, 1] - a[:, 1])
        for dx in range(int(reach[:, 0].max()) + 1):
            for dy in range(int(reach[:, 1].max()) + 1):
                which = np.flatnonzero((reach[:, 0] >= dx) & (reach[:, 1] >= dy) & (np.abs(det) > 1e-12))
                x, y = low[which, 0] + dx, low[which, 1] + dy
                px, py = x - a[which, 0], y - a[which, 1]
                v = (px * (c[which, 1] - a[which, 1]) - (c[which, 0] - a[which, 0]) * py) / det[which]
                w = ((b[which, 0] - a[which, 0]) * py - px * (b[which, 1] - a[which, 1])) / det[which]
                inside = (
                    (v >= -1e-6) & (w >= -1e-6) & (v + w <= 1 + 1e-6) & (x >= 0) & (y >= 0) & (x < size) & (y < size)
                )
                which, x, y, v, w = which[inside], x[inside], y[inside], v[inside, None], w[inside, None]
                t = surface.triangles[which]
                self.maps[y, x] = values[t[:, 0]] * (1 - v - w) + values[t[:, 1]] * v + values[t[:, 2]] * w
        if np.isnan(self.maps).all():
            raise ValueError(f"{p.surface}: no part of the surface has (s, t) between 0 and 1")
        for _ in range(8):  # pixels at rims take what lies beside them
            holes = np.isnan(self.maps[..., 0])
            if not holes.any():
                break
            for axis, step in ((0, 1), (0, -1), (1, 1), (1, -1)):
                beside = np.roll(self.maps, step, axis)
                take = np.isnan(self.maps[..., 0]) & ~np.isnan(beside[..., 0])
                self.maps[take] = beside[take]
        self.room = np.sqrt(surface.area / (p.warps * p.wefts))

    def at(self, s: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        x, y = np.clip(s, 0, 1) * (self.size - 1), np.clip(t, 0, 1) * (self.size - 1)
        i, j = np.minimum(x.astype(int), self.size - 2), np.minimum(y.astype(int), self.size - 2)
        f, g = (x - i)[..., None], (y - j)[..., None]
        m = self.maps
        value = (m[j, i] * (1 - f) + m[j, i + 1] * f) * (1 - g) + (m[j + 1, i] * (1 - f) + m[j + 1, i + 1] * f) * g
        return value[..., :3], value[..., 3:]


def above(p: SimpleNamespace, warp: np.ndarray, weft: np.ndarray) -> np.ndarray:
    weave = np.array(WEAVES[p.weave])
    return weave[weft % weave.shape[0], warp % weave.shape[1]]


def smooth(values: np.ndarray, cuts: int) -> np.ndarray:
    """Values at crossings, `cuts` times as many between them: by a cosine, which stays flat over floats."""
    t = np.arange(cuts) / cuts
    w = 0.5 - 0.5 * np.cos(np.pi * t)
    a, b = values[:, :-1, None], values[:, 1:, None]
    return np.concatenate([(a + (b - a) * w).reshape(len(values), -1), values[:, -1:]], axis=1)


def wobble(key: np.ndarray, t: np.ndarray, salt: int) -> np.ndarray:
    """A few slow waves a yarn, about -1 to 1."""
    total = np.zeros((len(key), len(t)))
    for k, rate in enumerate((3.1, 7.7, 17.3)):
        phase = 2 * np.pi * hashed(key, salt + k)
        total += np.sin(rate * 2 * np.pi * t + phase[:, None]) * (0.6, 0.5, 0.4)[k]
    return total


def yarns(ground, p: SimpleNamespace, warp: bool, plies: int, cuts: int) -> list[bytes]:
    count, crossings = (p.warps, p.wefts) if warp else (p.wefts, p.warps)
    index = np.arange(count)
    # Crossings, and half a room more at both ends.
    over = (
        above(p, index[:, None], np.arange(-1, crossings + 1))
        if warp
        else (1 - above(p, np.arange(-1, crossings + 1)[None], index[:, None]))
    )
    height = smooth(2.0 * over - 1, cuts)
    along = (np.arange(height.shape[1]) / cuts - 0.5) / crossings
    keep = (along >= -1e-9) & (along <= 1 + 1e-9)
    along, height = along[keep], height[:, keep]
    radius = 0.5 * p.thickness * ground.room
    key = index + (1 << 20) * warp
    lane = (index[:, None] + 0.5 + 0.25 * p.uneven * wobble(key, along, p.seed)) / count
    s, t = (lane, np.broadcast_to(along, lane.shape)) if warp else (np.broadcast_to(along, lane.shape), lane)
    course, normal = ground.at(s, t)
    tangent = unit(np.gradient(course, axis=1)) if course.shape[1] > 1 else np.zeros_like(course) + np.array([0, 1, 0])
    if normal is None:
        h = 1e-3
        ds = ground.at(s + h, t)[0] - ground.at(s - h, t)[0]
        dt = ground.at(s, t + h)[0] - ground.at(s, t - h)[0]
        normal = np.cross(ds, dt)
    good = ~np.isnan(course).any(axis=(1, 2))
    normal = unit(normal)
    side = unit(np.cross(normal, tangent))
    course = course + normal * (height * p.crimp * radius)[:, :, None]
    thick = radius * (1 + 0.5 * p.uneven * wobble(key, along, p.seed + 10))
    color = yarn_colors(p, warp, index)
    # Plies lie about the middle and just touch one another.
    share = 1 / (1 + 1 / np.sin(np.pi / plies)) if plies > 1 else 1.0
    parts = []
    for ply in range(plies):
        turn = 2 * np.pi * (p.twist * crossings * along + ply / plies + hashed(key, p.seed + 20)[:, None])
        out = thick * (1 - share) if plies > 1 else 0 * thick
        points = course + (out * np.cos(turn))[:, :, None] * side + (out * np.sin(turn))[:, :, None] * normal
        values = {
            "varying float width": 2 * thick * share * (1.15 if plies > 1 else 1),
            "uniform color Cs": color,
        }
        parts += rib.curves(points[good], {k: v[good] for k, v in values.items()}, run=2000)
    return parts


def yarn_colors(p: SimpleNamespace, warp: bool, index: np.ndarray) -> np.ndarray:
    own, other = (p.warpcolor, p.weftcolor) if warp else (p.weftcolor, p.warpcolor)
    color = (
        np.where(((index // p.stripes) % 2 == 1)[:, None], other, own) if p.stripes else np.tile(own, (len(index), 1))
    )
    return np.clip(color * (1 + p.colorvariation * (2 * hashed(index + 7919 * warp, p.seed + 30) - 1)[:, None]), 0, 1)


def fibres(ground, p: SimpleNamespace) -> list[bytes]:
    rng = np.random.default_rng(p.seed + 1)
    n = int(p.fibres * p.warps * p.wefts)
    if n == 0:
        return []
    s, t = rng.random(n), rng.random(n)
    root, normal = ground.at(s, t)
    h = 1e-3
    ds, dt = ground.at(s + h, t)[0] - root, ground.at(s, t + h)[0] - root
    if normal is None:
        normal = np.cross(ds, dt)
    ds, dt, normal = unit(ds), unit(dt), unit(normal)
    length = p.fibrelength * ground.room * (0.4 + 0.6 * rng.random(n))
    about = 2 * np.pi * rng.random(n)
    flat = np.cos(about)[:, None] * ds + np.sin(about)[:, None] * dt
    radius = 0.5 * p.thickness * ground.room
    lean = unit(flat + 0.5 * rng.random((n, 1)) * normal)
    points = [root + 0.3 * radius * normal]
    for _ in range(4):
        lean = unit(lean + 0.45 * rng.normal(size=(n, 3)) + 0.1 * normal)
        points.append(points[-1] + lean * (length / 4)[:, None])
    course = np.stack(points, axis=1)
    good = ~np.isnan(course).any(axis=(1, 2))
    which = (rng.random(n) < 0.5)[:, None]
    values = {
        "varying float width": np.full((n, 5), 0.06 * radius),
        "uniform color Cs": np.where(which, p.warpcolor, p.weftcolor) * 0.9 + 0.1,
    }
    return list(rib.curves(course[good], {k: v[good] for k, v in values.items()}))
