"""Where the files that ship with Kanuka lie."""

from __future__ import annotations

import os
from pathlib import Path


def standard_shaders() -> str:
    """Folder of the standard shaders: KANUKA_SHADERS, else that of this checkout."""
    given = os.environ.get("KANUKA_SHADERS")
    return given or str(Path(__file__).resolve().parents[2] / "shaders")
