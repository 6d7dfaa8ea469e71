"""The scenes of the comparison, as data that every renderer's worker turns into its own terms. NumPy alone.

World: y up, right-handed. Depth counts surface scattering events, the one whose direct light is sampled included.
Seeds are fixed and every number is drawn in float64, so that all renderers, on all machines, get the same geometry;
large meshes are kept as PLY files in the cache folder.
"""

from __future__ import annotations

import hashlib
import inspect
import os
from collections.abc import Callable
from dataclasses import dataclass, field, fields, is_dataclass, replace
from pathlib import Path

import numpy as np

DEPTH = 7
UNBOUNDED = 64  # a depth that cuts nothing off
Color = tuple[float, float, float]


@dataclass(frozen=True)
class Camera:
    origin: Color
    target: Color
    fov: float  # degrees across the picture's width
    up: Color = (0, 1, 0)


@dataclass(frozen=True)
class Medium:
    """Grey, alike everywhere; 1/m, and Henyey and Greenstein's mean cosine."""

    absorption: float
    scattering: float
    mean_cosine: float = 0


@dataclass(frozen=True)
class Finish:
    """What a surface is made of, where it is not matte; a mesh's colour is that of what lies below a coat."""

    # metal, glass, coated; gloss: an interface's reflection and nothing else; thin: a sheet of glass; none: the
    # medium inside, and no surface.
    kind: str
    alpha: float = 0  # width of microfacets; 0 = smooth
    slopes: str = "ggx"  # or beckmann
    medium: Medium | None = None  # what is inside
    ior: float = 1.5
    abbe: float = 0  # 0 = no dispersion
    metal: str = "Au"  # by its measured index, where the renderer is spectral
    metal_color: Color = (1.0, 0.78, 0.34)  # where it is not


@dataclass(frozen=True)
class Mesh:
    """Polygons with one colour. `faces` is (M, 3) or (M, 4), or the mesh is the PLY file `path`."""

    name: str
    color: Color
    points: np.ndarray | None = None
    faces: np.ndarray | None = None
    path: Path | None = None
    radiance: Color | None = None  # shines on the side its faces run around counter-clockwise
    chain: int = 0  # links of the noise chain that colours it; 0 = `color` alone
    finish: Finish | None = None

    def arrays(self) -> tuple[np.ndarray, np.ndarray]:
        return read_ply(self.path) if self.path else (self.points, self.faces)

    def triangles(self) -> tuple[np.ndarray, np.ndarray]:
        points, faces = self.arrays()
        if faces.shape[1] == 4:
            faces = faces[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
        return points, faces


@dataclass(frozen=True)
class Copies:
    mesh: Mesh
    transforms: np.ndarray  # (N, 4, 4) float32, acting on columns


@dataclass(frozen=True)
class Panel:
    """A rectangle that shines along `direction` as an EXR picture has it: upright as seen from where it shines to."""

    center: Color
    direction: Color
    size: tuple[float, float]
    picture: Path

    def axes(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The picture's right, its up, and where it shines to: right × up."""
        forward = np.array(self.direction, float) / np.linalg.norm(self.direction)
        right = np.cross((0, 1, 0), forward)
        right /= np.linalg.norm(right)
        return right, np.cross(forward, right), forward


@dataclass(frozen=True)
class Scene:
    name: str
    resolution: tuple[int, int]
    samples: int
    camera: Camera
    meshes: list[Mesh] = field(default_factory=list)
    copies: list[Copies] = field(default_factory=list)
    sky: float = 0  # radiance of a constant surrounding
    environment: Path | None = None  # EXR, latitude and longitude: rows from +y down, columns from -z over +x
    panel: Panel | None = None
    band: tuple[float, float] | None = None  # light is cut to these wavelengths, nm; for spectral renderers
    depth: int = DEPTH
    stage: Path | None = None  # USD: in place of all that, but for resolution, samples and depth


# ---- shapes ---------------------------------------------------------------------------------------------------------


def quad(center: Color, x: Color, y: Color) -> tuple[np.ndarray, np.ndarray]:
    """The parallelogram center ± x ± y, facing x × y."""
    c, x, y = (np.asarray(v, float) for v in (center, x, y))
    return np.array([c - x - y, c + x - y, c + x + y, c - x + y], np.float32), np.array([[0, 1, 2, 3]], np.int32)


def box(matrix: list[list[float]], center: Color) -> tuple[np.ndarray, np.ndarray]:
    """The cube [-1, 1]³ under `matrix`, moved to `center`; 24 points, faces outwards."""
    points, faces = [], []
    for axis in range(3):
        for sign in (1.0, -1.0):
            normal, a, b = np.zeros(3), np.zeros(3), np.zeros(3)
            normal[axis], a[(axis + 1) % 3], b[(axis + 2) % 3] = sign, sign, 1
            side, face = quad(normal, a, b)
            faces.append(face + 4 * len(points))
            points.append(side.astype(float) @ np.asarray(matrix).T + center)
    return np.concatenate(points).astype(np.float32), np.concatenate(faces)


def ball(center: Color, around: int = 128, down: int = 64) -> tuple[np.ndarray, np.ndarray]:
    """A unit sphere of flat triangles."""
    v, u = np.linspace(0, np.pi, down + 1)[:, None], np.arange(around) / around * 2 * np.pi
    points = np.stack([np.sin(v) * np.cos(u), np.cos(v) + 0 * u, np.sin(v) * np.sin(u)], -1).reshape(-1, 3) + center
    row, column = (i.ravel() for i in np.indices((down, around)))
    a, b = row * around + column, row * around + (column + 1) % around
    upper, lower = row > 0, row < down - 1  # at the poles one of the two triangles is no more than a line
    triangles = [np.stack([a, b, b + around], -1)[upper], np.stack([a, b + around, a + around], -1)[lower]]
    return points.astype(np.float32), np.concatenate(triangles).astype(np.int32)


def height_field(n: int) -> tuple[np.ndarray, np.ndarray]:
    """n × n points over [-1, 1]²; noise of power ~ frequency^-3.8 in both directions, 0.35 high at most."""
    rng = np.random.default_rng(7)
    squared = np.fft.fftfreq(n)[:, None] ** 2 + np.fft.rfftfreq(n)[None] ** 2
    squared[0, 0] = 1
    amplitude = squared**-0.95
    amplitude[0, 0] = 0
    height = np.fft.irfft2(amplitude * np.exp(2j * np.pi * rng.random(squared.shape)), s=(n, n))
    height *= 0.35 / np.abs(height).max()
    x, z = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n), indexing="ij")
    points = np.stack([x, height, z], -1).reshape(-1, 3).astype(np.float32)
    index = np.arange(n * n, dtype=np.int32).reshape(n, n)
    a, b, c, d = index[:-1, :-1].ravel(), index[1:, :-1].ravel(), index[1:, 1:].ravel(), index[:-1, 1:].ravel()
    return points, np.stack([a, d, c, a, c, b], -1).reshape(-1, 3)


def tree(leaves: int = 9900) -> tuple[np.ndarray, np.ndarray]:
    """A tapered trunk under a crown of leaves, quads of some centimetres: 19 992 triangles, about two units tall."""
    rng = np.random.default_rng(11)
    sides, rings = 12, 9
    angle, level = np.arange(sides) / sides * 2 * np.pi, np.arange(rings)[:, None] / (rings - 1)
    radius = 0.07 * (1 - 0.7 * level)
    trunk = np.stack([radius * np.cos(angle), 1.4 * level + 0 * angle, radius * np.sin(angle)], -1).reshape(-1, 3)
    ring, side = (i.ravel() for i in np.indices((rings - 1, sides)))
    a, b = ring * sides + side, ring * sides + (side + 1) % sides
    bark = np.stack([a, a + sides, b + sides, a, b + sides, b], -1).reshape(-1, 3)

    def unit(v: np.ndarray) -> np.ndarray:
        return v / np.linalg.norm(v, axis=1, keepdims=True)

    direction = unit(rng.normal(size=(leaves, 3)))
    distance = rng.random(leaves)[:, None] ** (1 / 2.2)
    center = direction * distance * (0.55, 0.8, 0.55) + (0, 1.25, 0)
    normal = unit(direction + 0.9 * rng.normal(size=(leaves, 3)))
    tangent = unit(np.cross(normal, rng.normal(size=(leaves, 3))))
    size = (0.02 + 0.02 * rng.random(leaves))[:, None]
    along, across = tangent * size, np.cross(normal, tangent) * size * 0.6
    corners = [center - along - across, center + along - across, center + along + across, center - along + across]
    crown = np.stack(corners, 1).reshape(-1, 3)
    first = len(trunk) + 4 * np.arange(leaves)[:, None]
    blades = (first + np.array([0, 1, 2, 0, 2, 3])).reshape(-1, 3)
    return np.concatenate([trunk, crown]).astype(np.float32), np.concatenate([bark, blades]).astype(np.int32)


def placements(n: int) -> tuple[np.ndarray, float]:
    """n trees on a jittered square lattice one unit apart: their matrices, and the side of the square."""
    rng = np.random.default_rng(5)
    side = int(np.ceil(np.sqrt(n)))
    i = np.arange(n)
    x, z = i % side + 0.5 - side / 2, i // side + 0.5 - side / 2
    x, z = x + 0.9 * (rng.random(n) - 0.5), z + 0.9 * (rng.random(n) - 0.5)
    angle, scale = 2 * np.pi * rng.random(n), 0.6 + 0.8 * rng.random(n)
    m = np.zeros((n, 4, 4), np.float32)
    m[:, 0, 0] = m[:, 2, 2] = np.cos(angle) * scale
    m[:, 0, 2] = np.sin(angle) * scale
    m[:, 2, 0] = -m[:, 0, 2]
    m[:, 1, 1], m[:, 3, 3] = scale, 1
    m[:, 0, 3], m[:, 2, 3] = x, z
    return m, float(side)


# ---- PLY ------------------------------------------------------------------------------------------------------------


def cache_folder() -> Path:
    usual = Path(__file__).resolve().parent.parent / "build" / "bench"
    folder = Path(os.environ.get("KANUKA_BENCH_CACHE") or usual).absolute()
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def metal_file(metal: str) -> Path:
    """Wavelengths, n and k, a row each; Kanuka's worker writes it, so that others may take the same."""
    return cache_folder() / f"{metal}.txt"


def write_ply(path: Path, mesh: tuple[np.ndarray, np.ndarray]) -> None:
    points, faces = mesh
    header = f"""ply
format binary_little_endian 1.0
element vertex {len(points)}
property float x
property float y
property float z
element face {len(faces)}
property list uchar int vertex_indices
end_header
"""
    records = np.empty(len(faces), [("count", "u1"), ("corners", "<i4", 3)])
    records["count"], records["corners"] = 3, faces
    temporary = path.with_suffix(f".{os.getpid()}")
    with temporary.open("wb") as file:
        file.write(header.encode())
        points.astype("<f4").tofile(file)
        records.tofile(file)
    os.replace(temporary, path)


def read_ply(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """A file that write_ply made."""
    with path.open("rb") as file:
        sizes = {}
        for line in iter(file.readline, b"end_header\n"):
            words = line.decode().split()
            if words[0] == "element":
                sizes[words[1]] = int(words[2])
        points = np.fromfile(file, "<f4", 3 * sizes["vertex"]).reshape(-1, 3)
        records = np.fromfile(file, [("count", "u1"), ("corners", "<i4", 3)], sizes["face"])
    return points, np.ascontiguousarray(records["corners"])


def digest(*parts: object) -> str:
    """Of texts, numbers and arrays."""
    whole = hashlib.sha256()
    for part in parts:
        whole.update(part.tobytes() if isinstance(part, np.ndarray) else repr(part).encode())
        whole.update(b"\0")
    return whole.hexdigest()[:12]


def kept(name: str, ending: str, make: Callable, write: Callable, *given: object) -> Path:
    """The file of what `make` makes of what it is given, named after the source of both: so none is of yesterday."""
    path = cache_folder() / f"{name}-{digest(inspect.getsource(make), inspect.getsource(write), *given)}{ending}"
    if not path.exists():
        write(path, make(*given))
    return path


def content(scene: Scene) -> str:
    """A digest of all that makes the picture; of files, what is in them."""

    def told(value: object) -> str:
        if isinstance(value, Path):
            return hashlib.sha256(value.read_bytes()).hexdigest()
        if isinstance(value, np.ndarray):
            return digest(value)
        if is_dataclass(value):
            return digest(*(f"{f.name} {told(getattr(value, f.name))}" for f in fields(value)))
        return digest(*map(told, value)) if isinstance(value, list | tuple) else repr(value)

    return told(scene)


# ---- scenes ---------------------------------------------------------------------------------------------------------

WHITE, GREEN = (0.885809, 0.698859, 0.666422), (0.105421, 0.37798, 0.076425)
RED, LAMP = (0.570068, 0.0430135, 0.0443706), (18.387, 13.9873, 6.75357)


def cornell(_n: int) -> Scene:
    """Cornell University's box in the measures and colours of Mitsuba's `cornell_box()`: flat, indirect, one lamp."""
    small = [[0.286891, 0, -0.0877115], [0, 0.3, 0], [0.0877115, 0, 0.286891]]
    large = [[0.28491, 0, 0.0939491], [0, 0.61, 0], [-0.0939491, 0, 0.28491]]
    meshes = [
        Mesh("lamp", WHITE, *quad((0, 0.99, 0.01), (0.23, 0, 0), (0, 0, 0.19)), radiance=LAMP),
        Mesh("floor", WHITE, *quad((0, -1, 0), (1, 0, 0), (0, 0, -1))),
        Mesh("ceiling", WHITE, *quad((0, 1, 0), (1, 0, 0), (0, 0, 1))),
        Mesh("back", WHITE, *quad((0, 0, -1), (1, 0, 0), (0, 1, 0))),
        Mesh("right", GREEN, *quad((1, 0, 0), (0, 0, 1), (0, 1, 0))),
        Mesh("left", RED, *quad((-1, 0, 0), (0, 0, -1), (0, 1, 0))),
        Mesh("small", WHITE, *box(small, (0.335, -0.7, 0.38))),
        Mesh("large", WHITE, *box(large, (-0.33, -0.4, -0.28))),
    ]
    return Scene("cornell", (512, 512), 64, Camera((0, 0, 3.9), (0, 0, 0), 39.3077), meshes)


def grey_cornell(n: int) -> Scene:
    """The box with walls and lamp of one grey: no spectrum of it depends on how colours become spectra."""
    made = cornell(n)
    grey = [replace(m, color=(0.6,) * 3, radiance=(15.0,) * 3 if m.radiance else m.radiance) for m in made.meshes]
    return replace(made, name="grey-cornell", meshes=grey)


def terrain(n: int) -> Scene:
    """A height field of 2 (n - 1)² flat triangles under a white sky: loading, building, rays that share nothing."""
    ground = Mesh("ground", (0.5, 0.5, 0.5), path=kept("terrain", ".ply", height_field, write_ply, n))
    return Scene("terrain", (640, 360), 32, Camera((1.6, 0.95, 1.6), (0, -0.1, 0), 45), [ground], sky=1)


def forest(n: int) -> Scene:
    """n copies of a tree under a white sky."""
    matrices, side = placements(n)
    one = Mesh("tree", (0.25, 0.45, 0.15), path=kept("tree", ".ply", tree, write_ply))
    soil = Mesh("soil", (0.35, 0.28, 0.2), *quad((0, 0, 0), (side, 0, 0), (0, 0, -side)))
    camera = Camera((0, 14, side / 2 + 12), (0, 0, side / 2 - 40), 60)
    return Scene("forest", (640, 360), 16, camera, [soil], [Copies(one, matrices)], sky=1)


def shading(n: int) -> Scene:
    """A ball on a plane, coloured by a chain of n links, each four octaves of noise that mix in another colour."""
    meshes = [
        Mesh("plane", (1, 1, 1), *quad((0, 0, 0), (20, 0, 0), (0, 0, -20)), chain=n),
        Mesh("ball", (1, 1, 1), *ball((0, 1, 0)), chain=n),
    ]
    return Scene("shading", (512, 512), 16, Camera((0, 3.2, 4.2), (0, 0.55, 0), 42), meshes, sky=1)


@dataclass(frozen=True)
class Link:
    frequency: float
    color: Color


def chain(n: int) -> tuple[Color, list[Link]]:
    """The links of `shading`: the first colour, then for each link the noise's frequency and the colour it mixes in."""
    rng = np.random.default_rng(3)
    first = tuple(0.8 * rng.random(3))
    return first, [Link(4 / (5 * rng.random(3) + 1).mean(), tuple(0.8 * rng.random(3))) for _ in range(n)]


def make_all() -> dict[str, tuple[Callable[[int], Scene], int]]:
    import still_life  # which takes its shapes from here
    import usd_scenes
    import validation

    return MAKERS | still_life.MAKERS | validation.MAKERS | usd_scenes.MAKERS


MAKERS: dict[str, tuple[Callable[[int], Scene], int]] = {  # with the usual n
    "cornell": (cornell, 0),
    "grey-cornell": (grey_cornell, 0),
    "terrain": (terrain, 1415),
    "forest": (forest, 100_000),
    "forest-million": (forest, 1_000_000),
    "shading": (shading, 16),
}


def make(name: str, n: int = 0, scale: float = 1) -> Scene:
    """A scene by name; `scale` multiplies the sides of the picture."""
    maker, usual = make_all()[name]
    scene = maker(n or usual)
    width, height = scene.resolution
    return replace(scene, resolution=(max(1, round(width * scale)), max(1, round(height * scale))))
