"""Colour as spectra, from scene to picture: metamers, lights by spectrum and unit, observers, spaces, exposure."""

from __future__ import annotations

import math
import struct
import zlib
from pathlib import Path

import numpy as np
import pytest

import kanuka

POINTS = np.array([[-4, -4, 0], [4, -4, 0], [4, 4, 0], [-4, 4, 0]], np.float32)
QUAD = np.array([[0, 1, 2, 3]], np.int32)
NM = np.arange(360, 831)


def wall(
    color: object, light: object, *, unit: str = "", amount: float = math.pi, kind: str = "distant"
) -> kanuka.Scene:
    """A matte wall straight on, lit straight on: its radiance is reflectance times the light's over pi."""
    scene = kanuka.Scene()
    scene.resolution = 8, 8
    scene.camera = kanuka.Camera((0, 0, 2), (0, 0, 0), fov=40)
    scene.options.max_depth = 1
    scene.add_mesh(POINTS, QUAD, material=kanuka.Material("matte", color=color, Ka=0, Kd=1))
    scene.add_light(kind, amount=amount, direction=(0, 0, -1), position=(0, 0, 2), spectrum=light, unit=unit)
    return scene


def mean(scene: kanuka.Scene, progressions: int = 64) -> np.ndarray:
    picture = kanuka.render(scene, progressions=progressions)
    assert [str(m) for m in picture.journal] == []
    return picture["rgb"].reshape(-1, 3).mean(axis=0, dtype=np.float64)


def metamers() -> tuple[kanuka.Spectrum, kanuka.Spectrum]:
    """Two reflectances of one colour under D65: they differ by a ripple without its part along the observer."""
    d65 = kanuka.Spectrum("D65").values.astype(np.float64)
    one = np.eye(len(NM))
    weights = np.array([kanuka.Spectrum(NM, one[i]).xyz() for i in range(len(NM))]).T * d65
    ripple = np.sin((NM - 360) / 18)
    black = ripple - weights.T @ np.linalg.solve(weights @ weights.T, weights @ ripple)
    base = 0.35 + 0.1 * np.cos((NM - 560) / 90)
    return kanuka.Spectrum(NM, base), kanuka.Spectrum(NM, base + 0.2 * black / np.abs(black).max())


@pytest.mark.parametrize("light", ["D65", "A", "F11"])
def test_metamers_render_as_numeric_integration_says(light: str) -> None:
    source = kanuka.Spectrum(light)
    white = source.xyz()
    seen, wanted = [], []
    for paint in metamers():
        scene = wall(paint, source)
        scene.options.output_space = "xyz"
        seen.append(mean(scene, 512))
        wanted.append(np.array(paint.xyz(source)))
    for got, expected in zip(seen, wanted, strict=True):
        assert kanuka.delta_e_2000(tuple(got), tuple(expected), white) < 0.35
    difference = kanuka.delta_e_2000(tuple(wanted[0]), tuple(wanted[1]), white)
    rendered = kanuka.delta_e_2000(tuple(seen[0]), tuple(seen[1]), white)
    assert rendered == pytest.approx(difference, abs=0.35)
    if light == "D65":
        assert difference < 0.01
    else:
        assert difference > 3


def test_a_camera_sees_metamers_apart(tmp_path: Path) -> None:
    def bell(at: float, width: float) -> np.ndarray:
        return np.exp(-0.5 * ((NM - at) / width) ** 2)

    table = np.stack([NM, bell(600, 35), bell(535, 40), bell(460, 28)], axis=1)
    camera = tmp_path / "camera.csv"
    np.savetxt(camera, table[20:-100:5], delimiter=",", header="nm,r,g,b")
    colors = []
    for paint in metamers():
        scene = wall(paint, "D65")
        scene.options.sensor = str(camera)
        colors.append(mean(scene, 256))
    assert np.abs(colors[0] - colors[1]).max() > 0.01


@pytest.mark.parametrize("light", ["A", "F11", "LED-B1", "blackbody:3200"])
@pytest.mark.parametrize("observer", ["1931", "1964"])
def test_white_balance(light: str, observer: str) -> None:
    scene = wall((1, 1, 1), light)
    scene.options.white_balance = light
    scene.options.observer = observer
    assert mean(scene, 256) == pytest.approx([1, 1, 1], abs=0.03)


def test_a_lights_spectrum_without_balance_is_its_colour() -> None:
    got = mean(wall((1, 1, 1), "A"), 512)
    assert got == pytest.approx(kanuka.Spectrum("A").rgb(), abs=0.03)


def test_a_measured_colour_survives_a_shaders_arithmetic(tmp_path: Path) -> None:
    paint = metamers()[1]
    file = tmp_path / "paint.csv"
    np.savetxt(file, np.stack([NM, paint.values], axis=1), delimiter=",")
    plain, scaled = wall(str(file), "F11"), wall(str(file), "F11", amount=2 * math.pi)
    assert mean(scaled, 256) / 2 == pytest.approx(mean(plain, 256), rel=1e-3)
    expected = np.array(paint.rgb(kanuka.Spectrum("F11")))
    assert mean(plain, 512) == pytest.approx(expected, abs=0.02)


def test_spaces_agree() -> None:
    """White is white whatever the space; a colour given in one comes out as its conversion in another."""
    for space in ("rec709", "rec2020", "acescg"):
        scene = wall((1, 1, 1), None)
        scene.options.color_space = space
        assert mean(scene, 256) == pytest.approx([1, 1, 1], abs=0.02)
        scene.options.output_space = "rec709"
        assert mean(scene, 256) == pytest.approx([1, 1, 1], abs=0.02)
    scene = wall((0.5, 0.2, 0.1), None)
    plain = mean(scene, 256)
    scene.options.output_space = "acescg"
    matrix = np.array(
        [[0.6130974, 0.3395231, 0.0473795], [0.0701937, 0.9163539, 0.0134524], [0.0206156, 0.1095698, 0.8698146]]
    )
    assert mean(scene, 256) == pytest.approx(matrix @ plain, abs=2e-3)
    scene = wall(tuple(matrix @ (0.5, 0.2, 0.1)), None)
    scene.options.color_space = "acescg"
    scene.options.output_space = "rec709"
    assert mean(scene, 512) == pytest.approx([0.5, 0.2, 0.1], abs=0.015)


def test_units_of_lights() -> None:
    """Under 100 lux a white wall has 100 / pi nit; a candela at 2 m gives a quarter lux."""
    assert mean(wall((1, 1, 1), None, unit="lux", amount=100))[1] == pytest.approx(100 / math.pi, rel=0.02)
    spot = mean(wall((1, 1, 1), None, unit="candela", amount=1000, kind="point"))[1]
    lumen = mean(wall((1, 1, 1), None, unit="lumen", amount=4000 * math.pi, kind="point"))[1]
    assert lumen == pytest.approx(spot, rel=1e-5)
    efficacy = kanuka.Spectrum("A").efficacy
    watt = mean(wall((1, 1, 1), "A", unit="watt", amount=4000 * math.pi / efficacy, kind="point"))
    candela = mean(wall((1, 1, 1), "A", unit="candela", amount=1000, kind="point"))
    assert watt == pytest.approx(candela, rel=1e-4)


def test_area_lights_spread_their_lumen() -> None:
    """A wall of 64 square metres that gives 800 lm has 800 / (64 pi) nit, through its own spectrum."""
    scene = kanuka.Scene()
    scene.resolution = 8, 8
    scene.camera = kanuka.Camera((0, 0, 2), (0, 0, 0), fov=40)
    lamp = kanuka.Shader("arealight", intensity=800, spectrum="F11", unit="lumen")
    scene.add_mesh(POINTS, QUAD, area_light=lamp)
    scene.options.output_space = "xyz"
    got = mean(scene, 512)
    assert got == pytest.approx(np.array(kanuka.Spectrum("F11").xyz()) * 800 / (64 * math.pi), rel=0.03)


def test_exposure() -> None:
    scene = wall((0.18, 0.18, 0.18), None, unit="lux", amount=100_000)
    scene.options.f_stop, scene.options.shutter_time = 16, 1 / 100
    assert mean(scene)[1] == pytest.approx(0.18e5 / math.pi / 100 * 100 / (120 * 256), rel=0.02)
    scene.options.exposure_stops = 1
    brighter = mean(scene)
    scene.options.exposure_stops = 0
    assert brighter == pytest.approx(2 * mean(scene), rel=1e-3)


def test_what_is_not_there_is_reported(tmp_path: Path) -> None:
    scene = wall("no-such-paint.csv", "no-such-light")
    scene.options.color_space = "prophoto"
    scene.options.observer = "cat"
    scene.options.sensor = "nowhere.csv"
    picture = kanuka.render(scene, progressions=1)
    messages = " | ".join(str(m) for m in picture.journal)
    for word in ("no-such-paint", "no-such-light", "prophoto", "cat", "nowhere.csv"):
        assert word in messages
    assert np.isfinite(picture["rgb"]).all()


def chromaticities(path: Path) -> list[float]:
    data = path.read_bytes()
    at = data.index(b"chromaticities\0chromaticities\0") + 30
    return list(struct.unpack("<8f", data[at + 4 : at + 36]))


def test_headers_name_the_space(tmp_path: Path) -> None:
    scene = wall((1, 1, 1), None)
    scene.options.output_space = "acescg"
    picture = kanuka.render(scene, progressions=1)
    picture.write(tmp_path / "a.exr")
    ap1 = [0.713, 0.293, 0.165, 0.83, 0.128, 0.044, 0.32168, 0.33767]
    assert chromaticities(tmp_path / "a.exr") == pytest.approx(ap1, abs=1e-5)
    assert kanuka.read(tmp_path / "a.exr").space == "acescg"


def png_bytes(path: Path) -> np.ndarray:
    """The first byte of each of 8 rows of an 8-bit RGB PNG without filters worth the name."""
    data, at, packed = path.read_bytes(), 8, b""
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at : at + 8])
        if kind == b"IDAT":
            packed += data[at + 8 : at + 8 + size]
        at += size + 12
    return np.frombuffer(zlib.decompress(packed), np.uint8)


def test_png_encodings(tmp_path: Path) -> None:
    grey = kanuka.Picture({"rgb": np.full((1, 1, 3), 0.18, np.float32)})
    for display, value in (("srgb", 0.461356), ("rec709", 0.18 ** (1 / 2.4))):
        grey.write(tmp_path / "a.png", display=display)
        assert png_bytes(tmp_path / "a.png")[1] == round(value * 255)


def test_rib_and_command(kanuka_command, tmp_path: Path) -> None:
    (tmp_path / "paint.csv").write_text("400,0.2\n700,0.6\n")
    (tmp_path / "a.rib").write_text(
        'Format 8 8 1\nProjection "perspective" "fov" [40]\nTranslate 0 0 2\n'
        'Option "color" "string whitebalance" "A" "string output" "xyz"\nOption "exposure" "float stops" [1]\n'
        'WorldBegin\nLightSource "distantlight" 1 "string spectrum" "A" "float intensity" [100] "string unit" "lux"\n'
        'Attribute "color" "string spectrum" "paint.csv"\nSurface "matte" "float Ka" [0] "float Kd" [1]\n'
        'Polygon "P" [-4 -4 0  4 -4 0  4 4 0  -4 4 0]\nWorldEnd\n'
    )
    done = kanuka_command("render", "a.rib", "-o", "a.exr", "--progressions", "256", "--exposure", "2")
    assert done.returncode == 0, done.stderr
    picture = kanuka.read(tmp_path / "a.exr")
    assert picture.space == "xyz"
    paint = kanuka.Spectrum([400, 700], [0.2, 0.6])
    wanted = np.array(paint.xyz(kanuka.Spectrum("A"))) * 4 * 100 / math.pi
    got = picture["rgb"].reshape(-1, 3).mean(axis=0)
    assert got == pytest.approx(wanted, rel=0.02)
    done = kanuka_command("render", "a.rib", "-o", "b.exr", "--progressions", "1", "--output-space", "acescg")
    assert done.returncode == 0, done.stderr
    assert kanuka.read(tmp_path / "b.exr").space == "acescg"


def test_metals_and_glasses() -> None:
    n, k = kanuka.metal("gold")
    assert n[550 - 360] == pytest.approx(0.43, abs=0.02) and k[550 - 360] == pytest.approx(2.47, abs=0.02)
    assert kanuka.glass("BK7")[587 - 360] == pytest.approx(1.5168, abs=1e-4)
    with pytest.raises(KeyError, match="diamond"):
        kanuka.glass("jelly")
