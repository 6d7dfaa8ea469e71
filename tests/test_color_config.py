"""Configurations of OpenColorIO: the built-in one against published primaries and curves, worked out here in double
precision, and small ones that are written here."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("MaterialX")
import PyOpenColorIO as ocio
from pxr import Sdf, Usd, UsdShade

import kanuka
import kanuka.usd
from kanuka.looks import pictures
from kanuka.looks.files import Files
from kanuka.usd import color_config
from kanuka.usd.color_config import Configuration
from kanuka.usd.materials import Materials
from kanuka.usd.spaces import Spaces
from test_texture_spaces import PUBLISHED, SPACES, flat
from usd_graphs import plain
from usd_stages import CAMERA, FLOOR, ST, SUN, picture, read, stage

BUILT_IN = "ocio://cg-config-latest"
CODE = (0.6, 0.4, 0.2)
PALE = (0.5, 0.4, 0.45)  # which a spectrum can have in every space
BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])  # Lam 1985


def d65_from(name: str) -> np.ndarray:
    """XYZ under D65: SMPTE RP 177, and Bradford's adaptation of another white. XYZ are themselves; USD scales its axes
    so that they add up to white."""
    if name == "xyz":
        return np.eye(3)
    numbers = np.array(PUBLISHED[name]).reshape(4, 2)
    columns = np.array([[x, y, 1 - x - y] for x, y in numbers]).T
    white, daylight = columns[:, 3] / columns[1, 3], np.array([0.3127 / 0.3290, 1, 0.3583 / 0.3290])
    found = columns[:, :3] @ np.diag(np.linalg.solve(columns[:, :3], white))
    gain = np.diag((BRADFORD @ daylight) / (BRADFORD @ white))
    return np.linalg.inv(BRADFORD) @ gain @ BRADFORD @ found


def between(a: str, b: str) -> np.ndarray:
    return np.linalg.inv(d65_from(b)) @ d65_from(a)


def acescct(v: float) -> float:
    """Academy S-2016-001."""
    return (v - 0.0729055341958355) / 10.5402377416545 if v <= 0.155251141552511 else 2 ** (v * 17.52 - 9.72)


KNOWN = SPACES | {
    "ACEScct": (acescct, "ap1"),
    "g26_p3d65_display": (lambda v: v**2.6, "p3"),
    "g22_adobergb_scene": (lambda v: v ** (563 / 256), "adobe"),  # an alias of its space with Adobe's own curve
}


@pytest.fixture(scope="module")
def built_in() -> Configuration:
    return Configuration(ocio.Config.CreateFromFile(BUILT_IN), BUILT_IN)


def test_spaces_of_the_built_in_configuration_are_as_published(built_in: Configuration):
    met = 0
    for name, (curve, primaries) in KNOWN.items():
        for ours, to in {"rec709": "rec709", "rec2020": "rec2020", "acescg": "ap1"}.items():
            if (space := built_in.named(name, ours)) is None:
                continue
            met += 1
            light = between(primaries, to) @ [curve(v) for v in CODE]
            assert space.converted(np.array(CODE), ours) == pytest.approx(light, abs=1e-5), (name, ours)
    assert met > 60


def test_what_it_renders_in_is_told_by_its_matrices(built_in: Configuration):
    found = {name: built_in.rendered(name) for name in built_in._config.getColorSpaceNames()}
    assert {name: ours for name, ours in found.items() if ours} == {
        "ACEScg": "acescg",
        "Linear Rec.2020": "rec2020",
        "Linear Rec.709 (sRGB)": "rec709",
    }
    assert built_in.rendered("scene_linear") == "acescg" and built_in.rendered("lin_ap1_scene") == "acescg"
    assert built_in.rendered("teapot") is None


# ---- a small one of our own

POWER, STEPS = 1.7, (0.0, 0.05, 0.3, 0.55, 1.0)  # of a curve; values of a table from 0 to 1
WARM = np.array([[0.9, 0.1, 0.0], [0.05, 0.85, 0.1], [0.0, 0.2, 0.8]])
CONFIG = """ocio_profile_version: 2
search_path: .
roles: {ROLES}
file_rules:
  - !<Rule> {name: Film, colorspace: film, pattern: "*flat*", extension: "exr"}
  - !<Rule> {name: Default, colorspace: warm}
displays:
  screen:
    - !<View> {name: plain, colorspace: lin}
colorspaces:
  - !<ColorSpace>
    name: lin
    aliases: [house_linear]
  - !<ColorSpace>
    name: ap0
    from_scene_reference: !<MatrixTransform> {matrix: [AP0]}
  - !<ColorSpace>
    name: warm
    aliases: [house warm]
    to_scene_reference: !<GroupTransform>
      children:
        - !<ExponentTransform> {value: POWER}
        - !<MatrixTransform> {matrix: [WARM]}
  - !<ColorSpace>
    name: film
    to_scene_reference: !<FileTransform> {src: film.spi1d, interpolation: linear}
  - !<ColorSpace>
    name: lost
    to_scene_reference: !<FileTransform> {src: lost.spi1d, interpolation: linear}
  - !<ColorSpace>
    name: numbers
    isdata: true
"""
ROLES = "scene_linear: lin, aces_interchange: ap0, data: numbers"


def sixteen(matrix: np.ndarray) -> str:
    whole = np.eye(4)
    whole[:3, :3] = matrix
    return ", ".join(repr(float(x)) for x in whole.ravel())


def configured(folder: Path, roles: str = ROLES, linear: str = "rec709") -> Path:
    text = CONFIG.replace("ROLES", roles).replace("POWER", str(POWER))
    text = text.replace("[AP0]", f"[{sixteen(between(linear, 'ap0'))}]").replace("[WARM]", f"[{sixteen(WARM)}]")
    (folder / "house.ocio").write_text(text)
    rows = "\n".join(str(v) for v in STEPS)
    (folder / "film.spi1d").write_text(f"Version 1\nFrom 0 1\nLength {len(STEPS)}\nComponents 1\n{{\n{rows}\n}}\n")
    return folder / "house.ocio"


def house(folder: Path, **options) -> Configuration:
    path = str(configured(folder, **options))
    return Configuration(ocio.Config.CreateFromFile(path), path)


def warm(rgb) -> np.ndarray:
    return WARM @ np.array(rgb) ** POWER


def film(rgb) -> np.ndarray:
    return np.interp(rgb, np.linspace(0, 1, len(STEPS)), STEPS)


LOOK = """
def Material "m" {
    token outputs:surface.connect = </m/s.outputs:out>
    def Shader "s" {
        uniform token info:id = "ND_standard_surface_surfaceshader"
        color3f inputs:base_color = (0.6, 0.4, 0.2) VALUE
        float inputs:base = 1
        float inputs:emission = 1
        color3f inputs:emission_color.connect = </m/t.outputs:out>
        token outputs:out
    }
    def Shader "t" {
        uniform token info:id = "ND_image_color4"
        asset inputs:file = @FILE@ PICTURE
        color4f outputs:out
    }
}
"""


def said(space: str) -> str:
    return f'( colorSpace = "{space}" )' if space else ""


def shaded(
    config: Configuration | None, space: str, file: str = "", of_file: str | None = None, rendered: str = "rec709"
) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """What a value of CODE and a picture become."""
    text = LOOK.replace("VALUE", said(space)).replace("FILE", file)
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.ImportFromString("#usda 1.0\n" + text.replace("PICTURE", said(space if of_file is None else of_file)))
    opened, told = Usd.Stage.Open(layer), []

    def say(severity: str, text: str) -> None:
        told.append(text)

    materials = Materials(say, Files(), Usd.TimeCode.Default(), Spaces(say, rendered, config))
    made = materials.of(UsdShade.Material.Get(opened, "/m"))
    shader = kanuka.compile_shader(materials._files.folder / f"{made.shader}.sl")
    found = shader.run(4, 4, plain(made))["slots"]
    return found["body.diffuseReflectance"][2, 2], found["light.radiance"][2, 2], told


def eighths(rgb) -> tuple[float, ...]:
    return tuple(round(v * 255) / 255 for v in rgb)


@pytest.mark.parametrize(
    ("name", "light"), [("warm", warm), ("house warm", warm), ("film", film), ("numbers", np.array), ("data", np.array)]
)
def test_spaces_of_a_matrix_and_a_curve_and_of_a_table(tmp_path: Path, name: str, light):
    """A value, and pictures of codes and of light."""
    code = eighths(CODE)
    for suffix, tolerance in (("png", 2e-3), ("exr", 2e-3)):
        value, seen, told = shaded(house(tmp_path), name, flat(tmp_path, code, suffix))
        assert value == pytest.approx(light(CODE), abs=1e-5)
        assert seen == pytest.approx(light(code), abs=tolerance), suffix
        assert told == []


def test_they_are_converted_into_what_is_rendered_in(tmp_path: Path):
    file, config = flat(tmp_path, eighths(CODE)), house(tmp_path)
    for name, light in (("warm", warm), ("film", film)):
        value, seen, told = shaded(config, name, file, rendered="acescg")
        assert value == pytest.approx(between("rec709", "ap1") @ light(CODE), abs=2e-5)
        if name == "film":  # shaders that run without a scene know of no other space
            assert seen == pytest.approx(between("rec709", "ap1") @ light(eighths(CODE)), abs=2e-3)
        assert told == []


def test_names_that_it_does_not_know_are_those_that_are_built_in(tmp_path: Path):
    value, _, told = shaded(house(tmp_path), "lin_ap1_scene", flat(tmp_path, CODE))
    assert value == pytest.approx(between("ap1", "rec709") @ CODE, abs=1e-5) and told == []
    value, _, told = shaded(house(tmp_path), "teapot", flat(tmp_path, CODE))
    assert value == pytest.approx(CODE) and len(told) == 2 and all("teapot" in text for text in told)


def test_curves_that_fit_need_no_other_picture(tmp_path: Path):
    """A power of codes is undone by the shader; of floats, which may be below 0, and by a table a picture is made."""
    config, before = house(tmp_path), set(pictures.folder().iterdir())
    file = flat(tmp_path, (0.1, 0.2, 0.3))
    shaded(config, "warm", file)
    assert set(pictures.folder().iterdir()) == before
    shaded(config, "film", file)
    assert len(set(pictures.folder().iterdir()) - before) == 1


def test_rules_for_files_are_for_those_that_say_auto(tmp_path: Path):
    config = house(tmp_path)
    png, exr = (flat(tmp_path, eighths(CODE), suffix) for suffix in ("png", "exr"))
    for file, light in ((exr, film), (png, warm)):
        _, seen, told = shaded(config, "", file, of_file="auto")
        assert seen == pytest.approx(light(eighths(CODE)), abs=2e-3) and told == []
    _, seen, told = shaded(config, "", exr)
    assert seen == pytest.approx(eighths(CODE), abs=1e-3) and told == []
    _, seen, told = shaded(None, "", exr, of_file="auto")
    assert seen == pytest.approx(eighths(CODE), abs=1e-3) and told == []


# ---- of stages

GLOWING = """
def Material "matte" {
    token outputs:mtlx:surface.connect = </matte/s.outputs:out>
    def Shader "s" {
        uniform token info:id = "ND_surface_unlit"
        color3f inputs:emission_color = (0.5, 0.4, 0.45) ( colorSpace = "SPACE" )
        token outputs:out
    }
}
"""


def head(config: str) -> str:
    return f'#usda 1.0\n(\n    colorConfiguration = @{config}@\n    upAxis = "Y"\n)\n'


def loaded(folder: Path, space: str, config: str = "", **options):
    parts = (CAMERA, GLOWING.replace("SPACE", space), FLOOR.replace("EXTRA", ST.replace("map", "st")), SUN)
    return read(stage(folder, *parts, **({"head": head(config)} if config else {})), **options)


def seen(scene: kanuka.Scene) -> np.ndarray:
    """Wavelengths are drawn at random."""
    return picture(scene, 4, 64)[1:3, 1:3].mean((0, 1))


def test_a_stage_names_its_configuration_beside_it(tmp_path: Path):
    configured(tmp_path)
    scene, told = loaded(tmp_path, "film", "./house.ocio")
    assert told == [] and scene.options.color_space == "rec709"
    assert seen(scene) == pytest.approx(film(PALE), abs=0.012)


def test_archives_are_configurations_with_their_tables(tmp_path: Path):
    path = configured(tmp_path)
    path.write_text(path.read_text().replace("search_path: .", 'search_path: ""'))
    config = ocio.Config.CreateFromFile(str(path))
    config.setWorkingDir(str(tmp_path))
    config.archive(str(tmp_path / "house.ocioz"))
    (tmp_path / "film.spi1d").unlink()
    scene, told = loaded(tmp_path, "film", "house.ocioz")
    assert told == []
    assert seen(scene) == pytest.approx(film(PALE), abs=0.012)


def test_a_package_holds_its_configuration(tmp_path: Path):
    """Without files of its own: a space that is a matrix and a power."""
    from pxr import Sdf

    configured(tmp_path)
    parts = (CAMERA, GLOWING.replace("SPACE", "warm"), FLOOR.replace("EXTRA", ST.replace("map", "st")), SUN)
    inside = stage(tmp_path, *parts, head=head("house.ocio"))
    with Sdf.ZipFileWriter.CreateNew(str(tmp_path / "a.usdz")) as package:
        package.AddFile(str(inside), "a.usda")
        package.AddFile(str(tmp_path / "house.ocio"), "house.ocio")
    (tmp_path / "house.ocio").unlink()
    scene, told = read(tmp_path / "a.usdz")
    assert told == []
    assert seen(scene) == pytest.approx(warm(PALE), abs=0.012)


def test_a_stage_names_one_that_is_built_in(tmp_path: Path):
    scene, told = loaded(tmp_path, "ACEScct", BUILT_IN)
    assert told == [] and scene.options.color_space == "acescg"
    light = [acescct(v) for v in PALE]
    assert seen(scene) == pytest.approx(light, abs=0.012)
    scene, told = loaded(tmp_path, "ACEScct", BUILT_IN, color_space="rec709")
    assert told == [] and scene.options.color_space == "rec709"
    assert seen(scene) == pytest.approx(between("ap1", "rec709") @ light, abs=0.012)


def test_the_environment_names_one_for_stages_that_name_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    (tmp_path / "env").mkdir()
    monkeypatch.setenv("OCIO", str(configured(tmp_path / "env", linear="rec2020")))
    scene, told = loaded(tmp_path, "film")
    assert told == [] and scene.options.color_space == "rec2020"
    assert seen(scene) == pytest.approx(film(PALE), abs=0.012)
    scene, told = loaded(tmp_path, "ACEScg", BUILT_IN)
    assert told == [] and scene.options.color_space == "acescg"


@pytest.mark.parametrize("path", ["absent.ocio", "broken.ocio", "broken.ocioz", "ocio://teapot"])
def test_a_configuration_that_cannot_be_read_is_told_once(tmp_path: Path, path: str):
    (tmp_path / "broken.ocio").write_bytes(b"\xff\xfe: [nothing\n\x00")
    (tmp_path / "broken.ocioz").write_bytes(b"PK\x03\x04nothing")
    scene, told = loaded(tmp_path, "lin_ap1_scene", path)
    assert len(told) == 1 and path in told[0] and "not read" in told[0]
    light = between("ap1", "rec709") @ PALE
    assert seen(scene) == pytest.approx(light, abs=0.012)


def test_without_the_package_names_that_are_built_in_go_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "PyOpenColorIO", None)
    scene, told = loaded(tmp_path, "lin_ap1_scene", BUILT_IN)
    assert len(told) == 1 and BUILT_IN in told[0] and "kanuka[usd]" in told[0]
    assert scene.options.color_space == "rec709"
    light = between("ap1", "rec709") @ PALE
    assert seen(scene) == pytest.approx(light, abs=0.012)


def test_what_cannot_be_converted_is_told_and_stays(tmp_path: Path):
    """A space whose table is not there; a file that is no picture."""
    value, _, told = shaded(house(tmp_path), "lost", flat(tmp_path, CODE))
    assert value == pytest.approx(CODE) and len(told) == 2 and all("lost" in text for text in told)
    (tmp_path / "bad.png").write_bytes(b"no picture")
    with pytest.warns(kanuka.Warning, match="bad.png"):
        value, _, told = shaded(house(tmp_path), "film", str(tmp_path / "bad.png"))
    assert value == pytest.approx(film(CODE), abs=1e-5)
    assert len([text for text in told if "bad.png" in text and "not converted" in text]) == 1


def test_a_configuration_without_a_common_space_is_told(tmp_path: Path):
    """Its linear one is taken for what is rendered in, as it is. (With the space AP0 in it OpenColorIO finds out what
    the others are, without a role.)"""
    path = configured(tmp_path, roles="scene_linear: lin")
    assert Configuration(ocio.Config.CreateFromFile(str(path)), "").rendered("lin") == "rec709"
    text = path.read_text()
    begin = text.index("  - !<ColorSpace>\n    name: ap0")
    path.write_text(text[:begin] + text[text.index("  - !<ColorSpace>\n    name: warm") :])
    scene, told = loaded(tmp_path, "film", "house.ocio", color_space="acescg")
    assert len(told) == 1 and "house.ocio" in told[0] and "scene_linear" in told[0]
    assert seen(scene) == pytest.approx(film(PALE), abs=0.012)


def test_settings_name_what_to_render_in_by_the_configuration(tmp_path: Path):
    configured(tmp_path, linear="rec2020")
    settings = 'def RenderSettings "s" {\n    uniform token renderingColorSpace = "NAME"\n}\n'

    def space(name: str) -> tuple[str, list[str]]:
        text = head("house.ocio").replace(")\n", '    renderSettingsPrimPath = "/s"\n)\n')
        path = stage(tmp_path, CAMERA, FLOOR.replace("EXTRA", ""), SUN, settings.replace("NAME", name), head=text)
        scene, told = read(path)
        return scene.options.color_space, [each for each in told if "/s" in each]

    assert space("house_linear") == ("rec2020", [])
    assert space("lin_ap1_scene") == ("acescg", [])  # which it does not know
    found, told = space("film")
    assert found == "rec709" and len(told) == 1 and "film" in told[0]


def test_summaries_convert_no_pictures(tmp_path: Path):
    configured(tmp_path)
    before = set(pictures.folder().iterdir())
    text = LOOK.replace("VALUE", said("warm")).replace("FILE", flat(tmp_path, CODE)).replace("PICTURE", said("film"))
    found = kanuka.usd.summary(stage(tmp_path, text, head=head("house.ocio")))
    assert found["materials"][0]["not_read"] == [] and set(pictures.folder().iterdir()) == before


def test_every_kind_of_curve_is_fitted_or_left(tmp_path: Path):
    """Within 1e-5 of the processor, for every space of the built-in configuration that has a curve and a matrix."""
    config = ocio.Config.CreateFromFile(BUILT_IN)
    ours, fits = Configuration(config, BUILT_IN), 0
    rgb = np.random.default_rng(7).random((500, 3)).astype(np.float32)
    for name in config.getColorSpaceNames():
        space = ours.named(name, "acescg")
        if space.is_data or not space.matrix_of:
            continue
        fits += 1
        expected = rgb.copy()
        cpu = config.getProcessor(name, "ACEScg").getOptimizedCPUProcessor(ocio.OPTIMIZATION_LOSSLESS)
        cpu.applyRGB(expected)
        found = space.curve.decoded(rgb) @ space.rendered("acescg").T
        assert found == pytest.approx(expected, abs=1.5e-5), name
    assert fits >= 18
    assert not color_config.Configured.fits(ours.named("ACEScct", "acescg"), "a.png")
