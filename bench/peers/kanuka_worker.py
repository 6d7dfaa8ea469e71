"""Kanuka, by its Python package; a scene may be a RIB file too. Options: geometry_tolerance, shading_rate, lanes,
watertight."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

import kanuka
import own
import scenes
from peers import worker

SHADERS = Path(__file__).resolve().parent.parent / "shaders"

say = worker.claim_stdout()
request = worker.Request.read()
figures = worker.Figures()


def chain_shader(n: int) -> Path:
    """Writes the chain of noises as a shader of n links; returns its folder."""
    folder = scenes.cache_folder() / "shaders"
    folder.mkdir(exist_ok=True)
    first, links = scenes.chain(n)

    def color(rgb: scenes.Color) -> str:
        return "color(" + ", ".join(f"{value:.6f}" for value in rgb) + ")"

    mixes = "\n".join(f"    c = mix(c, {color(k.color)}, octaves(Q, {k.frequency:.6f}));" for k in links)
    source = f"""// Four octaves of noise, scaled to [0, 1].
float octaves(point Q; float frequency) {{
    float sum = float noise(Q * frequency) + 0.5 * float noise(Q * (2 * frequency));
    sum += 0.25 * float noise(Q * (4 * frequency)) + 0.125 * float noise(Q * (8 * frequency));
    return sum / 1.875;
}}

surface chain{n}() {{
    point Q = transform("object", P);
    color c = {color(first)};
{mixes}
    Oi = Os;
    Ci = Oi * c * diffuse(normalize(N));
}}
"""
    path = folder / f"chain{n}.sl"
    if not path.exists() or path.read_text() != source:
        path.write_text(source)
    return folder


def material(scene: kanuka.Scene, mesh: scenes.Mesh) -> kanuka.Material:
    if mesh.chain:
        scene.options.shader_path = [str(chain_shader(mesh.chain))]
        return kanuka.Material(f"chain{mesh.chain}")
    finish = mesh.finish
    if finish is None:
        return kanuka.Material("matte", color=mesh.color)
    scene.options.shader_path = [str(SHADERS)]
    roughness = finish.alpha**0.5
    if finish.kind == "metal":
        np.savetxt(scenes.metal_file(finish.metal), [np.arange(360, 831), *kanuka.metal(finish.metal)])
        return kanuka.Material(f"metal_{finish.metal}", roughness=roughness)
    medium = finish.medium or scenes.Medium(0, 0)
    inside = {
        "absorption": [medium.absorption] * 3,
        "scattering": [medium.scattering] * 3,
        "meanCosine": medium.mean_cosine,
    }
    if finish.kind == "glass":
        return kanuka.Material("glass", ior=finish.ior, abbe=finish.abbe, roughness=roughness, **inside)
    if finish.kind == "none":
        return kanuka.Material("cloud", **inside)
    if finish.kind == "thin":
        return kanuka.Material("thin", ior=finish.ior)
    if finish.kind == "gloss":
        tail = {"ggx": 0.5, "beckmann": 0.0}[finish.slopes]
        return kanuka.Material("gloss", ior=finish.ior, roughness=roughness, tail=tail)
    return kanuka.Material("lacquer", paint=mesh.color, coatIor=finish.ior, coatRoughness=roughness)


def build(made: scenes.Scene) -> kanuka.Scene:
    if made.stage:
        from kanuka import usd

        scene = usd.load(made.stage, resolution=made.resolution, journal=kanuka.Journal())
        scene.options.max_depth = made.depth
        scene.options.exposure_gain = 1
        return scene
    scene = kanuka.Scene()
    scene.resolution = made.resolution
    scene.options.max_depth = made.depth
    camera = made.camera
    scene.camera = kanuka.Camera(camera.origin, camera.target, camera.up, fov=camera.fov, fov_axis="x")
    for mesh in made.meshes:
        points, faces = mesh.arrays()
        scene.add_mesh(points, faces, material=material(scene, mesh), area_light=mesh.radiance, name=mesh.name)
    for copies in made.copies:
        group = scene.add_group(copies.mesh.name)
        group.add_mesh(*copies.mesh.arrays(), material=material(scene, copies.mesh))
        scene.add_instances(group, np.ascontiguousarray(copies.transforms[:, :3]))
    if made.sky:
        scene.add_light("environment", amount=[made.sky] * 3)
    if made.environment:
        scene.add_light("environment", texture=str(made.environment))
    if panel := made.panel:
        width, height = panel.size
        scene.add_light(
            "quad",
            texture=str(panel.picture),
            position=panel.center,
            direction=panel.direction,
            width=width,
            height=height,
        )
    return scene


def load() -> tuple[kanuka.Scene, int]:
    if request.scene.endswith(".rib"):
        scene = kanuka.load(request.scene)
        scene.resolution = tuple(max(1, round(side * request.scale)) for side in scene.resolution)
        return scene, request.samples or 16
    if maker := own.MAKERS.get(request.scene):
        scene, samples = maker(request.n), 64
        scene.resolution = tuple(max(1, round(side * request.scale)) for side in scene.resolution)
    else:
        made = request.make_scene()
        scene, samples = build(made), made.samples
    scene.options.filter, scene.options.filter_width = "box", (1, 1)
    scene.options.watertight = request.option("watertight", True)
    return scene, request.samples or samples


# A build of before there were stores is asked without.
stores = {"store": request.option("store")} if request.option("store") else {}
pictures: list[np.ndarray] = []
per_seed: dict[str, list[float]] = {}
for seed in request.seeds:
    one = worker.Figures()
    with one.time("load_s"):
        scene, samples = load()
    began = time.process_time()
    with one.time("total_s"):
        picture = kanuka.render(
            scene,
            progressions=samples,
            seed=seed,
            threads=request.thread_count(),
            geometry_tolerance=request.option("geometry_tolerance"),
            shading_rate=request.option("shading_rate"),
            lanes=request.option("lanes", 0),
            **stores,
        )
    one["cpu_s"] = time.process_time() - began  # of all threads
    if picture.journal.error_count:
        raise SystemExit("\n".join(str(message) for message in picture.journal))
    pictures.append(picture["rgb"])
    phases = picture.stats["time"]
    one |= {name: phases[name] for name in ("dice_s", "shade_s", "bvh_s")}
    one["build_s"] = one["dice_s"] + one["shade_s"] + phases.get("store_s", 0) + one["bvh_s"]
    one["render_s"] = phases["transport_s"]
    # Reading aside, from the start of the work to a whole picture of one sample: `load_s` and `build_s` are in it.
    one["first_picture_s"] = one["load_s"] + phases["first_pixel_s"]
    for name, value in one.items():
        per_seed.setdefault(name, []).append(value)

figures["render_s"] = per_seed.pop("render_s")
figures |= {name: float(np.median(values)) for name, values in per_seed.items()}
figures |= {f"{name}_bytes": picture.stats["bytes"][name] for name in ("grids", "lobe_inputs", "bvh")}
figures["store_written_bytes"] = picture.stats["bytes"].get("store_written", 0)
figures |= {
    name: picture.stats["count"][name]
    for name in ("vertices", "micropolygons", "traced_polygons", "rays", "nan_samples")
}
figures["samples"] = samples
figures["settings"] = {
    "sampler": "nets, Owen's scrambling",
    "roulette": "learned by a pilot",
    "depth": scene.options.max_depth,
    "clamps": 0,
}
figures["version"] = kanuka.__version__
worker.finish(say, request, figures, pictures)
