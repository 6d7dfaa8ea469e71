"""Shapes of kanuka.Scene against the same shapes in RIB, which other tests compare with closed forms: the same bits."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import kanuka


def pixels(scene: kanuka.Scene) -> np.ndarray:
    scene.resolution = 64, 64
    scene.add_light("distant", amount=3, direction=(0.3, -0.4, -1))
    picture = kanuka.render(scene, progressions=4, threads=1, aovs=["N", "id"])
    return np.concatenate([picture["rgb"], picture["N"]], -1)


def of_python(add: Callable[[kanuka.Scene | kanuka.Group], object], in_group: bool = False) -> np.ndarray:
    scene = kanuka.Scene()
    if in_group:
        group = scene.add_group("g")
        add(group)
        scene.add_instances(group, np.eye(4)[None])
    else:
        add(scene)
    scene.camera = kanuka.Camera((0, 0, 5), (0, 0, 0), fov=40)
    return pixels(scene)


def of_rib(tmp_path, body: str) -> np.ndarray:
    """RIB's camera looks along +z: at the same place, the same way round."""
    path = tmp_path / "a.rib"
    path.write_text(f'WorldBegin Surface "plastic"\n{body}\nWorldEnd\n')
    scene = kanuka.load(path)
    scene.camera = kanuka.Camera((0, 0, 5), (0, 0, 0), fov=40)
    return pixels(scene)


def texts(values: object) -> str:
    return " ".join(f"{x:.9g}" for x in np.asarray(values, np.float32).reshape(-1))


rng = np.random.default_rng(5)
x, y = np.meshgrid(np.linspace(-1, 1, 7), np.linspace(-1, 1, 4))
BUMPS = np.stack([x, y, rng.uniform(-0.4, 0.4, x.shape)], -1).astype(np.float32)
KNOTS_7 = np.array([0, 0, 0, 0, 1, 2, 3, 4, 4, 4, 4], np.float32)
KNOTS_4 = np.array([0, 0, 0, 0, 1, 1, 1, 1], np.float32)
WEIGHTED = np.concatenate([BUMPS * (w := 1 + rng.uniform(size=(4, 7, 1)).astype(np.float32)), w], -1)
RING = [(2, 0.5), (3, 0.5), (3, 0.9), (1, 0.9), (2, 0.5)]
RING_KNOTS = [0, 0, 0.25, 0.5, 0.75, 1, 1]
BLOBS_CODE = [1001, 0, 1001, 16, 0, 2, 0, 1]
BLOBS = [
    *np.diag([0.9, 0.9, 0.9, 1]).reshape(-1),
    *np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0.6, 0.3, 0, 1]]).reshape(-1),
]
CLOUD = rng.uniform(0, 6, (3, 4, 5)).astype(np.float32)

SAME: dict[str, tuple[Callable, str]] = {
    "patches": (
        lambda s: s.add_patches(BUMPS, material="plastic"),
        f'PatchMesh "bicubic" 7 "nonperiodic" 4 "nonperiodic" "P" [{texts(BUMPS)}]',
    ),
    "patches of two bases": (
        lambda s: s.add_patches(BUMPS, basis=("catmull-rom", "b-spline"), material="plastic"),
        f'Basis "catmull-rom" 1 "b-spline" 1 PatchMesh "bicubic" 7 "nonperiodic" 4 "nonperiodic" "P" [{texts(BUMPS)}]',
    ),
    "bilinear patches": (
        lambda s: s.add_patches(BUMPS, basis="bilinear", material="plastic"),
        f'PatchMesh "bilinear" 7 "nonperiodic" 4 "nonperiodic" "P" [{texts(BUMPS)}]',
    ),
    "nurbs": (
        lambda s: s.add_nurbs(BUMPS, KNOTS_7, KNOTS_4, material="plastic"),
        f'NuPatch 7 4 [{texts(KNOTS_7)}] 0 4 4 4 [{texts(KNOTS_4)}] 0 1 "P" [{texts(BUMPS)}]',
    ),
    "rational nurbs in part": (
        lambda s: s.add_nurbs(WEIGHTED, KNOTS_7, KNOTS_4, u_range=(0.5, 3), v_range=(0, 0.75), material="plastic"),
        f'NuPatch 7 4 [{texts(KNOTS_7)}] 0.5 3 4 4 [{texts(KNOTS_4)}] 0 0.75 "Pw" [{texts(WEIGHTED)}]',
    ),
    "trimmed nurbs": (
        lambda s: s.add_nurbs(BUMPS, KNOTS_7, KNOTS_4, trim=[[(RING, RING_KNOTS)]], material="plastic"),
        f"TrimCurve [1] [2] [{texts(RING_KNOTS)}] [0] [1] [5] [2 3 3 1 2] [.5 .5 .9 .9 .5] [1 1 1 1 1] "
        f'NuPatch 7 4 [{texts(KNOTS_7)}] 0 4 4 4 [{texts(KNOTS_4)}] 0 1 "P" [{texts(BUMPS)}]',
    ),
    "part of a sphere": (
        lambda s: s.add_sphere(1, -0.3, 0.7, 200, material="plastic"),
        "Sphere 1 -0.3 0.7 200",
    ),
    "part of a torus": (
        lambda s: s.add_torus(0.8, 0.3, 270, 20, 200, material="plastic"),
        "Torus 0.8 0.3 20 200 270",
    ),
    "paraboloid": (
        lambda s: s.add_paraboloid(1, 0.2, 1.5, 300, material="plastic"),
        "Paraboloid 1 0.2 1.5 300",
    ),
    "hyperboloid": (
        lambda s: s.add_hyperboloid((1, 0, -1), (0.2, 0.8, 1), 250, material="plastic"),
        "Hyperboloid 1 0 -1 0.2 0.8 1 250",
    ),
    "blobby": (
        lambda s: s.add_blobby(2, BLOBS_CODE, BLOBS, material="plastic"),
        f'Blobby 2 [{" ".join(map(str, BLOBS_CODE))}] [{texts(BLOBS)}] [""]',
    ),
    "volume": (
        lambda s: s.add_volume(CLOUD, shape="ellipsoid", material="cloud"),
        f'Surface "cloud" Volume "ellipsoid" [-1 1 -1 1 -1 1] [5 4 3] "vertex float density" [{texts(CLOUD)}]',
    ),
    "even volume": (
        lambda s: s.add_volume(3, bound=(-1, 0.5, -1, 1, -1, 1), material="cloud"),
        'Surface "cloud" Volume "box" [-1 .5 -1 1 -1 1] [0 0 0] "constant float density" [3]',
    ),
}


@pytest.mark.parametrize("name", SAME)
def test_shapes_are_those_of_rib(name: str, tmp_path) -> None:
    add, rib = SAME[name]
    seen = of_python(add)
    assert (seen[..., 0] > 0).sum() > 100  # something is in the picture
    assert np.array_equal(seen, of_rib(tmp_path, rib))


@pytest.mark.parametrize("in_group", [False, True])
def test_solids_are_cut_as_in_rib(in_group: bool, tmp_path) -> None:
    def add(place) -> None:
        cut = place.add_solid("difference")
        assert cut.kind == "difference"
        place.add_sphere(1, material="plastic", solid=cut)  # a primitive of its own
        both = cut.add("union")
        place.add_sphere(
            0.6,
            transform=np.array([[1, 0, 0, 0.5], [0, 1, 0, 0], [0, 0, 1, 0.75], [0, 0, 0, 1]]),
            solid=both,
            material="matte",
        )
        tube = both.add("primitive")
        place.add_cylinder(0.3, -2, 2, solid=tube, material="matte")
        place.add_disk(0.3, 2, solid=tube, material="matte")
        place.add_disk(0.3, -2, solid=tube, material="matte")

    rib = """SolidBegin "difference"
        SolidBegin "primitive" Sphere 1 -1 1 360 SolidEnd
        SolidBegin "union" Surface "matte"
        SolidBegin "primitive" Translate .5 0 .75 Sphere .6 -.6 .6 360 SolidEnd
        SolidBegin "primitive" Cylinder .3 -2 2 360 Disk 2 .3 360 Disk -2 .3 360 SolidEnd
        SolidEnd SolidEnd"""
    if in_group:
        rib = f"ObjectBegin 1 {rib} ObjectEnd ObjectInstance 1"
    seen = of_python(add, in_group)
    whole = of_python(lambda s: s.add_sphere(1, material="plastic"))
    assert np.abs(seen - whole).max() > 0.1
    np.testing.assert_array_equal(seen, of_rib(tmp_path, rib))


def test_patches_move() -> None:
    """A flat lattice that moves by its own width while the shutter is open covers half of where it was on average."""
    flat = np.stack([x, y, 0 * x], -1).astype(np.float32)

    def covered(points, **more) -> float:
        scene = kanuka.Scene()
        scene.resolution = 64, 64
        scene.options.shutter = (0, 1)
        scene.camera = kanuka.Camera((0, 0, 5), (0, 0, 0), fov=60)
        scene.add_patches(points, basis="bilinear", **more)
        picture = kanuka.render(scene, progressions=16, threads=1, integrator="facing")
        return float(picture["alpha"].sum())

    moved = np.stack([flat, flat + np.float32([2, 0, 0])])
    column = covered(flat)
    assert covered(moved) == pytest.approx(column, rel=0.03)  # as much in all, over twice as wide


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda s: s.add_patches(BUMPS[:, :6]), "nu = 6"),
        (lambda s: s.add_patches(BUMPS[0]), "points: expected shape"),
        (lambda s: s.add_patches(BUMPS, basis="cubic"), "basis: "),
        (lambda s: s.add_patches(BUMPS, basis=("bilinear", "bezier")), "basis: "),
        (lambda s: s.add_nurbs(BUMPS, KNOTS_7[::-1], KNOTS_4), "uknot"),
        (lambda s: s.add_nurbs(BUMPS, KNOTS_7[:5], KNOTS_4), "u_knots: expected 7 numbers"),
        (lambda s: s.add_nurbs(BUMPS, KNOTS_7, KNOTS_4, u_range=(3, 1)), "umin"),
        (lambda s: s.add_nurbs(BUMPS, KNOTS_7, KNOTS_4, trim=[[([1, 2], [0, 1])]]), "trim: points"),
        (lambda s: s.add_blobby(0, [1001, 0], BLOBS), "leaves"),
        (lambda s: s.add_volume(np.ones((2, 2))), "density: expected"),
        (lambda s: s.add_volume(shape="ball"), "shape: "),
        (lambda s: s.add_volume(bound=(1, 0, 0, 1, 0, 1)), "bound: "),
        (lambda s: s.add_solid("sum"), "kind: "),
        (lambda s: s.add_solid("primitive").add("union"), "has shapes, and no parts"),
        (lambda s: s.add_sphere(solid=kanuka.Scene().add_solid("union")), "another scene"),
        (lambda s: s.add_group().add_sphere(solid=s.add_solid("union")), "another scene or group"),
    ],
)
def test_what_makes_no_shape_is_told_and_adds_none(call: Callable, words: str) -> None:
    scene = kanuka.Scene()
    with pytest.raises(ValueError, match=words):
        call(scene)
    assert scene.summary()["primitives"] == {}
