"""Pictures on meshes that shine: what they send to a floor, and what of them is seen, against what was painted."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka
from test_color_config import between
from usd_lights import GLOWING, panel, shone
from usd_stages import CAMERA, read, stage

LEFT, RIGHT = (0.8, 0.4, 0.2), (0.4, 0.6, 0.4)  # of the picture
PICTURE = "asset inputs:texture:file = @./halves.exr@"
# s grows along x; the panel is seen from below with x to the left.
ST = 'texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] (interpolation = "vertex")'
BOUND = "rel material:binding = </glowing>"  # which shines (0.5, 1, 2) and reflects a half
MODE = 'uniform token light:materialSyncMode = "%s"'
INTENSITY = "float inputs:intensity = 6"


def halves(folder: Path) -> None:
    rgb = np.full((16, 16, 3), LEFT, np.float32)
    rgb[:, 8:] = RIGHT
    kanuka.Picture({"rgb": rgb}).write(folder / "halves.exr")


@pytest.mark.parametrize(
    ("body", "radiance"),
    [
        ([], (6, 6, 6)),
        (["color3f inputs:color = (1, 0.5, 0)"], (6, 3, 0)),
        ([BOUND], (3, 6, 12)),
        ([BOUND, MODE % "independent"], (6, 6, 6)),
        ([BOUND, MODE % "noMaterialResponse"], (6, 6, 6)),
        (["bool inputs:normalize = 1", "float inputs:intensity = 0.01"], (6.25, 6.25, 6.25)),
    ],
)
def test_a_mesh_shines_as_its_picture_is(tmp_path: Path, body: list[str], radiance: tuple[float, ...]):
    halves(tmp_path)
    body = [ST, PICTURE, *([INTENSITY] if "normalize" not in "".join(body) else []), *body]
    found, told = shone(tmp_path, GLOWING, panel(*body), size=9, reach=0.1)
    assert told == []
    mean = (np.array(LEFT) + RIGHT) / 2
    assert found[4, 4] * 4 / 0.0016 == pytest.approx(radiance * mean, rel=0.03, abs=0.01)
    scene, _ = read(stage(tmp_path, CAMERA, GLOWING, panel(*body)))
    for x, color in ((-0.01, LEFT), (0.01, RIGHT)):
        scene.camera = kanuka.Camera((x, 1.9, 0), (x, 2, 0), up=(0, 0, 1), fov=2)
        scene.resolution = (4, 4)
        seen = kanuka.render(scene, progressions=16, threads=1, max_depth=1)["rgb"].mean((0, 1))
        assert seen == pytest.approx(np.array(radiance) * color, rel=0.02, abs=0.01)


def test_its_picture_has_a_space(tmp_path: Path):
    halves(tmp_path)
    picture = f'{PICTURE} ( colorSpace = "lin_ap1_scene" )'
    found, told = shone(tmp_path, panel(ST, picture, INTENSITY), size=9, reach=0.1)
    light = between("ap1", "rec709") @ (6 * (np.array(LEFT) + RIGHT) / 2)
    assert told == [] and found[4, 4] * 4 / 0.0016 == pytest.approx(light, rel=0.03)


def test_a_picture_that_is_not_there_is_told_and_the_mesh_shines_evenly(tmp_path: Path):
    found, told = shone(tmp_path, panel(ST, PICTURE, INTENSITY), size=9, reach=0.1)
    assert len(told) == 1 and told[0].startswith("/panel.inputs:texture:file:") and "halves.exr" in told[0]
    assert found[4, 4] * 4 / 0.0016 == pytest.approx((6, 6, 6), rel=0.03)
