"""RenderProducts and RenderVars of USD stages: which pictures are made, under which names, with which layers."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest

import kanuka
import kanuka.usd
from usd_stages import CAMERA, FLOOR, MATTE, SUN, stage

# Half as far from the floor as "cam".
NEAR = CAMERA.replace('"cam"', '"low"').replace("(0, 4, 0, 1)", "(0, 2, 0, 1)")
SEEN = FLOOR.replace(
    "EXTRA",
    """texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] (interpolation = "faceVarying")
    float[] primvars:heat = [7] (interpolation = "uniform")
    color3f[] primvars:displayColor = [(0.25, 0.5, 0.75)]""",
)
PRODUCTS = """
def Scope "Render" {
    def RenderSettings "settings" {
        uniform int2 resolution = (16, 16)
        rel camera = </cam>
        rel products = [</Render/beauty>, </Render/data>, </Render/near>]
    }
    def RenderProduct "beauty" {
        token productName = "out.exr"
        rel orderedVars = [</Render/color>, </Render/diffuse>, </Render/mirrors>]
    }
    def RenderProduct "data" {
        token productName = "data"
        rel orderedVars = [</Render/depth>, </Render/uv>, </Render/heat>, </Render/tint>]
    }
    def RenderProduct "near" {
        token productName = "near.png"
        rel camera = </low>
        uniform int2 resolution = (8, 4)
        rel orderedVars = [</Render/depth>]
    }
    def RenderVar "color" {
        uniform token dataType = "color4f"
        uniform string sourceName = "Ci"
    }
    def RenderVar "diffuse" {
        uniform string sourceName = "C<RD>L"
        uniform token sourceType = "lpe"
    }
    def RenderVar "mirrors" {
        uniform string sourceName = "lpe:C<RS>L"
    }
    def RenderVar "depth" {
        uniform token dataType = "float"
        uniform string sourceName = "depth"
    }
    def RenderVar "uv" {
        uniform token dataType = "texCoord2f"
        uniform string sourceName = "st"
        uniform token sourceType = "primvar"
    }
    def RenderVar "heat" {
        uniform token dataType = "float"
        uniform string sourceName = "primvars:heat"
    }
    def RenderVar "tint" {
        uniform string sourceName = "displayColor"
    }
}
"""
RADIANCE = 0.5 / math.pi * 2  # of the floor: albedo over pi, times the sun's irradiance


def settled(folder: Path, text: str = PRODUCTS, *more: str) -> Path:
    path = stage(folder, CAMERA, NEAR, SEEN, MATTE, SUN, text, *more, name="shot.usda")
    path.write_text(path.read_text().replace("(\n", '(\n    renderSettingsPrimPath = "/Render/settings"\n', 1))
    return path


def of_vars(folder: Path, *bodies: str, extra: str = "") -> tuple[list, list[str]]:
    """The products of settings with one product, which has a var for each body."""
    targets = ", ".join(f"</Render/v{k}>" for k in range(len(bodies)))
    made = "".join(f'    def RenderVar "v{k}" {{\n{body}\n    }}\n' for k, body in enumerate(bodies))
    path = settled(
        folder,
        f"""
def Scope "Render" {{
    def RenderSettings "settings" {{
        rel products = [</Render/p>]
    }}
    def RenderProduct "p" {{
        token productName = "p.exr"
        rel orderedVars = [{targets}]
        {extra}
    }}
{made}}}
""",
    )
    journal = kanuka.Journal()
    return kanuka.usd.products(path, journal=journal), [m.message for m in journal]


def inner(layer: np.ndarray) -> np.ndarray:
    """Without the pixels whose filter reaches over the floor's edge."""
    return layer[4:-4, 4:-4]


# ---- pictures


def test_each_product_is_a_file_with_its_vars(kanuka_command, tmp_path: Path) -> None:
    path = settled(tmp_path)
    folder = tmp_path / "elsewhere"
    folder.mkdir()
    command = ("render", path, "--progressions", "4", "--threads", "1", "--stats", "figures.json")
    done = kanuka_command(*command, cwd=folder)
    assert (done.returncode, done.stdout.split()) == (0, ["out.exr", "data.exr", "near.exr"]), done.stderr
    assert "warning" not in done.stderr
    assert "/Render/beauty, /Render/data (1 of 2)" in done.stderr and "/Render/near (2 of 2)" in done.stderr
    beauty, data, near = (kanuka.read(folder / f"{name}.exr") for name in ("out", "data", "near"))
    assert set(beauty.keys()) == {"rgb", "alpha", "lpe:C<RD>L", "lpe:C<RS>L"}
    # A path's wavelengths are at random: 256 of them agree within a hundredth.
    assert inner(beauty["rgb"]).mean() == pytest.approx(RADIANCE, rel=0.02)
    assert beauty["lpe:C<RD>L"] == pytest.approx(beauty["rgb"], abs=1e-3) and not beauty["lpe:C<RS>L"].any()
    assert set(data.keys()) == {"Z", "uv", "heat", "tint"}
    assert inner(data["Z"]) == pytest.approx(4) and inner(data["heat"]) == pytest.approx(7)
    # Of the picture's middle pixels: columns and rows from the left and from the top, where t is 1.
    uv, at = inner(data["uv"]), (np.arange(4, 12) + 0.5) / 16
    assert uv[..., 0].mean(0) == pytest.approx(at, abs=0.04)
    assert uv[..., 1].mean(1) == pytest.approx(1 - at, abs=0.04)
    assert inner(data["tint"]).reshape(-1, 3) == pytest.approx(np.tile([0.25, 0.5, 0.75], (64, 1)), rel=1e-3)
    assert (near.width, near.height, near.keys()) == (8, 4, ["Z"])
    assert near["Z"][1:3, 3:5] == pytest.approx(2)
    sizes = [json.loads((folder / f"figures.{name}.json").read_text())["count"]["paths"] for name in ("beauty", "near")]
    assert sizes[0] == 8 * sizes[1]  # 16 * 16 and 8 * 4 pixels


@pytest.mark.parametrize(
    ("more", "size", "layers"),
    [
        ((), (16, 16), {"rgb", "alpha", "lpe:C<RD>L", "lpe:C<RS>L"}),
        (("--aov", "point Pref"), (16, 16), {"rgb", "alpha", "lpe:C<RD>L", "lpe:C<RS>L", "Pref"}),
        (("--product", "/Render/near"), (8, 4), {"Z"}),
        (("--product", "data", "--resolution", "6x6"), (6, 6), {"Z", "uv", "heat", "tint"}),
    ],
)
def test_with_a_name_the_first_products_settings_count(kanuka_command, tmp_path: Path, more, size, layers) -> None:
    path = settled(tmp_path)
    done = kanuka_command("render", path, "--progressions", "1", "--threads", "1", "-q", "-o", "it.exr", *more)
    assert (done.returncode, done.stdout.split()) == (0, ["it.exr"]), done.stderr
    found = kanuka.read(tmp_path / "it.exr")
    assert ((found.width, found.height), set(found.keys())) == (size, layers)


def test_one_product_is_made_under_its_name(kanuka_command, tmp_path: Path) -> None:
    path = settled(tmp_path)
    run = ("render", path, "--progressions", "1", "--threads", "1", "-q", "--png")
    assert kanuka_command(*run, "--product", "near").stdout.split() == ["near.exr", "near.png"]


def test_products_that_are_not_there_end_the_command(kanuka_command, tmp_path: Path) -> None:
    done = kanuka_command("render", settled(tmp_path), "--product", "far")
    assert done.returncode == 4
    assert 'no product "far"; it has /Render/beauty, /Render/data, /Render/near' in done.stderr
    (tmp_path / "a.rib").write_text("WorldBegin WorldEnd\n")
    assert kanuka_command("render", "a.rib", "--product", "x").returncode == 2


def test_frames_of_products_have_their_own_files(kanuka_command, tmp_path: Path) -> None:
    text = PRODUCTS.replace('productName = "out.exr"', 'productName.timeSamples = {1: "a.exr", 2: "b.exr"}')
    text = text.replace('"near.png"', '"near.####.exr"')
    path = settled(tmp_path, text)
    done = kanuka_command("render", path, "--frame", "1-2", "--progressions", "1", "--threads", "1", "-q")
    first, second = ["a.exr", "data.0001.exr", "near.0001.exr"], ["b.exr", "data.0002.exr", "near.0002.exr"]
    assert done.stdout.split() == first + second, done.stderr


def test_products_of_one_name_are_two_files(kanuka_command, tmp_path: Path) -> None:
    path = settled(tmp_path, PRODUCTS.replace('"near.png"', '"out.exr"'))
    done = kanuka_command("render", path, "--progressions", "1", "--threads", "1", "-q")
    assert sorted(done.stdout.split()) == ["data.exr", "out.beauty.exr", "out.near.exr"]


def test_numbers_of_frames_in_names(tmp_path: Path) -> None:
    for name, expected in (
        ("a.####.exr", "a.0012.exr"),
        ("a.#.exr", "a.12.exr"),
        ("a.%04d.exr", "a.0012.exr"),
        ("a.%d.exr", "a.12.exr"),
        ("a.$F4.exr", "a.0012.exr"),
        ("$F/a.<F5>.exr", "12/a.00012.exr"),
        ("sub/a.exr", "sub/a.exr"),
    ):
        path = settled(tmp_path, PRODUCTS.replace("near.png", name))
        assert kanuka.usd.products(path, frame=12, product="near")[0].name == expected
        path.unlink()


# ---- the Python interface


def test_a_product_is_loaded_and_rendered(tmp_path: Path) -> None:
    path = settled(tmp_path)
    products = kanuka.usd.products(path)
    assert [(p.path, p.name) for p in products] == [
        ("/Render/beauty", "out.exr"),
        ("/Render/data", "data"),
        ("/Render/near", "near.png"),
    ]
    assert products[1].layers == ("Z", "uv", "heat", "tint") and products[1].aovs == ("uv.X", "uv.Y", "heat", "tint")
    assert products[0].layers == ("rgb", "alpha", "lpe:C<RD>L", "lpe:C<RS>L")
    assert kanuka.usd.load(path).resolution == (16, 16)
    near = kanuka.usd.load(path, product="/Render/near")
    assert near.resolution == (8, 4) and near.camera.camera_from_world[2, 3] == pytest.approx(2)
    above = kanuka.usd.load(path, product="/Render/near", camera="cam", resolution=(4, 4))
    assert above.resolution == (4, 4) and above.camera.camera_from_world[2, 3] == pytest.approx(4)
    scene = kanuka.usd.load(path, product="/Render/data")
    picture = kanuka.render(scene, progressions=1, threads=1, aovs=products[1].aovs)
    picture.write(tmp_path / "a.exr", layers=products[1].layers)
    assert set(kanuka.read(tmp_path / "a.exr").keys()) == {"Z", "uv", "heat", "tint"}
    with pytest.raises(TypeError, match="product: expected a path or name"):
        kanuka.usd.load(path, product=3)


def test_what_a_product_says_goes_over_its_settings(tmp_path: Path) -> None:
    own = """uniform float pixelAspectRatio = 2
        uniform float4 dataWindowNDC = (0.25, 0, 1, 0.5)
        uniform bool disableMotionBlur = 0
        uniform bool disableDepthOfField = 1"""
    settings = """uniform int2 resolution = (20, 10)
        uniform float pixelAspectRatio = 3
        uniform bool instantaneousShutter = 1"""
    text = PRODUCTS.replace("uniform int2 resolution = (16, 16)", settings)
    text = text.replace("uniform int2 resolution = (8, 4)", own)
    data, near = kanuka.usd.products(settled(tmp_path, text))[1:]
    assert (near.settings.resolution, near.settings.pixel_aspect) == ((20, 10), 2)
    assert near.settings.crop == (0.25, 1, 0.5, 1)
    assert (near.settings.motion_blur, near.settings.depth_of_field) == (True, False)
    assert (data.settings.pixel_aspect, data.settings.crop) == (3, None)
    assert (data.settings.motion_blur, data.settings.depth_of_field) == (False, True)
    scene = kanuka.usd.load(tmp_path / "shot.usda", product="near")
    assert scene.options.pixel_aspect == 2 and scene.options.crop == (0.25, 1, 0.5, 1)


def test_parts_of_a_stage_keep_settings_and_products(tmp_path: Path) -> None:
    path = settled(tmp_path, PRODUCTS, MATTE.replace("matte", "other"))
    for product, size in ((), (16, 16)), ("/Render/near", (8, 4)), ("near", (8, 4)):
        scene = kanuka.usd.load(path, mask=["/sun", "/matte", "/floor"], product=product)
        assert scene.resolution == size and scene.summary()["primitives"] == {"polygon mesh": 1}
    assert kanuka.usd.load(path, mask=["/sun"]).summary()["primitives"] == {}


def test_layers_of_primvars_are_on_all_that_has_them(tmp_path: Path) -> None:
    """Two faces of two materials, subdivided, and a cloud of points, each with its own value."""
    mesh = """
def Mesh "two" (prepend apiSchemas = ["MaterialBindingAPI"]) {
    rel material:binding = </matte>
    uniform token subdivisionScheme = "SCHEME"
    token interpolateBoundary = "edgeAndCorner"
    int[] faceVertexCounts = [4, 4]
    int[] faceVertexIndices = [0, 1, 4, 3, 1, 2, 5, 4]
    point3f[] points = [(-1,0,1), (0,0,1), (1,0,1), (-1,0,-1), (0,0,-1), (1,0,-1)]
    float[] primvars:heat = [3, 5] (interpolation = "uniform")
    def GeomSubset "left" (prepend apiSchemas = ["MaterialBindingAPI"]) {
        uniform token elementType = "face"
        uniform token familyName = "materialBind"
        int[] indices = [0]
        rel material:binding = </other>
    }
}
def Points "drops" {
    point3f[] points = [(-0.5, 1, 0), (0.5, 1, 0)]
    float[] widths = [0.5, 0.5]
    float[] primvars:heat = [11, 13] (interpolation = "vertex")
}
"""
    for scheme in ("none", "catmullClark"):
        own = mesh.replace("SCHEME", scheme)
        path = stage(
            tmp_path, CAMERA, MATTE, MATTE.replace("matte", "other"), SUN, PRODUCTS, own, name=f"{scheme}.usda"
        )
        journal = kanuka.Journal()
        scene = kanuka.usd.load(path, product="data", journal=journal)
        assert not len(journal)
        scene.resolution = (16, 16)
        scene.options.filter, scene.options.filter_width = "box", (1, 1)
        heat = kanuka.render(scene, progressions=4, threads=1, aovs=["heat"])["heat"]
        assert (heat[2, 4], heat[2, 12]) == (pytest.approx(3), pytest.approx(5))
        assert (heat[8, 4], heat[8, 11]) == (pytest.approx(11), pytest.approx(13))


# ---- names of layers


@pytest.mark.parametrize(
    ("name", "layers", "aovs"),
    [
        *((name, ("rgb",), ()) for name in ("Ci", "color", "beauty", "RGB")),
        ("rgba", ("rgb", "alpha"), ()),
        *((name, ("alpha",), ()) for name in ("a", "alpha", "Oi")),
        *((name, ("Z",), ()) for name in ("z", "depth", "cameraDepth", "__depth")),
        *((name, ("N",), ()) for name in ("N", "normal", "__Nworld")),
        *((name, ("P",), ()) for name in ("P", "__Pworld", "position")),
        ("albedo", ("albedo",), ()),
        ("primId", ("id",), ()),
        ("Pref", ("Pref",), ("Pref",)),
        ("sampleCount", ("sample_count",), ("sample_count",)),
        ("displayColor", ("v0",), ("v0",)),
        ("UV", ("v0",), ("v0.X", "v0.Y")),
        ("lpe:C<RD>L", ("lpe:C<RD>L",), ("lpe:C<RD>L",)),
        ("primvars:wet", ("v0",), ("v0",)),
    ],
)
def test_names_that_renderers_have_for_layers(tmp_path: Path, name: str, layers: tuple, aovs: tuple) -> None:
    for source in ("raw", "intrinsic"):
        (found,), told = of_vars(tmp_path, f'uniform string sourceName = "{name}"\ntoken sourceType = "{source}"')
        assert (found.layers, found.aovs, told) == (layers, aovs, [])
        (tmp_path / "shot.usda").unlink()


def test_layers_keep_their_order_and_are_there_once(tmp_path: Path) -> None:
    names = ("depth", "N", "z", "Ci")
    (found,), told = of_vars(tmp_path, *(f'uniform string sourceName = "{name}"' for name in names))
    assert found.layers == ("Z", "N", "rgb") and told == []


def test_layers_are_not_named_as_what_shaders_have(tmp_path: Path) -> None:
    text = PRODUCTS.replace('RenderVar "heat"', 'RenderVar "p1"').replace("/heat>", "/p1>")
    found = kanuka.usd.products(settled(tmp_path, text), product="data")[0]
    assert found.layers == ("Z", "uv", "primvar_p1", "tint")


# ---- what cannot be had


@pytest.mark.parametrize(
    ("body", "words", "layers"),
    [
        ('string sourceName = "Peye"', '/Render/v1: there is no layer "Peye"', ("Z",)),
        ('string sourceName = "C<RX>L"\ntoken sourceType = "lpe"', "/Render/v1: the light path expression", ("Z",)),
        (
            'string sourceName = "N"\ntoken sourceType = "magic"',
            '/Render/v1: there is no sourceType "magic"',
            ("Z", "N"),
        ),
        (
            'string sourceName = "a"\ntoken sourceType = "primvar"\ntoken dataType = "string"',
            '/Render/v1: a dataType of "string" makes no layer',
            ("Z", "v1"),
        ),
        (
            'string sourceName = "albedo"\ntoken dataType = "float"',
            "/Render/v1: .* 3 numbers, .*, float, ",
            ("Z", "albedo"),
        ),
    ],
)
def test_vars_that_cannot_be_had_are_told(tmp_path: Path, body: str, words: str, layers: tuple) -> None:
    (found,), told = of_vars(tmp_path, 'string sourceName = "z"', body)
    assert found.layers == layers
    assert len(told) == 1 and re.match(words, told[0]), told


def test_products_that_cannot_be_made_are_told(tmp_path: Path) -> None:
    (found,), told = of_vars(tmp_path, 'string sourceName = "glow"')
    assert found.layers == ("rgb", "alpha") and any("none of its vars" in text for text in told)
    text = PRODUCTS.replace("</Render/near>]", "</Render/near>, </Render/no>, </cam>]")
    text = text.replace('token productName = "out.exr"', 'uniform token productType = "deepRaster"')
    text = text.replace('token productName = "data"', "").replace("</Render/uv>", "</Render/uvw>")
    path = settled(tmp_path, text)
    journal = kanuka.Journal()
    found = kanuka.usd.products(path, journal=journal)
    assert [(p.path, p.name) for p in found] == [("/Render/data", "data"), ("/Render/near", "near.png")]
    told = [m.message for m in journal]
    for words in (
        "/Render/beauty: products of type deepRaster are not made",
        "/Render/no: the settings name it as a product, but there is no RenderProduct",
        "/cam: the settings name it as a product",
        "/Render/data: it has no productName",
        "/Render/data: there is no RenderVar /Render/uvw",
    ):
        assert sum(words in text for text in told) == 1, (words, told)
    assert len(told) == 5
    with pytest.raises(kanuka.Error, match="products of type deepRaster are not made"):
        kanuka.usd.load(path, product="beauty")


def test_there_is_no_overscan(tmp_path: Path) -> None:
    own = "uniform float4 dataWindowNDC = (-0.1, 0.5, 1.1, 1.1)"
    (found,), told = of_vars(tmp_path, 'string sourceName = "z"', extra=own)
    assert found.settings.crop == (0, 1, 0, 0.5)
    assert len(told) == 1 and told[0].startswith("/Render/p: a data window beyond the picture")


def test_settings_of_products_that_make_no_picture_are_told(tmp_path: Path) -> None:
    (found,), told = of_vars(
        tmp_path,
        'string sourceName = "z"',
        extra="uniform int2 resolution = (-3, 4)\nuniform float pixelAspectRatio = nan\n"
        "uniform float4 dataWindowNDC = (nan, 0, 1, 1)\nrel camera = </nowhere>",
    )
    assert (found.settings.resolution, found.settings.pixel_aspect, found.settings.crop) == (None, 1, None)
    assert len(told) == 3 and all(text.startswith("/Render/p: ") for text in told)
    with pytest.warns(kanuka.Warning) as caught:
        scene = kanuka.usd.load(tmp_path / "shot.usda")
    assert any(
        "/nowhere: the settings' camera is not there; the stage has /cam, /low" in str(w.message) for w in caught
    )
    assert scene.resolution == (960, 960)


@pytest.mark.parametrize(
    ("policy", "wide", "high", "pixel_aspect"),
    [
        # How wide a picture sees at the floor that is twice as wide as high, then one that is twice as high as wide,
        # of an aperture that sees 2 by 2.
        ("expandAperture", 4, 2, 1),
        ("cropAperture", 2, 1, 1),
        ("adjustApertureWidth", 4, 1, 1),
        ("adjustApertureHeight", 2, 2, 1),
        ("adjustPixelAspectRatio", 2, 2, 0.5),
    ],
)
def test_what_gives_way_where_the_aperture_has_another_shape(
    tmp_path: Path, policy: str, wide: float, high: float, pixel_aspect: float
) -> None:
    for size, across, aspect in (("(16, 8)", wide, pixel_aspect), ("(8, 16)", high, 1 / pixel_aspect)):
        own = f'resolution = {size}\nuniform token aspectRatioConformPolicy = "{policy}"'
        path = settled(tmp_path, PRODUCTS.replace("resolution = (8, 4)", own).replace("rel camera = </low>", ""))
        scene = kanuka.usd.load(path, product="near")
        assert scene.camera.fov_axis == "x"
        assert 2 * 4 * math.tan(math.radians(scene.camera.fov / 2)) == pytest.approx(across)
        assert scene.options.pixel_aspect == pytest.approx(aspect)
        path.unlink()
