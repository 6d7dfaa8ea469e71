"""Instances that differ: variants of shading, tints, roughness. They are compared with things that are made so."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import kanuka
from test_sessions import same

SHADERS: list[str] = []  # the folder of:
BANDED = """/* Looks that go with "variant": three colours, and bands of a fourth. */
surface banded(uniform float variant = 0; uniform float bands = 0; uniform float gloss = 0; uniform float holes = 0;) {
    uniform color body = color(0.8, 0.2, 0.1);
    if (variant > 0.5)
        body = color(0.1, 0.6, 0.2);
    if (variant > 1.5)
        body = color(0.2, 0.2, 0.8);
    color shown = body;
    if (bands > 0)
        shown = mix(body, color(0.7, 0.7, 0.7), mod(floor(t * bands), 2));
    if (holes > 0)
        Oi = variant < 0.5 ? 1 : 0.5;
    normal Nf = faceforward(normalize(N), I);
    Ci = Oi * (shown * diffuse(Nf) + gloss * specular(Nf, -normalize(I), 0.2));
}
"""


@pytest.fixture(autouse=True, scope="module")
def shaders(tmp_path_factory: pytest.TempPathFactory) -> None:
    folder = tmp_path_factory.mktemp("shaders")
    (folder / "banded.sl").write_text(BANDED)
    SHADERS[:] = [str(folder)]


Shape = Callable[[kanuka.Group, kanuka.Material, dict], object]


def moved(x: float, y: float = 0, z: float = 0, size: float = 1) -> np.ndarray:
    matrix = np.diag([size, size, size, 1.0])
    matrix[:3, 3] = x, y, z
    return matrix[:3]


def stage(width: int = 96) -> kanuka.Scene:
    scene = kanuka.Scene()
    scene.resolution = width, 32
    scene.options.shader_path = SHADERS
    scene.camera = kanuka.Camera((0, 0.6, 9), (0, 0, 0), fov=18)
    floor = np.array([[-9, -1, -9], [-9, -1, 9], [9, -1, 9], [9, -1, -9]], np.float32)
    scene.add_mesh(floor, np.array([[0, 1, 2, 3]], np.int32), material=kanuka.Material("matte", color=(0.4, 0.4, 0.4)))
    scene.add_light("distant", amount=2, direction=(-0.5, -1, -0.7), angle=3)
    scene.add_light("environment", amount=0.4)
    return scene


def sphere(group: kanuka.Group, material: kanuka.Material, more: dict) -> None:
    group.add_sphere(0.8, material=material, **more)


def dense_mesh(group: kanuka.Group, material: kanuka.Material, more: dict) -> None:
    """Finer than pixels: it is shaded at its vertices, in patches."""
    t = np.linspace(0, 1, 121, dtype=np.float32)
    u, v = np.meshgrid(t, t)
    points = np.stack([1.6 * u - 0.8, 1.6 * v - 0.8, 0.1 * np.sin(9 * u)], -1).reshape(-1, 3)
    corner = (np.arange(120)[:, None] * 121 + np.arange(120)).reshape(-1, 1)
    uv = np.stack([u, v], -1).reshape(-1, 2)
    group.add_mesh(points, (corner + np.array([0, 1, 122, 121])).astype(np.int32), uv=uv, material=material, **more)


def trimmed(group: kanuka.Group, material: kanuka.Material, more: dict) -> None:
    x, y = np.meshgrid(np.linspace(-0.8, 0.8, 4), np.linspace(-0.8, 0.8, 4))
    points = np.stack([x, y, 0.2 * x * y], -1).astype(np.float32)
    knots = [0, 0, 0, 0, 1, 1, 1, 1]
    square = [[0.2, 0.2], [0.8, 0.2], [0.8, 0.8], [0.2, 0.8], [0.2, 0.2]]
    group.add_nurbs(
        points, knots, knots, trim=[[(square, [0, 0, 1, 2, 3, 4, 4])]], trim_outside=True, material=material, **more
    )


SHAPES: dict[str, Shape] = {"sphere": sphere, "mesh": dense_mesh, "trimmed": trimmed}


def banded(**values: float) -> kanuka.Shader:
    return kanuka.Shader("banded", **values)


def row(count: int) -> np.ndarray:
    return np.stack([moved(1.9 * (k - (count - 1) / 2)) for k in range(count)]).astype(np.float32)


def varied(shape: Shape, variants: list[float], **values: float) -> kanuka.Scene:
    scene = stage()
    group = scene.add_group("thing")
    shape(group, banded(**values), {"variants": 3})
    scene.add_instances(group, row(len(variants)), variant=variants)
    return scene


def apart(shape: Shape, variants: list[float], **values: float) -> kanuka.Scene:
    """A group for each."""
    scene = stage()
    for variant, place in zip(variants, row(len(variants)), strict=True):
        group = scene.add_group("thing")
        shape(group, banded(variant=variant, **values), {})
        scene.add_instances(group, place[None])
    return scene


def close(a: kanuka.Picture, b: kanuka.Picture, most: float = 2e-4) -> None:
    x, y = np.asarray(a["rgb"], np.float64), np.asarray(b["rgb"], np.float64)
    assert np.abs(x - y).max() <= most * max(y.max(), 1)


# ---- variants --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("bands", [0, 7])
def test_whole_variants_are_what_the_shader_makes_of_them(shape: str, bands: int) -> None:
    one = kanuka.render(varied(SHAPES[shape], [2, 0, 1], bands=bands), progressions=4, threads=2)
    other = kanuka.render(apart(SHAPES[shape], [2, 0, 1], bands=bands), progressions=4, threads=2)
    # Dicing may differ: a group has the rate of its closest place.
    assert abs(np.asarray(one["rgb"]).mean() / np.asarray(other["rgb"]).mean() - 1) < 0.003
    red, green, blue = (np.asarray(one["rgb"])[8:20, k * 32 + 10 : k * 32 + 22].mean((0, 1)) for k in (1, 2, 0))
    assert red.argmax() == 0
    assert green.argmax() == 1
    assert blue.argmax() == 2


def test_they_are_those_of_things_made_apart_to_the_bit() -> None:
    """One instance: both are diced alike."""
    for variant in (0, 1, 2):
        a = kanuka.render(varied(sphere, [variant], bands=5, gloss=0.3), progressions=4)
        assert same(a, kanuka.render(apart(sphere, [variant], bands=5, gloss=0.3), progressions=4))


def test_between_two_both_are_blended() -> None:
    """What is lit directly is linear in what it reflects."""

    def picture(variant: float) -> np.ndarray:
        scene = varied(sphere, [variant])
        return np.asarray(kanuka.render(scene, progressions=4, integrator="direct")["rgb"], np.float64)

    red, green, between = picture(0), picture(1), picture(0.25)
    assert np.abs(red - green).max() > 0.2
    assert np.abs(0.75 * red + 0.25 * green - between).max() < 2e-4
    assert np.array_equal(picture(2), picture(7))  # beyond the last is the last


def test_the_shader_runs_once_for_each_variant_whatever_there_are_of_instances() -> None:
    few, many = (kanuka.render(varied(sphere, v, bands=3), progressions=1) for v in ([0.5], [0, 0.5, 1]))
    plain = kanuka.render(apart(sphere, [0], bands=3), progressions=1)
    shaded = plain.stats["count"]["shader_evaluations"]
    assert few.stats["count"]["shader_evaluations"] == pytest.approx(3 * shaded, rel=0.1)
    assert many.stats["count"]["shader_evaluations"] == pytest.approx(3 * shaded, rel=0.3)


def test_lanes_and_threads_find_the_same_bits() -> None:
    scene = varied(sphere, [0.3, 1, 1.6], bands=5, gloss=0.3)
    one = kanuka.render(scene, progressions=4, lanes=1, threads=1)
    for lanes in (8, 16):
        assert same(one, kanuka.render(scene, progressions=4, lanes=lanes, threads=2))


def test_presence_is_that_of_the_first() -> None:
    """The tracer, which knows no variants, decides by it what is there."""
    first, other = (kanuka.render(varied(sphere, [v], holes=1), progressions=2)["Z"] for v in (0, 1))
    apart_from_it = kanuka.render(apart(sphere, [1], holes=1), progressions=2)["Z"]
    assert np.array_equal(first, other, equal_nan=True)
    assert not np.array_equal(first, apart_from_it, equal_nan=True)


def test_a_store_has_them_all(tmp_path: Path) -> None:
    scene = varied(sphere, [0.3, 1, 1.6], bands=5)
    first = kanuka.render(scene, progressions=2, store=tmp_path)
    other = varied(sphere, [2, 2, 0.1], bands=5)
    second = kanuka.render(other, progressions=2, store=tmp_path)
    assert second.stats["count"]["shader_evaluations"] < first.stats["count"]["shader_evaluations"] / 10
    assert same(second, kanuka.render(other, progressions=2))


def test_other_layers_are_shown_as_the_first(tmp_path: Path) -> None:
    (tmp_path / "choosy.sl").write_text(
        """class choosy(uniform float variant = 0;)
{
    public void mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)
    {
        MnkMaterialBoundary boundary = CreateBoundary(material);
        if (variant > 0.5)
            AddLobe(boundary, "shine", BlinnBrdf());
        else
            AddLobe(boundary, "paint", LambertBrdf());
    }
    public void mnk_prelighting(output MnkMaterialBoundary boundary)
    {
        if (variant > 0.5)
            SetLobe(boundary, "shine", 1.0, BlinnBrdf("exponent", 20));
        else
            SetLobe(boundary, "paint", 1.0, LambertBrdf());
    }
}
"""
    )
    scene = stage()
    scene.options.shader_path = [str(tmp_path)]
    group = scene.add_group("thing")
    group.add_sphere(0.8, material="choosy", variants=2)
    scene.add_instances(group, row(2), variant=[0, 1])
    picture = kanuka.render(scene, progressions=1)
    told = " ".join(map(str, picture.journal))
    assert "1 variants have other layers than the first" in told


# ---- tints and roughness ---------------------------------------------------------------------------------------------


def painted(color: tuple, **differences: object) -> kanuka.Scene:
    scene = stage()
    group = scene.add_group("thing")
    group.add_sphere(0.8, material=kanuka.Material("matte", color=color))
    scene.add_instances(group, row(1), **differences)
    return scene


@pytest.mark.parametrize("tint", [(0.8, 0.3, 0.1), (0.2, 0.5, 0.9), (0.25, 0.25, 0.25)])
def test_a_tint_of_white_is_that_colour(tint: tuple) -> None:
    a = kanuka.render(painted((1, 1, 1), tint=tint), progressions=4)
    close(a, kanuka.render(painted(tint), progressions=4), 1e-3)  # white is a hundredth off in places: sigmoids


def test_a_grey_tint_scales() -> None:
    a = kanuka.render(painted((0.6, 0.3, 0.2), tint=(0.5, 0.5, 0.5)), progressions=4, integrator="direct")
    half = kanuka.render(painted((0.6, 0.3, 0.2)), progressions=4, integrator="direct")
    dark = kanuka.render(painted((0, 0, 0)), progressions=4, integrator="direct")
    expected = [np.asarray(p["rgb"], np.float64) for p in (half, dark, a)]
    # The floor is lit directly, and sees nothing of the ball's colour.
    assert np.abs((expected[0] + expected[1]) / 2 - expected[2]).max() < 2e-3


def glossy(own: float, **differences: object) -> kanuka.Scene:
    scene = stage()
    group = scene.add_group("thing")
    steel = kanuka.Material("conductor", parameters={"float roughness": own})
    group.add_sphere(0.8, material=steel)
    scene.add_instances(group, row(1), **differences)
    return scene


def test_roughness_is_added() -> None:
    plain, rough = (kanuka.render(glossy(r), progressions=4) for r in (0.1, 0.3))
    added = kanuka.render(glossy(0.1, roughness=0.2), progressions=4)
    close(added, rough, 1e-3)
    assert np.abs(np.asarray(plain["rgb"]) - np.asarray(rough["rgb"])).max() > 0.1
    smooth = kanuka.render(glossy(0.1, roughness=-1), progressions=4)  # it ends at zero
    close(smooth, kanuka.render(glossy(0), progressions=4), 1e-3)


@pytest.mark.parametrize("memory", [None, "1G"])  # Embree's, and pages of our own
def test_the_innermost_instance_that_says_any_counts(memory: str | None) -> None:
    def scene_of(inner: object, outer: object) -> kanuka.Scene:
        scene = stage()
        ball, pair = scene.add_group("ball"), scene.add_group("pair")
        ball.add_sphere(0.8, material=kanuka.Material("matte", color=(0.9, 0.9, 0.9)))
        pair.add_instances(ball, row(2), **({"tint": inner} if inner is not None else {}))
        scene.add_instances(pair, np.stack([moved(0)]), **({"tint": outer} if outer is not None else {}))
        return scene

    red, blue = (0.8, 0.1, 0.1), (0.1, 0.1, 0.8)
    shown = {
        (inner, outer): kanuka.render(scene_of(inner, outer), progressions=2, memory=memory)
        for inner, outer in ((red, None), (None, red), (red, blue), (None, None))
    }
    assert same(shown[red, None], shown[None, red])
    assert same(shown[red, blue], shown[red, None])
    assert not same(shown[None, None], shown[red, None])


def test_own_pages_and_moving_instances_have_them_too() -> None:
    scene = stage()
    group = scene.add_group("thing")
    group.add_sphere(0.8, material=kanuka.Material("matte", color=(0.9, 0.9, 0.9)))
    tints = [(0.8, 0.1, 0.1), (0.1, 0.8, 0.1), (0.1, 0.1, 0.8)]
    scene.add_instances(group, row(3), tint=tints)
    still = kanuka.render(scene, progressions=8)
    within = kanuka.render(scene, progressions=8, memory="1G")
    # Vertices lie on a lattice there: a sample here and there falls on the other side of an edge.
    assert np.abs(np.asarray(still["rgb"], np.float64) - np.asarray(within["rgb"], np.float64)).mean() < 1e-3
    moving = stage()
    group = moving.add_group("thing")
    group.add_sphere(0.8, material=kanuka.Material("matte", color=(0.9, 0.9, 0.9)))
    there = row(3).copy()
    there[:, 1, 3] += 1e-4
    moving.add_instances(group, np.stack([row(3), there]), tint=tints)
    moving.options.shutter = 0, 1
    picture = np.asarray(kanuka.render(moving, progressions=8)["rgb"], np.float64)
    assert np.abs(picture - np.asarray(still["rgb"], np.float64)).mean() < 0.01


# ---- from files ------------------------------------------------------------------------------------------------------


def test_rib_says_it_by_attributes(tmp_path: Path) -> None:
    rib = """Attribute "identifier" "name" "x"
ObjectBegin "ball"
Attribute "instance" "int variants" [3]
Surface "banded" "float bands" [5]
Sphere 0.8 -0.8 0.8 360
ObjectEnd
"""
    variants, tints = [0.5, 2, 1], [(1, 1, 1), (0.5, 0.6, 0.7), (1, 1, 1)]
    for place, variant, tint in zip(row(3), variants, tints, strict=True):
        matrix = np.vstack([place, [0, 0, 0, 1]]).T.reshape(-1)
        rib += f'AttributeBegin\nAttribute "instance" "float variant" [{variant}]\n'
        if tint != (1, 1, 1):
            rib += f'Attribute "instance" "color tint" [{" ".join(map(str, tint))}]\n'
        rib += f'ConcatTransform [{" ".join(map(str, matrix))}]\nObjectInstance "ball"\nAttributeEnd\n'
    (tmp_path / "balls.rib").write_text(f"WorldBegin\n{rib}WorldEnd\n")
    read = kanuka.load(tmp_path / "balls.rib")
    assert read.summary()["groups"] == 1  # what they differ by makes no groups
    scene = stage()
    read.options.shader_path = scene.options.shader_path
    read.resolution, read.camera = scene.resolution, scene.camera
    read.add_light("environment", amount=1)
    other = kanuka.Scene()
    other.options.shader_path = scene.options.shader_path
    other.resolution, other.camera = scene.resolution, scene.camera
    group = other.add_group("ball")
    group.add_sphere(0.8, material=banded(bands=5), variants=3)
    other.add_instances(group, row(3), variant=variants, tint=tints)
    other.add_light("environment", amount=1)
    close(kanuka.render(read, progressions=4), kanuka.render(other, progressions=4))


# ---- errors ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"variant": [0, 1]}, "variant: expected a number, or that for each of 3 instances"),
        ({"tint": [0.5, 0.5]}, "tint: expected three numbers"),
        ({"tint": [(-1, 0, 0)] * 3}, "tint: expected numbers from 0 on"),
        ({"variant": [float("nan")] * 3}, "variant: expected numbers from 0 on"),
        ({"roughness": -2}, "roughness: expected numbers from -1 on"),
    ],
)
def test_what_does_not_fit_is_refused(given: dict, text: str) -> None:
    scene = stage()
    group = scene.add_group("thing")
    group.add_sphere(0.8)
    with pytest.raises(ValueError, match=text.replace("(", r"\(")):
        scene.add_instances(group, row(3), **given)
    with pytest.raises(ValueError, match="variants: expected 1 to 64"):
        group.add_sphere(1, variants=0)


# ---- things of their own ---------------------------------------------------------------------------------------------


FLOODED = """surface flooded(float level = 0; uniform float variant = 0;) {
    point Q = transform("world", P);
    Oi = 1;
    Ci = (ycomp(Q) > level ? color(0.8 - 0.2 * variant, 0.5, 0.3) : color(0.1, 0.1, 0.3)) * diffuse(normalize(N));
}
"""


def flooded(unique: bool, apart: bool, **more: object) -> kanuka.Scene:
    """Balls at three heights, some in pairs on a stand."""
    scene = stage()
    places = row(3).copy()
    places[:, 1, 3] = -0.4, 0, 0.5
    inner = np.stack([moved(-0.3, 0.1, 0, 0.5), moved(0.4, -0.2, 0, 0.4)]).astype(np.float32)
    material = kanuka.Material("flooded")
    if apart:
        for i, place in enumerate(places):
            whole = np.vstack([place, [0, 0, 0, 1]])
            scene.add_sphere(0.6, material=material, transform=whole)
            ball = scene.add_group(f"small {i}")
            ball.add_sphere(0.9, material="matte")
            scene.add_instances(ball, np.stack([(whole @ np.vstack([m, [0, 0, 0, 1]]))[:3] for m in inner]))
        return scene
    ball, group = scene.add_group("small"), scene.add_group("thing")
    ball.add_sphere(0.9, material="matte")
    group.add_sphere(0.6, material=material)
    group.add_instances(ball, inner)
    scene.add_instances(group, places, unique=unique, **more)
    return scene


@pytest.fixture
def water(tmp_path: Path) -> None:
    (Path(SHADERS[0]) / "flooded.sl").write_text(FLOODED)


def test_unique_instances_are_shaded_where_they_stand(water: None) -> None:
    unique = kanuka.render(flooded(True, False), progressions=4)
    assert same(unique, kanuka.render(flooded(True, False), progressions=4, threads=1))
    expected = kanuka.render(flooded(False, True), progressions=4)
    difference = np.abs(np.asarray(unique["rgb"], np.float64) - np.asarray(expected["rgb"], np.float64))
    assert difference.mean() < 1e-3  # small ones are diced for all of their places, or for those of a group
    shared = kanuka.render(flooded(False, False), progressions=4)
    assert np.abs(np.asarray(unique["rgb"]) - np.asarray(shared["rgb"])).max() > 0.1
    told = " ".join(map(str, shared.journal))
    assert "its shader asks where in the world it is" in told
    assert "its shader asks" not in " ".join(map(str, unique.journal))


def test_unique_instances_may_differ_besides(water: None) -> None:
    plain = kanuka.render(flooded(True, False), progressions=4)
    grey = kanuka.render(flooded(True, False, tint=[(1, 1, 1), (0.2, 0.2, 0.2), (1, 1, 1)]), progressions=4)
    a, b = np.asarray(plain["rgb"], np.float64), np.asarray(grey["rgb"], np.float64)
    assert np.abs(a - b)[:, 36:60].mean() > 10 * np.abs(a - b)[:, :28].mean()
    shifted = kanuka.render(flooded(True, False, variant=[0, 0, 2.5]), progressions=4)
    c = np.asarray(shifted["rgb"], np.float64)
    assert np.abs(a - c)[:, 64:].max() > 0.1
    assert np.abs(a - c)[:, :30].max() < 0.1


def test_a_unique_instance_that_moves_is_refused() -> None:
    scene = stage()
    group = scene.add_group("thing")
    group.add_sphere(0.8)
    with pytest.raises(ValueError, match="unique: what moves as an instance stays one"):
        scene.add_instances(group, np.stack([row(1), row(1) + 0.1]), unique=True)


# ---- USD ------------------------------------------------------------------------------------------------------------

PROTOTYPE = """
def Material "paint" {
    token outputs:surface.connect = </paint/s.outputs:surface>
    def Shader "s" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (0.9, 0.9, 0.9)
        float inputs:roughness.connect = </paint/r.outputs:result>
        token outputs:surface
    }
    def Shader "r" {
        uniform token info:id = "UsdPrimvarReader_float"
        string inputs:varname = "variant"
        float outputs:result
    }
}
"""
BALL = """
class Sphere "ball" (prepend apiSchemas = ["MaterialBindingAPI"]) {
    double radius = 0.45
    int primvars:kanuka:variants = 2
    rel material:binding = </paint>
}
"""
POINTS = """
def PointInstancer "pi" {
    rel prototypes = </ball>
    int[] protoIndices = [0, 0, 0]
    point3f[] positions = [(-0.6, 0, 0), (9, 9, 9), (0.6, 0, 0)]
    int64[] ids = [4, 5, 6]
    int64[] invisibleIds = [5]
    DIFFERENCES
}
"""
BY_INSTANCE = """
    color3f[] primvars:kanuka:tint = [(1, 0.1, 0.1), (1, 1, 1), (0.1, 0.1, 1)] (interpolation = "varying")
    float[] primvars:kanuka:variant = [0, 1, 1] (interpolation = "varying")
"""


def test_usd_says_it_by_primvars(tmp_path: Path) -> None:
    from test_usd_convert import both
    from usd_stages import CAMERA, SUN, stage

    at = tmp_path / "a"
    at.mkdir()
    path = stage(at, CAMERA, SUN, PROTOTYPE, BALL, POINTS.replace("DIFFERENCES", BY_INSTANCE))
    shown, rib, told = both(path)
    assert told == []
    assert np.abs(shown - rib).max(-1).mean() < 5e-3
    covered = shown[..., 3] > 0.9
    left, right = (shown[:, part][covered[:, part]][:, :3].mean(0) for part in (slice(0, 12), slice(12, 24)))
    assert left[0] > 3 * left[2]
    assert right[2] > 3 * right[0]


def test_usd_tells_of_lists_of_another_length(tmp_path: Path) -> None:
    from usd_stages import CAMERA, SUN, read, stage

    wrong = "color3f[] primvars:kanuka:tint = [(1, 0, 0), (0, 1, 0)]"
    _, told = read(stage(tmp_path, CAMERA, SUN, PROTOTYPE, BALL, POINTS.replace("DIFFERENCES", wrong)))
    assert any("primvars:kanuka:tint: expected a colour, or one for each of 3 instances" in text for text in told)
