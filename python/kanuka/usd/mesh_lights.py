"""Meshes that shine: UsdLuxMeshLightAPI, and the older GeometryLight, which names a mesh."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from pxr import Usd, UsdGeom, UsdLux

import kanuka
from kanuka.looks.colors import Lookup
from kanuka.looks.files import Files

from .items import Item
from .lights import emission, multipliers
from .linking import name_of
from .materials import Shine
from .shaping import Shapings
from .spaces import Spaces
from .stage import Say, silent
from .values import resolved

TINTED, INDEPENDENT = "materialGlowTintsLight", "independent"  # and noMaterialResponse


@dataclass(frozen=True)
class Glow:
    """What a light makes of a mesh. Kanuka's surfaces shine alike to the camera and on others, so the light's emission
    is what both see; USD shows the camera the material's own in two of its modes."""

    name: str
    radiance: tuple[float, float, float]
    mode: str
    lobes: dict[str, float]
    picture: tuple[str, Lookup] | None = None

    @property
    def shine(self) -> Shine:
        return Shine(self.radiance if self.mode == TINTED else (0.0, 0.0, 0.0), self.radiance, self.picture)

    def area_light(self, tinted: bool) -> kanuka.Shader:
        """Beside a material that shines by itself it says only which light that is."""
        color = (0.0, 0.0, 0.0) if tinted else self.radiance
        return kanuka.Shader("arealight", intensity=1.0, lightcolor=color, group=self.name, **self.lobes)


class MeshLights:
    def __init__(self, lights: list[Usd.Prim], shapings: Shapings, spaces: Spaces, files: Files, say: Say) -> None:
        self._shapings, self._spaces, self._files, self._say = shapings, spaces, files, say
        self.number = 0
        self.last_normalized = ""  # path of the light
        self._named: dict[str, Usd.Prim] = {}  # lights by the mesh that they name
        for prim in lights:
            if prim.GetTypeName() == "GeometryLight":
                self._name(prim)

    def _name(self, light: Usd.Prim) -> None:
        stage, targets = light.GetStage(), light.GetRelationship("geometry").GetForwardedTargets()
        meshes = [path for path in targets if (found := stage.GetPrimAtPath(path)) and found.IsA(UsdGeom.Mesh)]
        self._named |= {name_of(stage.GetPrimAtPath(path)): light for path in meshes}
        if len(meshes) != len(targets) or not targets:
            others = ", ".join(str(path) for path in targets if path not in meshes) or "nothing"
            self._say("warning", f"{light.GetPath()}: its geometry is {others}: only meshes shine")

    def light_of(self, item: Item) -> Usd.Prim | None:
        """What a mesh shines by: itself, or the light that names it; None: it does not."""
        named = self._named.get(name_of(item.prim)) if self._named else None
        if named is not None:
            return named if named.HasAPI(UsdLux.LightAPI) else None
        return item.prim if item.shines else None

    def of(self, light: Usd.Prim, time: Usd.TimeCode, area: Callable[[], float]) -> Glow | None:
        """area() is that of the mesh in the world. None: it is a bad one, which is told."""
        self.number += 1
        api = UsdLux.LightAPI(light)
        try:
            amount = emission(api, time, self._spaces)
            if api.GetNormalizeAttr().Get(time):
                surface = area()
                if not surface > 0:
                    raise ValueError("inputs:normalize is on, but its mesh has no area")
                amount = amount / surface
                self.last_normalized = name_of(light)
            if self._shapings.of(light, silent).shapes:
                self._say("warning", f"{light.GetPath()}: shaping has no effect on meshes: it shines as without")
        except ValueError as error:
            self._say("error", f"{light.GetPath()}: {error}. It does not shine")
            return None
        mode = str(api.GetMaterialSyncModeAttr().Get(time))
        radiance = tuple(float(x) for x in amount)
        return Glow(name_of(light), radiance, mode, multipliers(api, time), self._picture(light, time))

    def _picture(self, light: Usd.Prim, time: Usd.TimeCode) -> tuple[str, Lookup] | None:
        """Of the attribute that other lights have; it lies on the mesh by its st."""
        attribute = light.GetAttribute("inputs:texture:file")
        if not (file := resolved(attribute, time, self._files, self._say)):
            return None
        return file, self._spaces.lookup(file, self._spaces.of_file(attribute, file))
