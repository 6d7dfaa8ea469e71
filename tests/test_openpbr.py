"""OpenPBR's whole shader in a white furnace: it makes no light, and white materials lose none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("MaterialX")
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdShade

import kanuka
import kanuka.usd

SIZE = 32  # pixels of a sphere


def furnace(folder: Path, materials: list[dict[str, object]], progressions: int = 48) -> np.ndarray:
    """The mean of each sphere's middle under a sky of radiance 1, (N, 3)."""
    stage = Usd.Stage.CreateNew(str(folder / "furnace.usda"))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    for i, inputs in enumerate(materials):
        ball = UsdGeom.Sphere.Define(stage, f"/ball{i}")
        ball.CreateRadiusAttr(0.4)
        UsdGeom.XformCommonAPI(ball).SetTranslate(Gf.Vec3d(i, 0, 0))
        material = UsdShade.Material.Define(stage, f"/look{i}")
        shader = UsdShade.Shader.Define(stage, f"/look{i}/surface")
        shader.CreateIdAttr("ND_open_pbr_surface_surfaceshader")
        for name, value in inputs.items():
            kind = Sdf.ValueTypeNames.Color3f if isinstance(value, tuple) else Sdf.ValueTypeNames.Float
            kind = Sdf.ValueTypeNames.Bool if isinstance(value, bool) else kind
            shader.CreateInput(name, kind).Set(Gf.Vec3f(*value) if isinstance(value, tuple) else value)
        material.CreateSurfaceOutput("mtlx").ConnectToSource(shader.CreateOutput("out", Sdf.ValueTypeNames.Token))
        UsdShade.MaterialBindingAPI.Apply(ball.GetPrim()).Bind(material)
    UsdLux.DomeLight.Define(stage, "/sky")
    stage.GetRootLayer().Save()
    told = kanuka.Journal()
    scene = kanuka.usd.load(folder / "furnace.usda", journal=told)
    assert not [m.message for m in told.messages if "without effect" in m.message or "no node" in m.message]
    scene.resolution = SIZE * len(materials), SIZE
    n = len(materials)
    scene.camera = kanuka.Camera.from_matrix(
        np.array([[1, 0, 0, (n - 1) / 2], [0, 1, 0, 0], [0, 0, 1, 5], [0, 0, 0, 1]], dtype=float),
        projection="orthographic",
        screen_window=(-n / 2, n / 2, -0.5, 0.5),
    )
    rgb = kanuka.render(scene, progressions=progressions, max_depth=64, seed=5)["rgb"]
    inside = slice(SIZE // 2 - 7, SIZE // 2 + 7)
    return np.array([rgb[inside, i * SIZE + SIZE // 2 - 7 : i * SIZE + SIZE // 2 + 7].mean((0, 1)) for i in range(n)])


WHITE = {"base_color": (1.0, 1.0, 1.0)}


def test_white_materials_lose_nothing(tmp_path: Path) -> None:
    """Diffuse at any roughness, under a gloss, under fuzz; metal; clear glass."""
    materials = [
        WHITE | {"specular_weight": 0.0},
        WHITE | {"specular_weight": 0.0, "base_diffuse_roughness": 1.0},
        WHITE | {"specular_roughness": 0.1},
        WHITE | {"specular_roughness": 0.8, "specular_ior": 2.0},
        WHITE | {"base_metalness": 1.0, "specular_roughness": 0.0},
        WHITE | {"base_metalness": 1.0, "specular_roughness": 0.7},
        WHITE | {"base_metalness": 1.0, "specular_roughness": 0.6, "specular_roughness_anisotropy": 0.8},
        WHITE | {"fuzz_weight": 1.0},
        WHITE | {"transmission_weight": 1.0, "specular_roughness": 0.0},
        WHITE | {"transmission_weight": 1.0, "specular_roughness": 0.4},
        WHITE | {"transmission_weight": 1.0, "geometry_thin_walled": True, "specular_roughness": 0.0},
        WHITE | {"coat_weight": 1.0, "coat_darkening": 0.0},
        WHITE | {"subsurface_weight": 1.0, "subsurface_color": (1.0, 1.0, 1.0)},
    ]
    found = furnace(tmp_path, materials).mean(1)
    assert found == pytest.approx(np.ones(len(materials)), abs=0.02), list(zip(found.round(3), materials, strict=True))


def test_no_material_makes_light(tmp_path: Path) -> None:
    """Parameters at random, all at once: the whole space, emission apart."""
    random = np.random.default_rng(11)

    def some(low: float = 0.0, high: float = 1.0) -> float:
        """Often one of the ends."""
        return float(random.choice([low, high, random.uniform(low, high)]))

    def color() -> tuple[float, ...]:
        return tuple(float(x) for x in random.choice([np.ones(3), random.uniform(0, 1, 3)], axis=0))

    materials = [
        {
            "base_weight": some(),
            "base_color": color(),
            "base_diffuse_roughness": some(),
            "base_metalness": some(),
            "specular_weight": some(),
            "specular_color": color(),
            "specular_roughness": some(),
            "specular_ior": some(1.05, 3.0),
            "specular_roughness_anisotropy": some(0, 0.95),
            "transmission_weight": some(),
            "transmission_color": color(),
            "transmission_dispersion_scale": some(),
            "subsurface_weight": some(),
            "subsurface_color": color(),
            "fuzz_weight": some(),
            "fuzz_color": color(),
            "fuzz_roughness": some(0.1, 1.0),
            "coat_weight": some(),
            "coat_color": color(),
            "coat_roughness": some(),
            "coat_ior": some(1.05, 2.5),
            "coat_darkening": some(),
            "thin_film_weight": some(),
            "thin_film_thickness": some(0, 1),
            "thin_film_ior": some(1, 2),
            "geometry_thin_walled": bool(random.integers(2)),
        }
        for _ in range(40)
    ]
    found = furnace(tmp_path, materials)
    over = [(values.round(3), given) for values, given in zip(found, materials, strict=True) if values.max() > 1.02]
    assert not over, over
    assert np.isfinite(found).all() and found.mean() > 0.2
