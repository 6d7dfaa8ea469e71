"""A scene that is written as RIB: it has the methods of kanuka.Scene by which files are read into one."""

from __future__ import annotations

import math
import os
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import IO

import numpy as np

import kanuka
from kanuka.looks.material import MadeMaterial

from . import shapes
from .encode import instances, matrix, moving, placed, request, times_of
from .lights import light


class RibPlace:
    """What a scene and a group of it have in common. Shapes are checked as kanuka.Scene checks them."""

    def __init__(self, whole: RibScene) -> None:
        self._whole = whole
        self._requests: list[bytes] = []

    def _add(self, requests: bytes, looks: Mapping[str, object]) -> int:
        self._requests.append(b"AttributeBegin\n" + self._whole.looks(looks) + requests + b"AttributeEnd\n")
        self._whole.count += 1
        return self._whole.count - 1

    def _quadric(self, method: str, name: str, taken: tuple[float, ...], numbers: tuple, looks: dict) -> int:
        getattr(kanuka.Scene(), method)(*taken, **looks)
        return self._add(request(name, *(float(number) for number in numbers)), looks)

    def add_sphere(self, radius: float = 1, **looks: object) -> int:
        return self._quadric("add_sphere", "Sphere", (radius,), (radius, -radius, radius, 360), looks)

    def add_cylinder(self, radius=1, bottom=-1, top=1, sweep=360, **looks: object) -> int:
        numbers = (radius, bottom, top, sweep)
        return self._quadric("add_cylinder", "Cylinder", numbers, numbers, looks)

    def add_cone(self, radius=1, height=1, sweep=360, **looks: object) -> int:
        return self._quadric("add_cone", "Cone", (radius, height, sweep), (height, radius, sweep), looks)

    def add_disk(self, radius=1, height=0, sweep=360, **looks: object) -> int:
        return self._quadric("add_disk", "Disk", (radius, height, sweep), (height, radius, sweep), looks)

    def add_torus(self, major=1, minor=0.25, sweep=360, **looks: object) -> int:
        numbers = (major, minor, sweep)
        return self._quadric("add_torus", "Torus", numbers, (major, minor, 0, 360, sweep), looks)

    def add_mesh(self, points, faces, counts=None, *, normals=None, uv=None, primvars=None, **looks) -> int:
        primvars = dict(primvars or {})
        kanuka.Scene().add_mesh(points, faces, counts, normals=normals, uv=uv, primvars=primvars, **looks)
        return self._mesh("PointsPolygons", shapes.faces_of(faces, counts), (), points, normals, uv, primvars, looks)

    def add_subdivision(
        self, points, faces, counts=None, *, normals=None, uv=None, primvars=None, scheme="catmull-clark", **settings
    ) -> int:
        tagged = {name: settings.pop(name) for name in TAGS if name in settings}
        given = {"normals": normals, "uv": uv, "primvars": dict(primvars or {}), "scheme": scheme}
        kanuka.Scene().add_subdivision(points, faces, counts, **given, **tagged, **settings)
        tags, arguments = shapes.tags(tagged), shapes.faces_of(faces, counts)
        return self._mesh("SubdivisionMesh", arguments, tags, points, normals, uv, given["primvars"], settings, scheme)

    def _mesh(self, name, arguments, tags, points, normals, uv, primvars, looks, *before) -> int:
        if uv is not None:
            uv = np.asarray(uv, dtype=np.float32)
            storage = shapes.Counts(len(shapes.slices(points)[0]), 0, len(arguments[1]), len(arguments[0]))
            primvars = {storage.declared("st", uv, "float[2]"): uv} | primvars
        made = shapes.shape(
            name,
            (*before, *arguments, *tags),
            shapes.slices(points),
            normals,
            primvars,
            shapes.mesh_counts(*arguments),
            looks.get("times"),
        )
        return self._add(made, looks)

    def add_curves(
        self, points, counts, *, basis="linear", periodic=False, widths=None, normals=None, primvars=None, **looks
    ) -> int:
        primvars = dict(primvars or {})
        given = {"basis": basis, "periodic": periodic, "widths": widths, "normals": normals, "primvars": primvars}
        kanuka.Scene().add_curves(points, counts, **given, **looks)
        at, counts = shapes.slices(points), np.asarray(counts, dtype=np.int32)
        classes = shapes.curve_counts(counts, len(at[0]), basis, periodic)
        if widths is not None:
            wide = np.asarray(widths, dtype=np.float32)
            primvars = {classes.declared("float width", wide): wide} | primvars
        arguments = ("linear" if basis == "linear" else "cubic", counts, "periodic" if periodic else "nonperiodic")
        made = shapes.shape("Curves", arguments, at, normals, primvars, classes, looks.get("times"))
        if basis != "linear":
            step = shapes.STEPS[basis]
            made = request("Basis", basis, step, basis, step) + made
        return self._add(made, looks)

    def add_points(self, points, *, shape="sphere", widths=None, normals=None, primvars=None, **looks) -> int:
        primvars = dict(primvars or {})
        kanuka.Scene().add_points(points, shape=shape, widths=widths, normals=normals, primvars=primvars, **looks)
        at = shapes.slices(points)
        n = len(at[0])
        classes = shapes.Counts(n, n, n, 1)
        if widths is not None:
            wide = np.asarray(widths, dtype=np.float32)
            primvars = {classes.declared("float width", wide): wide} | primvars
        primvars["constant string type"] = shape
        return self._add(shapes.shape("Points", (), at, normals, primvars, classes, looks.get("times")), looks)

    def add_nurbs(
        self,
        points,
        u_knots,
        v_knots,
        *,
        u_range=None,
        v_range=None,
        trim=(),
        trim_outside=False,
        normals=None,
        uv=None,
        primvars=None,
        **looks,
    ) -> int:
        primvars = dict(primvars or {})
        given = {"trim": trim, "trim_outside": trim_outside, "normals": normals, "uv": uv, "primvars": primvars}
        kanuka.Scene().add_nurbs(points, u_knots, v_knots, u_range=u_range, v_range=v_range, **given, **looks)
        lattices = shapes.slices(points, 3)
        nv, nu, width = lattices[0].shape
        u, u_ends, u_spans = shapes.direction_of(nu, u_knots, u_range)
        v, v_ends, v_spans = shapes.direction_of(nv, v_knots, v_range)
        classes = shapes.Counts(nu * nv, u_ends * v_ends, u_ends * v_ends, u_spans * v_spans)
        if uv is not None:
            uv = np.asarray(uv, dtype=np.float32)
            primvars = {classes.declared("st", uv, "float[2]"): uv} | primvars
        at = [lattice.reshape(-1, width) for lattice in lattices]
        made = shapes.shape("NuPatch", (*u, *v), at, normals, primvars, classes, looks.get("times"))
        if len(trim):
            sense = request("Attribute", "trimcurve", parameters={"string sense": "outside"}) if trim_outside else b""
            made = sense + shapes.trim_curves(trim) + made
        return self._add(made, looks)

    def add_instances(
        self,
        group: RibGroup,
        transforms,
        times=None,
        *,
        variant=None,
        tint=None,
        roughness=None,
        primvars=None,
        unique=False,
    ) -> None:
        differences = {"variant": variant, "tint": tint, "roughness": roughness, "unique": unique or None}
        differences["primvars"] = dict(primvars or {})
        self._requests.append(instances(group.handle, np.asarray(transforms), times, differences))


LOOKS = frozenset(
    {"material", "transform", "area_light", "name", "shading_rate", "visible_camera", "double_sided", "variants"}
    | {"reverse_orientation", "times", "lights_off", "shadows_off"}
)
TAGS = frozenset({"creases", "crease_sharpness", "corners", "corner_sharpness", "holes"}) | {
    "boundary",
    "facevarying",
    "smooth_triangles",
}


class RibGroup(RibPlace):
    """An object of RIB; `handle` is its name there."""

    def __init__(self, whole: RibScene, handle: str) -> None:
        super().__init__(whole)
        self.handle = handle

    def requests(self) -> bytes:
        return request("ObjectBegin", self.handle) + b"".join(self._requests) + request("ObjectEnd")


class RibScene(RibPlace):
    """Options, camera and what is added become requests; write() puts them into a file, with the shaders beside it.

    `camera` takes a kanuka.Camera, or a list of them for the times from 0 to 1. `picture` is the file of its Display,
    by default the RIB's name, and `aovs` are layers beside its colour and alpha.
    """

    def __init__(self) -> None:
        super().__init__(self)
        self._scene = kanuka.Scene()
        self._groups: list[RibGroup] = []
        self._lights: list[bytes] = []
        self._cameras: list[kanuka.Camera] = []
        self._shaders: set[str] = set()
        self.picture = ""
        self.aovs: Sequence[str] = ()
        self.count = 0

    @property
    def options(self) -> kanuka.Options:
        return self._scene.options

    @property
    def journal(self) -> kanuka.Journal:
        return self._scene.journal

    @property
    def resolution(self) -> tuple[int, int]:
        return self._scene.resolution

    @resolution.setter
    def resolution(self, size: tuple[int, int]) -> None:
        self._scene.resolution = size

    @property
    def camera(self) -> kanuka.Camera:
        return self._scene.camera

    @camera.setter
    def camera(self, value: kanuka.Camera | Sequence[kanuka.Camera]) -> None:
        self._cameras = [value] if isinstance(value, kanuka.Camera) else list(value)
        self._scene.camera = self._cameras[0]

    def add_group(self, name: str = "") -> RibGroup:
        self._groups.append(RibGroup(self, f"{len(self._groups)} {name}".strip()))
        return self._groups[-1]

    def add_light(self, kind: str, **given: object) -> None:
        kanuka.Scene().add_light(kind, **given)
        handle = str(given.get("name") or f"light {len(self._lights)}")
        self._lights.append(light(kind, handle, given))

    def looks(self, given: Mapping[str, object]) -> bytes:
        """Attributes of what is added."""
        if unknown := sorted(set(given) - LOOKS):
            raise ValueError(f"{', '.join(unknown)}: it cannot be written as RIB")
        made: list[bytes] = []
        if name := given.get("name"):
            made.append(request("Attribute", "identifier", parameters={"string name": name}))
        for key, category, parameter in (
            ("lights_off", "lighting", "excludesubset"),
            ("shadows_off", "shadow", "excludesubset"),
        ):
            if names := given.get(key):
                made.append(
                    request("Attribute", category, parameters={f"string[{len(names)}] {parameter}": list(names)})
                )
        if not given.get("visible_camera", True):
            made.append(request("Attribute", "visibility", parameters={"integer camera": 0}))
        if given.get("variants", 1) != 1:
            made.append(request("Attribute", "instance", parameters={"integer variants": int(given["variants"])}))
        if given.get("shading_rate", 1) != 1:
            made.append(request("ShadingRate", float(given["shading_rate"])))
        if not given.get("double_sided", True):
            made.append(request("Sides", 1))
        if given.get("reverse_orientation", False):
            made.append(request("ReverseOrientation"))
        if given.get("transform") is not None:
            made.append(placed(given["transform"], given.get("times")))
        if (radiance := given.get("area_light")) is not None:
            values = {"float intensity": 1.0, "color lightcolor": np.broadcast_to(np.asarray(radiance, float), 3)}
            made.append(request("AreaLightSource", "arealight", f"area {self.count}", parameters=values))
        if (material := given.get("material")) is not None:
            made.append(self.surface(material))
        return b"".join(made)

    def surface(self, material: object) -> bytes:
        if isinstance(material, MadeMaterial):
            self._shaders.add(material.surface)
            return request("Surface", material.surface, parameters=material.values)
        if isinstance(material, str):
            return request("Surface", material)
        raise TypeError("material: only what is read from files can be written as RIB")

    # ---- the file

    def bounds(self) -> tuple | None:
        """As of kanuka.Scene, which reads it."""
        with tempfile.NamedTemporaryFile(suffix=".rib") as file:
            self._put(file)
            return kanuka.load(file.name, journal=kanuka.Journal()).bounds()

    def write(self, path: str | os.PathLike, *, binary: bool = False, packing: str = "auto") -> kanuka.Journal:
        """The RIB, and the shaders that it names in the folder NAME_shaders. What could not be is in the journal."""
        target = Path(path)
        folder = target.with_name(f"{target.name.split('.')[0]}_shaders")
        self._copy_shaders(folder)
        with tempfile.NamedTemporaryFile(suffix=".rib") as file:
            self._put(file, folder.name, target.name.split(".")[0])
            return kanuka.convert_rib(file.name, os.fspath(path), binary=binary, packing=packing)

    def _put(self, file: IO[bytes], folder: str = "", name: str = "") -> None:
        for part in self.requests(folder, name):
            file.write(part)
        file.flush()

    def _copy_shaders(self, folder: Path) -> None:
        found = [Path(place) / f"{name}.sl" for name in sorted(self._shaders) for place in self.options.shader_path]
        found = [source for source in found if source.is_file()]
        if found:
            folder.mkdir(exist_ok=True)
        for source in found:
            shutil.copyfile(source, folder / source.name)

    def requests(self, folder: str, name: str):
        """All of the file, piece by piece."""
        yield b"##RenderMan RIB-Structure 1.1\nversion 3.04\n"
        yield from self._options(folder, name)
        yield request("WorldBegin")
        yield request("Attribute", "light", parameters={"string shadows": "on"})
        yield from self._lights
        for group in self._groups:
            yield group.requests()
        yield from self._requests
        yield request("WorldEnd")

    def _options(self, folder: str, name: str):
        options, (width, height) = self.options, self.resolution
        yield request("Option", "searchpath", parameters={"string shader": f"{folder}:@:&"})
        if options.texture_path:
            yield request("Option", "searchpath", parameters={"string texture": ":".join([*options.texture_path, "&"])})
        yield request("Option", "kanuka", parameters={"string transport": options.transport})
        picture = self.picture or f"{name}.exr"
        yield request("Display", picture, "openexr", "rgba")
        for layer in self.aovs:  # those of one file's name are layers of it
            yield request("Display", f"+{picture}", "openexr", layer)
        yield request("Format", width, height, options.pixel_aspect)
        if options.crop != (0, 1, 0, 1):
            yield request("CropWindow", *map(float, options.crop))
        if options.shutter[0] != options.shutter[1]:
            yield request("Shutter", *map(float, options.shutter))
        if options.exposure_gain != 1:
            yield request("Exposure", options.exposure_gain, 1.0)
        yield from self._lens()

    def _lens(self):
        camera, (width, height) = self.camera, self.resolution
        yield request("Clipping", camera.near_clip, camera.far_clip)
        if camera.screen_window is not None:
            yield request("ScreenWindow", *map(float, camera.screen_window))
        if camera.f_stop > 0:
            yield request("DepthOfField", camera.f_stop, camera.focal_length, camera.focal_distance)
        if camera.projection == "perspective":
            fov = fov_of_smaller(camera.fov, camera.fov_axis, width * self.options.pixel_aspect / height)
            yield request("Projection", "perspective", parameters={"float fov": fov})
        else:
            yield request("Projection", camera.projection)
        seen = [request("Transform", matrix(each.camera_from_world)) for each in self._cameras or [camera]]
        yield moving(seen, times_of(len(seen), None))


def fov_of_smaller(fov: float, axis: str, aspect: float) -> float:
    """RIB's is across the shorter side; tangents go with lengths."""
    if axis == "smaller" or (axis == "x") == (aspect < 1):
        return fov
    return math.degrees(2 * math.atan(math.tan(math.radians(fov) / 2) * (aspect if aspect < 1 else 1 / aspect)))
