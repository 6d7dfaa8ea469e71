"""A camera backs off from bumped, textured surfaces, past where their faces are as small as micropolygons and they are
traced as meshes: looks do not depend on how a surface was diced. The reference is the same scene diced finely and
averaged over many samples."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka

SHADER = """
surface looks(string map = "";) {
    point q = transform("object", P);
    normal n = normalize(calculatenormal(P + 0.03 * noise(12 * q) * normalize(N)));
    float light = 0.5 + 0.5 * (n . normalize(vector(0.6, 0.5, -0.7)));
    // A pattern that fades where a step between vertices is as wide as it is; its mean is 0.5.
    float x = 60 * xcomp(q);
    float fade = 1 - smoothstep(0.2, 0.6, filterwidth(x));
    Ci = color(light, float texture(map, s, t), 0.5 + 0.5 * fade * sin(2 * PI * x));
}
"""
# u and v of faces, how they change, and the area of a micropolygon by both of its definitions.
FACES = """
surface faces() {
    vector a = Du(P) * filterwidth(u), b = dPdu * filterwidth(u);
    Ci = color(u, v, 0.5 * length(a) / max(length(b), 1e-9));
}
"""
# A bump by a displacement shader that moves nothing.
BUMPED = """
displacement bumped() {
    N = calculatenormal(P + 0.03 * noise(12 * transform("object", P)) * normalize(N));
}
"""
SHADED = """
surface shaded() {
    Ci = color(0.5 + 0.5 * (normalize(N) . normalize(vector(0.6, 0.5, -0.7))));
}
"""
SIZE = 48
N = 64


def text(values) -> str:
    return "[" + " ".join(f"{x:g}" for x in np.ravel(values)) + "]"


def height(x, y):
    return 0.3 * np.sin(2 * x) * np.cos(2 * y)


def geometry(kind: str) -> str:
    if kind in ("nurbs", "patches"):
        n = 40
        i = np.linspace(-1, 1, n)
        x, y = np.meshgrid(i, i)
        points = text(np.stack([x, y, height(x, y)], -1))
        if kind == "patches":
            return f'PatchMesh "bilinear" {n} "nonperiodic" {n} "nonperiodic" "P" {points}\n'
        knots = text([0, 0, 0, *range(n - 2), n - 3, n - 3, n - 3])
        return f'NuPatch {n} 4 {knots} 0 {n - 3} {n} 4 {knots} 0 {n - 3} "P" {points}\n'
    i = np.linspace(-1, 1, N + 1)
    x, y = np.meshgrid(i, i)
    points = text(np.stack([x, y, height(x, y)], -1))
    st = text(np.stack([x, y], -1) * 0.5 + 0.5)
    a = (np.arange(N)[:, None] * (N + 1) + np.arange(N)).ravel()
    if kind == "triangles":
        corners = np.stack([a, a + N + 1, a + N + 2, a, a + N + 2, a + 1], -1)
        sizes = np.full(2 * N * N, 3)
    else:
        corners = np.stack([a, a + N + 1, a + N + 2, a + 1], -1)
        sizes = np.full(N * N, 4)
    head, tail = "PointsPolygons", ""
    if kind == "subdivision":
        head, tail = 'SubdivisionMesh "catmull-clark"', ' ["interpolateboundary"] [0 0] [] []'
    data = f'"P" {points} "vertex float[2] st" {st}'
    if kind == "smooth":
        e = 1e-4
        normals = np.stack(
            [
                (height(x + e, y) - height(x - e, y)) / (2 * e),
                (height(x, y + e) - height(x, y - e)) / (2 * e),
                -np.ones_like(x),
            ],
            -1,
        )
        data += f' "vertex normal N" {text(normals)}'
    return f"{head} {text(sizes)} {text(corners)}{tail} {data}\n"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The shader, and a picture of black and white texels without any order: its mean is 0.5."""
    path = tmp_path_factory.mktemp("looks")
    for name, source in {"looks": SHADER, "faces": FACES, "bumped": BUMPED, "shaded": SHADED}.items():
        (path / f"{name}.sl").write_text(source)
    texels = (np.random.default_rng(1).random((1024, 1024)) > 0.5).astype(np.uint8) * 255
    (path / "noise.pgm").write_bytes(b"P5\n1024 1024\n255\n" + texels.tobytes())
    kanuka.make_texture([str(path / "noise.pgm")], str(path / "noise.tx"))
    return path


def render(
    folder: Path,
    kind: str,
    distance: float,
    rate: float,
    samples: int,
    shaders: str = 'Surface "looks" "string map" "noise.tx"',
    instances: bool = False,
):
    shape = f"{shaders}\n{geometry(kind)}"
    if instances:
        shape = f"ObjectBegin 1\n{shape}ObjectEnd\nObjectInstance 1\n"
    (folder / "scene.rib").write_text(f"""
Option "searchpath" "shader" "{folder}:@" "texture" "{folder}"
Format {SIZE} {SIZE} 1
Projection "perspective" "fov" 30
ShadingRate {rate}
PixelFilter "box" 1 1
WorldBegin
Translate 0 0 {distance}
Rotate 25 1 0 0
ReverseOrientation
{shape}
WorldEnd
""")
    return kanuka.render(kanuka.load(folder / "scene.rib"), progressions=samples)


def deviation(folder: Path, kind: str, distance: float, **keywords) -> np.ndarray:
    """Of each channel: root of the mean square, and the mean."""
    seen = render(folder, kind, distance, 1, 16, **keywords)
    reference = render(folder, kind, distance, 0.03, 144, **keywords)
    whole = (seen["alpha"] > 0.999) & (reference["alpha"] > 0.999)
    assert whole.sum() > 50
    error = (seen["rgb"] - reference["rgb"])[whole].astype(np.float64)
    result = np.stack([np.sqrt((error**2).mean(0)), error.mean(0)])
    print(kind, distance, "rms", result[0].round(4), "mean", result[1].round(4))
    return result


DISTANCES = (3.2, 4.5, 6.5, 9)  # from some micropolygons a face to some faces a micropolygon


@pytest.mark.parametrize("kind", ["quads", "triangles", "smooth", "subdivision", "nurbs", "patches"])
def test_looks_do_not_jump(folder: Path, kind: str) -> None:
    """Bump, texture, pattern that fades by filterwidth()."""
    for distance in DISTANCES:
        rms, mean = deviation(folder, kind, distance)
        assert (rms < [0.03, 0.04, 0.03]).all(), distance
        assert (np.abs(mean) < 0.01).all(), distance


def test_instances_look_the_same(folder: Path) -> None:
    rms, mean = deviation(folder, "quads", 6.5, instances=True)
    assert (rms < [0.03, 0.04, 0.03]).all()
    assert (np.abs(mean) < 0.01).all()


@pytest.mark.parametrize("kind", ["quads", "subdivision", "nurbs"])
def test_parameters_do_not_jump(folder: Path, kind: str) -> None:
    """u and v run once over each face: where a pixel holds some of them, 16 stratified samples leave some 0.04."""
    for distance in DISTANCES:
        rms, mean = deviation(folder, kind, distance, shaders='Surface "faces"')
        assert (rms < [0.05, 0.05, 0.03]).all(), distance
        assert (np.abs(mean) < 0.01).all(), distance


@pytest.mark.parametrize("kind", ["quads", "smooth", "subdivision"])
def test_bumps_by_displacement_do_not_fade(folder: Path, kind: str) -> None:
    for distance in DISTANCES:
        rms, mean = deviation(folder, kind, distance, shaders='Displacement "bumped" Surface "shaded"')
        assert rms[0] < 0.03, distance
        assert np.abs(mean[0]) < 0.01, distance


def test_far_textures_need_no_fine_levels(folder: Path) -> None:
    """A picture of 1024 x 1024 halfs or floats on 24 pixels: coarse levels do."""
    near = render(folder, "quads", 2, 0.05, 1).stats["bytes"]["textures"]
    far = render(folder, "quads", 9, 1, 1).stats["bytes"]["textures"]
    print("textures", near, far)
    assert far < near / 4
