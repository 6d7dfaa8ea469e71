#!/usr/bin/env python3
"""Makes the pictures and the generated geometry of scenes/showcase.rib. Needs numpy alone.

    tools/make_showcase_assets.py            writes scenes/textures/* and scenes/geometry/*

Everything is drawn from fixed seeds: the same numpy gives the same bytes.
"""

import math
import pathlib
import struct
import zlib

import numpy as np

SCENES = pathlib.Path(__file__).resolve().parent.parent / "scenes"


# ---- files -----------------------------------------------------------------------------------------------------------


def write_png(path, rgb):
    """Linear RGB in [0, 1] as an 8-bit sRGB PNG; each row predicted from the one above (filter 2)."""
    rgb = np.clip(rgb, 0, 1)
    encoded = np.where(rgb <= 0.0031308, 12.92 * rgb, 1.055 * rgb ** (1 / 2.4) - 0.055)
    pixels = np.round(encoded * 255).astype(np.uint8)
    height, width = pixels.shape[:2]
    flat = pixels.reshape(height, -1)
    above = np.vstack([np.zeros_like(flat[:1]), flat[:-1]])
    rows = np.hstack([np.full((height, 1), 2, np.uint8), flat - above])

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    with open(path, "wb") as f:
        f.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"sRGB", b"\0"))
        f.write(chunk(b"IDAT", zlib.compress(rows.tobytes(), 9)) + chunk(b"IEND", b""))


def write_exr(path, rgb):
    """Half floats, scanlines, ZIP in blocks of 16 lines: the layout of the OpenEXR file format's technical document."""
    height, width = rgb.shape[:2]
    half = rgb.astype(np.float16)

    def attribute(name, kind, data):
        return name + b"\0" + kind + b"\0" + struct.pack("<i", len(data)) + data

    channels = b"".join(name + b"\0" + struct.pack("<iBBBBii", 1, 0, 0, 0, 0, 1, 1) for name in (b"B", b"G", b"R"))
    window = struct.pack("<iiii", 0, 0, width - 1, height - 1)
    header = struct.pack("<ii", 20000630, 2)
    header += attribute(b"channels", b"chlist", channels + b"\0")
    header += attribute(b"compression", b"compression", b"\3")
    header += attribute(b"dataWindow", b"box2i", window) + attribute(b"displayWindow", b"box2i", window)
    header += attribute(b"lineOrder", b"lineOrder", b"\0")
    header += attribute(b"pixelAspectRatio", b"float", struct.pack("<f", 1))
    header += attribute(b"screenWindowCenter", b"v2f", struct.pack("<ff", 0, 0))
    header += attribute(b"screenWindowWidth", b"float", struct.pack("<f", 1)) + b"\0"
    blocks = []
    for y in range(0, height, 16):
        lines = half[y : y + 16, :, ::-1]  # B G R
        raw = np.frombuffer(np.ascontiguousarray(lines.transpose(0, 2, 1)).tobytes(), np.uint8)
        split = np.concatenate([raw[0::2], raw[1::2]]).astype(np.int32)
        delta = np.empty_like(split)
        delta[0] = split[0]
        delta[1:] = split[1:] - split[:-1] + 128
        packed = zlib.compress((delta & 255).astype(np.uint8).tobytes(), 9)
        if len(packed) >= len(raw):
            packed = raw.tobytes()
        blocks.append(struct.pack("<ii", y, len(packed)) + packed)
    offset = len(header) + 8 * len(blocks)
    table = b""
    for block in blocks:
        table += struct.pack("<Q", offset)
        offset += len(block)
    with open(path, "wb") as f:
        f.write(header + table + b"".join(blocks))


def numbers(values, digits=5):
    """Numbers of a RIB array, wrapped at a readable width."""
    words = [f"{v:.{digits}g}" for v in np.asarray(values, float).ravel()]
    lines, line = [], ""
    for word in words:
        if len(line) + len(word) > 110:
            lines.append(line)
            line = ""
        line += (" " if line else "") + word
    return "\n    ".join([*lines, line])


# ---- pictures --------------------------------------------------------------------------------------------------------


def periodic_noise(rng, size, period):
    """Smooth noise in [-1, 1] that repeats over the picture, `period` cells a side."""
    lattice = rng.uniform(-1, 1, (period, period))
    x = np.arange(size) / size * period
    i = np.floor(x).astype(int)
    f = x - i
    f = f * f * (3 - 2 * f)
    a, b = i % period, (i + 1) % period
    rows = lattice[a] * (1 - f)[:, None] + lattice[b] * f[:, None]
    return rows[:, a] * (1 - f) + rows[:, b] * f


def terrazzo(size=512):
    """Chips of stone in a pale binder: a Voronoi pattern whose cells are shrunk by a noisy margin."""
    rng = np.random.default_rng(7)
    count = 620
    centre = rng.uniform(0, 1, (count, 2))
    radius = rng.gamma(3.0, 0.0065, count)
    palette = np.array(
        [
            [0.62, 0.55, 0.47],
            [0.30, 0.27, 0.25],
            [0.75, 0.72, 0.66],
            [0.42, 0.22, 0.15],
            [0.22, 0.30, 0.29],
            [0.55, 0.38, 0.20],
            [0.12, 0.12, 0.13],
        ]
    )
    color = palette[rng.choice(len(palette), count, p=[0.25, 0.15, 0.25, 0.12, 0.09, 0.08, 0.06])]
    color = color * rng.uniform(0.8, 1.15, (count, 1))
    grid = (np.arange(size) + 0.5) / size
    warp_x = periodic_noise(rng, size, 32) * 0.006
    warp_y = periodic_noise(rng, size, 32) * 0.006
    x, y = grid[None, :] + warp_x, grid[:, None] + warp_y
    best = np.full((size, size), 9.0)
    second = np.full((size, size), 9.0)
    owner = np.zeros((size, size), int)
    for k in range(count):
        dx = np.abs(x - centre[k, 0])
        dy = np.abs(y - centre[k, 1])
        d = np.hypot(np.minimum(dx, 1 - dx), np.minimum(dy, 1 - dy)) - radius[k]
        closer = d < best
        second = np.where(closer, best, np.minimum(second, d))
        best = np.where(closer, d, best)
        owner = np.where(closer, k, owner)
    chip = np.clip(np.minimum(-best, (second - best) * 0.5 - 0.0012) / 0.0016 + 0.5, 0, 1)
    grain = periodic_noise(rng, size, 128) * 0.05 + periodic_noise(rng, size, 256) * 0.05
    binder = np.array([0.56, 0.53, 0.48])
    picture = binder * (1 - chip[..., None]) + color[owner] * chip[..., None]
    return picture * (1 + grain[..., None])


def sky(width=1024):
    """Early evening, latitude-longitude, pole at the top: a warm horizon, a deep zenith, thin bands of cloud."""
    height = width // 2
    rng = np.random.default_rng(3)
    theta = (np.arange(height) + 0.5) / height * math.pi
    phi = (np.arange(width) + 0.5) / width * 2 * math.pi
    up = np.cos(theta)[:, None]
    side = np.sin(theta)[:, None]
    direction = np.stack([side * np.cos(phi), side * np.sin(phi), up + 0 * phi], -1)
    azimuth, elevation = math.radians(62), math.radians(13)
    sun = np.array(
        [math.cos(elevation) * math.cos(azimuth), math.cos(elevation) * math.sin(azimuth), math.sin(elevation)]
    )
    facing = np.clip(direction @ sun, -1, 1)
    angle = np.degrees(np.arccos(facing))

    zenith = np.array([0.10, 0.20, 0.42])
    middle = np.array([0.34, 0.44, 0.62])
    horizon_cool = np.array([0.62, 0.56, 0.58])
    horizon_warm = np.array([1.35, 0.78, 0.42])
    warmth = (0.5 + 0.5 * facing) ** 2
    horizon = horizon_cool * (1 - warmth[..., None]) + horizon_warm * warmth[..., None]
    h = np.clip(up, 0, 1)[..., None]
    color = zenith + (middle - zenith) * np.exp(-h * 3.2) + (horizon - middle) * np.exp(-h * 9)

    # Clouds: noise on a plane overhead, so that bands run together at the horizon.
    scale = 1 / np.maximum(up, 0.035)
    cx, cy = direction[..., 0] * scale * 0.35, direction[..., 1] * scale * 1.1
    cloud = np.zeros((height, width))
    amplitude = 1.0
    lattice = rng.uniform(-1, 1, (64, 64))
    for octave in range(5):
        x, y = cx * 2**octave, cy * 2**octave
        i, j = np.floor(x).astype(int), np.floor(y).astype(int)
        fx, fy = x - i, y - j
        fx, fy = fx * fx * (3 - 2 * fx), fy * fy * (3 - 2 * fy)

        def at(a, b):
            return lattice[a % 64, b % 64]

        cloud += amplitude * (
            (at(i, j) * (1 - fx) + at(i + 1, j) * fx) * (1 - fy)
            + (at(i, j + 1) * (1 - fx) + at(i + 1, j + 1) * fx) * fy
        )
        amplitude *= 0.55
    cover = np.clip((cloud - 0.15) / 0.9, 0, 1) * np.clip(up / 0.10, 0, 1) * np.exp(-np.clip(up, 0, 1) * 1.6)
    lit = np.array([0.95, 0.66, 0.52]) * (0.45 + 1.3 * warmth[..., None])
    color = color * (1 - 0.75 * cover[..., None]) + lit * 0.75 * cover[..., None]

    glow = 5.0 * np.exp(-((angle / 9) ** 2)) + 1.2 * np.exp(-angle / 16)
    color = color + glow[..., None] * np.array([1.0, 0.62, 0.30])
    sea = 0.35 * horizon + np.array([0.02, 0.03, 0.04])
    below = np.clip(-up / 0.01, 0, 1)[..., None]
    color = color * (1 - below) + sea * below
    return np.maximum(color, 0)


# ---- geometry --------------------------------------------------------------------------------------------------------


def knot(path, segments=72):
    """A trefoil knot of square section with hollow sides, its four ridges creased; the section turns a quarter more
    than once around, so that the four ridges are one."""
    t = np.arange(segments) / segments * 2 * math.pi
    curve = np.stack([np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t), -1.15 * np.sin(3 * t)], -1) / 3
    tangent = np.roll(curve, -1, 0) - np.roll(curve, 1, 0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    # Rotation-minimising frames by projection, then the closing error is spread over the turn.
    normal = np.empty_like(curve)
    n = np.cross(tangent[0], [0, 0, 1.0])
    for i in range(segments):
        n = n - tangent[i] * (n @ tangent[i])
        n /= np.linalg.norm(n)
        normal[i] = n
    last = n - tangent[0] * (n @ tangent[0])
    last /= np.linalg.norm(last)
    binormal = np.cross(tangent, normal)
    error = math.atan2(last @ binormal[0], last @ normal[0])
    ring = [(1.0, 0.0), (0.70, math.pi / 4)] * 4  # corner, hollow side
    points = []
    for i in range(segments):
        twist = (math.pi / 2 * 1 - error) * i / segments
        for k, (radius, offset) in enumerate(ring):
            a = twist + (k // 2) * math.pi / 2 + offset
            points.append(curve[i] + 0.275 * radius * (math.cos(a) * normal[i] + math.sin(a) * binormal[i]))
    sides = len(ring)

    # After one turn corner k meets corner k + 1: the section has turned by a quarter.
    def at(i, k):
        return (i % segments) * sides + (k + (2 if i >= segments else 0)) % sides

    faces = [(at(i, k), at(i, k + 1), at(i + 1, k + 1), at(i + 1, k)) for i in range(segments) for k in range(sides)]
    ridge, k = [], 0
    for _ in range(4):
        ridge += [at(i, k) for i in range(segments)]
        k = (k + 2) % sides
    ridge.append(ridge[0])
    with open(path, "w") as f:
        f.write("# A trefoil knot; tools/make_showcase_assets.py\n")
        f.write('SubdivisionMesh "catmull-clark"\n  [' + numbers([4] * len(faces)) + "]\n  [" + numbers(faces, 9))
        f.write(f']\n  ["crease"] [{len(ridge)} 1]\n  [' + numbers(ridge, 9) + "] [2.5]\n")
        f.write('  "P" [' + numbers(points) + "]\n")


def lathe(path, what, profile):
    """A profile of cubic Bezier pieces, (radius, height), turned about the y axis: one bicubic patch mesh."""
    kappa = 4 / 3 * (math.sqrt(2) - 1)
    c = []
    for quarter in range(4):
        a = quarter * math.pi / 2
        cos, sin = round(math.cos(a)), round(math.sin(a))
        c += [(cos, sin), (cos - kappa * sin, sin + kappa * cos), (kappa * cos - sin, kappa * sin + cos)]
    c.append(c[0])
    points = [(r * x, h, -r * z) for r, h in profile for x, z in c]  # dPdu x dPdv leaves the body
    with open(path, "w") as f:
        f.write(f"# {what}; tools/make_showcase_assets.py\n")
        f.write('Basis "bezier" 3 "bezier" 3\n')
        f.write(f'PatchMesh "bicubic" {len(c)} "nonperiodic" {len(profile)} "nonperiodic"\n')
        f.write('  "P" [' + numbers(points) + "]\n")


def vase(path):
    lathe(
        path,
        "A vase",
        [
            (0.00, 0.00),
            (0.12, 0.00),
            (0.24, 0.00),
            (0.30, 0.015),
            (0.33, 0.03),
            (0.315, 0.06),
            (0.34, 0.14),
            (0.46, 0.48),
            (0.66, 0.66),
            (0.66, 0.98),
            (0.66, 1.30),
            (0.24, 1.34),
            (0.185, 1.62),
            (0.165, 1.74),
            (0.21, 1.82),
            (0.31, 1.88),
            (0.335, 1.895),
            (0.325, 1.925),
            (0.295, 1.915),
            (0.20, 1.88),
            (0.12, 1.76),
            (0.14, 1.60),
        ],
    )


def baluster(path):
    lathe(
        path,
        "A baluster",
        [
            (0.115, 0.00),
            (0.115, 0.03),
            (0.115, 0.05),
            (0.11, 0.06),
            (0.07, 0.07),
            (0.06, 0.09),
            (0.06, 0.11),
            (0.07, 0.16),
            (0.14, 0.20),
            (0.14, 0.30),
            (0.14, 0.42),
            (0.06, 0.50),
            (0.05, 0.62),
            (0.048, 0.65),
            (0.05, 0.67),
            (0.085, 0.675),
            (0.11, 0.68),
            (0.11, 0.70),
            (0.11, 0.73),
        ],
    )


def balustrade(path, count=44, spacing=0.36):
    """Balusters as instances of object 2, posts as instances of object 3."""
    with open(path, "w") as f:
        f.write("# A balustrade along x; tools/make_showcase_assets.py\n")
        for i in range(count):
            x = (i - (count - 1) / 2) * spacing
            thing = 3 if i % 11 == 5 else 2
            f.write(f"TransformBegin Translate {x:.4g} 0 0 ObjectInstance {thing} TransformEnd\n")


def gem(path, sides=8):
    """A brilliant of two tiers, its tip in the origin, its table up; the girdle has radius 1."""
    girdle, table, crown, pavilion, edge = 1.0, 0.56, 0.36, 0.86, 0.04
    middle_height = 0.55 * crown
    t = (crown - middle_height) / (crown - edge)  # where the kites' fold lies, so that they are flat
    middle = (table + (girdle - table) * t) / math.cos(math.pi / sides)

    def ring(r, y, shift):
        return [
            (r * math.cos(2 * math.pi * (k + shift) / sides), y, r * math.sin(2 * math.pi * (k + shift) / sides))
            for k in range(sides)
        ]

    points = (
        ring(table, crown, 0.5) + ring(middle, middle_height, 0) + ring(girdle, edge, 0.5) + ring(girdle, -edge, 0.5)
    )
    points = np.array([*points, (0, -pavilion, 0)])
    a, b, g, h, tip = 0, sides, 2 * sides, 3 * sides, 4 * sides
    faces = [[a + k for k in range(sides)]]
    for k in range(sides):
        before, after = (k - 1) % sides, (k + 1) % sides
        faces += [[a + before, a + k, b + k], [a + k, b + k, g + k, b + after], [g + before, b + k, g + k]]
        faces += [[g + before, g + k, h + k, h + before], [h + before, h + k, tip]]
    # Outwards: every facet is turned so that its normal leaves the centre.
    inside = np.array([0, -0.1, 0])
    turned = []
    for face in faces:
        p = points[face]
        n = np.cross(p[1] - p[0], p[2] - p[0])
        turned.append(face if n @ (p.mean(0) - inside) > 0 else face[::-1])
    points[:, 1] += pavilion
    with open(path, "w") as f:
        f.write("# A cut stone; tools/make_showcase_assets.py\n")
        f.write("PointsPolygons [" + numbers([len(t) for t in turned]) + "]\n  [")
        f.write(numbers([i for t in turned for i in t], 9) + ']\n  "P" [' + numbers(points) + "]\n")


def main():
    (SCENES / "textures").mkdir(parents=True, exist_ok=True)
    (SCENES / "geometry").mkdir(parents=True, exist_ok=True)
    write_png(SCENES / "textures" / "terrazzo.png", terrazzo())
    write_exr(SCENES / "textures" / "evening.exr", sky())
    knot(SCENES / "geometry" / "knot.rib")
    vase(SCENES / "geometry" / "vase.rib")
    baluster(SCENES / "geometry" / "baluster.rib")
    balustrade(SCENES / "geometry" / "balustrade.rib")
    gem(SCENES / "geometry" / "gem.rib")


if __name__ == "__main__":
    main()
