"""Mistakes of shaders that pictures alone would show: they are told, where they are known, and once."""

from __future__ import annotations

from pathlib import Path

import kanuka

PAINT = """
class paint(float rough = 1; color c = 0.5;) {
    public void mnk_init(output MnkObjectProperties o; output MnkMaterial m) {
        MnkMaterialBoundary b = CreateBoundary(m);
        AddLobe(b, "paint", MicrofacetConductorBrdf());
    }
    public void mnk_prelighting(MnkMaterialBoundary b) {
        SetLobe(b, "%s", 1, %s("reflectance", c, "roughness", rough * u));
    }
}
"""
SCENE = """
Option "searchpath" "shader" "{folder}:@"
Format 24 24 1
Projection "orthographic"
WorldBegin
LightSource "ambientlight" 1
Translate 0 0 1
Surface "paint" "float rough" {first}
Patch "bilinear" "P" [-1 -1 0 1 -1 0 -1 0 0 1 0 0]
Surface "paint" "float rough" {second} "color c" [1.5 0 0]
Patch "bilinear" "P" [-1 0 0 1 0 0 -1 1 0 1 1 0]
WorldEnd
"""


def render(folder: Path, first: float, second: float) -> kanuka.Picture:
    (folder / "paint.sl").write_text(PAINT % ("paint", "MicrofacetConductorBrdf"))
    (folder / "scene.rib").write_text(SCENE.format(folder=folder, first=first, second=second))
    return kanuka.render(kanuka.load(folder / "scene.rib"), progressions=1)


def told(picture: kanuka.Picture) -> list[str]:
    return [m.message for m in picture.journal.messages if "it is kept" in m.message]


def test_clamped_values_are_told_once_for_each_input(tmp_path: Path) -> None:
    messages = told(render(tmp_path, 2, 3))
    assert len(messages) == 2, messages
    reflectance, roughness = sorted(messages)
    assert 'shader "paint": paint.reflectance goes from 1.5 to 1.5' in reflectance
    assert 'shader "paint": paint.roughness goes from 0 to 3' in roughness
    assert "it is kept within 0 and 1" in roughness
    assert int(roughness.split("outside at ")[1].split()[0]) > 100
    assert told(render(tmp_path, 2, 3)) == messages  # for any order of threads


def test_values_in_range_are_not(tmp_path: Path) -> None:
    (tmp_path / "paint.sl").write_text(PAINT % ("paint", "MicrofacetConductorBrdf"))
    text = SCENE.format(folder=tmp_path, first=1, second=0.5).replace("[1.5 0 0]", "[1 0 0]")
    (tmp_path / "scene.rib").write_text(text)
    assert not told(kanuka.render(kanuka.load(tmp_path / "scene.rib"), progressions=1))


def test_names_and_types_of_lobes_are_errors_of_the_compiler(kanuka_command, tmp_path: Path) -> None:
    for name, lobe, message in [
        ("pant", "MicrofacetConductorBrdf", 'did you mean "paint"?'),
        ("paint", "MicrofacetDielectricBrdf", "mnk_init adds it as a MicrofacetConductorBrdf"),
    ]:
        source = (PAINT % (name, lobe)).replace('"reflectance", c, ', "")
        (tmp_path / "wrong.sl").write_text(source)
        result = kanuka_command("shader", "compile", "wrong.sl")
        assert result.returncode != 0
        assert message in result.stderr, result.stderr


SENT = """
class sent(output varying float depth = 0; output varying color c = 0; output varying color seen = 0;) {
    public void mnk_init(output MnkObjectProperties o; output MnkMaterial m) {
        MnkMaterialBoundary b = CreateBoundary(m);
        AddLobe(b, "glow", DiffuseEmission());
    }
    public void mnk_displacement(output point P; output normal N) {
        depth = 0.25;
        c = color(0.5, 0.25, 0.125);
    }
    public void mnk_prelighting(MnkMaterialBoundary b) {
        seen = 2 * c;
    }
}
"""


def test_outputs_of_displacement_reach_surface_and_display(tmp_path: Path) -> None:
    (tmp_path / "sent.sl").write_text(SENT)
    for shape in ['Patch "bilinear" "P" [-2 -2 0 2 -2 0 -2 2 0 2 2 0]', mesh(40)]:
        (tmp_path / "scene.rib").write_text(
            f'Option "searchpath" "shader" "{tmp_path}:@"\nFormat 16 16 1\nProjection "orthographic"\nWorldBegin\n'
            f'Translate 0 0 1\nSurface "sent"\n{shape}\nWorldEnd\n'
        )
        picture = kanuka.render(kanuka.load(tmp_path / "scene.rib"), progressions=1, aovs=["depth", "c", "seen"])
        assert abs(picture["depth"] - 0.25).max() < 1e-6
        assert abs(picture["c"] - (0.5, 0.25, 0.125)).max() < 1e-6
        assert abs(picture["seen"] - (1, 0.5, 0.25)).max() < 1e-6


def mesh(n: int) -> str:
    """Faces smaller than a micropolygon."""
    p = [f"{4 * i / n - 2:g} {4 * j / n - 2:g} 0" for j in range(n + 1) for i in range(n + 1)]
    v = [f"{a} {a + n + 1} {a + n + 2} {a + 1}" for j in range(n) for a in range(j * (n + 1), j * (n + 1) + n)]
    return f'PointsPolygons [{"4 " * n * n}] [{" ".join(v)}] "P" [{" ".join(p)}]'


def test_moving_p_in_a_surface_is_told(tmp_path: Path) -> None:
    (tmp_path / "moved.sl").write_text("surface moved() { P += 0.1 * normalize(N); Ci = diffuse(N); Oi = 1; }")
    journal = kanuka.Journal()
    assert kanuka.compile_shader(str(tmp_path / "moved.sl"), journal=journal)
    assert any("only a displacement shader moves the surface" in m.message for m in journal.messages)
