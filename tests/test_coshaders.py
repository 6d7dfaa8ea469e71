"""Co-shaders from RIB, from Python and at the command; glow without opacity; strict directions."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import kanuka

LAYERED = """\
class layered(
    shader base = null;      // what lies below
    shader layers[] = {};    // what is added to it
) {
    public void surface(output color Ci, Oi) {
        uniform float i;
        Ci = 0;
        if (base != null)
            Ci += base->get();
        for (i = 0; i < arraylength(layers); i += 1)
            Ci += layers[i]->get();
        Oi = 1;
    }
}
"""
TINT = """\
class tint(color c = 0.25; shader next = null; string __category = "tint") {
    public color get() {
        color r = c;
        if (next != null)
            r += next->get();
        return r;
    }
}
"""
SCENE = """\
Format 8 8 1
PixelFilter "box" 1 1
PixelSamples 2 2
Projection "orthographic"
WorldBegin
Shader "tint" "red" "color c" [0.5 0 0]
Shader "tint" "blue" "color c" [0 0 0.25] "shader next" "red"
AttributeBegin
  {body}
  Polygon "P" [-2 -2 1  2 -2 1  2 2 1  -2 2 1]
AttributeEnd
WorldEnd
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "layered.sl").write_text(LAYERED)
    (tmp_path / "tint.sl").write_text(TINT)
    return tmp_path


def seen(folder: Path, body: str, **keywords: object) -> tuple[np.ndarray, str]:
    path = folder / "scene.rib"
    path.write_text(SCENE.replace("{body}", body))
    scene = kanuka.load(path)
    picture = kanuka.render(scene, journal=scene.journal, **{"progressions": 256, **keywords})
    said = "\n".join(str(message) for message in scene.journal)
    return np.asarray(picture["rgb"]).reshape(-1, 3).mean(axis=0), said


def test_a_scene_connects_them(folder: Path) -> None:
    colour, said = seen(folder, 'Surface "layered" "shader base" "blue"')
    np.testing.assert_allclose(colour, (0.5, 0, 0.25), atol=5e-3, err_msg=said)
    body = 'Shader "tint" "red" "color c" [0 0.75 0] Surface "layered" "shader[2] layers" ["blue" "red"]'
    colour, said = seen(folder, body)
    np.testing.assert_allclose(colour, (0, 1.5, 0.25), atol=1e-2, err_msg=said)


def test_without_them_handles_are_null(folder: Path) -> None:
    colour, said = seen(folder, 'Surface "layered" "shader base" "nobody"')
    np.testing.assert_array_equal(colour, 0)
    assert 'names co-shader "nobody", which is not declared here; there is red, blue' in said


def test_circles_are_reported_and_the_rest_renders(folder: Path) -> None:
    body = 'Shader "tint" "red" "color c" [0.5 0 0] "shader next" "blue" Surface "layered" "shader base" "blue"'
    colour, said = seen(folder, body)
    np.testing.assert_allclose(colour, (0.5, 0, 0.25), atol=5e-3)
    assert "co-shaders are connected in a circle: blue -> red -> blue" in said


def test_python_passes_shaders_as_parameters(folder: Path) -> None:
    scene = kanuka.Scene()
    scene.resolution = 8, 8
    scene.options.shader_path = [str(folder)]
    scene.camera = kanuka.Camera((0, 0, 2), (0, 0, 0), fov=60)
    red = kanuka.Shader("tint", c=(0.5, 0, 0))
    material = kanuka.Material(
        "layered",
        base=kanuka.Shader("tint", c=(0, 0, 0.25), next=red),
        layers=[red, kanuka.Shader("tint", c=(0, 0.5, 0))],
    )
    quad = np.array([[-4, -4, 0], [4, -4, 0], [4, 4, 0], [-4, 4, 0]], np.float32)
    scene.add_mesh(quad, np.array([[0, 1, 2, 3]], np.int32), material=material)
    picture = kanuka.render(scene, progressions=64)
    colour = np.asarray(picture["rgb"]).reshape(-1, 3).mean(axis=0)
    np.testing.assert_allclose(colour, (1, 0.5, 0.25), atol=1e-2)


def test_the_command_connects_them(kanuka_command, folder: Path) -> None:
    output = folder / "a.exr"
    done = kanuka_command(
        *("shader", "run", "layered.sl", "--grid", "4x4", "--coshader", "a=tint.sl", "--coshader", "b=tint.sl"),
        *("--connect", "base=a", "--connect", "a.next=b", "--params", "a.c=0 0 1", "b.c=1 0 0"),
        *("--output", "emission.radiance", "-o", output),
    )
    assert done.returncode == 0, done.stderr
    np.testing.assert_allclose(np.asarray(kanuka.read(output)["rgb"])[0, 0], (1, 0, 1), atol=1e-3)
    info = kanuka_command("shader", "info", "layered.sl").stdout
    assert "shader base = null  // what lies below" in info
    assert "shader layers[]" in info
    kinds = {
        p["name"]: p["type"]
        for p in json.loads(kanuka_command("shader", "info", "layered.sl", "--json").stdout)["parameters"]
    }
    assert kinds == {"base": "shader", "layers": "shader"}


def test_glow_needs_no_opacity(folder: Path) -> None:
    (folder / "glow.sl").write_text("surface glow() { Oi = 0; Ci = color(0.25, 0.5, 1); }\n")
    behind = (
        'AttributeBegin Surface "constant" Color [0 0 0.5] Polygon "P" [-2 -2 2  2 -2 2  2 2 2  -2 2 2] AttributeEnd '
    )
    colour, said = seen(folder, behind + 'Surface "glow"', progressions=256)
    np.testing.assert_allclose(colour, (0.25, 0.5, 1 + 0.5 * 15 / 16), rtol=0.06, err_msg=said)


def test_strict_directions(kanuka_command, folder: Path) -> None:
    (folder / "rim.sl").write_text("surface rim() {\n Ci = Cs * (1 + normalize(I) . normalize(N));\n}\n")
    assert kanuka_command("shader", "compile", "rim.sl").returncode == 0
    strict = kanuka_command("shader", "compile", "rim.sl", "--strict-directions")
    assert strict.returncode != 0
    assert "rim.sl:2:" in strict.stderr
    assert "rim.sl:2:" not in seen(folder, 'Surface "matte"', strict_directions=True)[1]
    _, said = seen(folder, 'Surface "rim"', strict_directions=True)
    assert "does not compile" in said
