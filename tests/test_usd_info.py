"""kanuka info and kanuka.usd.summary(): what a stage holds."""

from __future__ import annotations

import json
import time
from pathlib import Path

import pytest

import kanuka
import kanuka.usd
from usd_stages import CAMERA, FLOOR, MATTE, SUN, stage

SET = """
def Xform "forest" {
    def Xform "a" (
        instanceable = true
        references = </tree>
    ) {}
    def Xform "b" (
        instanceable = true
        references = </tree>
    ) {}
    def PointInstancer "herbs" {
        rel prototypes = [</forest/herbs/moss>, </forest/herbs/fern>]
        int[] protoIndices = [1, 0, 1, 1, 7]
        point3f[] positions = [(0,0,0), (1,0,0), (2,0,0), (3,0,0), (4,0,0)]
        def Sphere "moss" {}
        def Sphere "fern" {}
    }
}
class Xform "tree" {
    def Cylinder "trunk" {}
    def Mesh "leaves" {}
    def Volume "bark" {}
}
def Xform "car" (
    variants = {
        string paint = "red"
    }
    prepend variantSets = "paint"
) {
    variantSet "paint" = {
        "red" {}
        "blue" {}
    }
}
def Material "strange" {
    token outputs:surface.connect = </strange/s.outputs:surface>
    def Shader "s" {
        uniform token info:id = "ArnoldToon"
        token outputs:surface
    }
}
def Material "textured" {
    token outputs:surface.connect = </textured/s.outputs:surface>
    def Shader "s" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor.connect = </textured/t.outputs:rgb>
        token outputs:surface
    }
    def Shader "t" {
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @./lost.png@
        color3f outputs:rgb
    }
}
def Scope "Render" {
    def RenderSettings "settings" {
        uniform int2 resolution = (32, 18)
        rel camera = </cam>
        rel products = [</Render/p>]
    }
    def RenderProduct "p" {
        token productName = "p.exr"
        rel orderedVars = [</Render/v>]
    }
    def RenderVar "v" {
        uniform string sourceName = "z"
    }
}
"""


def made(folder: Path) -> Path:
    path = stage(folder, CAMERA, FLOOR.replace("EXTRA", ""), MATTE, SUN, SET, name="shot.usda")
    head = '(\n    renderSettingsPrimPath = "/Render/settings"\n    startTimeCode = 3\n    endTimeCode = 7\n'
    path.write_text(path.read_text().replace("(\n", head, 1))
    return path


def test_a_summary_has_all_that_a_stage_holds(tmp_path: Path) -> None:
    journal = kanuka.Journal()
    found = kanuka.usd.summary(made(tmp_path), journal=journal)
    assert not len(journal)
    assert (found["up_axis"], found["meters_per_unit"], found["frames"]) == ("Y", 1, [3, 7])
    # What is instanced is counted apart, what is abstract is not there.
    assert found["prims"]["Xform"] == 4 and found["prims"]["Sphere"] == 2 and found["prims"]["Mesh"] == 1
    assert "Cylinder" not in found["prims"]
    (trees,) = found["instances"]
    assert trees == {
        "count": 2,
        "first": "/forest/a",
        "holds": {"Cylinder": 1, "Mesh": 1, "Volume": 1},
    }
    herbs = {"/forest/herbs/moss": 1, "/forest/herbs/fern": 3}
    assert found["point_instancers"] == [{"path": "/forest/herbs", "count": 5, "prototypes": herbs}]
    materials = {each["path"]: each for each in found["materials"]}
    assert set(materials) == {"/matte", "/strange", "/textured"}
    assert (materials["/matte"]["surface"], materials["/matte"]["not_read"]) == ("UsdPreviewSurface", [])
    assert materials["/strange"]["surface"] == "ArnoldToon"
    assert "no surface that can be read" in materials["/strange"]["not_read"][0]
    assert found["missing_textures"] == [{"path": "/textured/t.inputs:file", "file": "./lost.png"}]
    assert [(each["path"], each["type"], each["intensity"]) for each in found["lights"]] == [
        ("/sun", "DistantLight", 2)
    ]
    assert [(each["path"], each["focal_length"], each["aperture"]) for each in found["cameras"]] == [
        ("/cam", 40, [20, 20])
    ]
    assert (found["settings"]["path"], found["settings"]["resolution"]) == ("/Render/settings", (32, 18))
    product = {"path": "/Render/p", "name": "p.exr", "resolution": (32, 18), "camera": "/cam", "layers": ["Z"]}
    assert found["products"] == [product]
    variant = {"path": "/car", "set": "paint", "chosen": "red", "choices": ["blue", "red"]}
    assert found["variants"] == [variant]
    assert found["unread"] == {"Volume": {"count": 1, "first": "/forest/a/bark"}}
    blue = kanuka.usd.summary(made(tmp_path), variants={"/car{paint}": "blue"}, mask=["/car"])
    assert blue["variants"][0]["chosen"] == "blue" and "Sphere" not in blue["prims"]


def names(node: dict) -> list[str]:
    return [child["name"] for child in node.get("children", [])]


def test_trees_go_to_a_depth_and_count_what_is_below(tmp_path: Path) -> None:
    path = made(tmp_path)
    tree = kanuka.usd.summary(path)["tree"]
    assert names(tree) == ["cam", "floor", "matte", "sun", "forest", "car", "strange", "textured", "Render"]
    forest = tree["children"][4]
    assert names(forest) == ["a", "b", "herbs"] and names(forest["children"][2]) == ["moss", "fern"]
    assert [child.get("instance", False) for child in forest["children"]] == [True, True, False]
    flat = kanuka.usd.summary(path, depth=1)["tree"]["children"][4]
    assert "children" not in flat and flat["below"] == {"Xform": 2, "Sphere": 2, "PointInstancer": 1}
    none = kanuka.usd.summary(path, depth=0)
    assert "children" not in none["tree"] and none["tree"]["below"] == none["prims"]


@pytest.mark.parametrize(("groups", "each"), [(1, 40_000), (40_000, 0), (200, 200)])
def test_big_stages_are_summed_up(tmp_path: Path, groups: int, each: int) -> None:
    """In the time that prims are counted in, and on a page or two."""
    from pxr import Sdf

    from kanuka.cli import stage_info

    layer = Sdf.Layer.CreateNew(str(tmp_path / "big.usdc"))
    with Sdf.ChangeBlock():
        for k in range(groups):
            for name in (f"/g{k}", *(f"/g{k}/m{j}" for j in range(each))):
                spec = Sdf.CreatePrimInLayer(layer, name)
                spec.specifier, spec.typeName = Sdf.SpecifierDef, "Xform" if name.count("/") == 1 else "Mesh"
    layer.Save()
    started = time.monotonic()
    found = kanuka.usd.summary(tmp_path / "big.usdc")
    assert time.monotonic() - started < 8  # far above what it takes; a scene of them takes longer
    expected = {"Xform": groups} | ({"Mesh": groups * each} if each else {})
    assert found["prims"] == expected
    text = stage_info.text(found)
    assert len(text.splitlines()) < 60
    first = found["tree"]["children"][0]
    if groups == 1:
        assert len(first["children"]) == 16 and first["more"] == {"Mesh": each - 16}
    else:
        rest = {"Xform": groups - 16} | ({"Mesh": (groups - 16) * each} if each else {})
        assert len(found["tree"]["children"]) == 16 and found["tree"]["more"] == rest


def test_the_command_shows_a_stage(kanuka_command, tmp_path: Path) -> None:
    path = made(tmp_path)
    done = kanuka_command("info", path)
    assert done.returncode == 0, done.stderr
    lines = [" ".join(line.split()) for line in done.stdout.splitlines()]
    for line in (
        "frames 3 to 7, 24 a second",
        "settings /Render/settings: 32 × 18, /cam",
        "├─ floor Mesh",
        "│ ├─ a Xform, an instance",
        "/forest/a 2 of one prototype, which holds 3: 1 Cylinder, 1 Mesh, 1 Volume",
        "/forest/herbs 5: 1 of /forest/herbs/moss, 3 of /forest/herbs/fern",
        "/strange ArnoldToon",
        "/sun DistantLight: 2, color 1, 1, 1",
        "/cam perspective: 40 over 20 × 20",
        "/Render/p p.exr: 32 × 18, /cam; Z",
        "/car{paint} red of blue, red",
        "/textured/t.inputs:file ./lost.png",
        "Volume 1, the first is /forest/a/bark",
    ):
        assert line in lines, line
    done = kanuka_command("info", path, "--json", "--depth", "1", "--prim", "/forest", "--variant", "/car{paint}=blue")
    found = json.loads(done.stdout)
    assert names(found["tree"]) == ["cam", "forest", "Render"] and "below" in found["tree"]["children"][1]


def test_json_has_no_words_that_are_no_json(kanuka_command, tmp_path: Path) -> None:
    path = stage(tmp_path, SUN.replace("intensity = 2", "intensity = nan"))

    def refuse(word: str) -> None:
        raise AssertionError(word)

    found = json.loads(kanuka_command("info", path, "--json").stdout, parse_constant=refuse)
    assert found["lights"][0]["intensity"] is None
    assert "nan" in kanuka_command("info", path).stdout


def test_depth_is_for_stages(kanuka_command, tmp_path: Path) -> None:
    (tmp_path / "a.rib").write_text("WorldBegin WorldEnd\n")
    done = kanuka_command("info", "a.rib", "--depth", "2")
    assert done.returncode == 2 and "--depth is for USD stages" in done.stderr


def test_stages_that_are_odd_are_shown(tmp_path: Path) -> None:
    odd = stage(
        tmp_path,
        'def PointInstancer "empty" {\n}\n',
        'def Material "bare" {\n}\n',
        'def "untyped" {\n}\n',
        'def Xform "broken" (\n    references = @./gone.usda@\n) {\n}\n',
    )
    journal = kanuka.Journal()
    found = kanuka.usd.summary(odd, journal=journal)
    assert found["point_instancers"] == [{"path": "/empty", "count": 0, "prototypes": {}}]
    assert found["materials"][0]["surface"] == "" and found["prims"]["no type"] == 1
    assert any("gone.usda" in message.message for message in journal)
    with pytest.raises(kanuka.Error):
        kanuka.usd.summary(tmp_path / "none.usda")
