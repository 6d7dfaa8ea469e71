"""UsdGeomModelAPI's draw modes: models as their axes, their boxes or textured cards."""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from pxr import Kind, Sdf, Usd, UsdGeom, UsdShade

from kanuka.looks.rsl import halves

from .geometry import Shapes
from .items import Item
from .picture_headers import world_to_screen

DEFAULT, INHERITED = "default", "inherited"
MODES = ("origin", "bounds", "cards")
PURPOSES = [UsdGeom.Tokens.default_, UsdGeom.Tokens.proxy, UsdGeom.Tokens.render]
THIN = 1 / 250  # width of lines, of what they show
OPAQUE = 0.1  # alpha of textures, from where on there is something


class Face(NamedTuple):
    """Of a card: the axis that it looks along, and the ones that its picture's s and t go along, with their signs.

    USD's documentation and its own imaging differ in these. As in imaging, pictures are upright and not mirrored as
    seen from the side that they face: t goes along +z at the four sides, s along the viewer's right."""

    axis: int
    sign: int
    s: int
    s_sign: int
    t: int
    t_sign: int


FACES = {
    "XPos": Face(0, 1, 1, 1, 2, 1),
    "XNeg": Face(0, -1, 1, -1, 2, 1),
    "YPos": Face(1, 1, 0, -1, 2, 1),
    "YNeg": Face(1, -1, 0, 1, 2, 1),
    "ZPos": Face(2, 1, 0, 1, 1, 1),
    "ZNeg": Face(2, -1, 0, 1, 1, -1),
}
OPPOSITE = {name: name.replace("Pos", "Neg") if "Pos" in name else name.replace("Neg", "Pos") for name in FACES}
CORNERS = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], dtype=np.float32)
EDGES = [(a, a | bit) for bit in (1, 2, 4) for a in range(8) if not a & bit]


def applies(prim: Usd.Prim, names: frozenset[str]) -> bool:
    """Whether a model is drawn in a mode that is not the default, where that is inherited or its own."""
    if not prim.IsModel():
        return False
    if "model:applyDrawMode" in names:
        return bool(prim.GetAttribute("model:applyDrawMode").Get())
    return Kind.Registry.IsA(Usd.ModelAPI(prim).GetKind(), Kind.Tokens.component)


@dataclass
class DrawModes:
    """Draws models; `looks` is a stage of materials made for cards."""

    shapes: Shapes
    up: str
    looks: Usd.Stage = field(default_factory=Usd.Stage.CreateInMemory)
    _caches: dict[Usd.TimeCode, UsdGeom.BBoxCache] = field(default_factory=dict)
    _cards: dict[tuple[str, str], UsdShade.Material] = field(default_factory=dict)

    def draw(self, place, item: Item) -> None:
        """An item is the model, its mode is `above.draw_mode`."""
        mode = item.above.draw_mode
        if mode == "origin":
            self.lines(place, item, np.eye(3).repeat(2, 0) * np.tile([[0], [1]], (3, 1)), THIN)
            return
        if mode == "cards" and self.value(item, "cardGeometry", "cross") == "fromTexture":
            self.cards_of_textures(place, item)
            return
        box = self.bounds(item)
        if box is None:
            self.shapes.say("warning", f"{item.path}: its draw mode is {mode}, but it has no bounds. It is left out")
        elif mode == "bounds":
            corners = np.array([[box[(i >> axis) & 1][axis] for axis in range(3)] for i in range(8)])
            size = float(np.linalg.norm(box[1] - box[0]))
            self.lines(place, item, corners[np.array(EDGES)].reshape(-1, 3), size * THIN)
        elif mode == "cards":
            self.cards(place, item, box)
        else:
            self.shapes.say("warning", f'{item.path}: there is no draw mode "{mode}". It is left out')

    def value(self, item: Item, name: str, default=None):
        full = f"model:{name}"
        found = item.prim.GetAttribute(full).Get(self.shapes.shutter.frame) if full in item.names else None
        return default if found is None else found

    def bounds(self, item: Item) -> np.ndarray | None:
        """(2, 3), in the model's space: at the stage's earliest time, or at the frame where the model's own vary."""
        varying = any(
            name in item.names and item.prim.GetAttribute(name).ValueMightBeTimeVarying()
            for name in ("extent", "extentsHint")
        )
        time = self.shapes.shutter.frame if varying else Usd.TimeCode.EarliestTime()
        if time not in self._caches:
            self._caches[time] = UsdGeom.BBoxCache(time, PURPOSES, useExtentsHint=True)
        found = self._caches[time].ComputeUntransformedBound(item.prim).ComputeAlignedBox()
        box = np.array([found.GetMin(), found.GetMax()])
        return None if found.IsEmpty() or not np.isfinite(box).all() else box

    def plain(self, item: Item) -> dict[str, object]:
        """Looks in the model's colour."""
        made = self.shapes.material(None)
        ours, kind = made.primvars["displayColor"]
        color = tuple(float(x) for x in self.value(item, "drawModeColor", (0.18, 0.18, 0.18)))
        return self.shapes.looks(item, made) | {"material": made.with_values({f"{kind} {ours}": color})}

    def lines(self, place, item: Item, points: np.ndarray, width: float) -> None:
        place.add_curves(points, [2] * (len(points) // 2), widths=[width], **self.plain(item))

    # ---- cards

    def textures(self, item: Item) -> dict[str, str]:
        """Files by faces; an empty one is not found. Only faces that have one."""
        found = {}
        for name in FACES:
            asset = self.value(item, f"cardTexture{name}")
            if asset is not None and asset.path:
                found[name] = asset.resolvedPath
                if not asset.resolvedPath:
                    self.shapes.say("warning", f'{item.path}: the card\'s file "{asset.path}" is not found')
        return found

    def cards(self, place, item: Item, box: np.ndarray) -> None:
        files = self.textures(item)
        middle = self.value(item, "cardGeometry", "cross") == "cross"
        hidden = "XYZ".index(self.up.upper()) if self.visibility(item) == "simple" else -1
        for name, face in FACES.items():
            if face.axis == hidden or (files and name not in files and OPPOSITE[name] not in files):
                continue
            # The other side's picture is seen through from this one.
            source = name if name in files or not files else OPPOSITE[name]
            points = quad(FACES[source], box, box.mean(0) if middle else box[int(face.sign > 0)], face.axis)
            order = [0, 1, 2, 3] if source == name else [0, 3, 2, 1]
            self.card(place, item, points, order, files.get(source, ""))

    def visibility(self, item: Item) -> str:
        prim = item.prim
        while prim and not prim.IsPseudoRoot():
            attribute = prim.GetAttribute("model:cardVisibility")
            if attribute and (found := attribute.Get()) not in (None, INHERITED):
                return str(found)
            prim = prim.GetParent()
        return "full"

    def cards_of_textures(self, place, item: Item) -> None:
        for file in self.textures(item).values():
            if not file:
                continue
            try:
                inverse = np.linalg.inv(world_to_screen(file))
            except (ValueError, OSError, struct.error, np.linalg.LinAlgError) as error:
                self.shapes.say("warning", f"{item.path}: {file}: {error}. The card is left out")
                continue
            screen = np.concatenate([2 * CORNERS - 1, np.zeros((4, 1)), np.ones((4, 1))], axis=1) @ inverse
            points = screen[:, :3] / screen[:, 3:]
            # Cards face the side from which the picture was taken: that of smaller depth.
            nearer = np.array([0, 0, -0.5, 1]) @ inverse
            away = nearer[:3] / nearer[3] - points.mean(0)
            facing = np.cross(points[1] - points[0], points[3] - points[0]) @ away > 0
            self.card(place, item, points, [0, 1, 2, 3] if facing else [0, 3, 2, 1], file)

    def card(self, place, item: Item, points: np.ndarray, order: list[int], file: str) -> None:
        """A quad that is seen from one side; its points are those of s, t = 00, 10, 11, 01."""
        looks, primvars = self.plain(item), {}
        if file:
            made = self.shapes.material(self.textured(file))
            looks["material"] = made.material
            for ours, _ in made.primvars.values():
                primvars = {f"vertex float {half}": CORNERS[:, i] for i, half in enumerate(halves(ours))}
        place.add_mesh(points, [order], primvars=primvars, double_sided=False, **looks)

    def textured(self, file: str) -> UsdShade.Material:
        """As USD's imaging: a rough UsdPreviewSurface whose texture cuts it out."""
        if file not in self._cards:
            path = Sdf.Path(f"/cards/card{len(self._cards)}")
            material = UsdShade.Material.Define(self.looks, path)
            surface, picture, reader = (
                UsdShade.Shader.Define(self.looks, path.AppendChild(name)) for name in ("surface", "picture", "st")
            )
            surface.CreateIdAttr("UsdPreviewSurface")
            picture.CreateIdAttr("UsdUVTexture")
            reader.CreateIdAttr("UsdPrimvarReader_float2")
            types = Sdf.ValueTypeNames
            reader.CreateInput("varname", types.String).Set("st")
            picture.CreateInput("file", types.Asset).Set(Sdf.AssetPath(file, file))
            for wrap in ("wrapS", "wrapT"):
                picture.CreateInput(wrap, types.Token).Set("clamp")
            picture.CreateInput("st", types.Float2).ConnectToSource(reader.ConnectableAPI(), "result")
            surface.CreateInput("roughness", types.Float).Set(1)
            surface.CreateInput("diffuseColor", types.Color3f).ConnectToSource(picture.ConnectableAPI(), "rgb")
            surface.CreateInput("opacity", types.Float).ConnectToSource(picture.ConnectableAPI(), "a")
            surface.CreateInput("opacityThreshold", types.Float).Set(OPAQUE)
            material.CreateSurfaceOutput().ConnectToSource(surface.ConnectableAPI(), "surface")
            self._cards[file] = material
        return self._cards[file]


def quad(face: Face, box: np.ndarray, at: np.ndarray, axis: int) -> np.ndarray:
    """Corners of a picture in a box, at s, t = 00, 10, 11, 01."""
    points = np.empty((4, 3))
    points[:, axis] = at[axis]
    for other, sign, where in ((face.s, face.s_sign, CORNERS[:, 0]), (face.t, face.t_sign, CORNERS[:, 1])):
        low, high = box[:, other] if sign > 0 else box[::-1, other]
        points[:, other] = low + where * (high - low)
    return points
