"""From a stage to a scene: walks its prims once, in order."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from pxr import Gf, Usd, UsdGeom, UsdLux, UsdRender, UsdSkel

import kanuka
from kanuka import standins
from kanuka.looks.files import Files

from . import cameras, light_limits
from .geometry import Shapes
from .instanced_lights import InstancedLights, at_start
from .lights import ADDERS, Light, portals, stage_lights
from .linking import Links
from .materials import Materials
from .mesh_lights import MeshLights
from .render_products import chosen as chosen_products
from .render_products import product_of
from .render_vars import Shown
from .settings import Settings, settings_of
from .shaped_lights import MEMBERS
from .shaping import Shapings
from .spaces import rendering_space
from .stage import Gathered, Say, first_frame, input_error, open_stage
from .transforms import Transforms, stage_matrix

PURPOSES = ("default", "render")
# Prims that are read elsewhere, or hold others.
QUIET = frozenset(
    {"Xform", "Scope", "Material", "Shader", "NodeGraph", "GeomSubset", "Camera", "GeometryLight", "SpatialAudio"}
    | {"RenderSettings", "RenderProduct", "RenderVar", "SkelRoot", "Skeleton", "SkelAnimation", "BlendShape"}
)


@dataclass
class Reader:
    """Reads a stage into a scene. Prims of groups (prototypes) are in the space of the prototype."""

    stage: Usd.Stage
    scene: kanuka.Scene
    say: Say
    times: list[Usd.TimeCode]
    purposes: Sequence[str] = PURPOSES
    shown: Sequence[Shown] = ()
    lights: int = 0
    _groups: dict[tuple, kanuka.Group] = field(default_factory=dict)
    _on_the_way: set[str] = field(default_factory=set)
    _normalized: dict[int, str] = field(default_factory=dict)  # groups with meshes whose light goes by their area
    gathered: Gathered = field(default_factory=Gathered)

    def __post_init__(self) -> None:
        self.files = Files()
        self.materials = Materials(self.say, self.files, self.times[0], self.scene.options.color_space)
        lights = stage_lights(self.stage)
        self.portals = portals(lights)
        self.shapings = Shapings(self.times[0], self.files)
        self.mesh_lights = MeshLights(lights, self.shapings, self.say)
        self.links = Links(lights, self.times[0], self.say)
        light_limits.tell(lights, self.times[0], self.say, self.gathered)
        self.shapes = Shapes(self.materials, self.say, self.times, self.links, self.mesh_lights, self.shown)
        self.transforms = Transforms(self.times)
        self.instanced = InstancedLights()
        self.world = stage_matrix(self.stage)

    def read(self) -> None:
        root = self.stage.GetPseudoRoot()
        self.walk(root, self.scene, root, self.world)
        self.gathered.tell(self.say)

    def walk(self, top: Usd.Prim, place: kanuka.Scene | kanuka.Group, root: Usd.Prim, outer: np.ndarray) -> None:
        """Adds everything below `top` to a scene or group; `outer` is place_from_root."""
        within = Usd.PrimRange(top, Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate))
        prims = iter(within)
        for prim in prims:
            if prim.IsPseudoRoot():
                continue
            if not self.shows(prim):
                prims.PruneChildren()
                continue
            if prim.IsInstance() and prim != top:
                prims.PruneChildren()
                group, matrix = self.group_of(prim.GetPrototype(), prim), outer @ self.transforms.within(prim, root)
                self.place_instances(place, group, matrix)
                if place is self.scene:
                    self.instanced.add_instance(self, prim, at_start(matrix))
                continue
            if prim.IsA(UsdGeom.PointInstancer):
                prims.PruneChildren()
                self.add_instancer(UsdGeom.PointInstancer(prim), place, outer @ self.transforms.within(prim, root))
                continue
            self.add(prim, place, outer, root)

    def shows(self, prim: Usd.Prim) -> bool:
        if not prim.IsA(UsdGeom.Imageable):
            return True
        imageable = UsdGeom.Imageable(prim)
        if imageable.GetVisibilityAttr().Get(self.times[0]) == UsdGeom.Tokens.invisible:
            return False
        return imageable.ComputePurpose() in self.purposes or prim.GetTypeName() in ("Camera",)

    def add(self, prim: Usd.Prim, place, outer: np.ndarray, root: Usd.Prim) -> None:
        kind = str(prim.GetTypeName())
        if not kind or kind in QUIET or kind.endswith("LightFilter"):
            return
        matrix = outer @ self.transforms.within(prim, root)
        shape, light = prim.IsA(UsdGeom.Gprim), prim.HasAPI(UsdLux.LightAPI)
        if shape and light and kind != "Mesh":
            self.say("warning", f"{prim.GetPath()}: of shapes only meshes are lights: it does not shine")
        if light and not shape:
            if place is self.scene:  # else it is one for each instance
                self.add_light(prim, at_start(matrix), self.say)
        elif not self.shapes.add(place, prim, matrix):
            self.gathered.note(f"prims of type {kind} are not read yet", str(prim.GetPath()))

    def add_light(self, prim: Usd.Prim, matrix: np.ndarray, say: Say, members: int = MEMBERS) -> None:
        kind, path = str(prim.GetTypeName()), str(prim.GetPath())
        if kind in QUIET or (kind == "PortalLight" and path not in self.portals):
            return
        if kind not in ADDERS:
            self.gathered.note(f"prims of type {kind} are not read yet", path)
            return
        solid = not self.links.chooses_shadows(prim)
        try:
            ADDERS[kind](Light(self.scene, prim, matrix, self.times[0], self.files, self.shapings, say, solid, members))
        except ValueError as error:
            say("error", f"{path}: {error}. It is left out")
        self.lights += 1

    # ---- instances

    def group_of(self, prototype: Usd.Prim, named: Usd.Prim) -> kanuka.Group:
        """What a prototype holds, added once for each way in which it is linked with lights."""
        at = self.links.path_of(named)
        key = str(prototype.GetPath()), self.links.signature(at, prototype)
        if key not in self._groups:
            with self.links.placed(prototype.GetPath(), at):
                self.prepare(prototype)
                self._groups[key] = self.scene.add_group(str(named.GetPath()))
                self.fill(self._groups[key], prototype)
        return self._groups[key]

    def fill(self, group: kanuka.Group, top: Usd.Prim) -> None:
        self.mesh_lights.last_normalized = ""
        self.walk(top, group, top, np.eye(4))
        if self.mesh_lights.last_normalized:
            self._normalized[id(group)] = self.mesh_lights.last_normalized

    def add_instances(self, place, group: kanuka.Group, matrices: np.ndarray) -> None:
        place.add_instances(group, matrices)
        if id(group) in self._normalized and (np.abs(np.linalg.det(matrices[..., :3, :3]) - 1) > 1e-3).any():
            text = "normalize divides by the area of its mesh in the prototype, whose instances are scaled"
            self.gathered.note(text, self._normalized[id(group)])

    def prepare(self, top: Usd.Prim) -> None:
        """Groups of what is instanced below: a group holds instances of groups made before it."""
        prims = iter(Usd.PrimRange(top, Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)))
        for prim in prims:
            if prim.IsInstance():
                prims.PruneChildren()
                self.group_of(prim.GetPrototype(), prim)
            elif prim.IsA(UsdGeom.PointInstancer):
                prims.PruneChildren()
                for target in UsdGeom.PointInstancer(prim).GetPrototypesRel().GetForwardedTargets():
                    if inner := self.stage.GetPrimAtPath(target):
                        self.prototype_group(inner, prim)

    def place_instances(self, place, group: kanuka.Group, matrices: np.ndarray) -> None:
        """One, (4, 4), or one that moves, (T, 4, 4)."""
        self.add_instances(place, group, matrices[None] if matrices.ndim == 2 else matrices[:, None])

    def add_instancer(self, instancer: UsdGeom.PointInstancer, place, outer: np.ndarray) -> None:
        if outer.ndim == 3:
            self.say("warning", f"{instancer.GetPath()}: it moves as a whole; it stands as at the start of the shutter")
            outer = outer[0]
        for prim, matrices, mine in self.placements(instancer, self.say):
            group = self.prototype_group(prim, instancer.GetPrim())
            if group is not None:
                self.add_instances(place, group, in_place(outer, matrices, mine))
                if place is self.scene:
                    self.instanced.add_prototype(self, prim, lambda m=matrices, i=mine: outer @ m[i])

    def placements(
        self, instancer: UsdGeom.PointInstancer, say: Say
    ) -> Iterator[tuple[Usd.Prim, np.ndarray, np.ndarray]]:
        """Prototypes, with all matrices of the instancer and which of them are the prototype's. The prototype's own
        matrix is in them; what is above it counts for nothing."""
        path, time = instancer.GetPath(), self.times[0]
        targets = instancer.GetPrototypesRel().GetForwardedTargets()
        indices = instancer.GetProtoIndicesAttr().Get(time)
        if not targets or indices is None:
            return
        indices = np.asarray(indices)
        # Row vectors; what is masked out is left out.
        found = instancer.ComputeInstanceTransformsAtTime(
            time, time, UsdGeom.PointInstancer.IncludeProtoXform, UsdGeom.PointInstancer.ApplyMask
        )
        mask = np.asarray(instancer.ComputeMaskAtTime(time), dtype=bool)
        matrices = np.asarray(found, dtype=np.float64).reshape(-1, 4, 4).transpose(0, 2, 1)
        indices = indices[mask] if len(mask) == len(indices) else indices
        if len(matrices) != len(indices):
            say("error", f"{path}: {len(indices)} protoIndices, but {len(matrices)} places. It is left out")
            return
        if (bad := (indices < 0) | (indices >= len(targets))).any():
            say("error", f"{path}: {int(bad.sum())} protoIndices name no prototype. Those are left out")
            indices, matrices = indices[~bad], matrices[~bad]
        for index, target in enumerate(targets):
            mine = np.flatnonzero(indices == index)
            prim = self.stage.GetPrimAtPath(target)
            if len(mine) and prim:
                yield prim, matrices, mine
            elif len(mine):
                say("error", f"{path}: its prototype {target} is not there")

    def prototype_group(self, prim: Usd.Prim, instancer: Usd.Prim) -> kanuka.Group | None:
        """None: it is in itself."""
        path = f"{prim.GetPath()} as a prototype"
        if path in self._on_the_way:
            self.say("error", f"{prim.GetPath()}: the prototype is in itself. It is left out there")
            return None
        at = self.links.path_in(instancer, prim)
        key = path, self.links.signature(at, prim)
        if key not in self._groups:
            self._on_the_way.add(path)
            with self.links.placed(prim.GetPath(), at):
                self.prepare(prim)
                group = self.scene.add_group(str(prim.GetPath()))
                if prim.IsInstance():
                    group.add_instances(self.group_of(prim.GetPrototype(), prim), np.eye(4)[None])
                else:
                    self.fill(group, prim)
            self._groups[key] = group
            self._on_the_way.discard(path)
        return self._groups[key]


def in_place(outer: np.ndarray, matrices: np.ndarray, which: np.ndarray) -> np.ndarray:
    """(N, 3, 4) float32 of outer @ matrices[which], some at a time: there may be millions."""
    made = np.empty((len(which), 3, 4), dtype=np.float32)
    step = 1 << 16
    for first in range(0, len(which), step):
        made[first : first + step] = (outer @ matrices[which[first : first + step]])[:, :3]
    return made


def read(
    scene: kanuka.Scene,
    path: str,
    say: Say,
    *,
    frame: float | None,
    camera: str,
    variants: Mapping[str, str],
    mask: Sequence[str],
    purposes: Sequence[str],
    resolution: tuple[int, int] | None = None,
    color_space: str = "",
    product: Sequence[str] = (),
    moving: Callable[[list[kanuka.Camera]], object] = kanuka.Camera.moving,
) -> None:
    """Into an empty scene: the stage at a frame (None: its first), seen by `camera` (empty: its first one), with the
    settings of the first `product` and what all of them show."""
    stage = open_stage(path, say, variants, mask, product)
    time = first_frame(stage) if frame is None else frame
    settings = settings_of(stage, say)
    scene.options.color_space = rendering_space(stage, color_space, say)
    wanted = chosen_products(stage, settings, product, say, path)
    made = [product_of(prim, settings, time, say) for prim in (wanted if product else wanted[:1])]
    settings = made[0].settings if made else settings
    settings = replace(settings, resolution=resolution or settings.resolution)
    chosen = find_camera(stage, camera, settings.camera, path, say)
    opened, closed = shutter(chosen, time) if settings.motion_blur else (0.0, 0.0)
    times = [Usd.TimeCode(time + opened)] + ([Usd.TimeCode(time + closed)] if closed > opened else [])
    pose(stage, times)
    shown = tuple(dict.fromkeys(each for one in made for each in one.shown))
    reader = Reader(stage, scene, say, times, tuple(purposes or settings.purposes or PURPOSES), shown)
    if len(times) > 1:
        scene.options.shutter = (0, 1)
    scene.options.shader_path = [*scene.options.shader_path, str(reader.files.folder)]
    scene.options.texture_path = [str(Path(path).resolve().parent)]
    reader.read()
    settle(scene, stage, reader, chosen, settings, time, say, moving)


def pose(stage: Usd.Stage, times: list[Usd.TimeCode]) -> None:
    """Skins of UsdSkel, as points of their meshes at the times of the shutter; in a layer that goes with the stage."""
    if not any(prim.IsA(UsdSkel.Root) for prim in stage.Traverse()):
        return
    with Usd.EditContext(stage, stage.GetSessionLayer()):
        UsdSkel.BakeSkinning(stage.Traverse(), Gf.Interval(times[0].GetValue(), times[-1].GetValue()))


def find_camera(stage: Usd.Stage, wanted: str, usual: str, path: str, say: Say) -> Usd.Prim | None:
    """The one that is wanted, else that of the settings, else the first."""
    everyone = [p for p in stage.Traverse(Usd.TraverseInstanceProxies()) if p.IsA(UsdGeom.Camera)]
    for name in filter(None, (wanted, usual)):
        for prim in everyone:
            if name in (str(prim.GetPath()), prim.GetName()):
                return prim
        names = ", ".join(str(p.GetPath()) for p in everyone) or "none"
        if wanted:
            raise input_error(f'there is no camera "{wanted}"; it has {names}', path)
        say("warning", f"{usual}: the settings' camera is not there; the stage has {names}")
    return everyone[0] if everyone else None


def shutter(camera: Usd.Prim | None, time: float) -> tuple[float, float]:
    """Relative to the frame, in time codes."""
    if camera is None:
        return 0.0, 0.0
    schema = UsdGeom.Camera(camera)
    opened, closed = schema.GetShutterOpenAttr().Get(time), schema.GetShutterCloseAttr().Get(time)
    return float(opened or 0), float(closed or 0)


def settle(
    scene: kanuka.Scene,
    stage: Usd.Stage,
    reader: Reader,
    camera: Usd.Prim | None,
    settings: Settings,
    time: float,
    say: Say,
    moving: Callable[[list[kanuka.Camera]], object],
) -> None:
    """Camera, picture and light, where the stage has none as well."""
    world = reader.world
    if camera is not None:
        matrices = reader.transforms.within(camera, stage.GetPseudoRoot())
        if not (np.abs(np.linalg.det(matrices)) > 1e-12).all():
            say("error", f"{camera.GetPath()}: it is scaled to nothing; the stage is seen from the front instead")
            camera = None
    if camera is not None:
        schema = UsdGeom.Camera(camera)
        across, up = schema.GetHorizontalApertureAttr().Get(time), schema.GetVerticalApertureAttr().Get(time)
        aspect = across / up if across > 0 and up > 0 else 0
        if not 1 / 64 <= aspect <= 64:
            say("warning", f"{camera.GetPath()}: apertures of {across:g} by {up:g} make no picture; 16 by 9 stands in")
            aspect = cameras.DEFAULT_ASPECT
        height = max(1, round(cameras.DEFAULT_WIDTH / aspect))
        scene.resolution = settings.resolution or (cameras.DEFAULT_WIDTH, height)
        placed = world @ reader.transforms.within(camera, stage.GetPseudoRoot())
        size = scene.resolution
        if settings.conform == UsdRender.Tokens.adjustPixelAspectRatio:
            settings = replace(settings, pixel_aspect=aspect * size[1] / size[0])
        slices = [placed] if placed.ndim == 2 else list(placed)
        made = [
            cameras.camera_of(camera, matrix, at, size[0] / size[1] * settings.pixel_aspect, settings)
            for matrix, at in zip(slices, reader.times, strict=False)
        ]
        scene.camera = made[0] if len(made) == 1 else moving(made)
        scene.options.exposure_gain = float(schema.ComputeLinearExposureScale(reader.times[0]))
    else:
        box = UsdGeom.BBoxCache(reader.times[0], [*reader.purposes], useExtentsHint=True)
        bounds = box.ComputeWorldBound(stage.GetPseudoRoot()).ComputeAlignedRange()
        scene.resolution = settings.resolution or (cameras.DEFAULT_WIDTH, 540)
        if bounds.IsEmpty():
            say("warning", "the stage has nothing to look at")
            scene.camera = kanuka.Camera((0, 0, 5), (0, 0, 0))
        else:
            corners = np.array([bounds.GetCorner(i) for i in range(8)]) @ world[:3, :3].T + world[:3, 3]
            width, height = scene.resolution
            scene.camera = standins.camera(corners, width / height * settings.pixel_aspect)
            say("info", "the stage has no camera: it is seen from the front, so that all of it is in the picture")
    scene.options.pixel_aspect = settings.pixel_aspect
    if settings.crop:
        scene.options.crop = settings.crop
    if not reader.lights and not reader.mesh_lights.number:
        standins.lights(scene)
        say("info", "the stage has no lights: it is lit by a white sky and a sun")
