"""No shader that ships makes light: white furnaces of each, as it comes and with its parameters at their ends."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kanuka

SHADERS = Path(__file__).parent.parent / "shaders"
# Nothing that shines by itself, takes light away inside, or is no colour of a surface.
NO_REFLECTANCE = ("emission", "radiance", "absorption", "scattering", "background")
SKIPPED = {
    "cloud",  # a volume; docs/transport.md has its furnaces
    "emitter",
    "null",
    "constant",  # shines as Cs says
    "paintedconstant",
    "defaultsurface",  # lit from the eye where it stands in for what is not there
    "clamptoalpha",
}
# What gives back all light where its colours are white, within one part in a hundred (two: under thick layers).
LOSSLESS = {
    "matte": 0.01,
    "mirror": 0.01,
    "conductor": 0.01,
    "glass": 0.01,
    "leaf": 0.01,
    "hair": 0.01,
    "yarn": 0.01,
    "carved": 0.2,  # grains vary its stone, and its grooves lie in each other's way for as long as paths go
    "principled": 0.01,
    "lacquer": 0.02,
    "glaze": 0.25,  # cracks are darker
    "tiles": 0.06,  # each slab has its own shade
}


# A path through rougher glass has few and bright ends: test_rough_glass_loses_nothing takes more of them.
ROUGHEST = {"glass": 0.5}


def surfaces() -> list[str]:
    names = []
    for path in sorted(SHADERS.glob("*.sl")):
        shader = kanuka.compile_shader(path)
        if path.stem in SKIPPED or path.stem.startswith("Pxr"):
            continue
        if "mnk_prelighting" in shader.stages or shader.kind == "surface":
            names.append(path.stem)
    return names


def ball(name: str, values: dict[str, object]) -> kanuka.Scene:
    """All of the picture, in a sky of radiance 1."""
    scene = kanuka.Scene()
    scene.resolution = 24, 24
    scene.camera = kanuka.Camera((0, 0, 8), (0, 0, 0), fov=9)
    scene.options.max_depth = 64
    scene.add_sphere(material=kanuka.Material(name, color=(1, 1, 1), **values))
    scene.add_light("environment", amount=1)
    return scene


def furnace(name: str, values: dict[str, object]) -> np.ndarray:
    """The mean of each channel of the picture of a ball."""
    return kanuka.render(ball(name, values), progressions=64)["rgb"].mean(axis=(0, 1))


def cases(name: str) -> list[dict[str, object]]:
    parameters = kanuka.compile_shader(SHADERS / f"{name}.sl").parameters
    white = {
        p["name"]: (1.0, 1.0, 1.0)
        for p in parameters
        if p["type"] == "color" and not any(word in p["name"].lower() for word in NO_REFLECTANCE)
    }
    all_cases: list[dict[str, object]] = [white]
    for p in parameters:
        name_of = p["name"]
        if p["type"] == "float" and ("rough" in name_of.lower() or name_of in WEIGHTS):
            ends = (0.0, ROUGHEST.get(name, 1.0)) if "rough" in name_of.lower() else (0.0, 1.0)
            all_cases += [{**white, name_of: end} for end in ends]
    return all_cases


# Parameters that share light out between lobes.
WEIGHTS = (
    "gloss",
    "tinted",
    "transmission",
    "sheen",
    "metallic",
    "specular",
    "coat",
    "coatWeight",
    "twist",
    "Ks",
    "Kr",
)


@pytest.mark.parametrize("name", surfaces())
def test_no_shader_makes_light(name: str) -> None:
    for values in cases(name):
        if {"Kd", "Ks"} <= {p["name"] for p in kanuka.compile_shader(SHADERS / f"{name}.sl").parameters}:
            values = {**values, "Kd": 1 - float(values.get("Ks", 0.5))}  # classic sums: as much as is given
        found = furnace(name, values)
        assert found.max() < 1.01, f"{values}: {found}"
        if name in LOSSLESS:
            assert found.min() > 1 - LOSSLESS[name], f"{values}: {found}"


@pytest.mark.parametrize("name", surfaces())
def test_no_shader_makes_light_as_it_comes(name: str) -> None:
    assert furnace(name, {}).max() < 1.005


@pytest.mark.parametrize("ior", [1.05, 1.5, 2.4])
@pytest.mark.parametrize("roughness", [0.5, 0.8, 1.0])
def test_rough_glass_loses_nothing(ior: float, roughness: float) -> None:
    """Light is reflected inside over and over, and weights of samples multiply: with weights that are not bounded a
    picture of so many samples is dark, and its few bright pixels say little of how dark."""
    scene = ball("glass", {"ior": ior, "roughness": roughness})
    picture = kanuka.render(scene, progressions=256)["rgb"].mean(axis=2)
    error = picture.std() / np.sqrt(picture.size)
    assert error < 0.045
    assert picture.mean() == pytest.approx(1, abs=0.015 + 2 * error)
