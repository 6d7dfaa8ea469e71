"""Nodes of a scene by name: a scene that was edited makes the picture of one that was made so at once."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

import kanuka

POINTS = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32)
QUAD = np.array([[0, 1, 2, 3]], np.int32)
MOVED = np.array([[1, 0, 0, 0.5], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], float)


def make(**lamp: object) -> kanuka.Scene:
    scene = kanuka.Scene()
    scene.resolution = 16, 16
    scene.camera = kanuka.Camera((0, 0, 3), (0, 0, 0), fov=50)
    scene.add_mesh(POINTS, QUAD, name="wall", material="matte")
    scene.add_light("point", **({"position": (0, 0, 2), "amount": 3, "name": "lamp"} | lamp))
    return scene


def same_picture(a: kanuka.Scene, b: kanuka.Scene) -> bool:
    pictures = [np.asarray(kanuka.render(s, progressions=2)["rgb"]) for s in (a, b)]
    assert pictures[0].max() > 0
    return np.array_equal(*pictures)


@pytest.mark.parametrize(
    "values",
    [
        {"amount": (2, 1, 0)},
        {"position": (0.5, 0, 1), "radius": 0.2},
        {"decay": 1},
        {"group": "keys"},
    ],
)
def test_a_light_is_as_if_it_had_been_made_so(values: dict[str, object]) -> None:
    scene = make()
    scene.node("lamp").set(**values)
    assert same_picture(scene, make(**values))
    parameters = scene.node("lamp").parameters
    assert all(np.allclose(parameters[name], value) for name, value in values.items() if name != "group")


def test_lights_and_primitives_are_placed_as_when_they_are_made() -> None:
    scene, whole = make(), kanuka.Scene()
    scene.node("lamp").place(MOVED)
    scene.node("wall").place(MOVED)
    whole.resolution = 16, 16
    whole.camera = scene.camera
    whole.add_mesh(POINTS, QUAD, material="matte", transform=MOVED)
    whole.add_light("point", position=(0, 0, 2), amount=3, transform=MOVED)
    assert same_picture(scene, whole)


def test_what_is_removed_leaves_nothing() -> None:
    scene = make()
    extra = scene.add_light("distant", name="extra")
    group = scene.add_group("things")
    group.add_sphere(0.2)
    places = scene.add_instances(group, np.eye(4)[None])
    assert not same_picture(scene, make())
    with pytest.raises(ValueError, match='group "things" is placed by 1 instances; remove those as well'):
        scene.remove([extra, group.node])
    scene.remove([extra, group.node, places])
    assert same_picture(scene, make())
    with pytest.raises(ValueError, match="was removed"):
        group.add_sphere()
    with pytest.raises(ValueError, match="was removed"):
        extra.set(amount=1)


def test_attributes_camera_and_options() -> None:
    scene = make()
    scene.node("wall").set(visible_camera=False, lights_off=["lamp"])
    assert scene.node("wall").parameters["lights_off"] == ["lamp"]
    assert scene.node("wall").parameters["visible_camera"] is False
    assert not np.asarray(kanuka.render(scene, progressions=1)["rgb"]).any()
    scene.node("wall").set(visible_camera=True, lights_off=[])
    scene.node("camera").set(fov=30)
    assert scene.camera.fov == scene.node("camera").parameters["fov"] == 30
    whole = make()
    whole.camera = kanuka.Camera((0, 0, 3), (0, 0, 0), fov=30)
    assert same_picture(scene, whole)
    scene.options.seed = 7
    assert scene.options.seed == 7
    with pytest.raises(ValueError, match="seed: expected"):
        scene.options.seed = -1


def test_shaders_by_their_slots(tmp_path: Path) -> None:
    (tmp_path / "tint.sl").write_text("class tint(color c = 1) { public color get() { return c; } }")
    (tmp_path / "wall.sl").write_text(
        "class wall(float k = 1; shader base = null) { public void surface(output color Ci, Oi) {\n"
        "  Ci = k; if (base != null) Ci *= base->get(); Oi = 1; } }"
    )

    def painted(k: float, c: tuple[float, float, float]) -> kanuka.Scene:
        scene = kanuka.Scene()
        scene.resolution = 8, 8
        scene.options.shader_path = [str(tmp_path)]
        scene.camera = kanuka.Camera((0, 0, 1), (0, 0, 0), fov=40)
        material = kanuka.Material("wall", k=k, base=kanuka.Shader("tint", c=c))
        scene.add_mesh(POINTS, QUAD, name="wall", material=material)
        return scene

    scene = painted(1, (1, 1, 1))
    surface = scene.node("wall", "surface")
    assert surface.kind == "shader"
    assert surface.parameters["k"] == 1
    surface.set(k=0.5)
    surface.shader("base").set(c=(1, 0.5, 0.25))
    assert same_picture(scene, painted(0.5, (1, 0.5, 0.25)))
    with pytest.raises(ValueError, match="has no co-shader bse; did you mean base"):
        surface.shader("bse")
    with pytest.raises(ValueError, match="k: expected a float, got a color"):
        surface.set(k=(1, 0, 0))


RIB = """\
Format 16 16 1
Projection "perspective" "fov" 50
Translate 0 0 3
WorldBegin
LightSource "pointlight" "key" "from" [0 0 -2] "intensity" %s
LightSource "ambientlight" 1 "intensity" 0.1
ObjectBegin "leaf" AttributeBegin Attribute "identifier" "name" "blade" Sphere 0.2 -0.2 0.2 360 AttributeEnd ObjectEnd
AttributeBegin
Attribute "identifier" "name" "ball"
Surface "matte" "Kd" %s
Sphere 0.5 -0.5 0.5 360
AttributeEnd
Translate 1 0 0
ObjectInstance "leaf"
WorldEnd
"""


def loaded(folder: Path, intensity: float, kd: float) -> kanuka.Scene:
    path = folder / "scene.rib"
    path.write_text(RIB % (intensity, kd))
    return kanuka.load(path)


def test_files_are_edited_as_scenes_of_python_are(tmp_path: Path) -> None:
    scene = loaded(tmp_path, 3, 1)
    scene.node("key").set(intensity=6)
    scene.node("ball", "surface").set(Kd=0.5)
    assert same_picture(scene, loaded(tmp_path, 6, 0.5))
    assert scene.node("leaf").kind == "group"
    assert scene.node("leaf", "blade").name == "blade"
    assert scene.node(2) == scene.node("ball")
    with pytest.raises(ValueError, match='light "key" has no parameter intensty; did you mean intensity'):
        scene.node("key").set(intensty=1)


def test_ids_are_those_of_every_reading(tmp_path: Path) -> None:
    a, b = (loaded(tmp_path, k, 1) for k in (1, 2))
    for path in (["ball"], ["key"], ["1"], ["leaf"], ["leaf", "blade"], ["camera"]):
        assert a.node(*path).id == b.node(*path).id
        assert hash(a.node(*path)) == hash(b.node(*path))
    assert a.node("ball") != b.node("ball")  # of another scene
    assert kanuka.Scene().add_light("point", name="key").id == a.node("key").id


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda s: s.node("lmap"), ValueError, 'there is no node "lmap"; did you mean lamp?'),
        (lambda s: s.node("lamp", kind="group"), ValueError, 'there is no group "lamp"'),
        (lambda s: s.node("lamp", king="light"), TypeError, "node() has no argument king; did you mean kind?"),
        (lambda s: s.node(), TypeError, "node() needs a name"),
        (lambda s: s.node(99), ValueError, "there is no primitive of number 99"),
        (lambda s: s.node(b"lamp"), TypeError, "path: expected str, got b'lamp' (bytes)"),
        (lambda s: s.node("wall", "surfce"), ValueError, "has no shader surfce; did you mean surface?"),
        (lambda s: s.node("lamp").set(radios=1), ValueError, "has no parameter radios; did you mean radius?"),
        (lambda s: s.node("lamp").set(radius=-1), ValueError, "radius: expected"),
        (lambda s: s.node("lamp").set(radius="1"), TypeError, "radius: expected float, got '1' (str)"),
        (lambda s: s.node("lamp").set(amount=9, cone_angle=3), ValueError, "has no parameter cone_angle; it has"),
        (lambda s: s.node("wall").set(name="door"), ValueError, "name: a node is known by it"),
        (lambda s: s.node("wall").set(colour=1), ValueError, 'primitive "wall" has no attribute colour'),
        (lambda s: s.node("camera").set(fov=200), ValueError, "fov: the field of view must lie"),
        (lambda s: s.node("wall").place(np.zeros((4, 4))), ValueError, "transform: it flattens"),
        (lambda s: s.remove([s.node("camera")]), ValueError, "the camera cannot be removed"),
        (lambda s: s.remove([make().node("lamp")]), ValueError, "nodes: one belongs to another scene"),
        (lambda s: s.remove([None]), TypeError, "nodes: expected Sequence[Node], got None in it"),
        (lambda s: s.node("wall").node("surface", kind="light"), ValueError, "there is no light"),
        (lambda s: s.node("wall").node(), TypeError, "node() needs a name"),
    ],
)
def test_refusals_change_nothing(call, error: type[Exception], words: str) -> None:
    scene = make()
    with pytest.raises(error) as raised:
        call(scene)
    assert words in str(raised.value)
    assert same_picture(scene, make())


def test_names_that_are_given_twice_are_told() -> None:
    scene = make()
    second = scene.add_sphere(0.1, name="wall")
    assert scene.node("wall#2") == scene.node(second)
    assert [m.severity for m in scene.journal] == ["info"]
    group = scene.add_group("wall")
    with pytest.raises(ValueError, match='"wall" is the name of several nodes: say kind=, one of primitive, group'):
        scene.node("wall")
    assert scene.node("wall", kind="group") == group.node
    assert repr(group.node) == '<kanuka.Node: group "wall">'


def test_nodes_behind_a_name_that_several_have() -> None:
    scene = make()
    group = scene.add_group("wall")
    group.add_sphere(0.2, name="leaf", material="plastic")
    assert scene.node("wall", "leaf").name == "leaf"
    assert scene.node("wall", "leaf", "surface").kind == "shader"
    assert scene.node("wall", "surface") == scene.node("wall", "surface", kind="shader")
    assert group.node.node("leaf") == scene.node("wall", "leaf")
    assert group.node.node("leaf", kind="primitive") == scene.node("wall", "leaf")
    assert scene.node("wall", kind="primitive").node("surface").kind == "shader"
    with pytest.raises(ValueError, match='there is no node "laef"; did you mean leaf'):
        group.node.node("laef")
    with pytest.raises(ValueError, match='none of primitive "wall", group "wall" has "door"'):
        scene.node("wall", "door")


def test_nodes_are_compared_with_anything() -> None:
    node = make().node("lamp")
    assert node != None  # noqa: E711
    assert node not in [1, "lamp", None]
    assert node in [1, node]


def test_lights_that_are_added_to_a_file_shine(tmp_path: Path) -> None:
    scene, dark = loaded(tmp_path, 0, 1), loaded(tmp_path, 0, 1)
    scene.add_light("point", position=(0, 0, -2), amount=30)
    lit, unlit = (np.asarray(kanuka.render(s, progressions=1)["rgb"]).mean() for s in (scene, dark))
    assert lit > 2 * unlit
    named = loaded(tmp_path, 0, 1)
    named.add_light_shader(kanuka.Shader("pointlight", intensity=10, **{"point from": (0, 0, -2)}), name="fill")
    assert np.asarray(kanuka.render(named, progressions=1)["rgb"]).mean() > 2 * unlit


PROCEDURAL = """\
Format 16 16 1
Projection "perspective" "fov" 50
Translate 0 0 3
WorldBegin
LightSource "ambientlight" 1 "intensity" 0.1
ObjectBegin "leaf" Sphere 0.2 -0.2 0.2 360 ObjectEnd
Procedural "DynamicLoad" ["ball" ""] [-1 1 -1 1 -1 1]
WorldEnd
"""


def on_demand(folder: Path) -> kanuka.Scene:
    (folder / "scene.rib").write_text(PROCEDURAL)
    body = 'Color 1 0 0 ObjectInstance "leaf" Translate 0.5 0 0 Color 0 1 0 ObjectInstance "leaf"\n'
    return kanuka.load(folder / "scene.rib", on_demand=True, procedurals={"ball": lambda *_, **__: body})


def test_scenes_that_are_read_on_demand(tmp_path: Path) -> None:
    scene, dark = on_demand(tmp_path), on_demand(tmp_path)
    with pytest.raises(ValueError, match="read on demand"):
        scene.add_group("more")
    scene.add_light("point", position=(0, 0, -2), amount=30)
    lit, unlit = (np.asarray(kanuka.render(s, progressions=1)["rgb"]).mean() for s in (scene, dark))
    assert unlit > 0
    assert lit > 2 * unlit
    dark.add_light("point", position=(0, 0, -2), amount=30)  # the part is read already
    assert same_picture(scene, dark)


def test_a_light_shader_that_is_not_found_is_told_and_stood_in_for() -> None:
    scene = kanuka.Scene()
    scene.resolution = 8, 8
    scene.camera = kanuka.Camera((0, 0, 3), (0, 0, 0), fov=50)
    scene.add_mesh(POINTS, QUAD, material="matte")
    turned = np.diag([1.0, 1, -1, 1])  # it shines along -z
    light = scene.add_light_shader(kanuka.Shader("uberlight", intensity=5), turned)
    with pytest.warns(kanuka.Warning, match='light shader "uberlight" is not found .* searched in .* stands in'):
        picture = kanuka.render(scene, progressions=1)
    first = np.asarray(picture["rgb"])
    assert first.mean() > 0
    light.set(intensity=10)
    with pytest.warns(kanuka.Warning):
        second = np.asarray(kanuka.render(scene, progressions=1)["rgb"])
    np.testing.assert_allclose(second, 2 * first, rtol=1e-5)


def test_what_stands_in_for_a_light_follows_all_of_its_parameters(tmp_path: Path) -> None:
    text = """Format 16 16 1
Projection "perspective" "fov" 50
Translate 0 0 3
WorldBegin
LightSource "liquidspot" "key" "point from" [0 0 -2] "point to" [0 0 0] "float intensity" 9 "float coneangle" 0.3
  "float penumbraangle" %s "float decay" %s
Surface "matte"
Sphere 0.8 -0.8 0.8 360
WorldEnd
"""

    def read(*values: object) -> kanuka.Scene:
        (tmp_path / "light.rib").write_text(text % values)
        return kanuka.load(tmp_path / "light.rib")

    with pytest.warns(kanuka.Warning, match="stands in"):
        scene = read(0, 2)
        before = np.asarray(kanuka.render(scene, progressions=1)["rgb"])
        scene.node("key").set(penumbraangle=0.1, decay=0)
        after = np.asarray(kanuka.render(scene, progressions=1)["rgb"])
        expected = np.asarray(kanuka.render(read(0.1, 0), progressions=1)["rgb"])
    assert not np.array_equal(after, before)
    np.testing.assert_array_equal(after, expected)


def test_shader_parameters_are_read_and_written_alike() -> None:
    values = {
        "int steps": 3,
        "k": 0.5,
        "color c": (1, 0.5, 0.25),
        "float[3] row": [1, 2, 3],
        "float[2] pair": [1, 2],
        "point centre": (1, 2, 3),
        "hpoint h": (1, 2, 3, 1),
        "matrix m": np.arange(16).reshape(4, 4),
        "color[2] two": [[1, 0, 0], [0, 1, 0]],
        "string file": "a.tx",
        "string[2] files": ["a.tx", "b.tx"],
    }
    scene = kanuka.Scene()
    scene.add_sphere(1, name="ball", material=kanuka.Shader("any", **values))
    surface = scene.node("ball", "surface")
    before = surface.parameters
    for key, value in values.items():
        name = key.split()[-1]
        assert np.array_equal(before[name], value), key
        surface.set(**{name: before[name]})
        surface.set(**{name: value})
    after = surface.parameters
    assert list(after) == list(before)
    assert all(np.array_equal(after[name], before[name]) for name in before)
    assert isinstance(after["steps"], int)
    surface.set(steps=4, row=[4, 5, 6], c=kanuka.Spectrum("D65"))
    assert surface.parameters["steps"] == 4
    surface.set(c=(1, 0, 0))
    assert np.array_equal(surface.parameters["c"], (1, 0, 0))
    for wrong, words in [
        ({"steps": 2.5}, "steps: expected a whole number, got 2.5"),
        ({"row": [1, 2]}, r'row: expected a float\[3\], got a float\[2\]; it is declared "float\[3\] row"'),
        ({"pair": [1, 2, 3]}, r"pair: expected a float\[2\]"),
        ({"k": (1, 2, 3)}, 'k: expected a float, got a color; it is declared "float k"'),
        ({"m": np.eye(3)}, "m: expected a matrix"),
    ]:
        with pytest.raises(ValueError, match=words):
            surface.set(**wrong)


class Grows:
    """An array whose reading changes the scene that it goes to."""

    def __init__(self, values: np.ndarray, act) -> None:
        self.values, self.act = values, act

    def __array__(self, dtype: object = None, copy: object = None) -> np.ndarray:
        self.act()
        return np.asarray(self.values, dtype)


def test_what_happens_while_arguments_are_read() -> None:
    scene = kanuka.Scene()
    group = scene.add_group("first")

    def grow() -> None:
        for i in range(100):
            scene.add_group(str(i))

    group.add_mesh(Grows(POINTS, grow), QUAD, name="leaf")
    assert group.node.node("leaf").kind == "primitive"
    lamp = scene.add_light("point", name="lamp")
    lamp.place(Grows(MOVED, lambda: [scene.add_light("point") for _ in range(100)]))
    other = scene.add_group("other")
    gone: list[None] = []
    with pytest.raises(ValueError, match="was removed"):
        other.add_mesh(Grows(POINTS, lambda: gone or gone.append(scene.remove([other.node]))), QUAD)


def test_numbers_of_primitives_are_found_fast() -> None:
    scene = kanuka.Scene()
    numbers = [scene.add_sphere(1, name=f"ball {i}") for i in range(30000)]
    begin = time.perf_counter()  # one by one it took minutes
    nodes = [scene.node(n) for n in numbers]
    assert time.perf_counter() - begin < 2
    assert [n.name for n in nodes[:3]] == ["ball 0", "ball 1", "ball 2"]
    scene.remove(nodes[:2])
    with pytest.raises(ValueError, match="there is no primitive of number"):
        scene.node(numbers[0])
    assert scene.node(numbers[5]).name == "ball 5"
    assert scene.node(scene.add_sphere(1, name="last")).name == "last"
