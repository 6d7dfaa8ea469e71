"""Mixtures of MaterialX's surfaces, against the light of each by itself."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("MaterialX")
from usd_stages import CAMERA, FLOOR, ST, SUN, picture, read, stage

MIXTURE = """
def Material "matte" {
    token outputs:mtlx:surface.connect = </matte/mix.outputs:out>
    def Shader "mix" {
        uniform token info:id = "ND_mix_surfaceshader"
        token inputs:fg.connect = </matte/fg.outputs:out>
        token inputs:bg.connect = </matte/bg.outputs:out>
        float inputs:mix = WEIGHT
        token outputs:out
    }
    def Shader "fg" {
        uniform token info:id = "FGKIND"
        FG
        token outputs:out
    }
    def Shader "bg" {
        uniform token info:id = "BGKIND"
        BG
        token outputs:out
    }
    def Shader "st" {
        uniform token info:id = "ND_texcoord_vector2"
        float2 outputs:out
    }
    def Shader "s" {
        uniform token info:id = "ND_extract_vector2"
        float2 inputs:in.connect = </matte/st.outputs:out>
        float outputs:out
    }
}
"""
STANDARD, OPEN = "ND_standard_surface_surfaceshader", "ND_open_pbr_surface_surfaceshader"
RED = "color3f inputs:base_color = (0.8, 0.1, 0.1)\nfloat inputs:specular = 0"
GOLD = "float inputs:metalness = 1\ncolor3f inputs:base_color = (1, 0.7, 0.3)\nfloat inputs:specular_roughness = 0.4"
GREEN = "color3f inputs:base_color = (0.1, 0.7, 0.2)\nfloat inputs:coat_weight = 1"
GLOW = "float inputs:emission = 1\ncolor3f inputs:emission_color = (0.2, 0.4, 0.8)"
CUT = "color3f inputs:opacity = (%g, %g, %g)"


def seen(folder: Path, fg: str, bg: str, weight: str, kinds=(STANDARD, STANDARD)) -> tuple[np.ndarray, list[str]]:
    """(3,) of the floor's middle with the sky's share, which is white."""
    text = MIXTURE.replace("FGKIND", kinds[0]).replace("BGKIND", kinds[1])
    text = text.replace("WEIGHT", weight).replace("FG", fg).replace("BG", bg)
    sky = 'def DomeLight "sky" {\n}\n'
    path = stage(folder, CAMERA, text, FLOOR.replace("EXTRA", ST.replace("map", "st")), SUN, sky)
    scene, told = read(path)
    return picture(scene, 8, 256)[2:6, 2:6].mean((0, 1)), told


@pytest.mark.parametrize(
    ("fg", "bg", "kinds"),
    [
        (RED, GOLD, (STANDARD, STANDARD)),
        (GOLD, GREEN, (STANDARD, OPEN)),
        (f"{RED}\n{GLOW}", GOLD, (STANDARD, STANDARD)),
        (RED + "\n" + CUT % (0.5, 0.5, 0.5), GOLD, (STANDARD, STANDARD)),
        (RED + "\n" + CUT % (0.5, 0.5, 0.5), GOLD + "\n" + CUT % (0.2, 0.2, 0.2), (STANDARD, STANDARD)),
        ("color3f inputs:emission_color = (0.5, 1, 2)", RED, ("ND_surface_unlit", STANDARD)),
    ],
)
def test_a_mixture_sends_out_what_its_parts_do_by_their_weights(tmp_path: Path, fg: str, bg: str, kinds):
    """Light is linear in the mixture, also where it passes."""
    ends = [seen(tmp_path, fg, bg, weight, kinds)[0] for weight in ("1", "0")]
    assert np.abs(ends[0] - ends[1]).max() > 0.1
    for weight in (0.25, 0.7):
        found, told = seen(tmp_path, fg, bg, str(weight), kinds)
        assert told == []
        assert found == pytest.approx(weight * ends[0] + (1 - weight) * ends[1], rel=0.02, abs=5e-3)


@pytest.mark.parametrize("weight", ["0", "1"])
def test_the_ends_of_a_mixture_are_its_parts(tmp_path: Path, weight: str):
    found, _ = seen(tmp_path, RED, GOLD, weight)
    alone = GOLD if weight == "0" else RED
    text = 'def Material "matte" {\n    token outputs:mtlx:surface.connect = </matte/s.outputs:out>\n'
    text += f'    def Shader "s" {{\nuniform token info:id = "{STANDARD}"\n{alone}\ntoken outputs:out\n}}\n}}\n'
    scene, _ = read(stage(tmp_path, CAMERA, text, FLOOR.replace("EXTRA", ""), SUN, 'def DomeLight "sky" {\n}\n'))
    assert found == pytest.approx(picture(scene, 8, 256)[2:6, 2:6].mean((0, 1)), rel=0.01)


def test_a_weight_may_vary(tmp_path: Path):
    """By s: left the background, right the foreground; they are seen in turn."""
    text = MIXTURE.replace("FGKIND", STANDARD).replace("BGKIND", STANDARD).replace("FG", RED)
    text = text.replace("BG", RED.replace("(0.8, 0.1, 0.1)", "(0.1, 0.1, 0.8)"))
    text = text.replace("inputs:mix = WEIGHT", "inputs:mix.connect = </matte/s.outputs:out>")
    scene, told = read(stage(tmp_path, CAMERA, text, FLOOR.replace("EXTRA", ST.replace("map", "st")), SUN))
    rgb = picture(scene, 16, 32).mean(0)
    assert told == []
    s = (np.arange(16) + 0.5) / 16
    assert rgb[:, 0] / (rgb[:, 0] + rgb[:, 2]) == pytest.approx((0.1 + 0.7 * s) / 0.9, abs=0.03)


def test_mixtures_of_mixtures(tmp_path: Path):
    inner = MIXTURE.replace("FGKIND", STANDARD).replace("BGKIND", STANDARD).replace("WEIGHT", "0.5")
    outer = """
    def Shader "outer" {
        uniform token info:id = "ND_mix_surfaceshader"
        token inputs:fg.connect = </matte/mix.outputs:out>
        token inputs:bg.connect = </matte/bg.outputs:out>
        float inputs:mix = 0.5
        token outputs:out
    }
}
"""
    text = inner.rstrip()[:-1] + outer
    text = text.replace("surface.connect = </matte/mix", "surface.connect = </matte/outer")
    blue = RED.replace("(0.8, 0.1, 0.1)", "(0.1, 0.1, 0.9)")
    path = stage(tmp_path, CAMERA, text.replace("FG", RED).replace("BG", blue), FLOOR.replace("EXTRA", ""), SUN)
    scene, told = read(path)
    assert told == []
    expected = 0.25 * np.array((0.8, 0.1, 0.1)) + 0.75 * np.array((0.1, 0.1, 0.9))
    assert picture(scene, 8, 64).mean((0, 1)) == pytest.approx(2 / np.pi * expected, rel=0.03)


def test_parts_that_cannot_be_read_are_told_and_the_other_stands(tmp_path: Path):
    alone, _ = seen(tmp_path, RED, RED, "1")
    found, told = seen(tmp_path, RED, "", "0.5", (STANDARD, "ND_nobody_has_it"))
    assert found == pytest.approx(alone, rel=0.01)
    assert len(told) == 1 and "/matte/mix.inputs:bg" in told[0] and "ND_nobody_has_it" in told[0]
    _, told = seen(tmp_path, "", "", "0.5", ("ND_none", "ND_nobody_has_it"))
    assert len(told) == 2


def test_a_mixture_in_a_circle_is_told(tmp_path: Path):
    text = MIXTURE.replace("</matte/fg.outputs:out>", "</matte/mix.outputs:out>", 1).replace("WEIGHT", "0.5")
    text = text.replace("FGKIND", STANDARD).replace("BGKIND", STANDARD).replace("FG", "").replace("BG", "")
    _, told = read(stage(tmp_path, CAMERA, text, FLOOR.replace("EXTRA", ""), SUN))
    assert len(told) == 1 and "/matte" in told[0] and "circle" in told[0]


BUMP = """
    def Shader "bump" {
        uniform token info:id = "ND_normalmap_float"
        float3 inputs:in = (0.8, 0.5, 0.9)
        float3 outputs:out
    }
"""


def test_parts_have_normals_of_their_own(tmp_path: Path):
    """A floor that reflects all alike is as bright as the cosine to the sun above it."""
    lean = np.array([0.6, 0, 0.8])
    for weight in (0.0, 0.5, 1.0):
        text = MIXTURE.replace("FGKIND", STANDARD).replace("BGKIND", STANDARD).replace("WEIGHT", str(weight))
        bump = f"{RED}\nnormal3f inputs:normal.connect = </matte/bump.outputs:out>"
        text = text.replace("FG", bump).replace("BG", RED).rstrip()[:-1] + BUMP + "}\n"
        scene, told = read(stage(tmp_path, CAMERA, text, FLOOR.replace("EXTRA", ST.replace("map", "st")), SUN))
        assert told == []
        cosine = (1 - weight) + weight * lean[2]
        assert picture(scene, 8, 64).mean((0, 1))[0] == pytest.approx(0.8 * cosine * 2 / np.pi, rel=0.03)


FULL = """
float inputs:metalness = 0.2
float inputs:sheen = 0.2
float inputs:coat = 0.2
float inputs:transmission = 0.2
float inputs:emission = 0.2
float inputs:thin_film_thickness = 300
bool inputs:thin_walled = 1
float inputs:subsurface = 0.2
"""


FULLER = """
float inputs:base_metalness = 0.2
float inputs:fuzz_weight = 0.2
float inputs:coat_weight = 0.2
float inputs:transmission_weight = 0.2
float inputs:emission_luminance = 0.2
float inputs:thin_film_weight = 0.5
bool inputs:geometry_thin_walled = 1
float inputs:subsurface_weight = 0.2
"""


def test_more_lobes_than_there_may_be_are_told(tmp_path: Path):
    """Eight and ten of them: whichever there is more of stands alone."""
    _, told = seen(tmp_path, FULL, FULL, "0.5")
    assert told == []
    for weight, stands in (("0.4", "0"), ("0.6", "1")):
        found, told = seen(tmp_path, FULLER, FULL, weight, (OPEN, STANDARD))
        assert len(told) == 1 and "/matte/mix" in told[0] and "18 lobes" in told[0]
        alone, _ = (
            seen(tmp_path, FULLER, RED, "1", (OPEN, STANDARD)) if stands == "1" else seen(tmp_path, RED, FULL, "0")
        )
        assert found == pytest.approx(alone, rel=0.03)


def test_mixtures_in_one_another_end(tmp_path: Path):
    """Each one has the next one twice: as many surfaces as there are paths."""
    chain = [
        f"""
    def Shader "m{k}" {{
        uniform token info:id = "ND_mix_surfaceshader"
        token inputs:fg.connect = </matte/m{k + 1}.outputs:out>
        token inputs:bg.connect = </matte/m{k + 1}.outputs:out>
        float inputs:mix = 0.5
        token outputs:out
    }}"""
        for k in range(40)
    ]
    text = 'def Material "matte" {\n    token outputs:mtlx:surface.connect = </matte/m0.outputs:out>\n' + "".join(chain)
    text += f'\n    def Shader "m40" {{\nuniform token info:id = "{STANDARD}"\ntoken outputs:out\n}}\n}}\n'
    _, told = read(stage(tmp_path, CAMERA, text, FLOOR.replace("EXTRA", ""), SUN))
    assert any("too many mixtures" in each for each in told)
