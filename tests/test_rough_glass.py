"""What a rough interface reflects, against quadrature in double that shares no code with the renderer."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest

import kanuka

ROOT = Path(__file__).parent.parent
SPEC = importlib.util.spec_from_file_location("bench_balance", ROOT / "bench" / "peers" / "balance.py")
balance = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(balance)


def once(alpha: float, ior: float = 1.5) -> float:
    """Of light that comes straight down, the part that one facet reflects."""
    sphere = balance.Sphere()
    albedo = (sphere.reflected(alpha, ior) * sphere.solid).sum(1)
    return float(albedo[np.argmax(sphere.cosine)])


def reflected(material: kanuka.Material, shaders: Path) -> float:
    """The middle of a ball in a white surrounding that the camera does not see."""
    scene = kanuka.Scene()
    scene.resolution = 24, 24
    scene.options.shader_path = [str(shaders)]
    scene.camera = kanuka.Camera((0, 0, 40), (0, 0, 0), fov=0.6)
    scene.add_sphere(material=material)
    scene.add_light("environment", amount=1, visible_camera=False)
    return float(np.asarray(kanuka.render(scene, progressions=64)["rgb"]).mean())


def black_glass(alpha: float) -> kanuka.Material:
    """Nothing comes back from inside."""
    return kanuka.Material("glass", roughness=alpha**0.5, absorption=(1e4, 1e4, 1e4))


@pytest.mark.parametrize("alpha", [0.1, 0.2, 0.4, 0.7])
def test_gloss_reflects_what_one_facet_does(alpha: float) -> None:
    found = reflected(kanuka.Material("gloss", roughness=alpha**0.5), ROOT / "bench" / "shaders")
    assert found == pytest.approx(once(alpha), rel=0.01)


@pytest.mark.parametrize("alpha", [0.1, 0.2, 0.4, 0.7])
def test_rough_glass_reflects_no_less_than_one_facet(alpha: float, tmp_path: Path) -> None:
    """Light of several facets comes on top of that of one."""
    assert reflected(black_glass(alpha), tmp_path) >= 0.99 * once(alpha)
