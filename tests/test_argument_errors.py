"""Every argument of every public call, given what it cannot be: the error is Python's, and names the argument."""

from __future__ import annotations

import ast
import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import kanuka
from kanuka import _native

POINTS = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32)
MESH = {"points": POINTS, "faces": np.array([[0, 1, 2, 3]], np.int32)}
MOVING = np.stack([np.eye(4)[None]] * 2)
PICTURE = {"rgb": np.ones((2, 2, 3), np.float32)}
SHADER = "surface plain(float Kd = 1;) { Ci = Kd; }"


def picture() -> kanuka.Picture:
    return kanuka.Picture(PICTURE)


def compiled() -> kanuka.CompiledShader:
    return kanuka.compile_shader("plain.sl", source=SHADER)


def saved_checkpoint() -> kanuka.Checkpoint:
    scene = kanuka.Scene()
    scene.resolution = 2, 2
    session = kanuka.Session(scene, progressions=1, journal=kanuka.Journal())
    session.advance()
    with tempfile.TemporaryDirectory() as folder:
        session.save(Path(folder) / "state")
        return kanuka.merge([Path(folder) / "state"])


def scene_with_group() -> tuple[kanuka.Scene, kanuka.Group]:
    scene = kanuka.Scene()
    return scene, scene.add_group("a")


def with_group(call: Callable) -> Callable:
    def run(**given):
        scene, group = scene_with_group()
        return call(scene, **({"group": group} | given))

    return run


POINTS = {"points": [(0, 0, 0), (1, 0, 0)]}
CURVE = POINTS | {"counts": [2]}
LATTICE = {"points": np.zeros((4, 4, 3), np.float32)}
KNOTS = {"u_knots": [0, 0, 0, 0, 1, 1, 1, 1], "v_knots": [0, 0, 0, 0, 1, 1, 1, 1]}
BLOB = {"leaves": 1, "code": [1001, 0], "floats": np.eye(4).reshape(-1)}

# For each call, what makes it and what it needs; all else that it takes is in its signature.
CALLS: dict[str, tuple[Callable, dict[str, object]]] = {
    "Camera": (kanuka.Camera, {"origin": (0, 0, 1), "target": (0, 0, 0)}),
    "Camera.from_matrix": (kanuka.Camera.from_matrix, {"world_from_camera": np.eye(4)}),
    "Camera.moving": (kanuka.Camera.moving, {"cameras": [kanuka.Camera((0, 0, 1), (0, 0, 0))]}),
    "Checkpoint.save": (lambda **given: saved_checkpoint().save(**given), {"path": "state"}),
    "CompiledShader.run": (lambda **given: compiled().run(**given), {}),
    "Group.add_instances": (
        with_group(lambda scene, **given: scene.add_group("b").add_instances(**given)),
        {"transforms": MOVING},
    ),
    "Group.add_blobby": (lambda **given: kanuka.Scene().add_group().add_blobby(**given), BLOB),
    "Group.add_hyperboloid": (lambda **given: kanuka.Scene().add_group().add_hyperboloid(**given), {}),
    "Group.add_nurbs": (lambda **given: kanuka.Scene().add_group().add_nurbs(**given), LATTICE | KNOTS),
    "Group.add_paraboloid": (lambda **given: kanuka.Scene().add_group().add_paraboloid(**given), {}),
    "Group.add_patches": (lambda **given: kanuka.Scene().add_group().add_patches(**given), LATTICE),
    "Group.add_solid": (lambda **given: kanuka.Scene().add_group().add_solid(**given), {"kind": "union"}),
    "Group.add_volume": (lambda **given: kanuka.Scene().add_group().add_volume(**given), {}),
    "Group.add_mesh": (lambda **given: kanuka.Scene().add_group().add_mesh(**given), MESH),
    "Group.add_cone": (lambda **given: kanuka.Scene().add_group().add_cone(**given), {}),
    "Group.add_curves": (lambda **given: kanuka.Scene().add_group().add_curves(**given), CURVE),
    "Group.add_cylinder": (lambda **given: kanuka.Scene().add_group().add_cylinder(**given), {}),
    "Group.add_disk": (lambda **given: kanuka.Scene().add_group().add_disk(**given), {}),
    "Group.add_points": (lambda **given: kanuka.Scene().add_group().add_points(**given), POINTS),
    "Group.add_sphere": (lambda **given: kanuka.Scene().add_group().add_sphere(**given), {}),
    "Group.add_subdivision": (lambda **given: kanuka.Scene().add_group().add_subdivision(**given), MESH),
    "Group.add_torus": (lambda **given: kanuka.Scene().add_group().add_torus(**given), {}),
    "Journal.add": (lambda **given: kanuka.Journal().add(**given), {"severity": "info", "message": "a"}),
    "Lobe": (kanuka.Lobe, {"name": "LambertBrdf"}),
    "Lobe.albedo": (kanuka.Lobe("LambertBrdf").albedo, {"wo": (0, 0, 1)}),
    "Lobe.evaluate": (kanuka.Lobe("LambertBrdf").evaluate, {"wo": (0, 0, 1), "wi": (0, 0, 1)}),
    "Lobe.sample": (kanuka.Lobe("LambertBrdf").sample, {"wo": (0, 0, 1), "u": (0.5, 0.5, 0.5)}),
    "Material": (kanuka.Material, {"surface": "matte"}),
    "Node.node": (lambda **given: kanuka.Scene().add_group("a").node.node("b", **given), {}),
    "Node.place": (lambda **given: kanuka.Scene().add_light("point").place(**given), {"transform": np.eye(4)}),
    "Expansions": (kanuka.Expansions, {"shot": []}),
    "Picture": (kanuka.Picture, {"layers": PICTURE}),
    "Picture.write": (lambda **given: picture().write(**given), {"path": "a.exr"}),
    "Scene.add_archive": (
        lambda **given: kanuka.Scene().add_archive(**given),
        {"path": Path(__file__).parent.parent / "scenes" / "procedurals" / "bolster.rib"},
    ),
    "Scene.add_group": (lambda **given: kanuka.Scene().add_group(**given), {}),
    "Scene.add_instances": (with_group(kanuka.Scene.add_instances), {"transforms": MOVING}),
    "Scene.add_light": (lambda **given: kanuka.Scene().add_light(**given), {"kind": "point"}),
    "Scene.add_light_shader": (
        lambda **given: kanuka.Scene().add_light_shader(**given),
        {"shader": kanuka.Shader("pointlight")},
    ),
    "Scene.add_blobby": (lambda **given: kanuka.Scene().add_blobby(**given), BLOB),
    "Scene.add_hyperboloid": (lambda **given: kanuka.Scene().add_hyperboloid(**given), {}),
    "Scene.add_nurbs": (lambda **given: kanuka.Scene().add_nurbs(**given), LATTICE | KNOTS),
    "Scene.add_paraboloid": (lambda **given: kanuka.Scene().add_paraboloid(**given), {}),
    "Scene.add_patches": (lambda **given: kanuka.Scene().add_patches(**given), LATTICE),
    "Scene.add_solid": (lambda **given: kanuka.Scene().add_solid(**given), {"kind": "union"}),
    "Scene.add_volume": (lambda **given: kanuka.Scene().add_volume(**given), {}),
    "Scene.add_mesh": (lambda **given: kanuka.Scene().add_mesh(**given), MESH),
    "Scene.add_cone": (lambda **given: kanuka.Scene().add_cone(**given), {}),
    "Scene.add_curves": (lambda **given: kanuka.Scene().add_curves(**given), CURVE),
    "Scene.add_cylinder": (lambda **given: kanuka.Scene().add_cylinder(**given), {}),
    "Scene.add_disk": (lambda **given: kanuka.Scene().add_disk(**given), {}),
    "Scene.add_points": (lambda **given: kanuka.Scene().add_points(**given), POINTS),
    "Scene.add_sphere": (lambda **given: kanuka.Scene().add_sphere(**given), {}),
    "Scene.add_subdivision": (lambda **given: kanuka.Scene().add_subdivision(**given), MESH),
    "Scene.add_torus": (lambda **given: kanuka.Scene().add_torus(**given), {}),
    "Scene.node": (lambda **given: kanuka.Scene().node("camera", **given), {}),
    "Scene.remove": (lambda **given: kanuka.Scene().remove(**given), {"nodes": []}),
    "Session": (kanuka.Session, {"scene": kanuka.Scene()}),
    "Session.advance": (lambda **given: kanuka.Session(kanuka.Scene()).advance(**given), {}),
    "Session.prepare": (lambda **given: kanuka.Session(kanuka.Scene()).prepare(**given), {}),
    "Session.resume": (lambda **given: kanuka.Session(kanuka.Scene()).resume(**given), {"path": "state"}),
    "Session.save": (lambda **given: kanuka.Session(kanuka.Scene()).save(**given), {"path": "state"}),
    "Session.update": (lambda **given: kanuka.Session(kanuka.Scene()).update(**given), {}),
    "Shader": (kanuka.Shader, {"name": "plastic"}),
    "Solid.add": (lambda **given: kanuka.Scene().add_solid("union").add(**given), {"kind": "union"}),
    "Spectrum.rgb": (lambda **given: kanuka.Spectrum("D65").rgb(**given), {}),
    "Spectrum.xyz": (lambda **given: kanuka.Spectrum("D65").xyz(**given), {}),
    "checkpoint_info": (kanuka.checkpoint_info, {"path": "state"}),
    "check_integrator": (kanuka.check_integrator, {"text": "path"}),
    "check_layer": (kanuka.check_layer, {"text": "lpe:CL"}),
    "compare": (kanuka.compare, {"a": picture(), "b": picture()}),
    "compile_shader": (kanuka.compile_shader, {"path": "plain.sl", "source": SHADER}),
    "convert_rib": (kanuka.convert_rib, {"source": "a.rib", "target": "b.rib"}),
    "decimate": (kanuka.decimate, {"meshes": []}),
    "delta_e_2000": (kanuka.delta_e_2000, {"a": (1, 1, 1), "b": (1, 1, 1), "white": (1, 1, 1)}),
    "emit_shader": (kanuka.emit_shader, {"path": "plain.sl", "what": "ir", "source": SHADER}),
    "frames": (kanuka.frames, {"path": "a.rib"}),
    "glass": (kanuka.glass, {"name": "BK7"}),
    "load": (kanuka.load, {"path": "a.rib"}),
    "load_camera": (kanuka.load_camera, {"path": "a.rib"}),
    "make_texture": (kanuka.make_texture, {"pictures": ["a.exr"], "texture": "a.tx"}),
    "merge": (kanuka.merge, {"files": ["state"]}),
    "metal": (kanuka.metal, {"name": "Au"}),
    "picture_file": (kanuka.picture_file, {"display": "a.tif"}),
    "publish_shader": (kanuka.publish_shader, {"path": "plain.sl", "source": SHADER}),
    "published_metadata": (kanuka.published_metadata, {"path": "plain.slo"}),
    "read": (kanuka.read, {"path": "a.exr"}),
    "render": (kanuka.render, {"scene": kanuka.Scene()}),
    "write_oracle": (kanuka.write_oracle, {"scene": kanuka.Scene(), "path": "scene.oracle"}),
    "shader_cache_clear": (kanuka.shader_cache_clear, {}),
    "shader_cache_entries": (kanuka.shader_cache_entries, {}),
    "shader_cache_trim": (kanuka.shader_cache_trim, {}),
    "store_compress": (kanuka.store_compress, {"folder": str(Path(__file__).parent)}),
    "store_packs": (kanuka.store_packs, {"folder": "."}),
    "store_prune": (kanuka.store_prune, {"folder": ".", "bytes": 1 << 60}),
    "texture_cache_files": (kanuka.texture_cache_files, {}),
    "texture_cache_prune": (kanuka.texture_cache_prune, {}),
    "surface_mesh": (kanuka.surface_mesh, {"path": "a.rib"}),
    "traced_surfaces": (kanuka.traced_surfaces, {"scene": kanuka.Scene()}),
    "z_test": (
        kanuka.z_test,
        {"reference": picture(), "variance": picture(), "test": picture(), "reference_samples": 1, "test_samples": 1},
    ),
}
# Of two forms; made by scenes alone; its errors name the option.
NOT_CALLED_BY_NAME = {"Spectrum", "ProceduralRequest.find", "check_option"}


def parameters() -> list[tuple[str, str, str]]:
    """(call, parameter, annotation) of all that the stubs have."""
    stubs = ast.parse((Path(_native.__file__).parent / "_native.pyi").read_text())
    found = []

    def look(function: ast.FunctionDef, owner: str) -> None:
        if (function.name.startswith("_") and function.name != "__init__") or any(
            isinstance(d, ast.Attribute) or getattr(d, "id", "") == "property" for d in function.decorator_list
        ):
            return
        name = owner if function.name == "__init__" else f"{owner}.{function.name}" if owner else function.name
        for argument in [*function.args.args, *function.args.kwonlyargs]:
            if argument.arg != "self" and argument.annotation:
                found.append((name, argument.arg, ast.unparse(argument.annotation)))

    for node in stubs.body:
        if isinstance(node, ast.FunctionDef):
            look(node, "")
        elif isinstance(node, ast.ClassDef):
            for member in node.body:
                if isinstance(member, ast.FunctionDef):
                    look(member, node.name)
    return [p for p in found if p[0] not in NOT_CALLED_BY_NAME]


PARAMETERS = parameters()


def test_all_calls_are_tried() -> None:
    assert {name for name, _, _ in PARAMETERS} == set(CALLS)
    assert len(PARAMETERS) > 250


@pytest.mark.parametrize(("call", "parameter", "annotation"), PARAMETERS, ids=[f"{c}-{p}" for c, p, _ in PARAMETERS])
def test_wrong_types_are_told_by_the_arguments_name(call: str, parameter: str, annotation: str) -> None:
    function, needed = CALLS[call]
    wrong: list[object] = [object()]
    if "None" not in annotation and annotation != "object":
        wrong.append(None)
    if annotation in ("float", "int", "bool") or annotation.startswith("tuple["):
        wrong.append("many")
    if annotation == "str" or annotation.startswith("Sequence"):
        wrong.append(7j)
    for value in wrong:
        with pytest.raises((TypeError, ValueError)) as error:
            function(**(needed | {parameter: value}))
        assert parameter in str(error.value).split("\n")[0], value
        assert "incompatible function arguments" not in str(error.value)


def test_parameters_of_shaders_are_told_by_name() -> None:
    for make in (kanuka.Material, kanuka.Shader):
        with pytest.raises(TypeError, match="Kd"):
            make("matte", Kd=object())
        with pytest.raises(TypeError, match="Kd"):
            make("matte", Kd=None)
    with pytest.raises(TypeError, match="parameters"):
        kanuka.Material("matte", parameters={1: 2})
    with pytest.raises(TypeError, match="layers"):
        kanuka.Material("layered", layers=[kanuka.Shader("tint"), 3])
    with pytest.raises(TypeError, match="primvars"):
        kanuka.Scene().add_mesh(**MESH, primvars={1: [1]})


@pytest.mark.parametrize("name", [n for n in dir(kanuka.Options) if n[0] != "_" and n != "displays"])
def test_options_are_told_by_name(name: str) -> None:
    options = kanuka.Scene().options
    for value in (object(), None):
        with pytest.raises((TypeError, ValueError), match=name):
            setattr(options, name, value)


def test_numbers_that_do_not_fit_are_value_errors() -> None:
    for name, value in (("threads", 2**40), ("seed", -1), ("resolution", (0, 4)), ("progressions", 2**31)):
        with pytest.raises(ValueError, match=name):
            kanuka.render(kanuka.Scene(), **{name: value})


def test_options_are_checked_without_a_render() -> None:
    kanuka.check_option("max_depth", 3)
    for name, value, error, words in (
        ("max_depth", -1, ValueError, "max_depth: expected a whole number from 0 to 1000, got -1"),
        ("max_depth", "deep", TypeError, "max_depth: expected int"),
        ("max_dept", 1, ValueError, "there is no option max_dept"),
        ("transport", "none", ValueError, "full, classic or auto"),
        ("resolution", 4, TypeError, "resolution: expected tuple"),
    ):
        with pytest.raises(error, match=words):
            kanuka.check_option(name, value)


def test_misspelt_arguments_are_told_with_what_was_meant() -> None:
    with pytest.raises(TypeError, match=r"render\(\) has no argument progresions; did you mean progressions\?"):
        kanuka.render(kanuka.Scene(), progresions=4)
    with pytest.raises(TypeError, match=r"add_light\(\) has no argument colour; it has amount, "):
        kanuka.Scene().add_light("point", colour=1)


@pytest.mark.parametrize("material", ["plastic", kanuka.Shader("plastic"), kanuka.Material("plastic")])
def test_materials_may_be_names(material: object) -> None:
    scene = kanuka.Scene()
    scene.add_sphere(material=material)
    assert scene.summary()["shaders"]["surface"] == ["plastic"]


def test_what_does_nothing_for_a_light_is_warned_of() -> None:
    scene = kanuka.Scene()
    with pytest.warns(kanuka.Warning, match='cone_angle does nothing for a light of kind "quad"') as caught:
        scene.add_light("quad", cone_angle=3)
    assert caught[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene.add_light("spot", cone_angle=3)
