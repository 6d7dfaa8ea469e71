"""Instances that differ: variants of shading, tints, roughness. They are compared with things that are made so."""

from __future__ import annotations

import re
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
        Oi = variant < 0.5 ? 0.9 : 0.5;
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


def test_what_shows_no_variants_is_shaded_once() -> None:
    def evaluations(material: object, instanced: bool, **more: object) -> int:
        scene = stage()
        group = scene.add_group("thing") if instanced else scene
        sphere(group, material, more)
        if instanced:
            scene.add_instances(group, row(2), variant=[0, 2])
        return kanuka.render(scene, progressions=1).stats["count"]["shader_evaluations"]

    once = evaluations(banded(bands=3), False)
    assert evaluations(banded(bands=3), False, variants=8) == once  # in the world
    rock = kanuka.Material("plastic", color=(0.5, 0.4, 0.3))
    assert evaluations(rock, True, variants=8) == evaluations(rock, True)  # it does not ask which it is


def test_lobes_with_a_direction_have_variants_too(tmp_path: Path) -> None:
    """Tables of programs that need dPdu are one entry longer."""
    (tmp_path / "brushed.sl").write_text(
        """class brushed(uniform float variant = 0;)
{
    public void mnk_init(output MnkObjectProperties objectProperties; output MnkMaterial material)
    {
        MnkMaterialBoundary boundary = CreateBoundary(material);
        AddLobe(boundary, "metal", MicrofacetConductorBrdf());
    }
    public void mnk_prelighting(output MnkMaterialBoundary boundary)
    {
        color c = variant > 0.5 ? color(0.9, 0.2, 0.1) * (0.5 + 0.5 * s) : color(0.2, 0.3, 0.9);
        SetLobe(boundary, "metal", 1, MicrofacetConductorBrdf("reflectance", c, "roughness", 0.3 + 0.2 * variant,
                                                              "anisotropy", 0.7, "rotation", 0.2 * variant));
    }
}
"""
    )

    def picture(variant: float, shown: bool) -> kanuka.Picture:
        scene = stage()
        scene.options.shader_path = [str(tmp_path)]
        group = scene.add_group("thing")
        shader = kanuka.Shader("brushed") if shown else kanuka.Shader("brushed", variant=variant)
        group.add_sphere(0.8, material=shader, **({"variants": 2} if shown else {}))
        scene.add_instances(group, row(1), **({"variant": variant} if shown else {}))
        return kanuka.render(scene, progressions=4)

    for variant in (0, 1):
        assert same(picture(variant, True), picture(variant, False))


def test_a_session_sees_what_changes() -> None:
    scene = varied(sphere, [0, 1, 2], bands=3)
    session = kanuka.Session(scene, progressions=2)
    session.advance()
    before = session.picture()
    assert same(before, kanuka.render(varied(sphere, [0, 1, 2], bands=3), progressions=2))
    group = scene.add_group("more")
    group.add_sphere(0.3, material="matte")
    scene.add_instances(group, row(2), tint=(0.9, 0.1, 0.1))
    session.update()
    session.advance()
    assert same(session.picture(), kanuka.render(scene, progressions=2))
    scene.options.color_space = "rec2020"  # tints and colours mean something else
    session.update()
    session.advance()
    assert same(session.picture(), kanuka.render(scene, progressions=2))


def test_lanes_and_threads_find_the_same_bits() -> None:
    scene = varied(sphere, [0.3, 1, 1.6], bands=5, gloss=0.3)
    one = kanuka.render(scene, progressions=4, lanes=1, threads=1)
    for lanes in (8, 16):
        assert same(one, kanuka.render(scene, progressions=4, lanes=lanes, threads=2))


def test_presence_is_that_of_the_first() -> None:
    """The tracer, which knows no variants, decides by it what is there. Colours are each variant's own."""
    first, other = (kanuka.render(varied(sphere, [v], holes=1), progressions=2) for v in (0, 1))
    apart_from_it = kanuka.render(apart(sphere, [1], holes=1), progressions=2)
    assert np.array_equal(first["Z"], other["Z"], equal_nan=True)
    assert not np.array_equal(first["Z"], apart_from_it["Z"], equal_nan=True)
    assert np.asarray(other["rgb"])[14:18, 46:50, 1].mean() > 2 * np.asarray(first["rgb"])[14:18, 46:50, 1].mean()
    assert not any("other layers" in str(m) for m in other.journal)


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


def test_tints_in_a_white_furnace_are_what_is_seen() -> None:
    """Closed forms: a white ball shows the tint; glass of index 1.5 reflects R = 0.04 at each side, and tints what
    crosses one: R + (1 - R)² t² of two sides, with what is reflected inside and comes out again."""

    def middle(material: object, tint: object, far: float = 0) -> np.ndarray:
        scene = kanuka.Scene()
        scene.resolution = 32, 32
        scene.camera = kanuka.Camera((far, 0, 5), (far, 0, 0), fov=30)
        group = scene.add_group("ball")
        group.add_sphere(1, material=material)
        scene.add_instances(group, moved(far)[None], tint=tint)
        scene.add_light("environment", amount=1)
        rgb = np.asarray(kanuka.render(scene, progressions=64)["rgb"], np.float64)
        return rgb[14:18, 14:18].mean((0, 1))

    white = kanuka.Material("matte", parameters={"float Kd": 1.0})
    assert middle(white, (0.6, 0.3, 0.15)) == pytest.approx((0.6, 0.3, 0.15), rel=0.01)
    assert middle(white, (0.5, 0.5, 0.5), far=1e5) == pytest.approx((0.5,) * 3, rel=0.01)
    assert middle("glass", (1, 1, 1)) == pytest.approx((1.0,) * 3, rel=0.01)
    assert middle("glass", (0.5, 0.5, 0.5)) == pytest.approx((0.04 + 0.96**2 * 0.25 * (1 + 0.04 * 0.04),) * 3, rel=0.05)


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


# ---- errors ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"variant": [0, 1]}, "variant: expected a number, or that for each of 3 instances"),
        ({"tint": [0.5, 0.5]}, "tint: expected shape (3,) or (N, 3); got (2,)"),
        ({"tint": [(0.5, 0.5)] * 3}, "tint: expected shape (3,) or (N, 3); got (3, 2)"),
        ({"variant": [[0, 1, 2]]}, "variant: expected shape () or (N,); got (1, 3)"),
        ({"tint": [(1, 1, 1)] * 2}, "tint: expected three numbers, or that for each of 3 instances; got 6 numbers"),
        ({"tint": [(-1, 0, 0)] * 3}, "tint: expected numbers from 0 to a million"),
        ({"variant": [float("nan")] * 3}, "variant: expected numbers from 0 to a million"),
        ({"roughness": -2}, "roughness: expected numbers from -1 to a million"),
    ],
)
def test_what_does_not_fit_is_refused(given: dict, text: str) -> None:
    scene = stage()
    group = scene.add_group("thing")
    group.add_sphere(0.8)
    with pytest.raises(ValueError, match=re.escape(text)):
        scene.add_instances(group, row(3), **given)
    with pytest.raises(ValueError, match="variants: expected 1 to 64"):
        group.add_sphere(1, variants=0)
