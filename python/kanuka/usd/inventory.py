"""What a stage holds, without reading it into a scene: for people, and for scripts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdLux, UsdShade

from kanuka.looks.files import Files

from . import color_config
from .adders import ADDERS
from .materials import SURFACES, Materials, identifier_of, surfaces_of
from .reader import CLOSED, OPEN
from .render_products import chosen, product_of
from .settings import settings_of
from .spaces import Spaces, rendering_space
from .stage import Say, silent

WIDTH = 16  # children of one prim that are named; the others are counted
MATERIALS = 256  # that are looked into: each becomes a shader
LINES = 100  # of a tree whose depth is not asked for
UNTYPED = "no type"


@dataclass
class Tally:
    """How many there are, and the first one's path."""

    count: int = 0
    first: str = ""

    def add(self, path: str) -> None:
        self.count, self.first = self.count + 1, self.first or path


@dataclass
class Inventory:
    """Gathers it prim by prim, each visited once: stages may have millions."""

    stage: Usd.Stage
    time: Usd.TimeCode
    counts: Counter = field(default_factory=Counter)
    instances: dict[str, Tally] = field(default_factory=dict)  # of prototypes
    instancers: list[Usd.Prim] = field(default_factory=list)
    materials: list[Usd.Prim] = field(default_factory=list)
    shaders: list[Usd.Prim] = field(default_factory=list)
    lights: list[Usd.Prim] = field(default_factory=list)
    cameras: list[Usd.Prim] = field(default_factory=list)
    variants: list[Usd.Prim] = field(default_factory=list)
    unread: dict[str, Tally] = field(default_factory=dict)
    _lists: dict[str, list[Usd.Prim] | None] = field(default_factory=dict)

    def visit(self, prim: Usd.Prim) -> str:
        """Its type."""
        kind = prim.GetTypeName() or UNTYPED
        self.counts[kind] += 1
        if kind not in self._lists:
            self._lists[kind] = self._list_of(prim)
        mine = self._lists[kind]
        if mine is not None:
            mine.append(prim)
        elif kind == "Mesh" and prim.HasAPI(UsdLux.LightAPI):
            self.lights.append(prim)
        elif kind in self.unread:
            self.unread[kind].add(self.path(prim))
        if prim.IsInstance():
            self.instances.setdefault(str(prim.GetPrototype().GetPath()), Tally()).add(self.path(prim))
        if prim.HasVariantSets():
            self.variants.append(prim)
        return kind

    def _list_of(self, prim: Usd.Prim) -> list[Usd.Prim] | None:
        """Where prims of its type are kept."""
        kind = str(prim.GetTypeName())
        for schema, mine in (
            (UsdShade.Material, self.materials),
            (UsdShade.Shader, self.shaders),
            (UsdGeom.Camera, self.cameras),
            (UsdGeom.PointInstancer, self.instancers),
        ):
            if prim.IsA(schema):
                return mine
        if prim.HasAPI(UsdLux.LightAPI) and kind != "Mesh":
            return self.lights
        if kind not in CLOSED and kind not in OPEN and kind not in ADDERS:
            self.unread[kind] = Tally()
        return None

    def path(self, prim: Usd.Prim) -> str:
        """In the stage: what lies in a prototype is told of the first instance."""
        path = prim.GetPath()
        if prim.IsInPrototype():
            root = path.GetPrefixes()[0]
            if of := self.instances.get(str(root)):
                return of.first + str(path)[len(str(root)) :]
        return str(path)

    def tree(self, prim: Usd.Prim, depth: int) -> dict:
        """Names, types and children down to a depth; below, and beyond the first children, prims are counted."""
        found: dict = {} if prim.IsPseudoRoot() else {"name": prim.GetName(), "type": self.visit(prim)}
        if prim.IsInstance():
            return found | {"instance": True}
        children = prim.GetChildren()
        # A line that counts one child takes as much room as the child.
        named = children[: WIDTH + (len(children) == WIDTH + 1)] if depth > 0 else []
        if named:
            found["children"] = [self.tree(child, depth - 1) for child in named]
        more = Counter(self.visit(each) for child in children[len(named) :] for each in Usd.PrimRange(child))
        if more:
            found["more" if named else "below"] = dict(more.most_common())
        return found

    def prototypes(self) -> Iterator[dict]:
        """Each is walked once; instances in them are found on the way."""
        done: set[str] = set()
        while waiting := [key for key in self.instances if key not in done]:
            for key in waiting:
                done.add(key)
                inside = Usd.PrimRange(self.stage.GetPrimAtPath(key))
                held = Counter(self.visit(prim) for prim in inside if prim.GetPath() != key)
                yield {"key": key, "holds": dict(held.most_common())}


def fitting(stage: Usd.Stage) -> int:
    """The depth of the deepest tree that is no longer than a page or two."""
    level, depth, lines = [stage.GetPseudoRoot()], 0, 0
    while level:
        level = [child for prim in level for child in prim.GetChildren()[:WIDTH]]
        lines += len(level)
        if lines > LINES and depth:
            break
        depth += 1
    return depth


def inventory(stage: Usd.Stage, time: float, depth: int | None, say: Say, file: str) -> dict:
    held = Inventory(stage, Usd.TimeCode(time))
    tree = held.tree(stage.GetPseudoRoot(), fitting(stage) if depth is None else depth)
    in_stage = dict(held.counts.most_common())
    prototypes = list(held.prototypes())
    settings, config = settings_of(stage, say), color_config.chosen(stage, say)
    products = [product_of(prim, settings, time, say) for prim in chosen(stage, settings, (), say, file)]
    ranged = stage.HasAuthoredTimeCodeRange()
    return {
        "up_axis": str(UsdGeom.GetStageUpAxis(stage)),
        "meters_per_unit": UsdGeom.GetStageMetersPerUnit(stage),
        "frames": [stage.GetStartTimeCode(), stage.GetEndTimeCode()] if ranged else None,
        "frames_per_second": stage.GetFramesPerSecond(),
        "prims": in_stage,
        "tree": tree,
        "instances": [asdict(held.instances[each["key"]]) | {"holds": each["holds"]} for each in prototypes],
        "point_instancers": [instancer(held, prim) for prim in held.instancers],
        "materials": materials(held, config),
        "lights": [light(held, prim) for prim in held.lights],
        "cameras": [camera(held, prim) for prim in held.cameras],
        "settings": asdict(settings) | {"path": str(stage.GetMetadata("renderSettingsPrimPath") or "")},
        "products": [product(each) for each in products],
        "variants": [each for prim in held.variants for each in variants(held, prim)],
        "missing_textures": missing(held),
        "unread": {kind: asdict(tally) for kind, tally in held.unread.items()},
    }


def product(each) -> dict:
    settings = each.settings
    return {
        "path": each.path,
        "name": each.name,
        "resolution": settings.resolution,
        "camera": settings.camera,
        "layers": list(each.layers),
    }


def instancer(held: Inventory, prim: Usd.Prim) -> dict:
    schema = UsdGeom.PointInstancer(prim)
    targets = schema.GetPrototypesRel().GetForwardedTargets()
    indices = np.asarray(schema.GetProtoIndicesAttr().Get(held.time) or (), dtype=np.int64).reshape(-1)
    of_each = np.bincount(indices[(indices >= 0) & (indices < len(targets))], minlength=len(targets))
    prototypes = {str(target): int(n) for target, n in zip(targets, of_each, strict=True)}
    return {"path": held.path(prim), "count": len(indices), "prototypes": prototypes}


def materials(held: Inventory, config: color_config.Configuration | None) -> list[dict]:
    """What is not read of a material is what its reader tells."""
    told: list[str] = []

    def say(severity: str, text: str) -> None:
        told.append(text)

    spaces = Spaces(say, rendering_space(held.stage, "", silent, config), config, converts=False)
    reader = Materials(say, Files(), held.time, spaces)
    found = []
    for k, prim in enumerate(held.materials):
        material = UsdShade.Material(prim)
        told.clear()
        if k < MATERIALS:
            try:
                reader.of(material)
            except (ValueError, TypeError) as error:
                told.append(f"{prim.GetPath()}: {error}")
        surface = {"path": held.path(prim), "surface": surface_of(material), "looked_into": k < MATERIALS}
        found.append(surface | {"not_read": list(dict.fromkeys(told))})
    return found


def surface_of(material: UsdShade.Material) -> str:
    """The one that is read, else the first that there is."""
    seen = [identifier_of(shader) for shader in surfaces_of(material)]
    return next((each for each in seen if each in SURFACES), seen[0] if seen else "")


def light(held: Inventory, prim: Usd.Prim) -> dict:
    api = UsdLux.LightAPI(prim)
    values = {
        "intensity": api.GetIntensityAttr().Get(held.time),
        "exposure": api.GetExposureAttr().Get(held.time),
        "color": list(api.GetColorAttr().Get(held.time) or (1, 1, 1)),
        "normalize": bool(api.GetNormalizeAttr().Get(held.time)),
    }
    return {"path": held.path(prim), "type": str(prim.GetTypeName())} | values


def camera(held: Inventory, prim: Usd.Prim) -> dict:
    schema = UsdGeom.Camera(prim)
    return {
        "path": held.path(prim),
        "projection": str(schema.GetProjectionAttr().Get(held.time)),
        "focal_length": schema.GetFocalLengthAttr().Get(held.time),
        "aperture": [
            schema.GetHorizontalApertureAttr().Get(held.time),
            schema.GetVerticalApertureAttr().Get(held.time),
        ],
        "f_stop": schema.GetFStopAttr().Get(held.time),
    }


def variants(held: Inventory, prim: Usd.Prim) -> Iterator[dict]:
    sets = prim.GetVariantSets()
    for name in sets.GetNames():
        mine = sets.GetVariantSet(name)
        yield {
            "path": held.path(prim),
            "set": name,
            "chosen": mine.GetVariantSelection(),
            "choices": list(mine.GetVariantNames()),
        }


def missing(held: Inventory) -> list[dict]:
    """Files that inputs of shaders and lights name, and that are not found."""
    found = []
    for prim in (*held.shaders, *held.lights):
        for attribute in prim.GetAttributes():
            if attribute.GetTypeName() != Sdf.ValueTypeNames.Asset or not attribute.GetName().startswith("inputs:"):
                continue
            asset = attribute.Get(held.time)
            if asset is None or not asset.path or asset.resolvedPath:
                continue
            if UsdShade.UdimUtils.IsUdimIdentifier(asset.path):
                layer = next((spec.layer for spec in attribute.GetPropertyStack(held.time)), None)
                if UsdShade.UdimUtils.ResolveUdimTilePaths(asset.path, layer):
                    continue
            found.append({"path": f"{held.path(prim)}.{attribute.GetName()}", "file": asset.path})
    return found
