"""Reads what is in a stage: walks its prims once, in order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux

import kanuka
from kanuka.looks.files import Files

from . import draw_modes, light_limits, volumes
from .adders import ADDERS
from .arrays import primvar
from .geometry import Shapes
from .instanced_lights import InstancedLights, Places, instanced
from .instances import Instancer, Variables, differences_of, together_of
from .items import IDENTITY, Above, Item, above_of, bindings_of, handed_down, moved, place_all
from .lights import ADDERS as LIGHTS
from .lights import Light, portals, stage_lights
from .linking import Links
from .materials import Materials
from .mesh_lights import MeshLights
from .motion import Shutter
from .render_vars import Shown
from .shaped_lights import MEMBERS
from .shaping import Shapings
from .spaces import Spaces
from .stage import Gathered, Say
from .transforms import Transforms, at_start, stage_matrix

PURPOSES = ("default", "render")
# Prims that are read elsewhere, with all that is below them.
CLOSED = frozenset({"Material", "Shader", "NodeGraph", "GeomSubset", "LightFilter", "SpatialAudio"}) | frozenset(
    {"RenderSettings", "RenderProduct", "RenderVar", "SkelAnimation", "BlendShape"} | volumes.FIELDS
)
# Those that hold others, or are read elsewhere.
OPEN = frozenset({"", "Xform", "Scope", "Camera", "SkelRoot", "Skeleton", "GeometryLight"})
Place = kanuka.Scene | kanuka.Group
BATCH = 256  # shapes that are added together
# Groups of a prototype may differ by values which instances of one group can have as well, if these hold no more points
# together; or are no more than are exact as variables of instances.
EXACT_POINTS, LEAST_EXACT = 250_000, 8
PROXIES = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)
LOOSE = Usd.TraverseInstanceProxies(Usd.PrimIsActive & Usd.PrimIsLoaded)


@dataclass
class Held:
    """A group of what is at and below a prim, with its lights, which groups of Kanuka's have not. `normalized`: a light
    in it whose brightness goes by the area of its mesh."""

    group: kanuka.Group
    path: Sdf.Path
    lights: Places
    normalized: str
    asked: frozenset[str] = frozenset()  # names of primvars that its materials read


@dataclass
class Instances:
    """Of a group: (N, 3, 4), or (T, N, 3, 4) of what moves. `path`: that of the prim that is instanced, natively; empty
    where an instancer places its prototype."""

    held: Held
    matrices: np.ndarray
    path: Sdf.Path = Sdf.Path.emptyPath
    differences: dict[str, np.ndarray | bool] = field(default_factory=dict)

    def lights(self) -> Places:
        return instanced(self.held.lights, self.matrices, self.held.path, self.path or self.held.path)


def joined(instances: Sequence[Instances]) -> list[Instances]:
    """Native ones of a group, which come one by one, are added at once: they take less memory, and time."""
    made: dict[tuple, list[Instances]] = {}
    for k, each in enumerate(instances):
        kinds = tuple(sorted(each.differences)), tuple(sorted(each.differences.get("primvars", ())))
        native = each.path != Sdf.Path.emptyPath
        of = (id(each.held), each.matrices.shape, kinds) if native else (k,)
        made.setdefault(of, []).append(each)
    return [
        each[0]
        if len(each) == 1
        else replace(
            each[0],
            matrices=np.concatenate([one.matrices for one in each], axis=-3),
            differences=together_of([one.differences for one in each]),
        )
        for each in made.values()
    ]


@dataclass
class Found:
    """What is below a prim, in the order of the stage."""

    items: list[Item] = field(default_factory=list)
    lights: Places = field(default_factory=list)
    instances: list[Instances] = field(default_factory=list)
    models: list[Item] = field(default_factory=list)  # that are drawn in another way


@dataclass
class Family:
    """Groups of a prototype. They differ by what they inherit: by values of primvars that their materials ask for.
    `shared`: those whose instances have such values as variables; they differ by others."""

    asked: set[str] = field(default_factory=set)
    own_values: set[str] = field(default_factory=set)  # names of primvars that solids in it have themselves
    groups: dict[tuple, Held] = field(default_factory=dict)
    shared: dict[tuple, Held] = field(default_factory=dict)
    points: int = 1  # of one of its groups

    @property
    def most_exact(self) -> int:
        return max(LEAST_EXACT, EXACT_POINTS // self.points)


@dataclass
class Reader:
    """Reads a stage into a scene. Prims of groups (prototypes) are in the space of the prototype."""

    stage: Usd.Stage
    scene: kanuka.Scene
    say: Say
    shutter: Shutter
    spaces: Spaces
    purposes: Sequence[str] = PURPOSES
    shown: Sequence[Shown] = ()
    lights: int = 0
    volumes: list[Usd.Prim] = field(default_factory=list)
    _families: dict[tuple, Family] = field(default_factory=dict)
    _on_the_way: set[Sdf.Path] = field(default_factory=set)
    gathered: Gathered = field(default_factory=Gathered)

    def __post_init__(self) -> None:
        self.files = Files()
        frame, lights = self.shutter.frame, stage_lights(self.stage)
        self.materials = Materials(self.say, self.files, frame, self.spaces)
        self.portals = portals(lights)
        self.shapings = Shapings(frame, self.files, self.spaces)
        self.mesh_lights = MeshLights(lights, self.shapings, self.spaces, self.files, self.say)
        self.links = Links(lights, frame, self.say)
        light_limits.tell(lights, frame, self.say, self.gathered)
        self.shapes = Shapes(
            self.materials,
            self.say,
            self.shutter,
            self.links,
            self.mesh_lights,
            self.spaces,
            self.gathered,
            ADDERS,
            self.shown,
        )
        self.transforms = Transforms(frame, self.shutter.times)
        self.instanced = InstancedLights()
        self.instancing = bool(self.stage.GetPrototypes())
        self.world = stage_matrix(self.stage)
        self.draw_modes = draw_modes.DrawModes(self.shapes, str(UsdGeom.GetStageUpAxis(self.stage)))

    def read(self) -> None:
        root = Above(matrices=(Gf.Matrix4d(self.world.T),))
        self.spaces.on_prims = False
        self.fill(self.scene, self.collect(self.stage.GetPseudoRoot(), root, self.scene))
        if self.volumes:
            self.say("warning", volumes.told(self.volumes, self.shutter.frame))
        self.gathered.tell(self.say)

    def fill(self, place: Place, found: Found) -> None:
        place_all([*found.items, *found.models])
        self.shapes.add(place, found.items)
        for model in found.models:
            self.draw_modes.draw(place, model)
        for each in found.instances:
            self.tell_of(each)
        for each in joined(found.instances):
            place.add_instances(each.held.group, each.matrices, **each.differences)
        if place is self.scene:  # lights of groups are added with their instances
            for prim, matrices in found.lights:
                self.add_light(prim, matrices[0], self.say)
            for each in found.instances:
                self.instanced.add(self, each.lights())

    def tell_of(self, each: Instances) -> None:
        if each.matrices.ndim == 4 and len(each.matrices) > 1 and each.differences.pop("unique", False):
            self.gathered.note("primvars:kanuka:unique: what moves stays instances", str(each.path or each.held.path))
        if each.held.normalized and (np.abs(np.linalg.det(each.matrices[..., :3]) - 1) > 1e-3).any():
            text = "normalize divides by the area of its mesh in the prototype, whose instances are scaled"
            self.gathered.note(text, each.held.normalized)

    def unknown(self, kind: str, prim: Usd.Prim) -> None:
        self.gathered.note(f"prims of type {kind} are not read yet", str(prim.GetPath()))

    # ---- the walk

    def collect(
        self, top: Usd.Prim, root: Above, place: Place | None = None, without: frozenset[str] = frozenset()
    ) -> Found:
        """All that is at and below `top`. The matrix of `top` itself is in `root` already. Groups of what is instanced
        below are made on the way: a group holds instances of groups made before it. With a place what is found goes
        there on the way too, and only the rest comes back: less waits in memory. `without`: primvars of `top` that
        nothing below inherits."""
        found = Found()
        waiting, inside = [(top, root)], False
        usual = top.IsPseudoRoot() or (top.IsDefined() and not top.IsAbstract())
        while waiting:
            prim, above = waiting.pop()
            kind = prim.GetTypeName()
            if kind in CLOSED:
                continue
            names = frozenset(prim.GetAuthoredPropertyNames())
            if "visibility" in names and self.hidden(prim):
                continue
            self.spaces.on_prims |= "colorSpace:name" in names
            here = self.enter(prim, names, above, root if inside else None)
            if here.draw_mode != draw_modes.DEFAULT and draw_modes.applies(prim, names):
                if self.shows(here):
                    found.models.append(Item(prim, str(prim.GetPath()), kind, names, here))
                continue
            if inside and self.instancing and prim.IsInstance():
                self.place_instance(found, prim, names, here)
                continue
            inside = True
            if kind == "PointInstancer":
                if self.shows(here):
                    self.place_instancer(found, prim, here, (top, root))
                continue
            children = prim.GetFilteredChildren(PROXIES) if usual else loose_children(prim)
            if self.shows(here):
                self.meet(found, prim, kind, names, here, bool(children))
            if place is not None and len(found.items) >= BATCH:
                self.fill(place, found)
                found = Found()
            if children:
                here = handed_down(prim, names, here)
                here = without_primvars(here, without) if without and prim == top else here
                waiting.extend((child, here) for child in reversed(children))
        return found

    def shows(self, here: Above) -> bool:
        return (here.purpose or "default") in self.purposes

    def hidden(self, prim: Usd.Prim) -> bool:
        return prim.GetAttribute("visibility").Get(self.shutter.frame) == UsdGeom.Tokens.invisible

    def enter(self, prim: Usd.Prim, names: frozenset[str], above: Above, root: Above | None) -> Above:
        """What a prim inherits, with its own; what is handed_down() is not yet in it. `root`: what prims that reset the
        stack of transformations are relative to; None: the prim stands where it is."""
        matrices, purpose, draw_mode = above.matrices, above.purpose, above.draw_mode
        if root is not None and "xformOpOrder" in names:
            steps, resets = self.transforms.steps(prim)
            matrices = moved(steps, root.matrices if resets else above.matrices)
        if "purpose" in names:
            purpose = str(prim.GetAttribute("purpose").Get())
        if "model:drawMode" in names:
            mode = str(prim.GetAttribute("model:drawMode").Get())
            draw_mode = draw_mode if mode == draw_modes.INHERITED else mode
        return Above(matrices, purpose, draw_mode, above.primvars, above.bindings)

    def meet(self, found: Found, prim: Usd.Prim, kind: str, names, here: Above, children: bool) -> None:
        if kind in OPEN:
            return
        light = prim.HasAPI(UsdLux.LightAPI)
        if kind in ADDERS:
            if light and kind != "Mesh":
                self.say("warning", f"{prim.GetPath()}: of shapes only meshes are lights: it does not shine")
            found.items.append(Item(prim, str(prim.GetPath()), kind, names, here, children, light))
        elif kind == "Volume":
            self.volumes.append(prim)
        elif light:
            found.lights.append((prim, at_start(here.columns)[None]))
        elif not kind.endswith("LightFilter"):
            self.unknown(kind, prim)

    def add_light(self, prim: Usd.Prim, matrix: np.ndarray, say: Say, members: int = MEMBERS) -> None:
        kind, path = str(prim.GetTypeName()), str(prim.GetPath())
        if kind == "PortalLight" and path not in self.portals:
            return
        if kind not in LIGHTS:
            self.unknown(kind, prim)
            return
        solid, frame = not self.links.chooses_shadows(prim), self.shutter.frame
        try:
            light = Light(self.scene, prim, matrix, frame, self.files, self.shapings, self.spaces, say, solid, members)
            LIGHTS[kind](light)
        except ValueError as error:
            say("error", f"{path}: {error}. It is left out")
        self.lights += 1

    # ---- instances

    def place_instance(self, found: Found, prim: Usd.Prim, names: frozenset[str], here: Above) -> None:
        inherited = handed_down(prim, names, here)
        key = (prim.GetPrototype().GetPath(), here.purpose, here.draw_mode, bindings_of(inherited))
        at, above = self.links.path_of(prim), here._replace(matrices=(IDENTITY,))
        said = any(name.startswith("primvars:kanuka:") for name in names)
        differences = differences_of(prim, self.shutter.frame, 1, self.say) if said else {}
        held, primvars = self.group_of_many(key, prim, at, above, inherited)
        differences |= {"primvars": primvars} if primvars else {}
        found.instances.append(Instances(held, here.columns[..., None, :3, :], prim.GetPath(), differences))

    def place_instancer(self, found: Found, prim: Usd.Prim, here: Above, root: tuple[Usd.Prim, Above]) -> None:
        # What prototypes hold is made first: places of many take much memory.
        variables = Variables(prim, self.shutter.frame, self.spaces.colors, self.gathered)
        for placed in Instancer(prim, here, root, self.shutter, self.transforms, self.say).placed():
            if (held := self.prototype_group(placed.prototype, prim)) is not None:
                named = {name: self.shapes.named[name] for name in sorted(held.asked & set(self.shapes.named))}
                below = placed.prototype.GetPath().HasPrefix(prim.GetPath())
                differences = placed.differences
                if primvars := variables.of(placed.which, named, below):
                    differences = differences | {"primvars": primvars}
                found.instances.append(Instances(held, placed.matrices, differences=differences))

    def prototype_group(self, prim: Usd.Prim, instancer: Usd.Prim) -> Held | None:
        """None: it is in itself."""
        path = prim.GetPath()
        if path in self._on_the_way:
            self.say("error", f"{path}: the prototype is in itself. It is left out there")
            return None
        above = above_of(prim, self.shutter.frame)
        self.spaces.on_prims = True  # what is above it may be out of the walk's way
        self._on_the_way.add(path)
        held = self.group_of(("prototype", path), prim, self.links.path_in(instancer, prim), above, above)
        self._on_the_way.discard(path)
        return held

    def group_of(self, key: tuple, prim: Usd.Prim, at: Sdf.Path, above: Above, inherited: Above) -> Held:
        """What a prototype holds, added once for each way in which it is linked with lights, being `at` a path, and for
        each set of values that its prims inherit."""
        return self.group_in(self.family_of(key, prim, at), prim, at, above, inherited)

    def group_in(self, family: Family, prim: Usd.Prim, at: Sdf.Path, above: Above, inherited: Above) -> Held:
        if (values := family_values(family, inherited, self.shutter.frame)) not in family.groups:
            held = self.hold_of(family, prim, at, above)
            family.groups[family_values(family, inherited, self.shutter.frame)] = held
            return held
        self.note_reads(family)
        return family.groups[values]

    def group_of_many(
        self, key: tuple, prim: Usd.Prim, at: Sdf.Path, above: Above, inherited: Above
    ) -> tuple[Held, dict[str, np.ndarray]]:
        """The same of a native instance: what is in it may inherit other values from each. Where they are too many
        there is one group more, whose instances have them as variables, as Scene.add_instances() takes these."""
        family = self.family_of(key, prim, at)
        values = family_values(family, inherited, self.shutter.frame)
        if values in family.groups or len(family.groups) < family.most_exact or prim.GetTypeName() in ADDERS:
            return self.group_in(family, prim, at, above, inherited), {}
        own = self.variables(family, inherited)
        if not own:
            return self.group_in(family, prim, at, above, inherited), {}
        others = tuple(each for each in values if each[0] not in own)
        if others not in family.shared:
            without = frozenset(family.asked) - {name for name, _ in others}
            family.shared[others] = self.hold_of(family, prim, at, without_primvars(above, without), without)
        self.note_reads(family)
        return family.shared[others], {key: value for each in own.values() for key, value in each.items()}

    def variables(self, family: Family, inherited: Above) -> dict[str, dict[str, np.ndarray]]:
        """Of the primvars that its materials ask for, those that are inherited and of one value, by their names."""
        found: dict[str, dict[str, np.ndarray]] = {}
        for have in inherited.primvars:
            name = str(have.GetPrimvarName())
            # Variables of instances would go over values of the material, which own ones of solids are.
            if name not in family.asked & set(self.shapes.named) or name in family.own_values:
                continue
            ours, kind = self.shapes.named[name]
            made = primvar(have, ours, kind, self.shutter.frame, self.spaces.colors)
            if made and all(len(values) == 1 for values in made.values()):
                found[name] = {key.split(" ", 1)[1]: values for key, values in made.items()}
        return found

    def family_of(self, key: tuple, prim: Usd.Prim, at: Sdf.Path) -> Family:
        return self._families.setdefault((*key, self.links.signature(at, prim)), Family())

    def hold_of(
        self, family: Family, prim: Usd.Prim, at: Sdf.Path, above: Above, without: frozenset[str] = frozenset()
    ) -> Held:
        shapes = self.shapes
        outside = shapes.asked, shapes.own_values
        points, shapes.asked, shapes.own_values = shapes.points, set(), set()
        held = self.hold(prim, at, above, without)
        family.points = max(family.points, shapes.points - points)
        family.asked |= shapes.asked
        family.own_values |= shapes.own_values
        shapes.asked, shapes.own_values = outside
        self.note_reads(family)
        return held

    def note_reads(self, family: Family) -> None:
        """What holds it reads the same."""
        self.shapes.asked |= family.asked
        self.shapes.own_values |= family.own_values

    def hold(self, prim: Usd.Prim, at: Sdf.Path, above: Above, without: frozenset[str] = frozenset()) -> Held:
        with self.links.placed(prim.GetPath(), at):
            found = self.collect(prim, above, without=without)
            group = self.scene.add_group(str(prim.GetPath()))
            self.mesh_lights.last_normalized = ""
            self.fill(group, found)
        inside = [light for each in found.instances for light in each.lights()]
        asked = frozenset(self.shapes.asked)
        return Held(group, prim.GetPath(), found.lights + inside, self.mesh_lights.last_normalized, asked)


def loose_children(prim: Usd.Prim) -> list[Usd.Prim]:
    """Of prototypes that are below a class or an over, so that nothing else renders them (UsdGeomPointInstancer)."""
    found = prim.GetFilteredChildren(LOOSE)
    return [child for child in found if child.GetSpecifier() == Sdf.SpecifierDef]


def without_primvars(above: Above, names: frozenset[str]) -> Above:
    return above._replace(primvars=tuple(p for p in above.primvars if str(p.GetPrimvarName()) not in names))


def family_values(family: Family, above: Above, frame: Usd.TimeCode) -> tuple:
    """Of the primvars that its materials ask for, those that are inherited."""
    asked = [p for p in above.primvars if p.GetPrimvarName() in family.asked]
    return tuple(sorted((str(p.GetPrimvarName()), str(p.ComputeFlattened(frame))) for p in asked))
