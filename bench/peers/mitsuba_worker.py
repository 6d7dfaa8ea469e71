"""Mitsuba 3. Variants: llvm_ad_spectral, llvm_ad_rgb, scalar_spectral, scalar_rgb.

The LLVM variants compile a kernel for each scene; it is compiled before the clock runs, and its time is `compile_s`.
"""

from __future__ import annotations

import glob
import os
import tempfile
from pathlib import Path

import drjit
import mitsuba as mi
import numpy as np

import scenes
import still_life
from peers import worker

say = worker.claim_stdout()
request = worker.Request.read()
figures = worker.Figures()

# Of several LLVMs, Dr.Jit takes the one it finds first; 14 is too old for it and 15 crashes with AVX-512.
if "DRJIT_LIBLLVM_PATH" not in os.environ:
    for version in ("20.1", "19.1", "18.1", "17", "16"):
        if found := glob.glob(f"/usr/lib/*/libLLVM*{version}*"):
            os.environ["DRJIT_LIBLLVM_PATH"] = found[0]
            break

mi.set_variant(request.variant)
drjit.set_thread_count(request.thread_count())

Place = mi.ScalarTransform4f
ROULETTE = 5  # paths of so many vertices may end early, as with its defaults; ours from the fourth bounce on
folder = tempfile.TemporaryDirectory()  # meshes that Mitsuba reads as files


def material(mesh: scenes.Mesh) -> dict:
    if mesh.chain:
        raise SystemExit("Mitsuba has no procedural textures: it cannot render the chain of noises")
    color = {"type": "rgb", "value": list(mesh.color)}
    finish = mesh.finish
    if finish is None:
        return {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": color}}
    if finish.abbe:
        raise SystemExit("Mitsuba's glass does not disperse")
    rough = {"distribution": finish.slopes, "alpha": finish.alpha} if finish.alpha else {}
    kind = "rough" if finish.alpha else ""
    glass = {"int_ior": finish.ior, "ext_ior": 1.0}
    if finish.kind == "metal":
        metal = as_ours(finish, {"type": f"{kind}conductor", **index_of(finish.metal), **rough}, "metal")
        return {"type": "twosided", "bsdf": metal}
    if finish.kind == "glass":
        return as_ours(finish, {"type": f"{kind}dielectric", **glass, **rough}, "glass")
    if finish.kind == "gloss":
        return as_ours(finish, {"type": f"{kind}dielectric", **glass, **rough, "specular_transmittance": 0.0})
    if finish.kind == "thin":
        return {"type": "thindielectric", **glass}
    if finish.kind == "none":
        return {"type": "null"}
    coat = {"type": f"{kind}plastic", "int_ior": finish.ior, "diffuse_reflectance": color, "nonlinear": True, **rough}
    if finish.alpha and request.option("as_ours"):
        coat["diffuse_reflectance"] = 0.0  # paint is below the coat as ours is
    return as_ours(finish, coat, "coat", color)


def as_ours(finish: scenes.Finish, bsdf: dict, lossless: str = "", paint: dict | None = None) -> dict:
    """Where pictures are compared: masking and shadowing, and what meets several facets, are as ours are by design."""
    if not finish.alpha or not request.option("as_ours"):
        return bsdf
    from peers import mitsuba_smith

    made = {"type": mitsuba_smith.NAME, "facets": bsdf, "slopes": finish.slopes, "alpha": finish.alpha}
    if paint:
        made["reflectance"] = paint
    return made | {"lossless": lossless, "spectra": str(scenes.metal_file(finish.metal)), "ior": finish.ior}


def medium(given: scenes.Medium) -> dict:
    extinction = given.absorption + given.scattering
    return {
        "type": "homogeneous",
        "sigma_t": extinction,
        "albedo": given.scattering / extinction,
        "phase": {"type": "hg", "g": given.mean_cosine},
    }


def index_of(metal: str) -> dict:
    """The spectra that Kanuka has, where the caller left them; else Mitsuba's own."""
    path = scenes.metal_file(metal)
    if "spectral" not in request.variant or not path.exists():
        return {"material": metal}
    nm, n, k = np.loadtxt(path)

    def spectrum(values: np.ndarray) -> dict:
        return {"type": "spectrum", "value": list(zip(nm.tolist(), values.tolist(), strict=True))}

    return {"eta": spectrum(n), "k": spectrum(k)}


def in_band(band: tuple[float, float], strength: float) -> dict:
    """Mitsuba's own white, D65 of unit luminance, cut to a band; its tables are linear between knots."""
    white = mi.load_dict({"type": "d65", "scale": 1.0})
    interaction = mi.SurfaceInteraction3f()

    def at(nm: float) -> float:
        interaction.wavelengths = mi.Spectrum(nm)
        return float(np.array(white.eval(interaction)).ravel()[0])

    knots = np.linspace(*band, 6)
    values = [(knots[0] - 1e-3, 0.0), *((float(nm), strength * at(float(nm))) for nm in knots), (knots[-1] + 1e-3, 0.0)]
    return {
        "type": "irregular",
        "wavelengths": ",".join(f"{nm:.4f}" for nm, _ in values),
        "values": ",".join(f"{value:.6g}" for _, value in values),
    }


def shape(mesh: scenes.Mesh, band: tuple[float, float] | None = None) -> dict:
    path = mesh.path
    if path is None:
        path = Path(folder.name) / f"{mesh.name}.ply"
        scenes.write_ply(path, mesh.triangles())
    made = {"type": "ply", "filename": str(path), "face_normals": True, "bsdf": material(mesh)}
    if mesh.finish and mesh.finish.medium:
        made["interior"] = medium(mesh.finish.medium)
    if mesh.radiance:
        light = in_band(band, mesh.radiance[0]) if band else {"type": "rgb", "value": list(mesh.radiance)}
        made["emitter"] = {"type": "area", "radiance": light}
    return made


def describe(scene: scenes.Scene) -> dict:
    width, height = scene.resolution
    camera = scene.camera
    media = any(mesh.finish and mesh.finish.medium for mesh in scene.meshes)
    described = {
        "type": "scene",
        # max_depth counts the vertices after the camera's, the light's own included; in media, particles too.
        "integrator": {
            "type": "volpath" if media else "path",
            "max_depth": -1 if scene.depth >= scenes.UNBOUNDED else scene.depth + 1,
            "rr_depth": ROULETTE,
        },
        "sensor": {
            "type": "perspective",
            "fov": camera.fov,
            "fov_axis": "x",
            "near_clip": 1e-3,
            "far_clip": 1e5,
            "to_world": Place().look_at(origin=camera.origin, target=camera.target, up=camera.up),
            "sampler": {"type": request.option("sampler", "independent")},
            "film": {
                "type": "hdrfilm",
                "width": width,
                "height": height,
                "rfilter": {"type": "box"},
                "pixel_format": "rgb",
                "component_format": "float32",
            },
        },
    }
    if scene.sky:
        described["sky"] = {"type": "constant", "radiance": {"type": "rgb", "value": [scene.sky] * 3}}
    if scene.environment:
        described["sky"] = {"type": "envmap", "filename": str(still_life.from_pole(scene.environment))}
    if panel := scene.panel:
        right, up, forward = panel.axes()
        half = np.array(panel.size) / 2
        place = np.eye(4)
        place[:3, :] = np.stack([right * half[0], up * half[1], forward, panel.center], axis=-1)
        upside_down = mi.Bitmap(np.ascontiguousarray(np.array(mi.Bitmap(str(panel.picture)))[::-1]))  # v goes up
        picture = {"type": "bitmap", "bitmap": upside_down, "filter_type": "nearest", "wrap_mode": "clamp"}
        described["panel"] = {
            "type": "rectangle",
            "to_world": Place(place),
            "bsdf": {"type": "diffuse", "reflectance": 0.0},
            "emitter": {"type": "area", "radiance": picture},
        }
    with figures.time("load_s"):
        for mesh in scene.meshes:
            described[f"mesh_{mesh.name}"] = mi.load_dict(shape(mesh, scene.band))
    for copies in scene.copies:
        described[copies.mesh.name] = {"type": "shapegroup", "mesh": shape(copies.mesh)}
        group = {"type": "ref", "id": copies.mesh.name}
        with figures.time("load_s"):
            for i, matrix in enumerate(copies.transforms.astype(float)):
                described[f"copy_{i}"] = {"type": "instance", "to_world": Place(matrix), "shapegroup": group}
    return described


def equal_energy() -> np.ndarray:
    """RGB of a spectrum that is 1 everywhere: what a white picture of an area light shines with, not D65."""
    nm = np.linspace(360, 830, 4701)
    x, y, z = (float(np.trapezoid(np.array(c), nm)) for c in mi.cie1931_xyz(mi.Float(nm)))
    return np.array(mi.xyz_to_srgb(mi.Color3f(x / y, 1, z / y))).ravel()


def render(scene: mi.Scene, samples: int, seed: int) -> np.ndarray:
    image = mi.render(scene, spp=samples, seed=seed)
    drjit.eval(image)
    drjit.sync_thread()
    return np.array(image)


described = describe(made := request.make_scene())
samples = request.samples or made.samples
with figures.time("build_s"):
    loaded = mi.load_dict(described)
described.clear()
with figures.time("first_s"):
    render(loaded, 1, 1000)
if "llvm" in request.variant:
    with figures.time("compile_s"):  # the kernel differs from that of a single sample
        render(loaded, samples, 1001)

white = equal_energy() if made.panel and "spectral" in request.variant else 1
pictures, figures["render_s"] = [], []
for seed in request.seeds:
    one = worker.Figures()
    with one.time("s"):
        picture = render(loaded, samples, seed)
    pictures.append(picture / white)
    figures["render_s"].append(one["s"])
figures["first_picture_s"] = sum(figures.get(name, 0) for name in ("load_s", "build_s", "first_s"))
figures["version"] = mi.__version__
figures["samples"] = samples
figures["settings"] = {
    "sampler": request.option("sampler", "independent"),
    "roulette": f"from vertex {ROULETTE} on, kept by 0.95 at most",
    "depth": made.depth,
    "clamps": 0,
}
worker.finish(say, request, figures, pictures)
