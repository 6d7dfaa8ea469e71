"""Texts, files and matrices as primvars of instances in USD, compared with prims that have these themselves."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka
from kanuka.usd import reader
from test_usd_instance_primvars import shown
from test_usd_native_instances import PLACES, albedo, at, native, prototype
from usd_shapes import ball, mesh
from usd_stages import CAMERA, SUN, read, stage

COLORS = {"red": (0.7, 0.2, 0.2), "green": (0.2, 0.6, 0.3), "grey": (0.4, 0.4, 0.4)}
SQUARE = "point3f[] points = [(-0.2, 0, 0.2), (0.2, 0, 0.2), (0.2, 0, -0.2), (-0.2, 0, -0.2)]\n"
READER = """
    def Shader "r" {
        uniform token info:id = "UsdPrimvarReader_string"
        string inputs:varname = "pic"
        FALLBACK
        string outputs:result
    }
"""
GEOMPROP = """
    def Shader "r" {
        uniform token info:id = "ND_geompropvalueuniform_filename"
        string inputs:geomprop = "pic"
        asset outputs:result
    }
"""
UV = """
    def Shader "t" {
        uniform token info:id = "UsdUVTexture"
        asset inputs:file.connect = </pictured/r.outputs:result>
        token inputs:sourceColorSpace = "raw"
        color3f outputs:rgb
    }
"""
IMAGE = """
    def Shader "t" {
        uniform token info:id = "ND_image_color3"
        asset inputs:file.connect = </pictured/r.outputs:result>
        color3f outputs:rgb
    }
"""
MATERIAL = """
def Material "pictured" {
    token outputs:surface.connect = </pictured/s.outputs:surface>
    def Shader "s" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor.connect = </pictured/t.outputs:rgb>
        int inputs:useSpecularWorkflow = 1
        color3f inputs:specularColor = (0, 0, 0)
        token outputs:surface
    }
    NODES
}
"""
MATRIX = """
    def Shader "t" {
        uniform token info:id = "ND_transformmatrix_vector3M4"
        float3 inputs:in = (0.5, 0.25, 0.125)
        matrix4d inputs:mat.connect = </pictured/m.outputs:result>
        color3f outputs:rgb
    }
    def Shader "m" {
        uniform token info:id = "UsdPrimvarReader_matrix"
        string inputs:varname = "frame"
        matrix4d inputs:fallback = ((0.5, 0, 0, 0), (0, 0.5, 0, 0), (0, 0, 0.5, 0), (0, 0, 0, 1))
        matrix4d outputs:result
    }
"""
BOUND = '(prepend apiSchemas = ["MaterialBindingAPI"]) {\n rel material:binding = </pictured>'


def material(*nodes: str, fallback: str = "") -> str:
    return MATERIAL.replace("NODES", "".join(nodes).replace("FALLBACK", fallback))


def pictures(folder: Path) -> dict[str, Path]:
    found = {}
    for name, rgb in COLORS.items():
        pixels = np.tile(np.float32(rgb), (8, 8, 1))
        (folder / f"{name}.pfm").write_bytes(b"PF\n8 8\n-1.0\n" + pixels.tobytes())
        kanuka.make_texture([str(folder / f"{name}.pfm")], str(folder / f"{name}.tx"))
        found[name] = folder / f"{name}.tx"
    return found


def instancer(primvars: str, shape: str = "") -> str:
    return f"""
def PointInstancer "pi" {{
    rel prototypes = </pi/it>
    int[] protoIndices = [0, 0, 0]
    point3f[] positions = [(-0.6, 0, 0), (0, 0, 0), (0.6, 0, 0)]
    {primvars}
    def Xform "it" {BOUND}
    {shape or ball("b", 0)}
    }}
}}
"""


def apart(folder: Path, each: list[str], made: str, shape: str = "ball") -> np.ndarray:
    text = ""
    for k, (x, more) in enumerate(zip((-0.6, 0, 0.6), each, strict=True)):
        if shape == "ball":
            text += ball(f"b{k}", x, more).replace(f'"b{k}" {{', f'"b{k}" {BOUND}')
        else:
            square = mesh(SQUARE + more)
            text += f'def Xform "x{k}" {BOUND}\ndouble3 xformOp:translate = ({x}, 0, 0)\n'
            text += f'uniform token[] xformOpOrder = ["xformOp:translate"]\n{square}\n}}\n'
    scene, told = read(stage(folder, CAMERA, SUN, made, text, name="apart.usda"))
    assert told == []
    return shown(scene)


def flat(folder: Path, colors: np.ndarray) -> np.ndarray:
    """Of colours that the material has itself."""
    text = ""
    for k, (r, g, b) in enumerate(colors):
        own = f"color3f inputs:diffuseColor = ({r}, {g}, {b})"
        connected = "color3f inputs:diffuseColor.connect = </pictured/t.outputs:rgb>"
        text += material().replace(connected, own).replace("pictured", f"m{k}")
        text += ball(f"b{k}", 0.6 * (k - 1), "").replace(f'"b{k}" {{', f'"b{k}" {BOUND}').replace("pictured", f"m{k}")
    scene, told = read(stage(folder, CAMERA, SUN, text, name="flat.usda"))
    assert told == []
    return shown(scene)


def painted(folder: Path, files: dict[str, Path], names: list[str]) -> np.ndarray:
    """By the value of an input, in the place of a primvar."""
    made = ""
    for name in sorted(set(names)):
        made += (
            material(UV)
            .replace("pictured", f"m_{name}")
            .replace(
                f"asset inputs:file.connect = </m_{name}/r.outputs:result>", f"asset inputs:file = @{files[name]}@"
            )
        )
    text = "".join(
        ball(f"b{k}", x, "").replace(f'"b{k}" {{', f'"b{k}" {BOUND}').replace("</pictured>", f"</m_{name}>")
        for k, (x, name) in enumerate(zip((-0.6, 0, 0.6), names, strict=True))
    )
    scene, told = read(stage(folder, CAMERA, SUN, made, text, name="painted.usda"))
    assert told == []
    return shown(scene)


VALUES = {
    "string": ('"{red}"', '"{green}"', '"{red}"'),
    "token": ('"{green}"', '"{red}"', '"{green}"'),
    "asset": ("@./red.tx@", "@./green.tx@", "@./green.tx@"),
}


@pytest.mark.parametrize("kind", VALUES)
@pytest.mark.parametrize("shape", ["ball", "mesh"])
def test_texts_and_files_of_each_instance(tmp_path: Path, kind: str, shape: str) -> None:
    files, made = pictures(tmp_path), material(READER, UV)
    values = [value.format(**files) for value in VALUES[kind]]
    primvar = f'{kind}[] primvars:pic = [{", ".join(values)}] (interpolation = "vertex")'
    own = mesh(SQUARE) if shape == "mesh" else ""
    scene, told = read(stage(tmp_path, CAMERA, SUN, made, instancer(primvar, own)))
    assert told == []
    assert scene.summary()["groups"] == 1
    expected = apart(tmp_path, [f"{kind} primvars:pic = {value}" for value in values], made, shape)
    assert shown(scene) == pytest.approx(expected, abs=2e-3)
    assert list(expected.argmax(axis=1)) == {"string": [0, 1, 0], "token": [1, 0, 1], "asset": [0, 1, 1]}[kind]


@pytest.mark.parametrize("inside", [True, False])
def test_indexed_ones_and_one_for_all(tmp_path: Path, inside: bool) -> None:
    files, made = pictures(tmp_path), material(READER, UV)
    primvar = f"""string[] primvars:pic = ["{files["red"]}", "{files["grey"]}"] (interpolation = "varying")
    int[] primvars:pic:indices = [1, 0, 0]"""
    scene, told = read(stage(tmp_path, CAMERA, SUN, made, instancer(primvar)))
    assert told == []
    assert shown(scene) == pytest.approx(painted(tmp_path, files, ["grey", "red", "red"]), abs=2e-3)
    primvar = f'token primvars:pic = "{files["green"]}"'
    text = instancer(primvar)
    if not inside:
        text = text.replace("</pi/it>", "</lib/it>").replace('def Xform "it"', 'over "no"')
        text += f'class Scope "lib" {{\ndef Xform "it" {BOUND}\n{ball("b", 0)}\n}}\n}}\n'
    scene, told = read(stage(tmp_path, CAMERA, SUN, made, text))
    assert told == []
    assert shown(scene) == pytest.approx(painted(tmp_path, files, ["green"] * 3), abs=2e-3)


def test_without_one_the_fallback_stands(tmp_path: Path) -> None:
    files = pictures(tmp_path)
    grey = painted(tmp_path, files, ["grey"] * 3)
    for fallback, expected in ((f'string inputs:fallback = "{files["grey"]}"', grey), ("", np.zeros((3, 3)))):
        scene, told = read(stage(tmp_path, CAMERA, SUN, material(READER, UV, fallback=fallback), instancer("")))
        assert told == []
        assert shown(scene) == pytest.approx(expected, abs=2e-3)


def test_materialx_reads_them(tmp_path: Path) -> None:
    files, made = pictures(tmp_path), material(GEOMPROP, IMAGE)
    values = ", ".join(f"@{files[name]}@" for name in ("red", "grey", "green"))
    scene, told = read(stage(tmp_path, CAMERA, SUN, made, instancer(f"asset[] primvars:pic = [{values}]")))
    assert told == []
    assert shown(scene) == pytest.approx(painted(tmp_path, files, ["red", "grey", "green"]), abs=2e-3)


@pytest.mark.parametrize("shape", ["ball", "mesh"])
def test_matrices_of_each_instance(tmp_path: Path, shape: str) -> None:
    """Rows of points and of matrices, as USD has them: (0.5, 0.25, 0.125, 1) M."""
    rows = np.stack([np.eye(4), [[0, 1, 0, 0], [1, 0, 0, 0], [0, 0, 2, 0], [0.1, 0, 0, 1]], np.diag([1, 2, 4, 1])])
    listed = ["(" + ", ".join(f"({', '.join(f'{x:g}' for x in row)})" for row in m) + ")" for m in rows]
    made = material(MATRIX)
    own = mesh(SQUARE) if shape == "mesh" else ""
    primvar = f'matrix4d[] primvars:frame = [{", ".join(listed)}] (interpolation = "varying")'
    scene, told = read(stage(tmp_path, CAMERA, SUN, made, instancer(primvar, own)))
    assert told == []
    each = apart(tmp_path, [f"matrix4d primvars:frame = {m}" for m in listed], made, shape)
    assert shown(scene) == pytest.approx(each, abs=2e-3)
    colors = np.stack([(np.array([0.5, 0.25, 0.125, 1]) @ m)[:3] for m in rows])
    assert shown(scene) == pytest.approx(flat(tmp_path, colors), abs=2e-3)
    kanuka.usd.convert(tmp_path / "a.usda", tmp_path / "a.rib")
    assert shown(kanuka.load(tmp_path / "a.rib")) == pytest.approx(shown(scene), abs=2e-3)


def test_a_rib_of_it_is_the_same_picture(tmp_path: Path) -> None:
    files = pictures(tmp_path)
    values = ", ".join(f'"{files[name]}"' for name in ("red", "grey", "green"))
    for shape in ("", mesh(SQUARE + f'string primvars:pic = "{files["grey"]}"')):
        primvar = f'string[] primvars:pic = [{values}] (interpolation = "varying")'
        path = stage(tmp_path, CAMERA, SUN, material(READER, UV), instancer(primvar, shape))
        kanuka.usd.convert(path, tmp_path / "a.rib")
        expected, _ = read(path)
        assert shown(kanuka.load(tmp_path / "a.rib")) == pytest.approx(shown(expected), abs=2e-3)


@pytest.mark.parametrize("large", [False, True])  # a group for each text, or eight and one that has them as variables
def test_native_instances(tmp_path: Path, large: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    if large:
        monkeypatch.setattr(reader, "EXACT_POINTS", 1)
        monkeypatch.setattr(reader, "LEAST_EXACT", 1)
    files, made = pictures(tmp_path), material(READER, UV)
    names = ["red", "green", "grey", "green"] * 3
    text = prototype(ball("b", 0), bound="pictured") + "".join(
        native(f"n{k}", f'string primvars:pic = "{files[name]}"', PLACES[k]) for k, name in enumerate(names)
    )
    scene, told = read(stage(tmp_path, CAMERA, SUN, made, text))
    assert told == []
    assert scene.summary()["groups"] == (2 if large else 3)
    text = ""
    for k, name in enumerate(names):
        one = ball("b", 0, f'string primvars:pic = "{files[name]}"')
        text += f'def Xform "x{k}" {BOUND}\n{at(*PLACES[k])}\n{one}\n}}\n'
    apart, _ = read(stage(tmp_path, CAMERA, SUN, made, text, name="apart.usda"))
    assert albedo(scene) == pytest.approx(albedo(apart), abs=2e-3)
    assert np.ptp(albedo(scene), axis=0).min() > 0.1


def test_what_is_none_is_told(tmp_path: Path) -> None:
    files, made = pictures(tmp_path), material(READER, UV)
    for primvar, text in (
        (f'string[] primvars:pic = ["{files["red"]}", "b"] (interpolation = "varying")', "materials take a string"),
        ("float[] primvars:pic = [1, 2, 3]", "materials take a string"),
    ):
        scene, told = read(stage(tmp_path, CAMERA, SUN, made, instancer(primvar)))
        assert len(told) == 1
        assert f"/pi: primvar pic: {text}" in told[0]
        assert shown(scene) == pytest.approx(np.zeros((3, 3)), abs=0.02)
    own = mesh(SQUARE + f'string[] primvars:pic = ["{files["red"]}", "b", "c", "d"] (interpolation = "vertex")')
    scene, told = read(stage(tmp_path, CAMERA, SUN, made, instancer("", own)))
    assert "primvar pic varies, but shapes have one text or matrix; the first stands" in told[0]
    own = mesh(SQUARE + f'string primvars:pic = "{files["red"]}"')
    expected, _ = read(stage(tmp_path, CAMERA, SUN, made, instancer("", own), name="one.usda"))
    assert shown(scene) == pytest.approx(shown(expected), abs=2e-3)
