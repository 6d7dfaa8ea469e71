"""Texts and matrices that instances bring to surface shaders, compared with things that have these themselves."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import kanuka
import kanuka.rib
from test_instance_primvars import FAR, card, middles, rib, told
from test_instance_variation import SHADERS, close, moved, row, stage
from test_sessions import same

SOURCES = {
    "painted": """surface painted(uniform string tex = ""; uniform float wetness = 0; uniform string pair[2] = {"", ""};
            uniform float variant = 0;) {
    uniform string file = pair[1] != "" ? pair[1] : tex;
    color shown = file == "" ? color(0.5) : color texture(file, s, t);
    if (variant > 0.5)
        shown = color(0.6, 0.3, 0.6);
    Oi = 1;
    Ci = shown * (1 - 0.8 * wetness) * diffuse(faceforward(normalize(N), I));
}
""",
    "framed": """surface framed(uniform matrix frame = 1;) {
    point q = transform(frame, P);
    Oi = 1;
    Ci = color(0.5 + 0.4 * sin(5 * xcomp(q)), 0.5 + 0.4 * sin(5 * ycomp(q)), 0.4) * diffuse(normalize(N));
}
""",
    "stencil": """class stencil(uniform string tex = "";) {
    public color of(float a, b;) { return tex == "" ? color(0.5) : color texture(tex, a, b); }
}
""",
    "stencilled": """class stencilled(uniform string by = "";) {
    public void surface(output color Ci, Oi;) {
        shader other = getshader(by);
        Oi = 1;
        Ci = other->of(s, t) * diffuse(normalize(N));
    }
}
""",
}
COLORS = {"red": (0.8, 0.2, 0.1), "green": (0.2, 0.7, 0.1), "blue": (0.3, 0.3, 0.6), "grey": (0.4, 0.4, 0.4)}


@pytest.fixture(autouse=True, scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Pictures by their names: of one colour each, and "bands" and "waves" of several."""
    folder = tmp_path_factory.mktemp("shaders")
    for name, text in SOURCES.items():
        (folder / f"{name}.sl").write_text(text)
    SHADERS[:] = [str(folder)]
    y, x = np.mgrid[:64, :64] / 64
    made = {name: np.tile(np.float32(rgb), (64, 64, 1)) for name, rgb in COLORS.items()}
    made["bands"] = np.stack([0.4 + 0.3 * np.sin(12 * y), 0.5 + 0.2 * np.sin(9 * x), 0.3 + 0 * x], -1)
    made["waves"] = np.stack([0.3 + 0 * x, 0.4 + 0.3 * np.sin(20 * x * y), 0.5 + 0.2 * np.cos(9 * y)], -1)
    found = {}
    for name, pixels in made.items():
        path = folder / f"{name}.pfm"
        path.write_bytes(b"PF\n64 64\n-1.0\n" + np.asarray(pixels, "<f4")[::-1].tobytes())
        kanuka.make_texture([str(path)], str(folder / f"{name}.tx"))
        found[name] = str(folder / f"{name}.tx")
    return found


def instanced(places: np.ndarray, primvars: dict, *, look: object = "painted", unique: bool = False) -> kanuka.Scene:
    scene = stage()
    group = scene.add_group("card")
    card(group, look)
    scene.add_instances(group, places, primvars=primvars, unique=unique)
    return scene


def alone(places: np.ndarray, each: list[dict], look: object = "painted") -> kanuka.Scene:
    """A group for each, whose mesh has the variables."""
    scene = stage()
    for place, primvars in zip(places, each, strict=True):
        group = scene.add_group("card")
        card(group, look, primvars=primvars)
        scene.add_instances(group, place[None])
    return scene


def painted(files: dict[str, str], names: list[str], *more: dict) -> np.ndarray:
    """The middles of three cards that have pictures themselves."""
    each = [{"tex": files[name]} for name in names]
    return middles(alone(row(3), [a | b for a, b in zip(each, more or [{}] * 3, strict=True)]))


def with_far(count: int) -> np.ndarray:
    """Three in the picture, and more that are not."""
    far = [moved(k, 0, FAR) for k in range(count)]
    return np.concatenate([row(3), np.stack(far).astype(np.float32)])


FRAMES = [np.diag([1, 2, 1, 1.0]), np.eye(4), np.array([[0, 1, 0, 0.3], [-1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])]


# ---- few values are exact --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("memory", [None, "1G"])  # Embree's, and pages of our own
def test_few_texts_are_those_of_things_that_have_them(files: dict[str, str], memory: str | None) -> None:
    texts = [files[name] for name in ("bands", "waves", "red")]
    one, other = instanced(row(3), {"tex": texts}), alone(row(3), [{"tex": text} for text in texts])
    a, b = (kanuka.render(scene, progressions=4, memory=memory) for scene in (one, other))
    assert same(a, kanuka.render(one, progressions=4, memory=memory, threads=1))
    difference = np.abs(np.asarray(a["rgb"], np.float64) - np.asarray(b["rgb"], np.float64))
    assert difference.mean() < 2e-3  # a group has the rate of its closest place
    assert np.abs(middles(one) - middles(other)).max() < 0.01
    assert middles(one)[2] == pytest.approx(COLORS["red"], abs=0.01)


@pytest.mark.parametrize("kind", ["text", "array", "matrix"])
def test_one_of_many_is_that_thing_to_the_bit(files: dict[str, str], kind: str) -> None:
    """One instance in the picture: both are diced for it alone."""
    places = np.concatenate([row(1), np.stack([moved(0, 0, FAR)]).astype(np.float32)])
    look, key, values = {
        "text": ("painted", "tex", [files["bands"], files["waves"]]),
        "array": ("painted", "string[2] pair", [["", files["bands"]], ["x", files["waves"]]]),
        "matrix": ("framed", "frame", [FRAMES[0], FRAMES[2]]),
    }[kind]
    for given in (values, values[::-1]):
        a = kanuka.render(instanced(places, {key: given}, look=look), progressions=4)
        two = stage()
        group = two.add_group("card")
        card(group, kanuka.Material(look, parameters={key: given[0]}))
        two.add_instances(group, places)
        assert same(a, kanuka.render(two, progressions=4)), given


def test_matrices_are_those_of_shapes(files: dict[str, str]) -> None:
    """By the variable of a mesh: a matrix that acts on columns, in its space."""
    one = instanced(row(3), {"frame": np.stack(FRAMES)}, look="framed")
    for each in ([{"matrix frame": m} for m in FRAMES], [{"constant matrix frame": m[None]} for m in FRAMES]):
        other = alone(row(3), each, look="framed")
        assert np.abs(middles(one) - middles(other)).max() < 0.01
    assert np.abs(middles(one)[0] - middles(one)[2]).max() > 0.05
    for all_alike in (FRAMES[2], FRAMES[2][None]):
        alike = instanced(row(3), {"frame": all_alike}, look="framed")
        assert np.abs(middles(alike) - middles(alone(row(3), [{"matrix frame": FRAMES[2]}] * 3, "framed"))).max() < 0.01


def test_equal_texts_are_shaded_once(files: dict[str, str]) -> None:
    def evaluations(primvars: dict) -> int:
        return kanuka.render(instanced(row(3), primvars), progressions=1).stats["count"]["shader_evaluations"]

    red, blue, green = (files[name] for name in ("red", "blue", "green"))
    once = evaluations({"tex": red})
    assert evaluations({"tex": [red] * 3}) == once
    assert evaluations({"nothing": [red, blue, green]}) == evaluations({})
    two, three = evaluations({"tex": [red, blue, red]}), evaluations({"tex": np.array([red, blue, green])})
    assert three - two == two - once > 0


def test_lists_of_a_group_have_one_numbering(files: dict[str, str]) -> None:
    """The second list begins with the last text of the first; one says nothing of it, and one has a number too."""
    scene = stage()
    group = scene.add_group("card")
    card(group, "painted")
    places = row(5)
    scene.add_instances(group, places[:2], primvars={"tex": [files["red"], files["blue"]]})
    scene.add_instances(group, places[2:3], primvars={"tex": [files["blue"]], "wetness": 0.5})
    scene.add_instances(group, places[3:4])
    scene.add_instances(group, places[4:], primvars={"wetness": [1]})
    red, blue = np.array(COLORS["red"]), np.array(COLORS["blue"])
    expected = np.stack([red, blue, blue * 0.6, [0.5] * 3, [0.1] * 3])
    scene.camera = kanuka.Camera((0, 0.6, 15), (0, 0, 0), fov=18)
    albedo = np.asarray(kanuka.render(scene, progressions=8)["albedo"], np.float64)
    columns = [round(48 + 12.7 * (k - 2)) for k in range(5)]
    shown = np.stack([albedo[14:18, c - 1 : c + 2].mean((0, 1)) for c in columns])
    assert shown == pytest.approx(expected, abs=0.015)


# ---- many are not ----------------------------------------------------------------------------------------------------


def test_of_too_many_the_most_frequent_are_exact(files: dict[str, str]) -> None:
    names = ["green", "blue", "red"] + ["blue"] * 3 + ["red"] * 2 + ["grey"]
    scene = instanced(with_far(6), {"tex": [files[name] for name in names]})
    for variants, expected in (
        (1, ["blue"] * 3),
        (2, ["blue", "blue", "red"]),  # most have blue, then red; others show the most frequent
        (3, ["green", "blue", "red"]),  # of equally frequent ones the first
        (4, ["green", "blue", "red"]),
    ):
        shown = middles(scene, instance_variants=variants)
        assert shown == pytest.approx(painted(files, expected), abs=0.002), variants
    text = told(scene, instance_variants=2)
    assert '4 values of "tex", and its surfaces are shaded with 2' in text
    assert "the most frequent texts and matrices. 2 instances of 9 have others, and show the nearest" in text
    assert "frequent" not in told(scene)


def test_many_numbers_are_blended_within_a_text(files: dict[str, str]) -> None:
    """Of each text as many as there is room for; nothing lies between two texts."""
    rng = np.random.default_rng(5)
    wetness = np.concatenate([[0.15, 0.62, 0.83], rng.uniform(0, 1, 40)]).astype(np.float32)
    names = ["red", "green", "blue"] + ["green", "red", "blue", "red"] * 10
    scene = instanced(with_far(40), {"tex": [files[name] for name in names], "wetness": wetness})
    assert '43 values of "tex", "wetness", and its surfaces are shaded with 6: instances are blended' in told(scene)
    expected = np.array([COLORS[name] for name in names[:3]]) * (1 - 0.8 * wetness[:3, None])
    for variants in (6, 8, 12):
        assert middles(scene, instance_variants=variants) == pytest.approx(expected, abs=0.01), variants


def test_of_many_sets_numbers_are_the_nearest_of_their_text(files: dict[str, str]) -> None:
    """Two numbers: clusters of each text by itself, whichever numbers are close in others."""
    rng = np.random.default_rng(6)
    base = np.array([(0.7, 0.3, 0.3), (0.3, 0.6, 0.3)])
    colors = (np.tile(base, (11, 1)) + rng.uniform(-0.02, 0.02, (22, 3))).astype(np.float32)
    (Path(SHADERS[0]) / "washed.sl").write_text(
        """surface washed(uniform string tex = ""; uniform color wash = 1;) {
            Oi = 1; Ci = wash * color texture(tex, s, t) * diffuse(faceforward(normalize(N), I)); }"""
    )
    names = np.array(["red", "blue"] * 11)
    names[[4, 5, 6]] = "blue", "red", "red"
    places = np.concatenate([row(2), with_far(20)[3:]])
    primvars = {"tex": [files[name] for name in names], "color wash": colors}
    scene = instanced(places, primvars, look="washed")
    text = told(scene, instance_variants=4)
    assert "shaded with 4: each instance shows the nearest" in text
    alike = [[k for k in range(22) if names[k] == names[i] and k % 2 == i % 2] for i in range(2)]
    expected = [np.array(COLORS[names[i]]) * colors[alike[i]].mean(0) for i in range(2)]
    assert middles(scene, 2, instance_variants=4) == pytest.approx(np.stack(expected), abs=0.004)


def test_unique_instances_have_their_own(files: dict[str, str]) -> None:
    names = ["bands", "waves", "red"] + ["green", "blue", "grey"] * 4
    scene = instanced(with_far(12), {"tex": [files[name] for name in names]}, unique=True)
    assert "values of" not in told(scene, instance_variants=1)
    other = stage()
    for place, name in zip(with_far(12), names, strict=True):
        card(other, "painted", primvars={"tex": files[name]}, transform=np.vstack([place, [0, 0, 0, 1]]))
    close(kanuka.render(scene, progressions=4), kanuka.render(other, progressions=4))
    framed = instanced(row(3), {"frame": np.stack(FRAMES)}, look="framed", unique=True)
    assert (
        np.abs(middles(framed) - middles(alone(row(3), [{"matrix frame": m} for m in FRAMES], "framed"))).max() < 0.01
    )


# ---- what goes with what ---------------------------------------------------------------------------------------------


def test_co_shaders_read_them(files: dict[str, str], tmp_path: Path) -> None:
    said = ['"uniform string tex" ["{red}"]', '"string tex" "{green}"', '"uniform string tex" ["{blue}"]']
    places = ["Translate -1.9 0 0", "", "Translate 1.9 0 0"]
    lines = "\n".join(
        f'AttributeBegin Attribute "instance:primvar" {text.format(**files)} {at} ObjectInstance "card" AttributeEnd'
        for text, at in zip(said, places, strict=True)
    )
    (tmp_path / "a.rib").write_text(rib('Shader "stencil" "it" Surface "stencilled" "string by" "it" ', lines))
    scene = kanuka.load(tmp_path / "a.rib")
    assert scene.summary()["groups"] == 1
    assert middles(scene) == pytest.approx(painted(files, ["red", "green", "blue"]), abs=0.005)


def test_what_lies_in_a_group_takes_what_is_around_it(files: dict[str, str]) -> None:
    for unique in (False, True):
        scene = stage()
        leaf, tree = scene.add_group("leaf"), scene.add_group("tree")
        card(leaf, "painted")
        tree.add_instances(leaf, np.stack([moved(0)]).astype(np.float32))
        scene.add_instances(tree, row(3), primvars={"tex": [files[n] for n in ("red", "green", "red")]}, unique=unique)
        assert middles(scene) == pytest.approx(np.array([COLORS[n] for n in ("red", "green", "red")]), abs=0.01)


def test_variants_and_tints_go_with_them(files: dict[str, str]) -> None:
    scene = stage()
    group = scene.add_group("card")
    card(group, "painted", variants=2)
    tint = [(1, 1, 1), (0.5, 0.5, 0.5), (1, 1, 1)]
    own = [{}, {}, {"variant": 1.0}]
    tex = [files["red"], files["green"], files["blue"]]
    scene.add_instances(group, row(3), variant=[0, 0, 1], tint=tint, primvars={"tex": tex})
    expected = painted(files, ["red", "green", "blue"], *own) * [[1], [0.5], [1]]
    assert middles(scene) == pytest.approx(expected, abs=0.005)


def test_what_a_shape_has_itself_counts_more(files: dict[str, str]) -> None:
    for unique in (False, True):
        scene = stage()
        group = scene.add_group("card")
        card(group, "painted", primvars={"tex": files["grey"]})
        scene.add_instances(group, row(3), primvars={"tex": [files["red"]] * 3}, unique=unique)
        assert middles(scene) == pytest.approx(np.tile(COLORS["grey"], (3, 1)), abs=0.01)


# ---- sessions and stores ---------------------------------------------------------------------------------------------


def test_a_session_shades_what_changes(files: dict[str, str]) -> None:
    def make(names: list[str]) -> tuple[kanuka.Scene, kanuka.Group, kanuka.Node]:
        scene = stage()
        group = scene.add_group("card")
        card(group, "painted")
        return scene, group, scene.add_instances(group, row(3), primvars={"tex": [files[name] for name in names]})

    scene, group, node = make(["red", "green", "bands"])
    session = kanuka.Session(scene, progressions=2)
    session.advance()
    for names, is_new in ((["red", "waves", "bands"], True), (["bands", "red", "waves"], False)):
        scene.remove([node])
        node = scene.add_instances(group, row(3), primvars={"tex": [files[name] for name in names]})
        session.update()
        session.advance()
        now = session.picture()
        assert same(now, kanuka.render(make(names)[0], progressions=2))
        evaluations = now.stats["count"]["shader_evaluations"]
        assert evaluations > 0 if is_new else evaluations == 0


def test_pages_of_a_store_have_their_values(files: dict[str, str], tmp_path: Path) -> None:
    def scene_of(names: list[str]) -> kanuka.Scene:
        return instanced(row(3), {"tex": [files[name] for name in names]})

    first = kanuka.render(scene_of(["bands", "waves", "red"]), progressions=2, store=tmp_path)
    again = kanuka.render(scene_of(["red", "bands", "waves"]), progressions=2, store=tmp_path)  # the same set
    assert again.stats["count"]["shader_evaluations"] < first.stats["count"]["shader_evaluations"] / 2
    other = scene_of(["red", "bands", "blue"])
    assert same(kanuka.render(other, progressions=2, store=tmp_path), kanuka.render(other, progressions=2))


# ---- files -----------------------------------------------------------------------------------------------------------


def test_rib_is_written_and_read(files: dict[str, str], tmp_path: Path) -> None:
    def fill(scene: object, names: list[str]) -> None:
        painted, framed = scene.add_group("painted"), scene.add_group("framed")
        card(painted, "painted")
        card(framed, "framed")
        scene.add_instances(painted, row(3)[:2], primvars={"tex": [files[name] for name in names]})
        scene.add_instances(framed, row(3)[2:], primvars={"frame": FRAMES[2]})
        far = np.stack([moved(k, 0, FAR) for k in range(3)])
        scene.add_instances(painted, far, primvars={"tex": "one", "string[2] pair": [["a b", 'c "d"']] * 3})
        scene.add_instances(framed, far, primvars={"matrix frame": np.stack(FRAMES)})

    written, plain = kanuka.rib.RibScene(), stage()
    fill(written, ["red", "bands"])
    fill(plain, ["red", "bands"])
    written.write(tmp_path / "a.rib")
    kanuka.convert_rib(str(tmp_path / "a.rib"), str(tmp_path / "b.rib"))
    text = (tmp_path / "b.rib").read_text()
    assert f'Attribute "instance:primvar" "uniform string tex" ["{files["red"]}"]' in text
    assert '"uniform string[2] pair" ["a b" "c \\"d\\""]' in text
    assert '"uniform matrix frame" [0 -1 0 0 1 0 0 0 0 0 1 0 0.3 0 0 1]' in re.sub("0.30000\\d+", "0.3", text)
    for name in "ab":
        read = kanuka.load(tmp_path / f"{name}.rib")
        assert read.summary()["groups"] == 2
        assert read.summary()["instances"] == 9
        read.options.shader_path = SHADERS
        read.resolution = 96, 32
        read.camera = kanuka.Camera((0, 0.6, 9), (0, 0, 0), fov=18)
        read.add_light("environment", amount=1)
        assert middles(read) == pytest.approx(middles(plain), abs=0.012)


def test_meshes_write_their_matrices(tmp_path: Path) -> None:
    written, plain = kanuka.rib.RibScene(), stage()
    for scene in (written, plain):
        for place, frame in zip(row(3), FRAMES, strict=True):
            at = np.vstack([place, [0, 0, 0, 1]])
            card(scene, "framed", primvars={"matrix frame": frame}, transform=at)
    written.write(tmp_path / "a.rib")
    read = kanuka.load(tmp_path / "a.rib")
    read.options.shader_path = SHADERS
    read.resolution = 96, 32
    read.camera = kanuka.Camera((0, 0.6, 9), (0, 0, 0), fov=18)
    read.add_light("environment", amount=1)
    assert middles(read) == pytest.approx(middles(plain), abs=0.012)


# ---- errors ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"tex": ["a", "b"]}, "tex: 2 values fit nothing here; one of 3 (uniform), 1 (constant)"),
        ({"float tex": ["a", "b", "c"]}, "float tex: expected numbers, got texts"),
        ({"string[2] pair": [["a", "b"], ["c"], ["d", "e"]]}, "expected 2 texts a value, got 1"),
        ({"tint": ["a", "b", "c"]}, "primvars: tint: instances have a value of that name"),
        ({"matrix frame": np.full((3, 4, 4), np.inf)}, "primvars: frame: expected finite numbers"),
        ({"hpoint frame": np.ones((3, 4))}, "primvars: frame: expected a float, color, point, vector, normal, matrix"),
    ],
)
def test_what_does_not_fit_is_refused(given: dict, text: str) -> None:
    scene = stage()
    group = scene.add_group("card")
    card(group)
    with pytest.raises(ValueError, match=re.escape(text)):
        scene.add_instances(group, row(3), primvars=given)


def test_what_is_no_text_is_refused() -> None:
    scene = stage()
    group = scene.add_group("card")
    card(group)
    with pytest.raises(TypeError, match="tex: expected"):
        scene.add_instances(group, row(3), primvars={"tex": ["a", 1, "b"]})


def test_a_text_for_a_number_is_told_with_its_line(tmp_path: Path) -> None:
    """The shader's default stands."""
    (tmp_path / "a.rib").write_text(
        rib('Surface "framed"', 'Attribute "instance:primvar" "string frame" "x"\nObjectInstance "card"')
    )
    text = told(kanuka.load(tmp_path / "a.rib"))
    assert "a.rib:11" in text
    assert 'parameter "frame" of shader "framed" is a matrix, not a string; its default is kept' in text


def test_values_of_two_types_do_not_count(files: dict[str, str]) -> None:
    scene = stage()
    group = scene.add_group("card")
    card(group, "painted")
    scene.add_instances(group, row(3)[:2], primvars={"tex": [files["red"], files["blue"]]})
    scene.add_instances(group, row(3)[2:], primvars={"tex": [1.0]})
    assert 'the variable "tex" as values of two types: none of them counts' in told(scene)
    assert middles(scene) == pytest.approx(np.full((3, 3), 0.5), abs=0.01)
