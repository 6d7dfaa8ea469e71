"""UsdLux: lights, in the units of its specification.

An area light's radiance is intensity * 2^exposure * color * blackbody(temperature), divided by its area in the world
where `normalize` is set. USD gives a distant light's brightness as irradiance upright to it where `normalize` is set,
and as the radiance of its disk where not. (OpenUSD, UsdLuxLightAPI, "Lights and their properties".)
"""

from __future__ import annotations

import math

import numpy as np
from pxr import Usd, UsdLux, UsdShade

import kanuka

from .stage import Say

# At once far from it and as bright as a point of these areas: lights that have none.
SMALL = 1e-3


def emission(light: UsdLux.LightAPI, time: Usd.TimeCode) -> np.ndarray:
    """(3,) before `normalize`."""

    def value(attribute: Usd.Attribute, default):
        found = attribute.Get(time)
        return default if found is None else found

    color = np.array(value(light.GetColorAttr(), (1, 1, 1)), dtype=float)
    color = color * value(light.GetIntensityAttr(), 1.0) * 2.0 ** value(light.GetExposureAttr(), 0.0)
    if value(light.GetEnableColorTemperatureAttr(), False):
        kelvin = value(light.GetColorTemperatureAttr(), 6500.0)
        color = color * np.array(UsdLux.BlackbodyTemperatureAsRgb(float(kelvin)), dtype=float)
    return color


def scales(matrix: np.ndarray) -> np.ndarray:
    """Lengths of the columns: how much the light's axes are stretched."""
    return np.linalg.norm(matrix[:3, :3], axis=0)


def add_light(scene: kanuka.Scene, prim: Usd.Prim, matrix: np.ndarray, time: Usd.TimeCode, folder, say: Say) -> bool:
    """False: not a light that Kanuka has."""
    api = UsdLux.LightAPI(prim)
    amount = emission(api, time)
    normalize = bool(api.GetNormalizeAttr().Get(time))
    name = str(prim.GetPath())
    shaping = Shaping(prim, time, folder, say)
    sx, sy, sz = scales(matrix)

    def divided(area: float) -> np.ndarray:
        return amount / max(area, 1e-12) if normalize else amount

    if prim.IsA(UsdLux.DistantLight):
        angle = float(UsdLux.DistantLight(prim).GetAngleAttr().Get(time) or 0)
        solid = math.pi * math.sin(math.radians(min(angle, 180) / 2)) ** 2 if angle > 0 else 1.0
        irradiance = amount if normalize else amount * solid
        scene.add_light("distant", amount=irradiance, angle=angle, transform=rotation(matrix), name=name)
    elif prim.IsA(UsdLux.DomeLight) or prim.GetTypeName() == "DomeLight_1":
        texture = resolved(prim.GetAttribute("inputs:texture:file"), time, folder, say)
        settings = {"texture": texture} if texture else {}
        scene.add_light("environment", amount=amount, transform=rotation(matrix), name=name, **settings)
    elif prim.IsA(UsdLux.RectLight):
        rect = UsdLux.RectLight(prim)
        width, height = float(rect.GetWidthAttr().Get(time)), float(rect.GetHeightAttr().Get(time))
        texture = resolved(rect.GetTextureFileAttr(), time, folder, say)
        settings = {"texture": texture} if texture else {}
        shaping.refuse(name)
        scene.add_light(
            "quad",
            amount=divided(width * sx * height * sy),
            width=width,
            height=height,
            transform=matrix,
            name=name,
            **settings,
        )
    elif prim.IsA(UsdLux.DiskLight):
        radius = float(UsdLux.DiskLight(prim).GetRadiusAttr().Get(time))
        shaping.refuse(name)
        area = math.pi * radius**2 * sx * sy
        scene.add_light("disk", amount=divided(area), radius=radius, transform=matrix, name=name)
    elif prim.IsA(UsdLux.CylinderLight):
        tube = UsdLux.CylinderLight(prim)
        radius, length = float(tube.GetRadiusAttr().Get(time)), float(tube.GetLengthAttr().Get(time))
        shaping.refuse(name)
        area = 2 * math.pi * radius * length * sx * math.sqrt((sy * sy + sz * sz) / 2)
        scene.add_light(
            "cylinder",
            amount=divided(area),
            radius=radius,
            height=length,
            direction=(1, 0, 0),
            transform=matrix,
            name=name,
        )
    elif prim.IsA(UsdLux.SphereLight):
        sphere = UsdLux.SphereLight(prim)
        radius = float(sphere.GetRadiusAttr().Get(time))
        mean = float((sx * sy * sz) ** (1 / 3))
        as_point = bool(sphere.GetTreatAsPointAttr().Get(time)) or radius * mean <= 0
        if shaping.shapes or as_point:
            # The intensity of a sphere that far away looks like a disk.
            disk = math.pi * max(radius * mean, 0) ** 2
            intensity = amount / (4 if normalize else 1) * (1 if normalize or disk <= 0 else disk)
            shaping.add(scene, intensity, 0.0 if as_point else radius * mean, unstretched(matrix), name)
        else:
            area = 4 * math.pi * (radius * mean) ** 2
            scene.add_light("sphere", amount=divided(area), radius=radius, transform=matrix, name=name)
    else:
        return False
    return True


class Shaping:
    """UsdLuxShapingAPI: a cone, a focus, a photometric file."""

    def __init__(self, prim: Usd.Prim, time: Usd.TimeCode, folder, say: Say) -> None:
        self.say = say
        api = UsdLux.ShapingAPI(prim)
        self.cone = float(api.GetShapingConeAngleAttr().Get(time) or 90)
        self.softness = float(api.GetShapingConeSoftnessAttr().Get(time) or 0)
        self.focus = float(api.GetShapingFocusAttr().Get(time) or 0)
        self.profile = resolved(api.GetShapingIesFileAttr(), time, folder, say)
        self.shapes = self.cone < 90 or self.focus > 0 or bool(self.profile)

    def refuse(self, name: str) -> None:
        if self.shapes:
            self.say(
                "warning", f"{name}: shaping of lights that are no spheres has no effect yet: it shines as without"
            )

    def add(self, scene: kanuka.Scene, intensity: np.ndarray, radius: float, matrix: np.ndarray, name: str) -> None:
        settings: dict[str, object] = {"amount": intensity, "radius": radius, "transform": matrix, "name": name}
        if self.profile:
            settings["profile"] = self.profile
        if self.cone < 90 or self.focus > 0:
            angle = min(self.cone, 90.0)
            scene.add_light(
                "spot",
                cone_angle=angle,
                cone_delta_angle=angle * min(max(self.softness, 0), 1),
                beam_distribution=self.focus,
                **settings,
            )
        else:
            scene.add_light("point", **settings)


def rotation(matrix: np.ndarray) -> np.ndarray:
    """Without translation and scale: for light from afar."""
    result = np.eye(4)
    result[:3, :3] = unstretched(matrix)[:3, :3]
    return result


def unstretched(matrix: np.ndarray) -> np.ndarray:
    result = matrix.copy()
    result[:3, :3] = matrix[:3, :3] / np.maximum(scales(matrix), 1e-30)
    return result


def resolved(attribute: Usd.Attribute, time: Usd.TimeCode, folder, say: Say) -> str:
    """The path of a file, or nothing."""
    asset = attribute.Get(time) if attribute else None
    if asset is None or not asset.path:
        return ""
    if UsdShade.UdimUtils.IsUdimIdentifier(asset.path):
        layer = next((spec.layer for spec in attribute.GetPropertyStack(time)), None)
        tiles = UsdShade.UdimUtils.ResolveUdimTilePaths(asset.path, layer)
        if not tiles:
            say("warning", f'{attribute.GetPath()}: no tile of "{asset.path}" is found')
            return ""
        return folder.tiles(tiles)
    if not asset.resolvedPath:
        say("warning", f'{attribute.GetPath()}: the file "{asset.path}" is not found')
        return ""
    return folder.file_of(asset.resolvedPath)
