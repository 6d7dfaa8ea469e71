"""What all Python tests share."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
COMMAND = Path(sys.executable).parent / "kanuka"


@pytest.fixture
def root() -> Path:
    return ROOT


@pytest.fixture
def kanuka(tmp_path: Path):
    """Runs the command in an empty folder: kanuka("render", scene, …) -> CompletedProcess."""

    def run(*arguments: object, **kwargs) -> subprocess.CompletedProcess[str]:
        kwargs.setdefault("cwd", tmp_path)
        kwargs.setdefault("timeout", 120)
        return subprocess.run([COMMAND, *map(str, arguments)], capture_output=True, text=True, **kwargs)

    return run
