"""Materials of USD node by node, in memory, and what their shaders give."""

from __future__ import annotations

import numpy as np
from pxr import Sdf, Usd, UsdShade

import kanuka
from kanuka.looks.files import Files
from kanuka.usd import library
from kanuka.usd.materials import Made, Materials

N = 8
SHIFT = 8.0
TYPES = {
    "float": Sdf.ValueTypeNames.Float,
    "integer": Sdf.ValueTypeNames.Int,
    "boolean": Sdf.ValueTypeNames.Bool,
    "color3": Sdf.ValueTypeNames.Color3f,
    "color4": Sdf.ValueTypeNames.Color4f,
    "vector2": Sdf.ValueTypeNames.Float2,
    "vector3": Sdf.ValueTypeNames.Float3,
    "vector4": Sdf.ValueTypeNames.Float4,
    "matrix33": Sdf.ValueTypeNames.Matrix3d,
    "matrix44": Sdf.ValueTypeNames.Matrix4d,
    "string": Sdf.ValueTypeNames.String,
    "filename": Sdf.ValueTypeNames.Asset,
}


class Graph:
    """A material whose emission is what a node gives."""

    def __init__(self) -> None:
        self.stage = Usd.Stage.CreateInMemory()
        self.material = UsdShade.Material.Define(self.stage, "/m")
        self.surface = self.node("surface", "ND_standard_surface_surfaceshader", emission=1.0)
        self.material.CreateSurfaceOutput("mtlx").ConnectToSource(
            self.surface.CreateOutput("surface", Sdf.ValueTypeNames.Token)
        )
        self.told: list[str] = []

    def node(self, name: str, identifier: str, **inputs) -> UsdShade.Shader:
        """Inputs are values, or (node, output)."""
        shader = UsdShade.Shader.Define(self.stage, f"/m/{name}")
        shader.CreateIdAttr(identifier)
        definition = library.definition(identifier)
        for key, value in inputs.items():
            key = key.rstrip("_")
            port = shader.CreateInput(key, TYPES[definition.getActiveInput(key).getType()])
            if isinstance(value, tuple) and isinstance(value[0], UsdShade.Shader):
                port.ConnectToSource(value[0].GetOutput(value[1]))
            else:
                port.Set(value)
        for output in definition.getActiveOutputs():
            if output.getType() in TYPES:
                shader.CreateOutput(output.getName(), TYPES[output.getType()])
        return shader

    def emit(self, shader: UsdShade.Shader, output: str = "out") -> None:
        port = self.surface.CreateInput("emission_color", Sdf.ValueTypeNames.Color3f)
        port.ConnectToSource(shader.GetOutput(output))

    def made(self) -> tuple[Made, kanuka.CompiledShader]:
        materials = Materials(lambda kind, text: self.told.append(text), Files(), Usd.TimeCode.Default())
        made = materials.of(self.material)
        assert made is not None
        return made, kanuka.compile_shader(materials._files.folder / f"{made.shader}.sl")

    def run(self, what: str = "light.radiance", **primvars) -> np.ndarray:
        """(N, N, 3) over the unit square, with s and t the texture coordinates."""
        made, shader = self.made()
        s, t = coordinates()
        known = {p["name"] for p in shader.parameters}
        values = {k: v for k, v in {"usd_st_0": s, "usd_st_1": t, **primvars}.items() if k in known}
        return shader.run(N, N, plain(made) | values)["slots"][what]


def plain(made: Made) -> dict[str, object]:
    """Its parameters by names without types."""
    return {name.split()[-1]: value for name, value in made.parameters.items()}


def coordinates() -> tuple[np.ndarray, np.ndarray]:
    u = np.linspace(0, 1, N, dtype=np.float32)
    return np.broadcast_to(u, (N, N)).copy(), np.broadcast_to(u[:, None], (N, N)).copy()
