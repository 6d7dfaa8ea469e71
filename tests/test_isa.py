"""A picture has the same bits on machines with AVX-512 and without: KANUKA_ISA=avx2 makes one of the other."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import kanuka
from conftest import ROOT

FLAGS = {"avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"}
HAS_AVX512 = set(Path("/proc/cpuinfo").read_text().split()) >= FLAGS
SCENES = ("showcase", "cornell", "volumes", "shapes", "solids", "listings")


def rendered(scene: str, folder: Path, isa: str) -> kanuka.Picture:
    out = folder / f"{scene}.{isa}.exr"
    command = [sys.executable, "-m", "kanuka", "render", ROOT / "scenes" / f"{scene}.rib", "-o", out, "-q"]
    command += ["--resolution", "48x27", "--progressions", "4"]
    # Shaders are compiled for either apart.
    places = {"PYTHONPATH": str(ROOT / "python"), "KANUKA_SHADER_CACHE": str(folder / isa)}
    subprocess.run([*map(str, command)], check=True, env=os.environ | places | {"KANUKA_ISA": isa})
    return kanuka.read(out)


@pytest.mark.skipif(not HAS_AVX512, reason="this machine has no AVX-512 to compare with")
@pytest.mark.parametrize("scene", SCENES)
def test_a_picture_does_not_depend_on_the_instruction_set(tmp_path: Path, scene: str) -> None:
    a, b = (rendered(scene, tmp_path, isa) for isa in ("", "avx2"))
    for layer in ("rgb", "alpha", "Z", "N", "albedo"):
        np.testing.assert_array_equal(np.asarray(a[layer]), np.asarray(b[layer]), err_msg=layer)
    assert np.asarray(a["rgb"]).any()
