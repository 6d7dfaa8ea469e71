"""Lights from Python and RIB: kinds, linking, profiles, daylight."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka

IES = """IESNA:LM-63-2002
TILT=NONE
1 1000 1.0 3 1 1 2 0 0 0
1 1 10
0 30 60
0
100 100 0
"""


def floor(**lights) -> kanuka.Scene:
    """Two halves of a floor, seen from above; options by half."""
    scene = kanuka.Scene()
    scene.resolution = (32, 16)
    scene.options.filter = "box"
    scene.options.filter_width = (1, 1)
    scene.options.max_depth = 1
    scene.camera = kanuka.Camera(
        (0, 4, 0), (0, 0, 0), (0, 0, -1), projection="orthographic", screen_window=(-2, 2, -1, 1)
    )
    for side in (-1, 1):
        points = np.array([[0, 0, -1], [0, 0, 1], [2 * side, 0, 1], [2 * side, 0, -1]], np.float32)
        faces = np.array([[0, 1, 2, 3]], np.int32)
        scene.add_mesh(points, faces, material=kanuka.Material("matte"), **(lights if side > 0 else {}))
    return scene


def halves(scene: kanuka.Scene, samples: int = 16) -> tuple[float, float]:
    green = kanuka.render(scene, progressions=samples)["rgb"][..., 1]
    return float(green[:, :16].mean()), float(green[:, 16:].mean())


@pytest.mark.parametrize("kind", ["quad", "disk", "sphere", "cylinder", "point", "spot"])
def test_kinds_light_the_floor(kind: str) -> None:
    scene = floor()
    options = {"visible_camera": False} if kind in ("quad", "disk", "sphere", "cylinder") else {}
    scene.add_light(kind, position=(0, 1, 0), direction=(0, -1, 0), cone_angle=60, **options)
    left, right = halves(scene)
    assert left > 0.01
    assert right == pytest.approx(left, rel=0.1)


@pytest.mark.parametrize("kind", ["point", "spot", "distant"])
def test_light_shaders_have_their_unit(kind: str) -> None:
    """A white matte surface shows Cl of a light shader (RISpec), and E / pi of an irradiance E."""

    def radiance(light: str) -> float:
        scene = floor()
        scene.camera = kanuka.Camera(
            (0, 4, 0), (0, 0, 0), (0, 0, -1), projection="orthographic", screen_window=(-0.1, 0.1, -0.05, 0.05)
        )
        where = {"point from": (0, 2, 0), "point to": (0, 0, 0)} if kind != "point" else {"point from": (0, 2, 0)}
        if light == "python":
            scene.add_light(kind, amount=5 * np.pi, position=(0, 2, 0), direction=(0, -1, 0))
        elif light == "unit":
            measure = {"distant": "lux"}.get(kind, "candela")
            scene.add_light(kind, amount=5, position=(0, 2, 0), direction=(0, -1, 0), unit=measure)
        else:
            more = {"string unit": {"distant": "lux"}.get(kind, "candela")} if light == "shader with unit" else {}
            shader = kanuka.Shader(f"{kind}light", intensity=5, **where, **more)
            scene.add_light_shader(shader)
        return float(kanuka.render(scene, progressions=64)["rgb"][..., 1].mean())

    far = 1 if kind == "distant" else 4  # the square of the distance
    assert radiance("python") == pytest.approx(5 / far, rel=0.01)
    assert radiance("shader") == pytest.approx(5 / far, rel=0.01)
    assert radiance("unit") == pytest.approx(radiance("shader with unit"), rel=0.01)


def test_unknown_kinds_are_named() -> None:
    with pytest.raises(ValueError, match="cylinder"):
        floor().add_light("laser")


@pytest.mark.parametrize("copies", [1, 40])
def test_lights_off_for_one_half(copies: int) -> None:
    scene = floor(lights_off=["key"])
    for _ in range(copies):
        scene.add_light("point", name="key", position=(0, 1, 0))
    scene.add_light("point", group="fill", position=(0, 1, 0), amount=0.1)
    left, right = halves(scene)
    assert left / right == pytest.approx((copies + 0.1) / 0.1, rel=0.05)


def test_shadows_off() -> None:
    means = []
    for off in ([], ["key"]):
        scene = floor()
        board = np.array([[-2, 0.5, -1], [-2, 0.5, 1], [2, 0.5, 1], [2, 0.5, -1]], np.float32)
        scene.camera = kanuka.Camera((0, 0.4, 0), (0, 0, 0), (0, 0, -1), fov=90)
        scene.add_mesh(board, np.array([[0, 1, 2, 3]], np.int32), shadows_off=off)
        scene.add_light("sphere", name="key", position=(0, 1, 0), radius=0.1)
        means.append(sum(halves(scene)))
    assert means[0] == 0
    assert means[1] > 0.01


def test_illuminate(tmp_path: Path) -> None:
    path = tmp_path / "halves.rib"
    path.write_text(
        'Format 32 16 1\nProjection "orthographic"\nScreenWindow -2 2 -1 1\nTranslate 0 0 4\nWorldBegin\n'
        'LightSource "pointlight" "key" "from" [0 0 -1]\n'
        'LightSource "pointlight" "fill" "from" [0 0 -1] "intensity" 0.1\n'
        'Surface "matte"\nPolygon "P" [-2 -1 0 -2 1 0 0 1 0 0 -1 0]\nIlluminate "key" 0\n'
        'Polygon "P" [0 -1 0 0 1 0 2 1 0 2 -1 0]\nWorldEnd\n'
    )
    scene = kanuka.load(path)
    scene.options.filter = "box"
    scene.options.filter_width = (1, 1)
    scene.options.max_depth = 1
    left, right = halves(scene)
    assert left / right == pytest.approx(11, rel=0.05)


def test_profiles(tmp_path: Path) -> None:
    good, bad = tmp_path / "good.ies", tmp_path / "bad.ies"
    good.write_text(IES)
    bad.write_text(IES.replace("0 30 60", "0 x 60"))
    scene = floor()
    scene.add_light("point", position=(0, 1, 0), direction=(0, -1, 0), profile=str(good))
    green = kanuka.render(scene, progressions=4)["rgb"][..., 1]
    assert green[8, 16] > 0.2
    assert green[8, 1] == 0  # beyond 60 degrees
    scene = floor()
    scene.add_light("point", position=(0, 1, 0), profile=str(bad))
    picture = kanuka.render(scene, progressions=1)
    assert any("bad.ies:5" in message.message for message in picture.journal)


def test_daylight() -> None:
    scene = floor()
    scene.add_light_shader(kanuka.Shader("skylight", turbidity=3.0, intensity=0.1), transform=turned())
    scene.add_light_shader(kanuka.Shader("sunlight", turbidity=3.0, intensity=0.1), transform=turned())
    assert min(halves(scene)) > 1


def turned() -> np.ndarray:
    """The zenith, +z, to +y."""
    return np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]], float)


def test_lamps_smaller_than_a_pixel_have_their_light(tmp_path: Path) -> None:
    """A disk and a ball far too small to be seen bring what their areas do."""
    for shape, area in (("Disk 0 0.01 360", np.pi * 0.01**2), ("Sphere 0.01 -0.01 0.01 360", np.pi * 0.01**2)):
        (tmp_path / "lamp.rib").write_text(
            'Format 16 16 1\nProjection "perspective" "fov" 1\nTranslate 0 0 9\nWorldBegin\n'
            f'AttributeBegin AreaLightSource "arealight" 1 "intensity" [10000] Translate 0 0 -2 {shape} AttributeEnd\n'
            'Surface "matte" Sides 2 Polygon "P" [-9 -9 0 -9 9 0 9 9 0 9 -9 0] WorldEnd\n'
        )
        picture = kanuka.render(kanuka.load(tmp_path / "lamp.rib"), progressions=64)
        seen = picture["rgb"][2:6, 2:6, 1].mean()  # beside the lamp's own picture
        assert seen == pytest.approx(10000 * area / 4 / np.pi, rel=0.04), shape


def test_portals_bring_the_environments_light_with_less_noise(tmp_path: Path) -> None:
    """A room with a window: by Python and by RIB the same picture as without the portal, on average."""

    def room(portal: str) -> kanuka.Scene:
        (tmp_path / "room.rib").write_text(
            'Format 24 24 1\nProjection "perspective" "fov" 90\nWorldBegin\n'
            'LightSource "environmentlight" 1 "intensity" 2\n' + portal + 'Surface "matte" "Kd" 0.7\n'
            'Polygon "P" [-2 -2 2  2 -2 2  2 2 2  -2 2 2]\n'
            'Polygon "P" [-2 -2 -2  -2 -2 2  -2 2 2  -2 2 -2]\n'
            'Polygon "P" [2 -2 -2  2 -2 2  2 2 2  2 2 -2]\n'
            'Polygon "P" [-2 -2 -2  2 -2 -2  2 -2 2  -2 -2 2]\n'
            'Polygon "P" [-2 -2 -2  2 -2 -2  2 2 -2  -2 2 -2]\n'
            'PointsGeneralPolygons [2] [4 4] [0 1 2 3 4 5 6 7] "P" [-2 2 -2  2 2 -2  2 2 2  -2 2 2'
            "  -0.5 2 -0.5  0.5 2 -0.5  0.5 2 0.5  -0.5 2 0.5]\nWorldEnd\n"
        )
        return kanuka.load(tmp_path / "room.rib")

    def pictures(scene: kanuka.Scene) -> np.ndarray:
        return np.stack([kanuka.render(scene, progressions=32, seed=seed)["rgb"][..., 1] for seed in range(8)])

    plain = pictures(room(""))
    by_rib = pictures(room('TransformBegin Translate 0 2 0 Rotate 90 1 0 0 LightSource "portallight" 2 TransformEnd\n'))
    scene = room("")
    scene.add_light("portal", position=(0, 2, 0), direction=(0, -1, 0))
    by_python = pictures(scene)
    assert plain.mean() > 0.005
    for portal in (by_rib, by_python):
        assert portal.mean() == pytest.approx(plain.mean(), rel=0.05)
        assert portal.var(axis=0).mean() < 0.6 * plain.var(axis=0).mean()
    with pytest.warns(kanuka.Warning, match='amount does nothing for a light of kind "portal"'):
        kanuka.Scene().add_light("portal", amount=2)
