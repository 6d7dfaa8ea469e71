"""Models in files of OBJ, PLY, STL and glTF: `kanuka.models.load("ball.obj")`. docs/models.md.

trimesh reads them, and hands over triangles.
"""

from __future__ import annotations

import hashlib
import io
import os
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import kanuka
from kanuka import messages, standins
from kanuka.looks.files import Files, write
from kanuka.looks.material import MadeMaterial
from kanuka.looks.rsl import Stage, Value, Writer, halves, primvar_name
from kanuka.looks.surface import Normal, Surface, text_of

__all__ = ["SUFFIXES", "add_file", "convert", "is_model", "load"]

SUFFIXES = (".obj", ".ply", ".stl", ".gltf", ".glb")
Say = Callable[[str, str], None]


def is_model(path: str | os.PathLike) -> bool:
    return Path(path).suffix.lower() in SUFFIXES


def load(
    path: str | os.PathLike, *, resolution: tuple[int, int] = (960, 540), journal: kanuka.Journal | None = None
) -> kanuka.Scene:
    """The models of a file on a neutral stage: on a grey ground, lit by a sky and a sun, seen from the front.

    What cannot be read is told: to `journal`, else as warnings. Raises kanuka.Error where nothing can be read, or
    trimesh is not installed.
    """
    scene = kanuka.Scene()
    _show(scene, path, resolution, journal)
    return scene


def convert(
    path: str | os.PathLike,
    rib: str | os.PathLike,
    *,
    resolution: tuple[int, int] = (960, 540),
    binary: bool = False,
    packing: str = "auto",
    journal: kanuka.Journal | None = None,
) -> None:
    """Writes a RIB of the same picture as load() makes. The shaders of its materials are written into the folder
    NAME_shaders beside it; textures are named where they lie. Raises kanuka.Error as load() does."""
    from kanuka.rib import RibScene

    scene = RibScene()
    _show(scene, path, resolution, journal)
    found = scene.write(rib, binary=binary, packing=packing)
    if journal is None:
        messages.tell(found.messages)
    else:
        for message in found:
            journal.add(message.severity, message.message, message.file)


def _show(scene, path: str | os.PathLike, resolution: tuple[int, int], journal: kanuka.Journal | None) -> None:
    corners = add_file(scene, path, journal=journal)
    scene.resolution = resolution
    standins.lights(scene)
    low, high = corners.min(0), corners.max(0)
    scene.camera = standins.camera((low, high), resolution[0] / resolution[1])
    middle, reach = (low + high) / 2, 40 * float(np.linalg.norm(high - low) or 1)
    x, z = middle[0] + reach * np.array([-1, 1, 1, -1]), middle[2] + reach * np.array([1, 1, -1, -1])
    ground = np.stack([x, np.full(4, low[1]), z], 1).astype(np.float32)
    scene.add_mesh(ground, np.array([[0, 1, 2, 3]], np.int32), name="ground")


def add_file(
    scene: kanuka.Scene,
    path: str | os.PathLike,
    *,
    transform: np.ndarray | None = None,
    journal: kanuka.Journal | None = None,
) -> np.ndarray:
    """Adds the models of a file to a scene, with their materials; returns the (8, 3) corners of their bounds.

    transform: (4, 4), acting on columns. What cannot be read is told: to `journal`, else as warnings. Raises
    kanuka.Error where nothing can be read, or trimesh is not installed.
    """
    file = os.fspath(path)
    told = kanuka.Journal()

    def say(severity: str, text: str) -> None:
        told.add(severity, text, file)
        if journal is not None:
            journal.add(severity, text, file)

    reader = Reader(scene, file, say)
    corners = reader.read(np.eye(4) if transform is None else np.asarray(transform, dtype=float))
    if journal is None:
        messages.tell(told.messages)
    return corners


def failed(text: str, path: str) -> kanuka.Error:
    error = kanuka.Error(f"{path}: {text}")
    error.file, error.line, error.column, error.exit_code = path, 0, 0, 4
    return error


def opened(path: str):
    """The file as trimesh has it, Y up as it says."""
    try:
        import trimesh
    except ImportError:
        raise failed("reading models needs trimesh and Pillow: pip install 'kanuka[models]'", path) from None
    if not Path(path).is_file():
        raise failed("there is no such file", path)
    try:
        found = trimesh.load_scene(path, process=False, maintain_order=True, split_objects=True, group_material=False)
    except Exception as error:  # whatever a reader of foreign bytes comes to
        raise failed(
            f"it cannot be read ({type(error).__name__}: {error}). Export it again where it was made", path
        ) from None
    if not any(hasattr(each, "faces") and len(each.faces) for each in found.geometry.values()):
        raise failed("there are no faces in it", path)
    return found


@dataclass
class Reader:
    scene: kanuka.Scene
    path: str
    say: Say
    files: Files = field(default_factory=Files)
    looks: dict[int, tuple[kanuka.Material, bool]] = field(default_factory=dict)  # by trimesh's materials

    def read(self, outer: np.ndarray) -> np.ndarray:
        found = opened(self.path)
        if (folder := str(self.files.folder)) not in self.scene.options.shader_path:
            self.scene.options.shader_path = [*self.scene.options.shader_path, folder]
        placed: dict[str, list[np.ndarray]] = {}
        for node in found.graph.nodes_geometry:
            matrix, geometry = found.graph[node]
            placed.setdefault(geometry, []).append(outer @ np.asarray(matrix, dtype=float))
        low, high = np.full(3, np.inf), np.full(3, -np.inf)
        for name, matrices in placed.items():
            mesh = found.geometry[name]
            points = self.points_of(mesh, name)
            if points is None:
                continue
            self.add(name, mesh, points, matrices)
            box = np.array([points.min(0), points.max(0)], dtype=float)
            corners = np.array([[box[i, 0], box[j, 1], box[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
            for matrix in matrices:
                there = corners @ matrix[:3, :3].T + matrix[:3, 3]
                low, high = np.minimum(low, there.min(0)), np.maximum(high, there.max(0))
        if not np.isfinite(low).all():
            raise failed("no face of it can be drawn", self.path)
        box = np.array([low, high])
        return np.array([[box[i, 0], box[j, 1], box[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])

    def points_of(self, mesh, name: str) -> np.ndarray | None:
        """None: it has no faces to draw."""
        if not hasattr(mesh, "faces") or not len(mesh.faces):
            self.say("warning", f'"{name}" has no faces; it is left out')
            return None
        points = np.ascontiguousarray(mesh.vertices, dtype=np.float32)
        good = np.isfinite(points).all(1)
        if not good.all():
            whole = good[mesh.faces].all(1)
            self.say(
                "warning", f'"{name}": {int((~whole).sum())} faces have points that are no numbers; they are left out'
            )
            if not whole.any():
                return None
            mesh.update_faces(whole)
            points[~good] = points[good].mean(0)
        return points

    def add(self, name: str, mesh, points: np.ndarray, matrices: list[np.ndarray]) -> None:
        faces = np.ascontiguousarray(mesh.faces, dtype=np.int32)
        visual = mesh.visual
        uv = getattr(visual, "uv", None)
        primvars: dict[str, np.ndarray] = {}
        if uv is not None and len(uv) == len(points):
            uv = np.nan_to_num(np.asarray(uv, dtype=np.float32))
            primvars |= dict(zip(halves(primvar_name("st")), (uv[:, 0].copy(), uv[:, 1].copy()), strict=True))
        colored = getattr(visual, "kind", None) == "vertex"
        if colored:
            colors = np.asarray(visual.vertex_colors)[:, :3] / np.float32(255)
            linear = np.where(colors <= 0.04045, colors / 12.92, ((colors + 0.055) / 1.055) ** 2.4)
            primvars[primvar_name("displayColor")] = linear.astype(np.float32)
        material, double_sided = self.look(getattr(visual, "material", None), colored, uv is not None)
        normals = mesh.vertex_normals if "vertex_normals" in mesh._cache else None
        settings = {"uv": uv, "primvars": primvars, "material": material, "double_sided": double_sided, "name": name}
        if normals is not None and np.isfinite(normals).all():
            settings["normals"] = np.ascontiguousarray(normals, dtype=np.float32)
        if len(matrices) == 1:
            self.scene.add_mesh(points, faces, transform=matrices[0].astype(np.float32), **settings)
            return
        group = self.scene.add_group(name)
        group.add_mesh(points, faces, **settings)
        self.scene.add_instances(group, np.stack(matrices).astype(np.float32))

    # ---- materials

    def look(self, material, colored: bool, has_uv: bool) -> tuple[kanuka.Material, bool]:
        key = hash((id(material), colored, has_uv))
        if key not in self.looks:
            self.looks[key] = self.made(material, colored, has_uv)
        return self.looks[key]

    def made(self, material, colored: bool, has_uv: bool) -> tuple[kanuka.Material, bool]:
        writer, shading, displacing = Writer(), Stage(), Stage()
        surface = Surface(roughness=writer.constant("float", 0.5))
        st = writer.primvar("st", "float2") if has_uv else None
        pbr = None
        if material is not None:
            pbr = material.to_pbr() if hasattr(material, "to_pbr") else material
        if colored:
            surface.base = writer.primvar("displayColor", "color", (0.18, 0.18, 0.18))
        elif pbr is None:
            surface.base = writer.constant("color", (0.5, 0.5, 0.5))
        else:
            self.physical(Look(self, writer, shading, st), pbr, surface, displacing)
        text = text_of(writer, surface, shading, displacing, st)
        double_sided = getattr(pbr, "doubleSided", None) is not False
        return MadeMaterial(self.files.shader(text), writer.values), double_sided

    def physical(self, look: Look, pbr, surface: Surface, displacing: Stage) -> None:
        """glTF 2.0, section 3.9: metallic and roughness factors, each by its texture's channel."""
        writer = look.writer
        factor = numbers(pbr.baseColorFactor, 4)
        color = look.texture(pbr.baseColorTexture, "srgb", None)
        base = writer.constant("color", tuple(factor[:3]))
        surface.base = Value("color", f"{color.text} * {base.text}") if color else base
        rough = writer.constant("float", 1.0 if pbr.roughnessFactor is None else float(pbr.roughnessFactor))
        metal = 1.0 if pbr.metallicFactor is None else float(pbr.metallicFactor)
        both = pbr.metallicRoughnessTexture
        green, blue = (look.texture(both, "raw", channel) for channel in (1, 2))
        surface.roughness = Value("float", f"{green.text} * {rough.text}") if green else rough
        if metal > 0:
            weight = writer.constant("float", metal)
            surface.metalness = Value("float", f"{blue.text} * {weight.text}") if blue else weight
        glow = numbers(pbr.emissiveFactor, 3, 0.0)
        if any(glow):
            light = look.texture(pbr.emissiveTexture, "srgb", None)
            factor_of = writer.constant("color", tuple(glow))
            surface.emission = Value("color", f"{light.text} * {factor_of.text}") if light else factor_of
        if pbr.alphaMode in ("MASK", "BLEND"):
            alpha = look.texture(pbr.baseColorTexture, "srgb", 3)
            all_of = writer.constant("float", float(factor[3]))
            there = f"{alpha.text} * {all_of.text}" if alpha else all_of.text
            if pbr.alphaMode == "MASK":
                least = writer.constant("float", 0.5 if pbr.alphaCutoff is None else float(pbr.alphaCutoff))
                there = f"({there} < {least.text} ? 0 : 1)"
            surface.presence = Value("float", there)
        bent = Look(self, writer, displacing, look.st).texture(pbr.normalTexture, "raw", None)
        if bent:
            surface.normal = Normal(Value("vector", f"2 * {bent.to('vector').text} - vector(1, 1, 1)"))


@dataclass
class Look:
    """A material's textures in one stage of its shader."""

    reader: Reader
    writer: Writer
    stage: Stage
    st: Value | None

    def texture(self, image, space: str, channel: int | None) -> Value | None:
        if image is None or self.st is None:
            return None
        channels = len(image.getbands())
        if channel is not None and channel >= channels:
            return None
        path = self.reader.files.folder / f"{digest(image)}.png"
        if not path.exists():
            data = io.BytesIO()
            image.save(data, "PNG", compress_level=1)
            write(path, data.getvalue())
        return self.writer.texture(self.stage, str(path), self.st, "periodic,periodic", space, channel, fill=1)


def digest(image) -> str:
    return hashlib.sha256(repr((image.size, image.mode)).encode() + image.tobytes()).hexdigest()[:16]


def numbers(value, size: int, default: float = 1.0) -> list[float]:
    """trimesh has factors of colours as bytes or as floats."""
    if value is None:
        return [default] * size
    given = np.asarray(value)
    scale = 255 if given.dtype.kind in "ui" else 1
    return [*(given / scale).astype(float).tolist(), *[1.0] * size][:size]
