"""Makes docs/images/openpbr.png: sixty balls of OpenPBR, a parameter a row (docs/usd.md)."""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdShade

import kanuka
import kanuka.usd

ROOT = Path(__file__).resolve().parent.parent
RED, GOLD, BLUE = (0.6, 0.05, 0.03), (1.0, 0.72, 0.3), (0.1, 0.25, 0.7)
STEPS = np.linspace(0, 1, 10)
# Of each row: what all have, and what changes along it.
ROWS = (
    ({"base_color": RED}, lambda x: {"specular_roughness": x}),
    (
        {"base_color": GOLD, "base_metalness": 1.0, "specular_roughness": 0.35},
        lambda x: {"specular_roughness_anisotropy": x},
    ),
    (
        {"transmission_weight": 1.0, "specular_roughness": 0.02, "transmission_dispersion_scale": 0.1},
        lambda x: {"specular_ior": 1.05 + x, "transmission_color": (1 - 0.5 * x, 1.0, 1 - 0.2 * x)},
    ),
    (
        {"base_color": BLUE, "specular_roughness": 0.5, "coat_roughness": 0.03, "coat_ior": 1.6},
        lambda x: {"coat_weight": x},
    ),
    (
        {"base_color": (0.05, 0.05, 0.06), "specular_roughness": 0.1, "thin_film_weight": 1.0, "specular_ior": 1.9},
        lambda x: {"thin_film_thickness": 0.15 + 0.65 * x},
    ),
    (
        {"base_color": (0.3, 0.02, 0.1), "fuzz_color": (1.0, 0.7, 0.8), "fuzz_roughness": 0.4},
        lambda x: {"fuzz_weight": x},
    ),
)


def material(stage: Usd.Stage, path: str, inputs: dict) -> UsdShade.Material:
    made = UsdShade.Material.Define(stage, path)
    shader = UsdShade.Shader.Define(stage, f"{path}/surface")
    shader.CreateIdAttr("ND_open_pbr_surface_surfaceshader")
    for name, value in inputs.items():
        colored = isinstance(value, tuple)
        kind = Sdf.ValueTypeNames.Color3f if colored else Sdf.ValueTypeNames.Float
        shader.CreateInput(name, kind).Set(Gf.Vec3f(*map(float, value)) if colored else float(value))
    made.CreateSurfaceOutput("mtlx").ConnectToSource(shader.CreateOutput("out", Sdf.ValueTypeNames.Token))
    return made


def place(prim, at: tuple[float, float, float], turn: tuple[float, float, float] = (0, 0, 0)) -> None:
    api = UsdGeom.XformCommonAPI(prim)
    api.SetTranslate(Gf.Vec3d(*map(float, at)))
    api.SetRotate(Gf.Vec3f(*map(float, turn)))


def build(path: Path) -> None:
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    for r, (common, varied) in enumerate(ROWS):
        for c, x in enumerate(STEPS):
            ball = UsdGeom.Sphere.Define(stage, f"/ball_{r}_{c}")
            ball.CreateRadiusAttr(0.44)
            place(ball, (c - 4.5, 2.5 - r, 0.5), (-90, 0, 0))
            look = material(stage, f"/look_{r}_{c}", common | varied(float(x)))
            UsdShade.MaterialBindingAPI.Apply(ball.GetPrim()).Bind(look)
    wall = UsdGeom.Mesh.Define(stage, "/wall")
    wall.CreatePointsAttr([(-20, -12, -0.3), (20, -12, -0.3), (20, 12, -0.3), (-20, 12, -0.3)])
    wall.CreateFaceVertexCountsAttr([4])
    wall.CreateFaceVertexIndicesAttr([0, 1, 2, 3])
    wall.CreateSubdivisionSchemeAttr("none")
    grey = material(stage, "/grey", {"base_color": (0.35, 0.35, 0.37), "specular_roughness": 0.6})
    UsdShade.MaterialBindingAPI.Apply(wall.GetPrim()).Bind(grey)
    sky = UsdLux.DomeLight.Define(stage, "/sky")
    sky.CreateIntensityAttr(0.35)
    for name, at, turn, size, amount in (
        ("key", (-5, 6, 7), (-42, -32, 0), (4, 3), 16),
        ("rim", (7, 3, 5), (-25, 55, 0), (1.5, 5), 9),
        ("low", (0, -8, 4), (60, 0, 0), (10, 0.6), 4),
    ):
        light = UsdLux.RectLight.Define(stage, f"/{name}")
        light.CreateWidthAttr(float(size[0])), light.CreateHeightAttr(float(size[1]))
        light.CreateIntensityAttr(float(amount))
        place(light, at, turn)
    camera = UsdGeom.Camera.Define(stage, "/camera")
    camera.CreateFocalLengthAttr(70.0)
    camera.CreateHorizontalApertureAttr(36.0), camera.CreateVerticalApertureAttr(21.6)
    place(camera, (0, 0, 21))
    stage.GetRootLayer().Save()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--progressions", type=int, default=128)
    parser.add_argument("-o", default=str(ROOT / "docs/images/openpbr.png"))
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        build(Path(folder) / "sheet.usda")
        scene = kanuka.usd.load(Path(folder) / "sheet.usda")
        kanuka.render(scene, progressions=arguments.progressions).write(arguments.o)


if __name__ == "__main__":
    main()
