"""Builds the wheel: setuptools takes the Python files, CMake the rest, by its install component `wheel`.

It compiles in build-wheel (KANUKA_WHEEL_BUILD names another folder), which is kept: a second wheel costs what changed.
A folder beside `build` has the objects of that in ccache: paths are told from the build folder there.
An editable installation compiles nothing: the checkout's module is built into python/kanuka by `make build`.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

from setuptools import Extension, setup
from setuptools.command.build import build
from setuptools.command.build_ext import build_ext

ROOT = Path(__file__).resolve().parent
BUILD = Path(os.environ.get("KANUKA_WHEEL_BUILD") or ROOT / "build-wheel").resolve()


class Build(build):
    def run(self) -> None:
        shutil.rmtree(self.build_lib, ignore_errors=True)  # what an earlier version had is not to be in this one
        super().run()


class BuildNative(build_ext):
    def run(self) -> None:
        if self.editable_mode or self.inplace:
            return
        for program, package in (("cmake", "cmake"), ("ninja", "ninja-build"), ("c++", "g++")):
            if not shutil.which(program):
                sys.exit(f"{program} is not there: apt-get install {package} (tools/setup.sh installs all of them)")
        import nanobind

        settings = {
            "CMAKE_BUILD_TYPE": "Release",
            "KANUKA_TESTS": "OFF",
            "KANUKA_UNITY": "ON",
            "KANUKA_PACKAGE": BUILD / "package",
            "KANUKA_SHADERS_FOLDER": "",
            "Python_EXECUTABLE": sys.executable,
            "nanobind_DIR": nanobind.cmake_dir(),  # an isolated build's is elsewhere each time
        }
        targets = ["kanuka_native", "kanuka_native_stub", "kanuka"]
        jobs = os.environ.get("CMAKE_BUILD_PARALLEL_LEVEL") or str(len(os.sched_getaffinity(0)))
        defines = [f"-D{name}={value}" for name, value in settings.items()]
        run("cmake", "-S", ROOT, "-B", BUILD, "-G", "Ninja", *defines)
        run("cmake", "--build", BUILD, "--parallel", jobs, "--target", *targets)
        package = Path(self.build_lib).resolve() / "kanuka"
        run("cmake", "--install", BUILD, "--component", "wheel", "--prefix", package, "--strip")


def run(*command: object) -> None:
    if subprocess.run([str(part) for part in command]).returncode:
        sys.exit(f"{command[0]} failed; what it said is above (pip shows it with -v)")


setup(
    ext_modules=[Extension("kanuka._native", sources=[])],
    cmdclass={"build": Build, "build_ext": BuildNative},
    options={"build": {"build_base": str(BUILD / "setuptools")}},
)
