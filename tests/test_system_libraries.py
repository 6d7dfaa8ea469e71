"""Which Debian packages the compiled parts need, what is said where one is missing; where a checkout's files lie."""

from __future__ import annotations

import importlib.util
import shlex
from pathlib import Path

import pytest

import kanuka
from kanuka import paths, system_libraries


def test_a_missing_library_is_told_with_its_package(monkeypatch: pytest.MonkeyPatch) -> None:
    lacking = {"libembree3.so.3", "libspng.so.0"}
    monkeypatch.setattr(system_libraries, "_loads", lambda name: name not in lacking)
    plain = ImportError("libembree3.so.3: cannot open shared object file: No such file or directory", path="x.so")
    error = system_libraries.explained(plain)
    assert str(error) == (
        "kanuka needs libembree3.so.3, libspng.so.0, which this machine lacks; "
        "on Debian 12: apt-get install libembree3-3 libspng0"
    )
    assert error.path == "x.so"


def test_a_module_that_is_not_built_is_told() -> None:
    plain = ModuleNotFoundError("No module named 'kanuka._native'", name="kanuka._native")
    error = system_libraries.explained(plain)
    assert "was built for another Python" in str(error)
    assert isinstance(error, ModuleNotFoundError)
    other = ImportError("undefined symbol: x")
    assert system_libraries.explained(other) is other


def test_the_table_is_what_was_built(root: Path) -> None:
    spec = importlib.util.spec_from_file_location("runtime_packages", root / "tools/runtime_packages.py")
    tool = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tool)
    assert tool.built(), "there is a module"
    assert tool.needed(tool.built()) == system_libraries.PACKAGES, "run tools/runtime_packages.py"


def test_the_manual_names_all_packages(root: Path) -> None:
    page = " ".join((root / "docs/python.md").read_text().replace("\\\n", " ").split())
    assert system_libraries.install_command() in page


def test_folders_of_a_checkout(root: Path, kanuka_command, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("KANUKA_SHADERS", raising=False)
    assert Path(kanuka.standard_shaders()) == root / "shaders"
    assert (Path(kanuka.include_dir()) / "ri.h").exists()
    assert Path(paths.libkanuka()).exists(), "make build"
    assert kanuka_command("paths", "include").stdout == kanuka.include_dir() + "\n"
    assert shlex.split(kanuka_command("paths", "flags").stdout) == paths.compiler_flags()
    listed = dict(line.split(maxsplit=1) for line in kanuka_command("paths").stdout.splitlines())
    assert listed == {
        "shaders": kanuka.standard_shaders(),
        "include": kanuka.include_dir(),
        "library": kanuka.library_dir(),
    }
    monkeypatch.setenv("KANUKA_SHADERS", "/elsewhere")
    assert kanuka_command("paths", "shaders").stdout == "/elsewhere\n"
