"""Shaders of several layers: outputs of earlier ones become parameters of later ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka

SHADERS = {
    # Red on the left, blue on the right; a height that rises from 0 to 1; Ci, that the last may leave alone.
    "halves": """surface halves(uniform float gain = 1; output varying color c = 0; output varying float h = 0) {
        c = gain * (s < 0.5 ? color(1, 0, 0) : color(0, 0, 1));
        h = s;
        Ci = color(0, 0.25, 0);
    }""",
    "dim": """surface dim(color input = color(0, 1, 0); float by = 0.5; output varying color result = 0;
            output varying string name = "") {
        result = by * input;
    }""",
    "show": "surface show(color paint = color(0, 1, 0)) { Oi = 1; Ci = paint * diffuse(normalize(N)); }",
    "leave": "surface leave(float unused = 0) { Oi = 1; }",
    "lit": """class lit(color paint = color(0, 1, 0); float lift = 0) {
        varying float seen = 0;
        public void begin() { seen = lift; }
        public void mnk_init(output MnkObjectProperties o; output MnkMaterial m) {
            MnkMaterialBoundary b = CreateBoundary(m);
            AddLobe(b, "body", LambertBrdf());
        }
        public void mnk_displacement(output point P; output normal N) { P += seen * normalize(N); }
        public void mnk_prelighting(output MnkMaterialBoundary b) {
            SetLobe(b, "body", 1.0, LambertBrdf("diffuseReflectance", paint));
        }
    }""",
    "gives": """surface gives(output uniform string which = ""; output varying float ramp[3] = {0, 0, 0};
            output uniform float some[] = {}) {
        which = "yes";
        ramp[0] = s; ramp[1] = 0.25; ramp[2] = 0.5;
        push(some, 0.75); push(some, 0.125);
    }""",
    "takes": """surface takes(uniform string word = "no"; varying float three[3] = {0, 0, 0};
            uniform float list[] = {1}; varying float two[2] = {1, 0}) {
        Oi = 1;
        if (word == "yes")
            Ci = color(three[0], three[1] + three[2], list[1]) * diffuse(normalize(N));
        else
            Ci = color(two[0], two[1], arraylength(list)) * diffuse(normalize(N));
    }""",
    "away": 'transformation away(float far = 1;) { P += far * vtransform("shader", vector (0, 0, 1)); }',
    "marks": """surface marks() { point p = transform("rig", P); Oi = 1;
        Ci = color(0.1 * xcomp(p), 0.5, 0.5) * diffuse(normalize(N)); }""",
    "rise": "displacement rise(output varying float up = 0) { up = 0.5 * s; }",
    "push": "displacement push(float amount = 0) { P += amount * normalize(N); }",
}
HEAD = """Format 16 16 1
PixelFilter "box" 1 1
Projection "orthographic"
WorldBegin
"""
SQUARE = """
Polygon "P" [-1 -1 2  1 -1 2  1 1 2  -1 1 2] "st" [0 1 1 1 1 0 0 0]
WorldEnd
"""
CHAIN = """ShaderLayer "surface" "halves" "a"
ShaderLayer "surface" "dim" "b" "float by" 0.25
ShaderLayer "surface" "{last}" "c"
ConnectShaderLayers "surface" "a" "c" "b" "input"
ConnectShaderLayers "surface" "b" "result" "c" "paint"
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name, text in SHADERS.items():
        (tmp_path / f"{name}.sl").write_text(text)
    return tmp_path


def render(folder: Path, body: str, **keywords: object) -> tuple[kanuka.Picture, str]:
    path = folder / "scene.rib"
    path.write_text(HEAD + body + SQUARE)
    scene = kanuka.load(path)
    picture = kanuka.render(scene, journal=scene.journal, **{"progressions": 64, **keywords})
    # No light shines: what is looked at are the layers beside the colour.
    said = [str(message) for message in scene.journal if "the picture is black" not in str(message)]
    return picture, "\n".join(said)


@pytest.mark.parametrize("last", ["show", "lit"])
def test_outputs_reach_later_layers(folder: Path, last: str) -> None:
    picture, said = render(folder, CHAIN.format(last=last))
    assert not said
    np.testing.assert_allclose(picture["albedo"][:, :7].mean(axis=(0, 1)), (0.25, 0, 0), atol=5e-3)
    np.testing.assert_allclose(picture["albedo"][:, 9:].mean(axis=(0, 1)), (0, 0, 0.25), atol=5e-3)


def test_the_same_for_any_number_of_lanes(folder: Path) -> None:
    pictures = [render(folder, CHAIN.format(last="show"), lanes=n, progressions=4)[0]["albedo"] for n in (1, 8, 16)]
    assert np.array_equal(pictures[0], pictures[1])
    assert np.array_equal(pictures[0], pictures[2])


def test_without_connections_parameters_keep_their_values(folder: Path) -> None:
    body = 'ShaderLayer "surface" "halves" "a"\nShaderLayer "surface" "show" "b"\n'
    picture, said = render(folder, body)
    assert not said
    np.testing.assert_allclose(picture["albedo"].mean(axis=(0, 1)), (0, 1, 0), atol=0.02)
    # All layers run: one that leaves Ci alone shows what it was.
    picture, _ = render(folder, body.replace("show", "leave"))
    np.testing.assert_allclose(picture["rgb"].mean(axis=(0, 1)), (0, 0.25, 0), atol=5e-3)


def test_floats_become_colours_and_layers_have_values_of_their_own(folder: Path) -> None:
    body = """ShaderLayer "surface" "halves" "a" "float gain" 0.75
ShaderLayer "surface" "show" "b"
ConnectShaderLayers "surface" "a" "h" "b" "paint"
"""
    picture, said = render(folder, body)
    assert not said
    ramp = np.repeat(((np.arange(16) + 0.5) / 16)[:, None], 3, axis=1)
    np.testing.assert_allclose(picture["albedo"].mean(axis=0), ramp, atol=0.02)
    picture, _ = render(folder, body.replace('"h"', '"c"'))
    np.testing.assert_allclose(picture["albedo"][:, :7].mean(axis=(0, 1)), (0.75, 0, 0), atol=0.01)


def test_displacements_have_layers(folder: Path) -> None:
    layers = """Surface "constant"
ShaderLayer "displacement" "rise" "a"
ShaderLayer "displacement" "push" "b"
ConnectShaderLayers "displacement" "a" "up" "b" "amount"
"""
    picture, said = render(folder, layers)
    assert not said
    depth = picture["Z"].mean(axis=0)
    np.testing.assert_allclose(np.abs(depth - 2), (np.arange(16) + 0.5) / 32, atol=0.02)
    # Of a class whose surface layers feed its displacement.
    body = """ShaderLayer "surface" "halves" "a"
ShaderLayer "surface" "lit" "b"
ConnectShaderLayers "surface" "a" "h" "b" "lift"
"""
    picture, said = render(folder, body)
    assert not said
    np.testing.assert_allclose(np.abs(picture["Z"].mean(axis=0) - 2), (np.arange(16) + 0.5) / 16, atol=0.03)


@pytest.mark.parametrize(
    ("connection", "message"),
    [
        ('"a" "d" "b" "paint"', "it has no such parameter; there are c, h"),
        ('"a" "gain" "b" "paint"', "that is no output parameter; there are c, h"),
        ('"a" "c" "b" "color"', "there is no such parameter; there are paint"),
        ('"z" "c" "b" "paint"', 'there is no surface layer "z"; there are a, b'),
    ],
)
def test_what_cannot_be_connected_is_said(folder: Path, connection: str, message: str) -> None:
    body = f"""ShaderLayer "surface" "halves" "a"
ShaderLayer "surface" "show" "b"
ConnectShaderLayers "surface" {connection}"""
    picture, said = render(folder, body)
    assert "scene.rib:7:" in said
    assert message in said
    assert len(said.splitlines()) == 1
    np.testing.assert_allclose(picture["albedo"].mean(axis=(0, 1)), (0, 1, 0), atol=0.02)


def test_circles_are_cut(folder: Path) -> None:
    body = """ShaderLayer "surface" "dim" "a"
ShaderLayer "surface" "dim" "b"
ShaderLayer "surface" "show" "c"
ConnectShaderLayers "surface" "a" "result" "b" "input"
ConnectShaderLayers "surface" "b" "result" "a" "input"
ConnectShaderLayers "surface" "b" "result" "c" "paint"
"""
    picture, said = render(folder, body)
    assert "connected in a circle" in said
    assert len(said.splitlines()) == 1
    assert np.isfinite(picture["albedo"]).all()


def test_patterns_feed_bxdfs(folder: Path) -> None:
    sky = 'Light "PxrDomeLight" "sky" "float intensity" 1\n'
    checks = '"color colorA" [0.8 0.8 0.8] "color colorB" [0.1 0.1 0.1] "float frequency" 2'
    body = f"""{sky}Pattern "PxrChecker" "c" {checks}
Pattern "PxrInvert" "i" "reference color inputRGB" ["c:resultRGB"]
Bxdf "PxrDiffuse" "d" "reference color diffuseColor" ["i:resultRGB"]
"""
    picture, said = render(folder, body)
    assert not said
    grey = picture["albedo"][..., 1]
    for rows, columns, albedo in ((0, 0, 0.2), (0, 8, 0.9), (8, 0, 0.9), (8, 8, 0.2)):
        tile = grey[rows + 1 : rows + 7, columns + 1 : columns + 7]
        np.testing.assert_allclose(tile, albedo, atol=0.02)
    _, said = render(folder, body.replace("PxrInvert", "PxrNoSuch"))
    assert "scene.rib:7:" in said
    assert '"PxrNoSuch" is not found' in said


def test_texts_and_arrays_are_handed_on(folder: Path) -> None:
    body = """ShaderLayer "surface" "gives" "a"
ShaderLayer "surface" "takes" "b"
"""
    connect = """ConnectShaderLayers "surface" "a" "which" "b" "word"
ConnectShaderLayers "surface" "a" "ramp" "b" "three"
ConnectShaderLayers "surface" "a" "some" "b" "list"
"""
    picture, said = render(folder, body + connect)
    assert not said
    ramp = (np.arange(16) + 0.5) / 16
    albedo = picture["albedo"].mean(axis=0)
    np.testing.assert_allclose(albedo[:, 0], ramp, atol=0.02)
    np.testing.assert_allclose(albedo[:, 1], 0.75, atol=5e-3)
    np.testing.assert_allclose(albedo[:, 2], 0.125, atol=5e-3)
    picture, said = render(folder, body)
    np.testing.assert_allclose(picture["albedo"].mean(axis=(0, 1)), (1, 0, 1), atol=5e-3)
    _, said = render(folder, body + 'ConnectShaderLayers "surface" "a" "ramp" "b" "two"')
    assert "a float[3] cannot become a float[2]" in said
    _, said = render(folder, body + 'ConnectShaderLayers "surface" "a" "which" "b" "two"')
    assert "a string cannot become a float[2]" in said


def test_displace_is_fed_by_patterns(folder: Path) -> None:
    body = """Surface "constant"
Pattern "rise" "r"
Displace "PxrDisplace" "d" "float dispAmount" 0.5 "reference float dispScalar" ["r:up"] "vector modelDispVector" [0 0 1]
"""
    picture, said = render(folder, body)
    assert not said
    depth = picture["Z"].mean(axis=0)
    rises = (np.arange(16) + 0.5) / 64
    np.testing.assert_allclose(np.abs(depth - 3), rises, atol=0.02)
    picture, said = render(folder, "Translate 0 0 -2 Scale 1 1 2 " + body.replace("[0 0 1]", "[0 0 0]"))
    assert not said  # lengths are the object's: twice as far
    np.testing.assert_allclose(np.abs(picture["Z"].mean(axis=0) - 2), 2 * rises, atol=0.04)


@pytest.mark.parametrize(
    ("mode", "low", "high"), [("1", 0, 0.5), ("2", -0.25, 0.5), ("3", -0.25, 0.5)], ids=["none", "centred", "mixed"]
)
def test_heights_are_brought_into_range(folder: Path, mode: str, low: float, high: float) -> None:
    body = f"""Surface "constant"
Pattern "halves" "h"
Pattern "PxrDispTransform" "t" "reference float dispScalar" ["h:h"] "int dispRemapMode" [{mode}] "float dispDepth" 0.5
    "float dispHeight" 1
Displace "PxrDisplace" "d" "float dispAmount" 0.5 "reference float dispScalar" ["t:resultF"]
"""
    picture, said = render(folder, body)
    assert not said
    along = (np.arange(16) + 0.5) / 16
    ramp = low + (high - low) * along
    if mode == "2":
        ramp = np.where(along > 0.5, 0.5 * (2 * along - 1), 0.25 * (2 * along - 1))
    rises = 2 - picture["Z"].mean(axis=0)
    np.testing.assert_allclose(rises if abs(rises[-1] - 0.5) < 0.1 else -rises, ramp, atol=0.025)


def test_deformations_come_first(folder: Path) -> None:
    body = 'Surface "constant"\nDeformation "away" "float far" 1\n'
    picture, said = render(folder, body)
    assert not said
    np.testing.assert_allclose(picture["Z"].mean(), 3, atol=1e-3)
    picture, said = render(folder, body + 'Displacement "push" "float amount" 0.25 Deformation "away" "float far" 0.5')
    assert not said
    np.testing.assert_allclose(np.abs(picture["Z"].mean() - 3.5), 0.25, atol=1e-3)


def test_scoped_coordinate_systems_are_those_of_the_block(folder: Path) -> None:
    def square(x: float) -> str:
        return f"""AttributeBegin Translate {x} 0 0 ScopedCoordinateSystem "rig" Translate 4 0 0 Translate {-x - 4} 0 0
Polygon "P" [{x} -1 2  {x + 1} -1 2  {x + 1} 1 2  {x} 1 2] "st" [0 1 1 1 1 0 0 0] AttributeEnd
"""

    path = folder / "scene.rib"
    path.write_text(HEAD + 'Surface "marks"\n' + square(-1) + square(0) + "WorldEnd\n")
    scene = kanuka.load(path)
    picture = kanuka.render(scene, journal=scene.journal, progressions=64)
    assert all("the picture is black" in str(message) for message in scene.journal)
    along = 0.1 * (np.arange(8) + 0.5) / 8  # each begins at its own
    np.testing.assert_allclose(picture["albedo"][..., 0].mean(axis=0), np.concatenate([along, along]), atol=0.01)
