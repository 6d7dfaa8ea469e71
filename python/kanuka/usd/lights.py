"""UsdLux: lights, in the units of its specification.

An area light's radiance is intensity * 2^exposure * color * blackbody(temperature), divided by its area in the world
where `normalize` is set. USD gives a distant light's brightness as irradiance upright to it where `normalize` is set,
and as the radiance of its disk where not. (OpenUSD, UsdLuxLightAPI, "Lights and their properties".)
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from pxr import Usd, UsdGeom, UsdLux

import kanuka
from kanuka.looks.files import Files
from kanuka.looks.layouts import LAYOUTS

from . import light_pictures, shaped_lights
from .shaping import Shaping, Shapings
from .spaces import Spaces
from .stage import Say
from .values import decimal, resolved, size

# From the z axis that Kanuka's disks face along to USD's -z.
TURNED = np.diag([-1.0, 1.0, -1.0, 1.0])
DOMES = ("DomeLight", "DomeLight_1")
# A dome's picture has its pole at +y; that of +z is so turned (UsdLuxDomeLight::OrientToStageUpAxis).
Z_POLE = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]], dtype=float)


def emission(light: UsdLux.LightAPI, time: Usd.TimeCode, spaces: Spaces) -> np.ndarray:
    """(3,) before `normalize`. Raises ValueError where it is no brightness."""
    intensity, exposure = decimal(light.GetIntensityAttr(), time, 1), decimal(light.GetExposureAttr(), time, 0)
    color = spaces.light(light.GetColorAttr(), time, (1, 1, 1))
    with np.errstate(over="ignore", invalid="ignore"):  # what is too bright is told below
        color = color * intensity * np.exp2(exposure)
    if light.GetEnableColorTemperatureAttr().Get(time):
        kelvin = decimal(light.GetColorTemperatureAttr(), time, 6500)
        color = color * spaces.from_rec709(UsdLux.BlackbodyTemperatureAsRgb(kelvin))
    if not np.isfinite(color).all() or (color < 0).any():
        raise ValueError(f"its brightness is {', '.join(f'{x:g}' for x in color)}: numbers of 0 or more are called for")
    return color


def multipliers(light: UsdLux.LightAPI, time: Usd.TimeCode) -> dict[str, float]:
    """By lobes, of those that are not 1."""
    found = {"diffuse": light.GetDiffuseAttr(), "specular": light.GetSpecularAttr()}
    return {lobes: factor for lobes, attribute in found.items() if (factor := decimal(attribute, time, 1)) != 1}


def scales(matrix: np.ndarray) -> np.ndarray:
    """Lengths of the columns: how much the light's axes are stretched."""
    return np.linalg.norm(matrix[:3, :3], axis=0)


@dataclass
class Light:
    """A prim that is to be a light of a scene. `solid`: whether it may be geometry, whose shadows are always there.
    `members`: of a cluster that stands for it."""

    scene: kanuka.Scene
    prim: Usd.Prim
    matrix: np.ndarray
    time: Usd.TimeCode
    folder: Files
    shapings: Shapings
    spaces: Spaces
    say: Say
    solid: bool = True
    members: int = shaped_lights.MEMBERS

    def __post_init__(self) -> None:
        api = UsdLux.LightAPI(self.prim)
        self.name = str(self.prim.GetPath())
        self.amount = emission(api, self.time, self.spaces)
        self.lobes = multipliers(api, self.time)
        self.normalize = bool(api.GetNormalizeAttr().Get(self.time))
        self.scales = scales(self.matrix)
        if not np.isfinite(self.matrix).all() or not self.scales.all():
            raise ValueError("its transformation leaves nothing of it")

    def radiance(self, area: float) -> np.ndarray:
        return self.amount / area if self.normalize else self.amount

    def shaping(self) -> Shaping:
        return self.shapings.of(self.prim, self.say)

    def texture(self, layout: str = "") -> str:
        """The file of its picture; empty where it has none, or none that can be read, which is told."""
        attribute = self.prim.GetAttribute("inputs:texture:file")
        if not (file := resolved(attribute, self.time, self.folder, self.say)):
            return ""
        try:
            return light_pictures.rendered(file, attribute, self.spaces, layout)
        except ValueError as error:
            self.say("warning", f"{self.name}: {error}. It shines as without")
            return ""

    def add(self, kind: str, **settings: object) -> None:
        self.scene.add_light(kind, name=self.name, **self.lobes, **settings)

    def surface(self, add: Callable[..., object], *shape: object, **settings: object) -> None:
        """Geometry that shines by its material."""
        dark = kanuka.Shader("arealight", intensity=0.0, **self.lobes)
        add(*shape, area_light=dark, name=self.name, **settings)

    def cluster(
        self, shaping: Shaping, body: shaped_lights.Body, local: tuple[np.ndarray, float], intensity: np.ndarray
    ) -> None:
        """Of points at local places with a distance between them."""
        places = local[0] @ self.matrix[:3, :3].T + self.matrix[:3, 3]
        radius = local[1] / 2 * float(self.scales.min())
        turned = unstretched(self.matrix)
        shaped_lights.add_cluster(self.add, shaping, self.folder, body, places, turned, intensity, radius)


def add_distant(light: Light) -> None:
    """Shaping cuts its disk, and dims what is left of it evenly."""
    angle = min(decimal(UsdLux.DistantLight(light.prim).GetAngleAttr(), light.time, 0), 180)
    if angle < 0:
        raise ValueError(f"inputs:angle is {angle:g}; it must be 0 or more")
    solid = math.pi * math.sin(math.radians(angle / 2)) ** 2 if angle > 0 else 1.0
    amount = light.amount if light.normalize else light.amount * solid
    shaping = light.shaping()
    if shaping.shapes:
        theta = (np.arange(64) + 0.5) / 64 * angle / 2
        phi = np.arange(5.0, 360, 10)[:, None]
        seen = np.sin(2 * np.radians(theta)) if angle > 0 else np.ones(64)  # cosine times what of the disk is there
        weights = (color * (shaping.weight(theta, phi, n) * seen).mean() for color, n in shaping.parts())
        amount = amount * sum(weights, np.zeros(3)) / seen.mean()
        angle = min(angle, 2 * shaping.cone)
    light.add("distant", amount=amount, angle=angle, transform=rotation(light.matrix))


def add_dome(light: Light) -> None:
    """DomeLight's pole is +y; that of DomeLight_1 is what it says, by default the stage's up axis."""
    pole = light.prim.GetAttribute("poleAxis").Get() if light.prim.GetAttribute("poleAxis") else "Y"
    matrix = light.matrix
    if pole == "Z" or (pole == "scene" and UsdGeom.GetStageUpAxis(light.prim.GetStage()) == "Z"):
        matrix = matrix @ Z_POLE
    layout = str(light.prim.GetAttribute("inputs:texture:format").Get(light.time) or "automatic")
    if layout not in LAYOUTS and layout not in ("automatic", "latlong"):
        light.say("warning", f'{light.name}: there is no format "{layout}" of pictures; it is taken for latlong')
    texture = light.texture(layout if layout in LAYOUTS else "")
    settings = {"texture": texture} if texture else {}
    light.add("environment", amount=light.amount, transform=rotation(matrix), **settings)


def add_flat(light: Light, area: float, local: Callable[[], tuple[np.ndarray, float]], surface, plain) -> None:
    """A light of one side: a surface with a lobe of emission, a cluster of points, or Kanuka's own."""
    shaping = light.shaping()
    radiance = light.radiance(area)
    if shaped_lights.leaves_flat(shaping):
        plain(radiance)
    elif light.solid and shaped_lights.is_lobe(shaping):
        texture = light.texture()
        material = shaped_lights.lobe_material(shaping, light.folder, radiance, texture)
        surface(material=material)
    else:
        if light.texture():
            light.say("warning", f"{light.name}: with this shaping its picture is not read; it shines as without")
        light.cluster(shaping, shaped_lights.FLAT, local(), radiance * area)


def add_rect(light: Light) -> None:
    rect = UsdLux.RectLight(light.prim)
    width, height = size(rect.GetWidthAttr(), light.time), size(rect.GetHeightAttr(), light.time)
    sx, sy, _ = light.scales
    x, y = width / 2, height / 2
    corners = np.array([[x, -y, 0], [-x, -y, 0], [-x, y, 0], [x, y, 0]])
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])

    def plain(radiance: np.ndarray) -> None:
        texture = light.texture()
        settings = {"texture": texture} if texture else {}
        light.add("quad", amount=radiance, width=width, height=height, transform=light.matrix, **settings)

    def surface(**settings) -> None:
        light.surface(light.scene.add_mesh, corners, [[0, 1, 2, 3]], uv=uv, transform=light.matrix, **settings)

    add_flat(
        light,
        width * sx * height * sy,
        lambda: shaped_lights.over_rectangle(width, height, light.members),
        surface,
        plain,
    )


def add_disk(light: Light) -> None:
    radius = size(UsdLux.DiskLight(light.prim).GetRadiusAttr(), light.time)
    sx, sy, _ = light.scales

    def plain(radiance: np.ndarray) -> None:
        light.add("disk", amount=radiance, radius=radius, transform=light.matrix)

    def surface(**settings) -> None:
        light.surface(light.scene.add_disk, radius, transform=light.matrix @ TURNED, **settings)

    add_flat(
        light, math.pi * radius**2 * sx * sy, lambda: shaped_lights.over_disk(radius, light.members), surface, plain
    )


def add_cylinder(light: Light) -> None:
    """One of no radius is a line, which has a brightness where `normalize` gives it one."""
    tube, time = UsdLux.CylinderLight(light.prim), light.time
    length, radius = size(tube.GetLengthAttr(), time), size(tube.GetRadiusAttr(), time, positive=False)
    sx, sy, sz = light.scales
    if radius == 0 and not light.normalize:
        raise ValueError("inputs:radius is 0: without inputs:normalize there is no light of it")
    area = 2 * math.pi * radius * length * sx * math.sqrt((sy * sy + sz * sz) / 2)
    shaping = light.shaping()
    if shaping.shapes or radius == 0:
        # A long tube has the area of its outline, 2 r l, as seen from the side.
        intensity = (light.amount if light.normalize else light.amount * area) / math.pi
        light.cluster(shaping, shaped_lights.TUBE, shaped_lights.over_line(length, radius, light.members), intensity)
        return
    light.add(
        "cylinder",
        amount=light.radiance(area),
        radius=radius,
        height=length,
        direction=(1, 0, 0),
        transform=light.matrix,
    )


def add_sphere(light: Light) -> None:
    sphere = UsdLux.SphereLight(light.prim)
    as_point = bool(sphere.GetTreatAsPointAttr().Get(light.time))
    radius = size(sphere.GetRadiusAttr(), light.time, positive=False)
    mean = float(np.prod(light.scales) ** (1 / 3))
    shaping = light.shaping()
    if not shaping.shapes and not as_point and radius > 0:
        area = 4 * math.pi * (radius * mean) ** 2
        light.add("sphere", amount=light.radiance(area), radius=radius, transform=light.matrix)
        return
    # The intensity of a sphere that far away looks like a disk.
    disk = math.pi * (radius * mean) ** 2
    intensity = light.amount / 4 if light.normalize else light.amount * (disk or 1)
    apart = 0.0 if as_point else 2 * radius * mean / float(light.scales.min())
    light.cluster(shaping, shaped_lights.BALL, (np.zeros((1, 3)), apart), intensity)


def add_portal(light: Light) -> None:
    portal = UsdLux.PortalLight(light.prim)
    width, height = size(portal.GetWidthAttr(), light.time), size(portal.GetHeightAttr(), light.time)
    light.lobes = {}
    light.add("portal", width=width, height=height, transform=light.matrix)


# By kinds of prims. They raise ValueError where a light cannot shine.
ADDERS: dict[str, Callable[[Light], None]] = {
    "DistantLight": add_distant,
    "DomeLight": add_dome,
    "DomeLight_1": add_dome,
    "RectLight": add_rect,
    "DiskLight": add_disk,
    "CylinderLight": add_cylinder,
    "SphereLight": add_sphere,
    "PortalLight": add_portal,
}


def stage_lights(stage: Usd.Stage) -> list[Usd.Prim]:
    """All prims that are lights; those in instances once for each instance."""

    def has_lights(prototype: Usd.Prim) -> bool:
        return any(prim.HasAPI(UsdLux.LightAPI) for prim in Usd.PrimRange(prototype))

    predicate = Usd.PrimDefaultPredicate
    if any(has_lights(prototype) for prototype in stage.GetPrototypes()):
        predicate = Usd.TraverseInstanceProxies(predicate)
    return [prim for prim in stage.Traverse(predicate) if prim.HasAPI(UsdLux.LightAPI)]


def portals(lights: list[Usd.Prim]) -> set[str]:
    """Portals that domes name: others guide nothing."""
    domes = [prim.GetRelationship("portals") for prim in lights if prim.GetTypeName() in DOMES]
    return {str(path) for relationship in domes for path in relationship.GetForwardedTargets()}


def rotation(matrix: np.ndarray) -> np.ndarray:
    """Without translation and scale: for light from afar."""
    result = np.eye(4)
    result[:3, :3] = unstretched(matrix)[:3, :3]
    return result


def unstretched(matrix: np.ndarray) -> np.ndarray:
    """As a light is turned, or mirrored, without scale and shear, which angles know nothing of: along its z axis, with
    its x axis as near as that allows."""
    x, y, z = np.moveaxis(matrix[:3, :3], 1, 0)
    z = z / max(np.linalg.norm(z), 1e-30)
    x = x - z * (x @ z)
    x = x / max(np.linalg.norm(x), 1e-30)
    across = np.cross(z, x)
    result = matrix.copy()
    result[:3, :3] = np.stack([x, across if y @ across >= 0 else -across, z], axis=1)
    return result
