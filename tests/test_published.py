"""What published scenes rely on, by scenes of our own: they show something where others' shaders are missing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka

HEAD = 'Format 24 24 1 PixelSamples 4 4 Projection "perspective" "fov" 40 Translate 0 0 4\n'
BALL = "Sphere 1 -1 1 360\n"


def render(tmp_path: Path, world: str, head: str = HEAD) -> np.ndarray:
    scene = tmp_path / "scene.rib"
    scene.write_text(f"{head}WorldBegin\n{world}WorldEnd\n")
    return np.asarray(kanuka.render(kanuka.load(scene), progressions=8)["rgb"])


@pytest.mark.parametrize(
    "world",
    [
        BALL,
        'Surface "defaultsurface"\n' + BALL,
        'LightSource "studio_uber" 1 "float intensity" 1 "float penumbra" 2\nSurface "matte"\n' + BALL,
        'LightSource "envlight" 1 "string filename" "occlusion.sm"\nSurface "matte"\n' + BALL,
        'AttributeBegin\nTranslate 0 2 -3\nRotate 60 1 0 0\nLight "PxrRectLight" "key" "float exposure" 4\n'
        'AttributeEnd\nBxdf "PxrDiffuse" "d"\n' + BALL,
        'AttributeBegin\nAreaLightSource "PxrStdEnvMapLight" "e" "color envTint" [.5 .5 .5]\n'
        'Geometry "envsphere"\nAttributeEnd\nIlluminate "e" 1\nBxdf "PxrLMDiffuse" "d"\n' + BALL,
    ],
    ids=["nothing", "defaultsurface", "unknown light", "unknown environment", "light in a block", "envsphere"],
)
def test_the_ball_is_seen(tmp_path: Path, world: str) -> None:
    middle = render(tmp_path, world)[8:16, 8:16]
    assert middle.mean() > 0.02


def test_a_lit_scene_stays_as_it_is(tmp_path: Path) -> None:
    """A file that names a shader and no light is black, as it says."""
    assert render(tmp_path, 'Surface "matte"\n' + BALL).max() == 0
