"""Samples that outshine their pixels: bounds on them, and the report of where they come from."""

from __future__ import annotations

import numpy as np
import pytest

import kanuka
from scenes import quad


def caustic() -> kanuka.Scene:
    """A floor beside a mirror, and a small bright panel that shines at the mirror alone."""
    scene = kanuka.Scene()
    scene.resolution = 24, 24
    scene.camera = kanuka.Camera((0, 2, 4), (0, 0, 0), fov=40)
    grey = kanuka.Material("matte", color=(0.5, 0.5, 0.5))
    scene.add_mesh(*quad((-4, 0, 4), (4, 0, 4), (4, 0, -1), (-4, 0, -1)), material=grey, name="floor")
    mirror = kanuka.Material("mirror")
    scene.add_mesh(*quad((-4, 0, -1), (4, 0, -1), (4, 4, -1), (-4, 4, -1)), material=mirror, name="mirror")
    panel = quad((-0.05, 1.5, 1), (-0.05, 1.6, 1), (0.05, 1.6, 1), (0.05, 1.5, 1))
    scene.add_mesh(*panel, material=kanuka.Material("null"), area_light=(400, 400, 400), name="panel")
    return scene


def render(scene: kanuka.Scene, **keywords: object) -> kanuka.Picture:
    return kanuka.render(scene, progressions=64, **keywords)


def test_the_report_follows_the_path() -> None:
    picture = render(caustic())
    stats = picture.stats
    assert stats["count"]["fireflies"] > 0
    assert 0 < len(stats["fireflies"]) <= 8
    for each in stats["fireflies"]:
        assert each["luminance"] > 16 * each["mean"]
        path = each["path"]
        names = [v["object"] for v in path]
        at = names.index("panel")
        assert names[at - 2 : at] == ["floor", "mirror"]
        assert path[at - 2]["lobe"] == "LambertBrdf"
        assert not path[at - 2]["smooth"]
        assert all(v["smooth"] for v in path if v["object"] == "mirror" and v["lobe"])
        # The panel by way of the mirror is nearly all there is, and what was traced again is what was seen.
        arrived = sum(v["lights_hit"] + v["emitted"] + v["light_samples"] for v in path)
        assert path[at]["emitted"] == pytest.approx(arrived, rel=0.05)
        assert arrived == pytest.approx(each["luminance"], rel=0.6)  # of its wavelengths: not quite luminance


def test_the_report_does_not_depend_on_threads() -> None:
    one, two = render(caustic(), threads=1), render(caustic(), threads=2)
    assert one.stats["fireflies"] == two.stats["fireflies"]


def test_a_bound_holds_and_is_off_by_default() -> None:
    free, bounded = caustic(), caustic()
    bounded.options.clamp_indirect = 5
    a, b = render(free), render(bounded)
    assert np.asarray(a["rgb"]).max() > 2 * np.asarray(b["rgb"]).max()
    assert b.stats["count"]["fireflies"] <= a.stats["count"]["fireflies"]
    # Of 64 samples one may bring 5, in colours up to some times that.
    assert np.asarray(b["rgb"])[12:].max() < 1.5


def test_direct_light_has_a_bound_of_its_own() -> None:
    scene = kanuka.Scene()
    scene.resolution = 8, 8
    scene.camera = kanuka.Camera((0, 0, 4), (0, 0, 0), fov=20)
    scene.add_mesh(*quad((-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)), material=kanuka.Material("matte"))
    scene.add_light("distant", amount=10 * np.pi, direction=(0, 0, -1))
    scene.options.clamp_indirect = 0.1
    assert np.asarray(render(scene)["rgb"]).mean() == pytest.approx(10, rel=0.01)
    scene.options.clamp_direct = 2
    assert np.asarray(render(scene)["rgb"]).mean() == pytest.approx(2, rel=0.05)


def test_the_command_prints_it(kanuka_command, tmp_path) -> None:
    rib = tmp_path / "mirror.rib"
    rib.write_text(
        """Format 16 16 1
PixelSamples 8 8
Projection "perspective" "fov" 40
Translate 0 0 4
WorldBegin
Surface "matte"
Polygon "P" [-4 -1 4  4 -1 4  4 -1 -4  -4 -1 -4]
Surface "mirror"
Polygon "P" [-4 -1 4  4 -1 4  4 4 4  -4 4 4]
AreaLightSource "arealight" 1 "intensity" 4000
Polygon "P" [-0.02 1 0  0.02 1 0  0.02 1.04 0  -0.02 1.04 0]
WorldEnd
"""
    )
    done = kanuka_command("render", rib, "-o", tmp_path / "x.exr", "--fireflies", "--clamp-indirect", "1e6", "--quiet")
    assert "mean" in done.stderr
    assert "bright" in done.stderr
