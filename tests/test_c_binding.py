"""A C program and the RIB that it writes make the same picture."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

import kanuka


@pytest.fixture
def program(root: Path) -> Path:
    path = Path(os.environ.get("KANUKA_BUILD", root / "build")) / "tests/c/kanuka_ri_picture"
    if not path.exists():
        pytest.skip(f"{path} was not built")
    return path


def test_a_c_program_renders_what_its_rib_renders(program: Path, tmp_path: Path) -> None:
    for name in ("c.exr", "c.rib"):
        result = subprocess.run([program, name], cwd=tmp_path, capture_output=True, text=True, check=False)
        assert (result.returncode, result.stderr) == (0, "")
    by_c = kanuka.read(tmp_path / "c.exr")
    assert (by_c.width, by_c.height) == (160, 120)
    assert by_c["rgb"].mean() > 0.05, "something is lit"
    by_rib = kanuka.render(kanuka.load(tmp_path / "c.rib"))
    by_rib.write(tmp_path / "rib.exr")
    assert np.array_equal(by_c["rgb"], kanuka.read(tmp_path / "rib.exr")["rgb"])
