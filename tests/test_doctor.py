"""kanuka doctor."""

from __future__ import annotations

import json
import os
from pathlib import Path


def test_it_finds_nothing_wrong_here(kanuka_command) -> None:
    result = kanuka_command("doctor", "--json")
    assert result.returncode == 0, result.stderr
    found = {finding["name"]: finding for finding in json.loads(result.stdout)["findings"]}
    assert {"machine", "standard shaders", "shader compiler", "picture", "texture cache", "USD stages"} <= found.keys()
    assert all(finding["state"] == "good" for finding in found.values()), found
    assert "good  picture" in kanuka_command("doctor").stdout


def test_it_names_what_is_bad_with_a_mend(kanuka_command, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    broken = {"KANUKA_SHADERS": str(tmp_path / "nowhere"), "KANUKA_SHADER_CACHE": str(tmp_path / "file" / "cache")}
    result = kanuka_command("doctor", "--json", env={**os.environ, **broken})
    found = {finding["name"]: finding for finding in json.loads(result.stdout)["findings"]}
    assert result.returncode == 3
    assert found["standard shaders"]["state"] == "bad" and "KANUKA_SHADERS" in found["standard shaders"]["mend"]
    assert found["shader cache"]["state"] == "missing" and "KANUKA_SHADER_CACHE" in found["shader cache"]["mend"]
