"""Light as RISpec's renderers found it, and what else published scenes count on."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka

HEAD = 'Format 48 48 1\nPixelFilter "box" 1 1\nProjection "perspective" "fov" 40\n'


def picture(tmp_path: Path, world: str, head: str = "", progressions: int = 16, **keywords: object) -> kanuka.Picture:
    path = tmp_path / "scene.rib"
    path.write_text(f"{HEAD}{head}WorldBegin\n{world}\nWorldEnd\n")
    return kanuka.render(kanuka.load(path), progressions=progressions, **keywords)


def middle(picture: kanuka.Picture) -> np.ndarray:
    return picture["rgb"][20:28, 20:28].mean(axis=(0, 1))


FULL = 'Option "kanuka" "string transport" ["full"]\n'
FLOOR = 'Surface "matte" Polygon "P" [-9 -9 6 -9 9 6 9 9 6 9 -9 6]\n'
SUN = 'LightSource "distantlight" 1 "intensity" 0.5 "from" [0 0 0] "to" [0 0 1]\n'
LAMP = 'LightSource "pointlight" 1 "intensity" 9 "from" [0 0 3]\n'
BEFORE = 'AttributeBegin Surface "matte" Translate 0 0 -1 Disk 0 9 360 AttributeEnd\n'  # between the sun and all else


def test_ambient_light_is_what_the_shader_makes_of_it(tmp_path: Path) -> None:
    room = 'LightSource "ambientlight" 1 "intensity" 0.4 Surface "matte" "Ka" {ka} "Kd" 1 Sphere 5 -5 5 360'
    for ka in (0.0, 0.5, 1.0):  # within a closed room: there are no shadows in it
        np.testing.assert_allclose(middle(picture(tmp_path, room.format(ka=ka))), 0.4 * ka, atol=5e-3)
    np.testing.assert_allclose(middle(picture(tmp_path, room.format(ka=0.5), FULL)), 0.2, atol=5e-3)
    # Plastic shows as much of it as matte, whatever its highlight; a mirror shows what others show.
    plastic = 'LightSource "ambientlight" 1 "intensity" 0.4 Surface "plastic" "Ka" 1 Translate 0 0 6 Sphere 2 -2 2 360'
    np.testing.assert_allclose(middle(picture(tmp_path, plastic)), 0.4, atol=5e-3)


def test_shadows_are_cast_where_lights_ask_for_them(tmp_path: Path) -> None:
    def lit(before: str, light: str, head: str = "") -> float:
        return float(middle(picture(tmp_path, before + light + BEFORE + FLOOR, head))[1])

    assert lit("", SUN) == pytest.approx(0.5, rel=0.02)
    mapped = SUN.replace("distantlight", "shadowdistant")
    assert lit("", mapped) == pytest.approx(0.5, rel=0.02)  # without a map the classic shader casts none
    assert lit("", mapped.replace('"intensity"', '"string shadowname" [""] "intensity"')) > 0.4
    assert lit("", mapped.replace('"intensity"', '"string shadowname" ["sun.shd"] "intensity"')) == 0
    assert lit("", SUN.replace('"intensity"', '"string shadowname" ["sun.shd"] "intensity"')) == 0
    assert lit('Attribute "light" "string shadows" ["on"]\n', SUN) == 0
    assert lit("", SUN, FULL) < 0.05  # what comes around the edges
    assert lit('Attribute "light" "string shadows" ["off"]\n', SUN, FULL) > 0.4
    # What casts none lets all through.
    none = BEFORE.replace("Surface", 'Attribute "render" "string casts_shadows" ["none"] Surface', 1)
    assert float(middle(picture(tmp_path, SUN + none + FLOOR, FULL))[1]) > 0.4
    clear = BEFORE.replace("Surface", 'Attribute "visibility" "int transmission" [0] Surface', 1)
    assert float(middle(picture(tmp_path, SUN + clear + FLOOR, FULL))[1]) > 0.4


def test_surfaces_light_nothing_and_mirrors_see_them(tmp_path: Path) -> None:
    backdrop = 'AttributeBegin Surface "constant" Color [1 1 1] Sphere 50 -50 50 360 AttributeEnd\n'
    assert middle(picture(tmp_path, SUN + backdrop + FLOOR)) == pytest.approx([0.5] * 3, rel=0.02)
    np.testing.assert_allclose(middle(picture(tmp_path, SUN + backdrop + FLOOR, FULL)), 1, rtol=0.02)  # a furnace
    np.testing.assert_allclose(middle(picture(tmp_path, SUN + backdrop)), 1, rtol=0.01)  # itself, to the camera
    mirror = 'Surface "mirror" ' + FLOOR.removeprefix('Surface "matte" ')
    (tmp_path / "mirror.sl").write_text(
        "surface mirror() { Oi = 1; Ci = trace(P, reflect(normalize(I), faceforward(normalize(N), I))); }"
    )
    np.testing.assert_allclose(middle(picture(tmp_path, SUN + backdrop + mirror)), 1, rtol=0.02)


def test_what_is_not_riscpecs_is_traced_in_full(tmp_path: Path) -> None:
    corner = FLOOR + 'Polygon "P" [2 -9 0 2 9 0 2 9 6 2 -9 6]\n'

    def right(world: str) -> float:
        return float(picture(tmp_path, world)["rgb"][20:28, 30:34, 1].mean())

    classic = right(SUN + corner)
    assert classic == pytest.approx(0.5, rel=0.05)
    glass = 'AttributeBegin Surface "glass" Translate -4 4 5 Sphere 0.1 -0.1 0.1 360 AttributeEnd\n'
    for extra in (glass, 'LightSource "environmentlight" 2 "intensity" 0.001\n'):
        assert right(SUN + extra + corner) == pytest.approx(right(FULL + SUN + extra + corner), rel=0.03)


def test_a_light_shader_of_the_scene_comes_first(tmp_path: Path) -> None:
    (tmp_path / "pointlight.sl").write_text(
        "light pointlight(float intensity = 1;) {\n"
        '  illuminate (point "shader" (0, 0, 0)) { Cl = intensity * color(1, 0, 0); } }'
    )
    world = 'TransformBegin Translate 0 0 3 LightSource "pointlight" 1 "intensity" 0.5 TransformEnd\n' + FLOOR
    assert middle(picture(tmp_path, world)) == pytest.approx([0.5, 0, 0], abs=0.05)  # no falloff, and red


def test_a_light_that_lies_in_a_polygon_shines(tmp_path: Path) -> None:
    ceiling = 'Surface "matte" Polygon "P" [-0.4 -0.4 3 -0.4 0.4 3 0.4 0.4 3 0.4 -0.4 3]\n'
    world = LAMP.replace("LightSource", 'Attribute "light" "string shadows" ["on"] LightSource') + ceiling + FLOOR
    assert picture(tmp_path, world)["rgb"][4, 24, 1] > 0.1


def test_partly_present_surfaces_converge(tmp_path: Path) -> None:
    world = 'LightSource "ambientlight" 1 "intensity" 1 Opacity [0.5 0.5 0.5] ' + FLOOR
    few, many = (np.std(picture(tmp_path, world, progressions=n)["rgb"][..., 1]) for n in (4, 256))
    assert many < 0.2 * few


def test_windows_off_the_centre_are_diced_as_finely(tmp_path: Path) -> None:
    def micropolygons(window: str, place: str) -> int:
        world = f'Surface "matte" {SUN} Translate {place} Sphere 0.4 -0.4 0.4 360'
        head = f'Projection "orthographic"\nScreenWindow {window}\n'
        return picture(tmp_path, world, head, 1).stats["count"]["micropolygons"]

    assert micropolygons("1 2 1 2", "1.5 1.5 5") == pytest.approx(micropolygons("-0.5 0.5 -0.5 0.5", "0 0 5"), rel=0.02)


def test_normals_calculated_at_corners_of_grids_are_not_turned(tmp_path: Path) -> None:
    (tmp_path / "again.sl").write_text("displacement again() { N = calculatenormal(P); }")
    world = f'{SUN} Surface "matte" Displacement "again" Translate 0 0 5 Sphere 1 -1 1 360'
    p = picture(tmp_path, world, "Format 300 300 1\n", 4)
    seen = p["alpha"] == 1
    out = p["P"][seen] - [0, 0, 5]
    turned = np.sum(out * p["N"][seen], axis=-1) / np.linalg.norm(p["N"][seen], axis=-1)
    assert turned.min() > 0.95


def test_frames_that_make_textures_are_passed_over_and_displays_keep_their_numbers(tmp_path: Path) -> None:
    assert kanuka.picture_file("ball.tif") == "ball.exr"
    assert kanuka.picture_file("dof.0154") == "dof.0154.exr"
    assert kanuka.picture_file("env.xp") == "env.xp.exr"


# ---- volumes

SKY = 'LightSource "environmentlight" 1 "intensity" 1 "visible" 1\n'


def test_a_volume_takes_what_is_on_its_way(tmp_path: Path) -> None:
    volume = (
        'Color [0 0 0] Opacity [{o} {o} {o}] Surface "null" Translate 0 0 6 '
        'Volume "box" [-9 9 -9 9 -1 1] [1 1 2] "varying float density" [{d}]'
    )
    for opacity, density, thickness in ((1, "1 1", 2), (2, "0 1", 2), (0.5, "0 0.5", 0.25)):
        world = SKY + volume.format(o=opacity, d=density)
        got = middle(picture(tmp_path, world, progressions=256))
        np.testing.assert_allclose(got, np.exp(-thickness), atol=0.01)


def test_white_smoke_vanishes_in_a_white_sky(tmp_path: Path) -> None:
    density = " ".join(str((7 * i) % 5) for i in range(27))
    smoke = f'Translate 0 0 6 Volume "ellipsoid" [-2 2 -2 2 -2 2] [3 3 3] "varying float density" [{density}]'
    np.testing.assert_allclose(middle(picture(tmp_path, SKY + smoke, progressions=64)), 1, atol=0.02)


def test_volumes_of_other_renderers_and_of_bad_values(tmp_path: Path) -> None:
    ris = (
        'Bxdf "PxrVolume" "v" "color diffuseColor" [0 0 0] "float densityFloat" 0.5 "string densityFloatPrimVar" "rho" '
        'Translate 0 0 6 Volume "box" [-9 9 -9 9 -1 1] [1 1 2] "varying float rho" [1 1]'
    )
    np.testing.assert_allclose(middle(picture(tmp_path, SKY + ris, progressions=256)), np.exp(-1), atol=0.01)
    bad = 'Translate 0 0 6 Volume "box" [-1 1 -1 1 -1 1] [1 1 2] "varying float density" [-3 nan]'
    broken = picture(tmp_path, SKY + bad)
    np.testing.assert_allclose(middle(broken), 1, atol=0.01)
    assert any("below zero or not finite" in m.message for m in broken.journal.messages)


def test_shaders_that_ask_for_indirect_light_get_it(tmp_path: Path) -> None:
    (tmp_path / "bleeding.sl").write_text(
        "surface bleeding() { normal n = faceforward(normalize(N), I);"
        " Oi = 1; Ci = Cs * (diffuse(n) + indirectdiffuse(P, n, 64)); }"
    )
    (tmp_path / "dirty.sl").write_text(
        "surface dirty() { normal n = faceforward(normalize(N), I); float hidden = occlusion(P, n, 64);"
        " Oi = 1; Ci = Cs * (1 - hidden) * (ambient() + diffuse(n)); }"
    )
    for surface, transport in (("bleeding", "full"), ("dirty", "full"), ("matte", "classic")):
        result = picture(tmp_path, SUN + FLOOR.replace("matte", surface), progressions=1)
        assert result.metadata["kanuka.transport"] == transport, surface


def test_what_names_no_surface_is_lit_from_the_eye(tmp_path: Path) -> None:
    light = 'LightSource "distantlight" 1 "intensity" 1 "from" [9 0 0] "to" [0 0 0]\n'
    floor = FLOOR.removeprefix('Surface "matte" ')
    assert middle(picture(tmp_path, light + FLOOR)) == pytest.approx([0] * 3, abs=1e-3)  # edge on to the light
    assert middle(picture(tmp_path, light + "Color [1 0.5 0.25]\n" + floor)) == pytest.approx([1, 0.5, 0.25], rel=0.05)
    # In full it is matte, and so is one whose shader is missing.
    assert middle(picture(tmp_path, light + floor, FULL)) == pytest.approx([0] * 3, abs=1e-3)
    assert middle(picture(tmp_path, light + 'Surface "nowhere"\n' + floor)) == pytest.approx([0] * 3, abs=1e-3)
