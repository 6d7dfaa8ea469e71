"""LuxCoreRender's PATHCPU engine with its Sobol sampler."""

from __future__ import annotations

import os
import time

import numpy as np
import pyluxcore

import scenes
from peers import worker

say = worker.claim_stdout()
request = worker.Request.read()
figures = worker.Figures()

ROULETTE = 3  # as it has it by default; later makes it slower

pyluxcore.Init(lambda _message: None)


def properties(values: dict[str, object]) -> pyluxcore.Properties:
    made = pyluxcore.Properties()
    for key, value in values.items():
        made.Set(pyluxcore.Property(key, value))
    return made


def floats(values: object) -> list[float]:
    return [float(value) for value in np.asarray(values).ravel()]


def noise_chain(n: int) -> dict[str, object]:
    first, links = scenes.chain(n)
    values: dict[str, object] = {
        "scene.textures.color0.type": "constfloat3",
        "scene.textures.color0.value": floats(first),
    }
    for i, link in enumerate(links):
        f = link.frequency
        values |= {
            f"scene.textures.noise{i}.type": "fbm",
            f"scene.textures.noise{i}.octaves": 4,
            f"scene.textures.noise{i}.roughness": 0.5,
            f"scene.textures.noise{i}.mapping.type": "globalmapping3d",
            f"scene.textures.noise{i}.mapping.transformation": floats(np.diag([f, f, f, 1])),
            f"scene.textures.color{i + 1}.type": "mix",
            f"scene.textures.color{i + 1}.amount": f"noise{i}",
            f"scene.textures.color{i + 1}.texture1": f"color{i}",
            f"scene.textures.color{i + 1}.texture2": floats(link.color),
        }
    return values


class Builder:
    def __init__(self, given: scenes.Scene) -> None:
        self.scene = pyluxcore.Scene()
        camera = given.camera
        self.parse(
            {
                "scene.camera.type": "perspective",
                "scene.camera.lookat.orig": floats(camera.origin),
                "scene.camera.lookat.target": floats(camera.target),
                "scene.camera.up": floats(camera.up),
                "scene.camera.fieldofview": float(camera.fov),
                "scene.camera.autovolume.enable": False,
                "scene.camera.clippinghither": 1e-3,
                "scene.camera.clippingyon": 1e5,
            }
        )
        if given.sky:
            self.parse({"scene.lights.sky.type": "constantinfinite", "scene.lights.sky.color": [float(given.sky)] * 3})
        if given.environment:
            turned = np.array([[0, 1, 0, 0], [0, 0, 1, 0], [1, 0, 0, 0], [0, 0, 0, 1]], float)
            self.parse(
                {
                    "scene.lights.sky.type": "infinite",
                    "scene.lights.sky.file": str(given.environment),
                    "scene.lights.sky.gamma": 1.0,
                    "scene.lights.sky.transformation": floats(turned.T),
                }
            )
        for mesh in given.meshes:
            self.mesh(mesh)
            self.parse(
                {f"scene.objects.{mesh.name}.shape": mesh.name, f"scene.objects.{mesh.name}.material": mesh.name}
            )
        for copies in given.copies:
            self.copies(copies)

    def parse(self, values: dict[str, object]) -> None:
        self.scene.Parse(properties(values))

    def mesh(self, mesh: scenes.Mesh) -> None:
        """Shape and material; an object of both is the caller's."""
        if mesh.path:
            self.parse({f"scene.shapes.{mesh.name}.type": "mesh", f"scene.shapes.{mesh.name}.ply": str(mesh.path)})
        else:
            points, faces = mesh.triangles()
            rows = [tuple(map(float, p)) for p in points], [tuple(map(int, f)) for f in faces]
            self.scene.DefineMesh(mesh.name, *rows, None, None, None, None)
        if mesh.finish:
            self.finish(mesh)
            return
        material: dict[str, object] = {f"scene.materials.{mesh.name}.type": "matte"}
        if mesh.chain:
            self.parse(noise_chain(mesh.chain))
            material[f"scene.materials.{mesh.name}.kd"] = f"color{mesh.chain}"
        else:
            material[f"scene.materials.{mesh.name}.kd"] = floats(mesh.color)
        if mesh.radiance:
            material[f"scene.materials.{mesh.name}.emission"] = floats(mesh.radiance)
        self.parse(material)

    def finish(self, mesh: scenes.Mesh) -> None:
        given = mesh.finish
        if given.kind == "metal":
            values = {"type": "metal2", "uroughness": given.alpha, "vroughness": given.alpha, "fresnel": "gold"}
            self.parse({"scene.textures.gold.type": "fresnelpreset", "scene.textures.gold.name": "gold"})
        elif given.kind == "glass":
            values = {"type": "glass", "interiorior": given.ior}
        else:
            reflected = ((given.ior - 1) / (given.ior + 1)) ** 2
            values = {"type": "glossy2", "kd": floats(mesh.color), "ks": [reflected] * 3}
            values |= {"uroughness": given.alpha, "vroughness": given.alpha}
        self.parse({f"scene.materials.{mesh.name}.{key}": value for key, value in values.items()})

    def copies(self, copies: scenes.Copies) -> None:
        """The first copy is an object with a transformation, which makes its mesh an instanced one; then duplicates."""
        name, matrices = copies.mesh.name, copies.transforms.transpose(0, 2, 1)  # columns first
        self.mesh(copies.mesh)
        self.parse(
            {
                f"scene.objects.{name}.shape": name,
                f"scene.objects.{name}.material": name,
                f"scene.objects.{name}.transformation": floats(matrices[0]),
            }
        )
        rest = np.ascontiguousarray(matrices[1:], np.float32).ravel()
        if rest.size:
            ids = np.arange(len(matrices) - 1, dtype=np.uint32)
            self.scene.DuplicateObject(name, "copy", len(matrices) - 1, rest, ids)


def configuration(given: scenes.Scene, samples: int, seed: int) -> dict[str, object]:
    width, height = given.resolution
    depths = {f"path.pathdepth.{kind}": given.depth for kind in ("total", "diffuse", "glossy", "specular")}
    return {
        "renderengine.type": "PATHCPU",
        "renderengine.seed": seed,
        "sampler.type": "SOBOL",
        "sampler.sobol.adaptive.strength": 0.0,
        "lightstrategy.type": "LOG_POWER",
        "path.russianroulette.depth": ROULETTE,
        "path.russianroulette.cap": 0.5,
        "native.threads.count": request.thread_count(),
        "batch.haltspp": samples,
        "path.clamping.variance.maxvalue": 0.0,
        "film.width": width,
        "film.height": height,
        "film.filter.type": "NONE",
        "film.hw.enable": False,
        "film.imagepipelines.0.0.type": "NOP",
        **depths,
    }


def render(builder: Builder, given: scenes.Scene, samples: int, seed: int) -> tuple[float, float, np.ndarray]:
    """Seconds until sampling began, of sampling, and the picture."""
    width, height = given.resolution
    session = pyluxcore.RenderSession(
        pyluxcore.RenderConfig(properties(configuration(given, samples, seed)), builder.scene)
    )
    start = time.perf_counter()
    session.Start()
    begun = time.perf_counter()
    while not session.HasDone():
        time.sleep(0.005)
        session.UpdateStats()
    end = time.perf_counter()
    session.Stop()
    pixels = np.empty(width * height * 3, np.float32)
    session.GetFilm().GetOutputFloat(pyluxcore.FilmOutputType.RGB, pixels)
    return begun - start, end - begun, pixels.reshape(height, width, 3)[::-1]


made = request.make_scene()
samples = request.samples or made.samples
with figures.time("load_s"):
    builder = Builder(made)
figures["build_s"], figures["first_s"], _ = render(builder, made, 1, 1000)
figures["first_picture_s"] = figures["load_s"] + figures["build_s"] + figures["first_s"]
pictures, figures["render_s"] = [], []
for seed in request.seeds:
    _, seconds, picture = render(builder, made, samples, seed)
    figures["render_s"].append(seconds)
    pictures.append(picture)
figures["version"] = pyluxcore.Version()
figures["samples"] = samples
figures["settings"] = {
    "sampler": "Sobol, not adaptive",
    "roulette": f"from bounce {ROULETTE} on, kept by 0.5 at least",
    "depth": made.depth,
    "lights": "log power",
    "clamps": 0,
}
worker.finish(say, request, figures, pictures)
os._exit(0)  # pyluxcore may abort while the interpreter ends
