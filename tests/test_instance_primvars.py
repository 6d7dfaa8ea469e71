"""Variables of instances that surface shaders read. They are compared with things that have these themselves."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import kanuka
import kanuka.rib
from test_instance_variation import SHADERS, close, moved, row, stage
from test_sessions import same

WET = """surface wet(uniform float wetness = 0; uniform color leaf = color(0.5, 0.5, 0.5); uniform float bands = 0;
            uniform float variant = 0;) {
    color shown = leaf * (1 - 0.8 * wetness);
    if (variant > 0.5)
        shown = color(0.1, 0.1, 0.7);
    if (bands > 0)
        shown *= 0.4 + 0.6 * mod(floor(t * bands), 2);
    Oi = 1;
    Ci = shown * diffuse(faceforward(normalize(N), I));
}
"""
FAR = 1000.0  # what stands there is in no picture


@pytest.fixture(autouse=True, scope="module")
def shaders(tmp_path_factory: pytest.TempPathFactory) -> None:
    folder = tmp_path_factory.mktemp("shaders")
    (folder / "wet.sl").write_text(WET)
    SHADERS[:] = [str(folder)]


def card(group: kanuka.Group, material: object = "wet", **more: object) -> None:
    """Finer than pixels, and with a `t` that goes over it."""
    t = np.linspace(0, 1, 41, dtype=np.float32)
    u, v = np.meshgrid(t, t)
    points = np.stack([1.6 * u - 0.8, 1.6 * v - 0.8, 0.1 * np.sin(9 * u)], -1).reshape(-1, 3)
    corner = (np.arange(40)[:, None] * 41 + np.arange(40)).reshape(-1, 1)
    faces = (corner + np.array([0, 1, 42, 41])).astype(np.int32)
    group.add_mesh(points, faces, uv=np.stack([u, v], -1).reshape(-1, 2), material=material, **more)


def instanced(places: np.ndarray, primvars: dict, *, bands: float = 0, unique: bool = False) -> kanuka.Scene:
    scene = stage()
    group = scene.add_group("card")
    card(group, kanuka.Shader("wet", bands=bands))
    scene.add_instances(group, places, primvars=primvars, unique=unique)
    return scene


def apart(places: np.ndarray, each: list[dict], *, bands: float = 0) -> kanuka.Scene:
    """A group for each, whose mesh has the variables."""
    scene = stage()
    for place, primvars in zip(places, each, strict=True):
        group = scene.add_group("card")
        card(group, kanuka.Shader("wet", bands=bands), primvars=primvars)
        scene.add_instances(group, place[None])
    return scene


def middles(scene: kanuka.Scene, count: int = 3, **options: object) -> np.ndarray:
    """What the cards of a row reflect: their albedo in the middle."""
    albedo = np.asarray(kanuka.render(scene, progressions=4, **options)["albedo"], np.float64)
    columns = [round(48 + 21.3 * (k - (count - 1) / 2)) for k in range(count)]
    return np.stack([albedo[13:19, c - 3 : c + 3].mean((0, 1)) for c in columns])


def rib(look: str, instances: str) -> str:
    return f"""Option "searchpath" "string shader" ["{SHADERS[0]}"]
Format 96 32 1
Projection "perspective" "fov" 18
Translate 0 0 9
WorldBegin
LightSource "distantlight" 1 "from" [0 0 -1] "to" [0 0 0]
ObjectBegin "card"
  {look}
  Polygon "P" [-0.8 -0.8 0 0.8 -0.8 0 0.8 0.8 0 -0.8 0.8 0]
ObjectEnd
{instances}
WorldEnd
"""


def told(scene: kanuka.Scene, **options: object) -> str:
    return " ".join(map(str, kanuka.render(scene, progressions=1, **options).journal))


# ---- few values are exact --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("memory", [None, "1G"])  # Embree's, and pages of our own
def test_few_values_are_those_of_things_that_have_them(memory: str | None) -> None:
    wetness, leaf = [0.1, 0.9, 0.5], [(0.8, 0.2, 0.1), (0.2, 0.8, 0.1), (0.9, 0.9, 0.1)]
    one = instanced(row(3), {"wetness": wetness, "leaf": leaf}, bands=5)
    other = apart(row(3), [{"wetness": w, "color leaf": c} for w, c in zip(wetness, leaf, strict=True)], bands=5)
    a, b = (kanuka.render(scene, progressions=4, memory=memory) for scene in (one, other))
    assert same(a, kanuka.render(one, progressions=4, memory=memory, threads=1))
    difference = np.abs(np.asarray(a["rgb"], np.float64) - np.asarray(b["rgb"], np.float64))
    assert difference.mean() < 2e-3  # a group has the rate of its closest place
    assert np.abs(middles(one) - middles(other)).max() < 0.01
    assert middles(one)[0].argmax() == 0
    assert middles(one)[1].argmax() == 1


def test_one_of_many_is_that_thing_to_the_bit() -> None:
    """One instance in the picture: both are diced for it alone."""
    places = np.concatenate([row(1), np.stack([moved(0, 0, FAR)]).astype(np.float32)])
    for which, wetness in enumerate((0.75, 0.25)):
        given = [0.75, 0.25] if which == 0 else [0.25, 0.75]
        a = kanuka.render(instanced(places, {"wetness": given}, bands=5), progressions=4)
        group_of_two = stage()
        group = group_of_two.add_group("card")
        card(group, kanuka.Shader("wet", bands=5), primvars={"wetness": given[0]})
        group_of_two.add_instances(group, places)
        assert same(a, kanuka.render(group_of_two, progressions=4)), wetness


def test_equal_values_are_shaded_once() -> None:
    def evaluations(primvars: dict) -> int:
        return kanuka.render(instanced(row(3), primvars, bands=3), progressions=1).stats["count"]["shader_evaluations"]

    once = evaluations({})
    assert evaluations({"wetness": [0.3, 0.3, 0.3]}) == once
    assert evaluations({"wetness": 0.3}) == once
    assert evaluations({"nothing": [1, 2, 3]}) == once
    two, three = evaluations({"wetness": [0.3, 0.5, 0.3]}), evaluations({"wetness": [0.3, 0.5, 0.8]})
    assert three - two == two - once > 0
    # What differs in what this shader does not read is no variant of its surface.
    assert evaluations({"wetness": [0.3, 0.3, 0.3], "nothing": [1, 2, 3]}) == once


def test_shapes_of_a_group_are_shaded_as_often_as_they_differ() -> None:
    """Two shaders of a group: one reads one variable, the other two, of which there are four pairs."""
    (Path(SHADERS[0]) / "soggy.sl").write_text(
        "surface soggy(uniform float wetness = 0; ) {"
        " Oi = 1; Ci = color(0.2 + 0.6 * wetness * s) * diffuse(normalize(N)); }"
    )
    wetness, leaf = [0.1, 0.1, 0.9, 0.9], [(1, 0, 0), (0, 1, 0), (1, 0, 0), (0, 1, 0)]

    def evaluations(material: str) -> int:
        scene = stage()
        group = scene.add_group("both")
        if material != "soggy":
            card(group, kanuka.Shader("wet", bands=3))
        if material != "wet":
            card(group, "soggy")
        scene.add_instances(group, row(4), primvars={"wetness": wetness, "leaf": leaf})
        return kanuka.render(scene, progressions=1).stats["count"]["shader_evaluations"]

    plain = evaluations("wet") / 4
    assert evaluations("both") - evaluations("wet") == pytest.approx(4 * plain, rel=0.1)  # counted, not run
    assert evaluations("soggy") == pytest.approx(2 * plain, rel=0.1)


# ---- many are not ----------------------------------------------------------------------------------------------------


def test_many_numbers_are_blended() -> None:
    """What is lit directly is linear in what it reflects, and that in the wetness here."""
    rng = np.random.default_rng(3)
    wetness = np.concatenate([[0.15, 0.62, 0.83], rng.uniform(0, 1, 40)]).astype(np.float32)
    places = np.concatenate([row(3), np.stack([moved(k, 0, FAR) for k in range(40)]).astype(np.float32)])
    scene = instanced(places, {"wetness": wetness})
    assert '43 values of "wetness"' in told(scene)
    assert "blended" in told(scene)
    expected = 0.5 * (1 - 0.8 * wetness[:3])
    for variants in (2, 3, 8):
        shown = middles(scene, instance_variants=variants).mean(1)
        assert shown == pytest.approx(expected, abs=0.01), variants
    assert "blended" not in told(scene, instance_variants=64)
    middle = middles(scene, instance_variants=1).mean(1)
    assert middle == pytest.approx([0.5 * (1 - 0.8 * (wetness.min() + wetness.max()) / 2)] * 3, abs=0.01)


def test_many_colors_are_the_nearest() -> None:
    rng = np.random.default_rng(4)
    base = np.array([(0.7, 0.3, 0.3), (0.3, 0.6, 0.3), (0.3, 0.3, 0.6), (0.6, 0.6, 0.4)])
    leaf = (np.repeat(base, 10, axis=0) + rng.uniform(-0.02, 0.02, (40, 3))).astype(np.float32)
    places = np.stack([moved(k, 0, FAR) for k in range(40)]).astype(np.float32)
    places[[5, 15, 25]] = row(3)
    scene = instanced(places, {"leaf": leaf})
    assert '40 values of "leaf"' in told(scene, instance_variants=4)
    assert "nearest" in told(scene, instance_variants=4)
    means = np.stack([leaf[k : k + 10].mean(0) for k in (0, 10, 20)])
    for variants, expected in ((4, means), (40, leaf[[5, 15, 25]])):
        made_so = middles(apart(row(3), [{"color leaf": c} for c in expected]))
        assert middles(scene, instance_variants=variants) == pytest.approx(made_so, abs=0.002)


def test_unique_instances_have_their_own() -> None:
    wetness = np.linspace(0, 1, 43).astype(np.float32)
    places = np.concatenate([row(3), np.stack([moved(k, 0, FAR) for k in range(40)]).astype(np.float32)])
    scene = instanced(places, {"wetness": wetness[::-1].copy()}, bands=5, unique=True)
    assert "values of" not in told(scene)
    one = kanuka.render(scene, progressions=4)
    other = stage()
    for place, w in zip(places, wetness[::-1], strict=True):
        card(
            other,
            kanuka.Shader("wet", bands=5),
            primvars={"wetness": float(w)},
            transform=np.vstack([place, [0, 0, 0, 1]]),
        )
    close(one, kanuka.render(other, progressions=4))


# ---- what goes with what ---------------------------------------------------------------------------------------------


def test_what_lies_in_a_group_takes_what_is_around_it() -> None:
    scene = stage()
    leaf, tree = scene.add_group("leaf"), scene.add_group("tree")
    card(leaf)
    tree.add_instances(leaf, np.stack([moved(0)]).astype(np.float32))
    scene.add_instances(tree, row(3)[:2], primvars={"wetness": [0.25, 1]})
    scene.add_instances(tree, row(3)[2:])  # says nothing, and is dry
    assert middles(scene).mean(1) == pytest.approx(0.5 * (1 - 0.8 * np.array([0.25, 1, 0])), abs=0.01)
    unique = stage()
    leaf, tree = unique.add_group("leaf"), unique.add_group("tree")
    card(leaf)
    tree.add_instances(leaf, np.stack([moved(0)]).astype(np.float32))
    unique.add_instances(tree, row(3), primvars={"wetness": [0.25, 1, 0.5]}, unique=True)
    assert middles(unique).mean(1) == pytest.approx(0.5 * (1 - 0.8 * np.array([0.25, 1, 0.5])), abs=0.01)


def test_the_innermost_that_says_anything_counts() -> None:
    scene = stage()
    leaf, tree = scene.add_group("leaf"), scene.add_group("tree")
    card(leaf)
    tree.add_instances(leaf, np.stack([moved(0)]).astype(np.float32), primvars={"leaf": (0.2, 0.9, 0.2)})
    scene.add_instances(tree, row(3), primvars={"wetness": [0.25, 1, 0]})
    assert middles(scene) == pytest.approx(np.tile([[0.2, 0.9, 0.2]], (3, 1)), abs=0.01)


def test_what_a_shape_has_itself_counts_more() -> None:
    def scene_of(unique: bool) -> kanuka.Scene:
        scene = stage()
        group = scene.add_group("card")
        card(group, primvars={"wetness": 0.5})
        scene.add_instances(group, row(3), primvars={"wetness": [0, 1, 0.2]}, unique=unique)
        return scene

    for unique in (False, True):
        assert middles(scene_of(unique)).mean(1) == pytest.approx([0.3] * 3, abs=0.01)
    assert 'change nothing: "wetness"' in told(scene_of(False))


def test_variants_go_with_them() -> None:
    scene = stage()
    group = scene.add_group("card")
    card(group, variants=2)
    more = {"variant": [0, 1, 0], "primvars": {"wetness": [0.5, 0.5, 1]}}
    scene.add_instances(group, row(3), **more)
    shown = middles(scene)
    assert shown[[0, 2]].mean(1) == pytest.approx([0.3, 0.1], abs=0.01)
    assert shown[1] == pytest.approx((0.1, 0.1, 0.7), abs=0.01)


def test_groups_that_share_nothing_have_variants_of_their_own() -> None:
    scene = stage()
    for k in range(3):
        group = scene.add_group(f"card {k}")
        card(group)
        places = np.stack([row(3)[k], moved(k, 0, FAR)]).astype(np.float32)
        scene.add_instances(group, places, primvars={"wetness": [0.2 * k + 0.3, 0.9]})
    assert "values of" not in told(scene, instance_variants=2)
    assert middles(scene, instance_variants=2).mean(1) == pytest.approx(
        0.5 * (1 - 0.8 * np.array([0.3, 0.5, 0.7])), abs=0.01
    )


def test_tints_and_motion_go_with_them() -> None:
    places = np.stack([row(3), row(3) + np.float32(1e-5)])
    scene = stage()
    group = scene.add_group("card")
    card(group)
    scene.add_instances(group, places, tint=(0.5, 0.5, 0.5), primvars={"wetness": [0.25, 1, 0.5]})
    scene.options.shutter = 0, 1
    assert middles(scene).mean(1) == pytest.approx(0.25 * (1 - 0.8 * np.array([0.25, 1, 0.5])), abs=0.01)


def test_co_shaders_read_them(tmp_path: Path) -> None:
    (Path(SHADERS[0]) / "stain.sl").write_text(
        "class stain(uniform float wetness = 0;) { public color of(color c;) { return c * (1 - 0.8 * wetness); } }"
    )
    (Path(SHADERS[0]) / "stained.sl").write_text(
        """class stained(uniform string by = "";)
{
    public void surface(output color Ci, Oi;)
    {
        shader other = getshader(by);
        Oi = 1;
        Ci = other->of(color(0.5)) * diffuse(normalize(N));
    }
}
"""
    )
    (tmp_path / "a.rib").write_text(
        rib(
            """Shader "stain" "it" Surface "stained" "string by" "it" """,
            """Attribute "instance:primvar" "float wetness" 0.25
TransformBegin Translate -1.9 0 0 ObjectInstance "card" TransformEnd
Attribute "instance:primvar" "float wetness" 1 ObjectInstance "card"
Attribute "instance:primvar" "float wetness" 0.5 Translate 1.9 0 0 ObjectInstance "card"
""",
        )
    )
    shown = middles(kanuka.load(tmp_path / "a.rib")).mean(1)
    assert shown == pytest.approx(0.5 * (1 - 0.8 * np.array([0.25, 1, 0.5])), abs=0.01)


# ---- sessions and stores ---------------------------------------------------------------------------------------------


def test_a_session_shades_what_changes() -> None:
    def make(wetness: list[float]) -> tuple[kanuka.Scene, kanuka.Group, kanuka.Node]:
        scene = stage()
        other, group = scene.add_group("other"), scene.add_group("card")
        card(other, kanuka.Shader("wet", bands=3))
        scene.add_instances(
            other, row(3) + moved(0, 0.8)[:3] * [[0, 0, 0, 1]] * 3, primvars={"wetness": [0.5, 0.6, 0.7]}
        )
        card(group, kanuka.Shader("wet", bands=5))
        return scene, group, scene.add_instances(group, row(3), primvars={"wetness": wetness})

    scene, group, node = make([0.1, 0.2, 0.3])
    session = kanuka.Session(scene, progressions=2)
    session.advance()
    first = session.picture().stats["count"]["shader_evaluations"]
    for wetness, is_new in (([0.1, 0.9, 0.3], True), ([0.3, 0.2, 0.1], False)):  # in another order is nothing new
        scene.remove([node])
        node = scene.add_instances(group, row(3), primvars={"wetness": wetness})
        session.update()
        session.advance()
        now = session.picture()
        assert same(now, kanuka.render(make(wetness)[0], progressions=2))
        evaluations = now.stats["count"]["shader_evaluations"]
        assert 0 < evaluations < first if is_new else evaluations == 0
    values = np.asarray(now["rgb"], np.float64)
    scene.remove([node])
    scene.add_instances(group, row(3), primvars={"wetness": [0.1, 0.2, 0.3]})
    session.update()
    session.advance()
    assert np.abs(np.asarray(session.picture()["rgb"], np.float64) - values).max() > 0.05


def test_pages_of_a_store_have_their_values(tmp_path: Path) -> None:
    first = kanuka.render(instanced(row(3), {"wetness": [0.1, 0.2, 0.3]}, bands=5), progressions=2, store=tmp_path)
    again = kanuka.render(instanced(row(3), {"wetness": [0.3, 0.1, 0.2]}, bands=5), progressions=2, store=tmp_path)
    assert again.stats["count"]["shader_evaluations"] < first.stats["count"]["shader_evaluations"] / 2  # the same set
    other = instanced(row(3), {"wetness": [0.3, 0.1, 0.8]}, bands=5)
    assert same(kanuka.render(other, progressions=2, store=tmp_path), kanuka.render(other, progressions=2))


# ---- files -----------------------------------------------------------------------------------------------------------


def test_rib_says_them(tmp_path: Path) -> None:
    (tmp_path / "a.rib").write_text(
        rib(
            'Surface "wet"',
            """AttributeBegin
  Attribute "instance:primvar" "uniform float wetness" [0.25] "color leaf" [0.2 0.4 0.8]
  TransformBegin Translate -1.9 0 0 ObjectInstance "card" TransformEnd
  Attribute "instance:primvar" "int wetness" [1]
  ObjectInstance "card"
AttributeEnd
TransformBegin Translate 1.9 0 0 ObjectInstance "card" TransformEnd
""",
        )
    )
    scene = kanuka.load(tmp_path / "a.rib")
    assert scene.summary()["groups"] == 1
    leaf = np.array([0.2, 0.4, 0.8])
    expected = np.stack([leaf * 0.8, leaf * 0.2, [0.5] * 3])
    assert middles(scene) == pytest.approx(expected, abs=0.012)


def test_rib_is_written_and_read(tmp_path: Path) -> None:
    given = {"wetness": np.array([0.25, 1, 0.5]), "leaf": np.array([(0.2, 0.4, 0.8), (0.8, 0.2, 0.2), (0.3, 0.3, 0.3)])}
    written = kanuka.rib.RibScene()
    group = written.add_group("card")
    card(group)
    written.add_instances(group, row(3), primvars=given)
    far = np.stack([moved(k, 0, FAR) for k in range(3)])
    written.add_instances(group, far, primvars={"color leaf": (0.1, 0.2, 0.3), "vector wind": (1, 0, 0)})
    written.write(tmp_path / "a.rib")
    kanuka.convert_rib(str(tmp_path / "a.rib"), str(tmp_path / "b.rib"))
    text = (tmp_path / "b.rib").read_text()
    assert 'Attribute "instance:primvar" "uniform float wetness" [0.25]' in text
    assert '"uniform vector wind" [1 0 0]' in text
    read = kanuka.load(tmp_path / "a.rib")
    assert read.summary()["instances"] == 6
    read.options.shader_path = SHADERS
    read.resolution = 96, 32
    read.camera = kanuka.Camera((0, 0.6, 9), (0, 0, 0), fov=18)
    read.add_light("environment", amount=1)
    expected = given["leaf"] * (1 - 0.8 * given["wetness"])[:, None]
    assert middles(read) == pytest.approx(expected, abs=0.012)


# ---- errors ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"wetness": [0, 1]}, "wetness: 2 values fit nothing here; one of 3 (uniform), 1 (constant)"),
        ({"wetness": [0, float("nan"), 1]}, "primvars: wetness: expected finite numbers"),
        ({"tint": [(1, 1, 1)] * 3}, "primvars: tint: instances have a value of that name"),
        ({"int wetness": [0, 1, 2]}, "primvars: wetness: expected a float, color, point, vector, normal, matrix"),
    ],
)
def test_what_does_not_fit_is_refused(given: dict, text: str) -> None:
    scene = stage()
    group = scene.add_group("card")
    card(group)
    with pytest.raises(ValueError, match=re.escape(text)):
        scene.add_instances(group, row(3), primvars=given)
