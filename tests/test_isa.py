"""A picture has the same bits on machines with AVX-512 and without: KANUKA_ISA=avx2 makes one of the other."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import kanuka
import validation_scenes
from conftest import ROOT

FLAGS = {"avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"}
HAS_AVX512 = set(Path("/proc/cpuinfo").read_text().split()) >= FLAGS
needs_avx512 = pytest.mark.skipif(not HAS_AVX512, reason="this machine has no AVX-512 to compare with")
SCENES = ("showcase", "cornell", "volumes", "shapes", "solids", "listings")
# A program of its own an instruction set: which one it takes is asked once.
RENDER_ALL = """
import sys

import numpy as np

import kanuka
import validation_scenes

taken = {"progressions": 2, "resolution": (32, 32)}
pictures = {name: kanuka.render(make(), **taken)["rgb"] for name, make in validation_scenes.ALL.items()}
np.savez(sys.argv[1], **{name: np.asarray(rgb) for name, rgb in pictures.items()})
"""


def run(command: list[object], folder: Path, isa: str) -> None:
    """Python, with one instruction set. Shaders are compiled for either apart."""
    python = os.pathsep.join(str(ROOT / part) for part in ("python", "tests"))
    places = {"PYTHONPATH": python, "KANUKA_SHADER_CACHE": str(folder / isa), "KANUKA_ISA": isa}
    subprocess.run([sys.executable, *map(str, command)], check=True, env=os.environ | places)


def rendered(scene: str, folder: Path, isa: str) -> kanuka.Picture:
    out = folder / f"{scene}.{isa}.exr"
    command = ["-m", "kanuka", "render", ROOT / "scenes" / f"{scene}.rib", "-o", out, "-q"]
    run([*command, "--resolution", "48x27", "--progressions", "4"], folder, isa)
    return kanuka.read(out)


@needs_avx512
@pytest.mark.parametrize("scene", SCENES)
def test_a_picture_does_not_depend_on_the_instruction_set(tmp_path: Path, scene: str) -> None:
    a, b = (rendered(scene, tmp_path, isa) for isa in ("", "avx2"))
    for layer in ("rgb", "alpha", "Z", "N", "albedo"):
        np.testing.assert_array_equal(np.asarray(a[layer]), np.asarray(b[layer]), err_msg=layer)
    assert np.asarray(a["rgb"]).any()


@pytest.fixture(scope="module")
def pictures(tmp_path_factory: pytest.TempPathFactory) -> list[dict[str, np.ndarray]]:
    """Of all validation scenes, with AVX-512 and without."""
    folder = tmp_path_factory.mktemp("isa")
    for isa in ("avx512", "avx2"):
        run(["-c", RENDER_ALL, folder / f"{isa}.npz"], folder, isa)
    return [dict(np.load(folder / f"{isa}.npz")) for isa in ("avx512", "avx2")]


@needs_avx512
@pytest.mark.parametrize("name", validation_scenes.ALL)
def test_no_feature_of_transport_depends_on_it(pictures: list[dict[str, np.ndarray]], name: str) -> None:
    with_avx512, without = pictures
    np.testing.assert_array_equal(with_avx512[name], without[name])
    assert with_avx512[name].any()
