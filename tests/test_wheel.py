"""The wheel: built without network, installed into an environment of its own, used in an empty folder."""

from __future__ import annotations

import ast
import os
import shutil
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import numpy as np
import pytest

import kanuka
from conftest import HEADER, ROOT, WORLD

pytestmark = pytest.mark.slow

SCENE = HEADER + WORLD.replace('"matte"', '"plastic" "Ks" [0.6]')


def call(*command: object, **keywords) -> str:
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, **keywords)
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Compiled in build-wheel, which is kept: what is new is compiled, and that once."""
    folder = tmp_path_factory.mktemp("wheel")
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check"]
    call(*pip, "wheel", ROOT, "--no-index", "--no-deps", "--no-build-isolation", "--wheel-dir", folder)
    (made,) = folder.glob("*.whl")
    return made


class Installed:
    """A fresh environment that has the wheel and NumPy, and knows nothing of the checkout."""

    def __init__(self, folder: Path, wheel: Path) -> None:
        venv.create(folder, with_pip=False, symlinks=True)
        self.python = folder / "bin/python"
        self.command = folder / "bin/kanuka"
        (self.site,) = folder.glob("lib/python3*/site-packages")
        self.package = self.site / "kanuka"
        numpy = Path(np.__file__).parents[1]
        for name in ("numpy", "numpy.libs"):
            if (numpy / name).exists():
                (self.site / name).symlink_to(numpy / name)
        pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--python", self.python]
        call(*pip, "install", "--no-index", "--no-deps", wheel)
        self.cache = folder / "shader_cache"

    def run(self, *command: object, cwd: Path, **more: str) -> str:
        """In that environment, without what names the checkout; standard output."""
        ours = ("KANUKA_", "PYTHON", "VIRTUAL_ENV", "LD_LIBRARY_PATH")
        clean = {name: value for name, value in os.environ.items() if not name.startswith(ours)}
        return call(*command, cwd=cwd, env=clean | {"KANUKA_SHADER_CACHE": str(self.cache)} | more)


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Installed:
    return Installed(tmp_path_factory.mktemp("environment"), wheel)


@pytest.fixture
def empty(tmp_path: Path) -> Path:
    """A folder that has a scene, and nothing else."""
    (tmp_path / "scene.rib").write_text(SCENE)
    return tmp_path


def pixels(path: Path) -> dict[str, np.ndarray]:
    picture = kanuka.read(path)
    return {name: picture[name] for name in picture.keys()}  # noqa: SIM118


def same(a: dict[str, np.ndarray], b: dict[str, np.ndarray]) -> bool:
    return a.keys() == b.keys() and all(np.array_equal(a[name], b[name]) for name in a)


@pytest.fixture
def expected(empty: Path) -> dict[str, np.ndarray]:
    """The picture of that scene by the checkout."""
    kanuka.render(kanuka.load(empty / "scene.rib")).write(empty / "checkout.exr")
    found = pixels(empty / "checkout.exr")
    assert found["rgb"].mean() > 0.01, "something is lit"
    return found


def test_it_has_what_ships_and_nothing_else(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        held = {name for name in archive.namelist() if ".dist-info/" not in name}
        (native,) = {name for name in held if Path(name).match("kanuka/_native.cpython-*.so")}
        stub = archive.read("kanuka/_native.pyi").decode()
    ours = {f"kanuka/{file.relative_to(ROOT / 'python/kanuka')}" for file in ROOT.glob("python/kanuka/**/*.py")}
    ours |= {f"kanuka/shaders/{file.relative_to(ROOT / 'shaders')}" for file in ROOT.glob("shaders/**/*.sl")}
    ours |= {f"kanuka/shaders/{file.relative_to(ROOT / 'shaders')}" for file in ROOT.glob("shaders/**/*.h")}
    ours |= {"kanuka/py.typed", "kanuka/_native.pyi", native}
    ours |= {"kanuka/include/ri.h", "kanuka/lib/libkanuka.so", "kanuka/lib/libkanuka.so.0"}
    assert held == ours
    assert "Scene" in {node.name for node in ast.parse(stub).body if isinstance(node, ast.ClassDef)}
    assert not wheel.name.endswith("-any.whl"), "it is of one platform"


def test_no_file_names_the_checkout(installed: Installed) -> None:
    files = [file for file in installed.package.rglob("*") if file.is_file() and file.suffix != ".pyc"]
    assert [file for file in files if os.fsencode(ROOT) in file.read_bytes()] == []


def test_the_command_makes_the_same_picture(installed: Installed, empty: Path, expected: dict) -> None:
    written = installed.run(installed.command, "render", "scene.rib", "-o", "by_command.exr", cwd=empty)
    assert written.strip().endswith("by_command.exr")
    assert same(pixels(empty / "by_command.exr"), expected)


IN_PYTHON = """\
import importlib.metadata, pathlib, sys
import kanuka

kanuka.render(kanuka.load("scene.rib")).write("by_python.exr")
assert kanuka.__version__ == importlib.metadata.version("kanuka")
print(*sys.path, sep="\\n")
for found in (kanuka.__file__, kanuka.standard_shaders(), kanuka.include_dir(), kanuka.library_dir()):
    assert pathlib.Path(found).exists(), found
    assert pathlib.Path(found).is_relative_to(sys.argv[1]), found
for line in pathlib.Path("/proc/self/maps").read_text().splitlines():
    print(line.split(maxsplit=5)[5] if "/" in line else "")
"""


def test_python_makes_the_same_picture_and_loads_nothing_of_the_checkout(
    installed: Installed, empty: Path, expected: dict
) -> None:
    loaded = installed.run(installed.python, "-c", IN_PYTHON, installed.package, cwd=empty).splitlines()
    assert same(pixels(empty / "by_python.exr"), expected)
    assert any(str(installed.package / "_native") in line for line in loaded)
    assert [line for line in loaded if line.startswith(str(ROOT)) and "/site-packages/numpy" not in line] == []


def test_it_reads_its_own_shaders_and_others_where_it_is_told_to(
    installed: Installed, empty: Path, expected: dict
) -> None:
    command = (installed.command, "render", "scene.rib", "-o")
    shader = installed.package / "shaders/plastic.sl"
    text = shader.read_text()
    try:
        shader.write_text("surface plastic(float Ks = 1;) { Ci = color(1, 0, 0); }\n")
        installed.run(*command, "own.exr", cwd=empty)
        installed.run(*command, "told.exr", cwd=empty, KANUKA_SHADERS=str(ROOT / "shaders"))
    finally:
        shader.write_text(text)
    assert not same(pixels(empty / "own.exr"), expected)
    assert same(pixels(empty / "told.exr"), expected)


COMPILE = """\
import pathlib, kanuka
for file in sorted(pathlib.Path(kanuka.standard_shaders()).glob("*.sl")):
    print(kanuka.compile_shader(str(file)).name)
"""


def test_shaders_compile(installed: Installed, empty: Path) -> None:
    names = installed.run(installed.python, "-c", COMPILE, cwd=empty).split()
    assert names == sorted(file.stem for file in ROOT.glob("shaders/*.sl"))
    assert "Kd" in installed.run(installed.command, "shader", "compile", "plastic", cwd=empty)


PROCEDURALS = """\
import kanuka
for name in ("trees.rib", "comb.rib"):
    scene = kanuka.load(name)
    summary = scene.summary()
    print(name, sum(summary["primitives"].values()) + summary["instances"], *scene.journal.messages)
"""


def test_procedurals_that_ship_and_libraries_of_them(installed: Installed, empty: Path) -> None:
    flags = installed.run(installed.command, "paths", "flags", cwd=empty).split()
    call("cc", "-shared", "-fPIC", ROOT / "tests/c/comb.c", flags[0], "-o", "comb.so", cwd=empty)
    for name, data in (("trees", "levels=2"), ("comb", "3 0.4")):
        request = f'Procedural "DynamicLoad" ["{name}" "{data}"] [-1 9 -1 9 -1 9]'
        (empty / f"{name}.rib").write_text(f'Declare "wear" "uniform float"\nWorldBegin\n{request}\nWorldEnd\n')
    trees, comb = installed.run(installed.python, "-W", "ignore", "-c", PROCEDURALS, cwd=empty).splitlines()
    assert int(trees.split()[1]) > 0, trees
    assert comb == "comb.rib 4"


def test_c_programs_find_the_header_and_the_library(installed: Installed, empty: Path) -> None:
    flags = installed.run(installed.command, "paths", "flags", cwd=empty).split()
    call("cc", "-std=c99", "-Wno-discarded-qualifiers", ROOT / "tests/c/picture.c", *flags, "-lm", "-o", "p", cwd=empty)
    installed.run(empty / "p", "c.exr", cwd=empty)
    installed.run(empty / "p", "c.rib", cwd=empty)
    kanuka.render(kanuka.load(empty / "c.rib")).write(empty / "rib.exr")
    assert np.array_equal(pixels(empty / "c.exr")["rgb"], pixels(empty / "rib.exr")["rgb"])


def test_a_missing_library_is_named(installed: Installed, tmp_path: Path) -> None:
    shutil.copytree(installed.package, tmp_path / "kanuka")
    (native,) = (tmp_path / "kanuka").glob("_native.cpython-*.so")
    native.write_bytes(native.read_bytes().replace(b"libembree3.so.3", b"libembrex3.so.3"))
    (tmp_path / "numpy").symlink_to(Path(np.__file__).parent)
    script = "try:\n import kanuka\nexcept ImportError as error:\n print(error)\n"
    said = installed.run(installed.python, "-c", script, cwd=tmp_path, PYTHONPATH=str(tmp_path))
    assert "kanuka needs libembrex3.so.3, which this machine lacks" in said
    assert "apt-get install " in said
