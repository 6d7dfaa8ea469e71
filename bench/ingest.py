"""Reading USD: a stage of 10 000 meshes, and a PointInstancer of a million places.

Beside each, in the same round, a loop of USD's own Python that opens the stage and gets what has to be read: arrays,
and matrices in the world. That is the least that a reader in Python takes.
"""

from __future__ import annotations

import gc
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import intervals
from settings import Found, Say, Settings

SIDE = 10  # vertices of a mesh along each side
MATERIALS = 20
NUMBERS = {"meshes": 10_000, "instances": 1_000_000}
SCENES = tuple(NUMBERS)
ARRAYS = ("points", "faceVertexCounts", "faceVertexIndices", "primvars:displayColor", "primvars:st")


def stage_of_meshes(path: Path, number: int) -> None:
    """Each of points of its own, 81 quads, a place and a colour; one of 20 materials. Some turn, some are
    subdivided, some have colours for each vertex, some have st."""
    from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade, Vt

    rng = np.random.default_rng(1)
    stage = Usd.Stage.CreateNew(str(path))
    materials = []
    for k in range(MATERIALS):
        material = UsdShade.Material.Define(stage, f"/looks/m{k}")
        shader = UsdShade.Shader.Define(stage, f"/looks/m{k}/s")
        shader.CreateIdAttr("UsdPreviewSurface")
        shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(*rng.random(3)))
        material.CreateSurfaceOutput().ConnectToSource(shader.CreateOutput("surface", Sdf.ValueTypeNames.Token))
        materials.append(material)
    corner = np.arange(SIDE * SIDE).reshape(SIDE, SIDE)
    quads = np.stack([corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]], -1).reshape(-1)
    counts = Vt.IntArray.FromNumpy(np.full(len(quads) // 4, 4, np.int32))
    indices = Vt.IntArray.FromNumpy(quads.astype(np.int32))
    flat = np.stack(np.meshgrid(*[np.linspace(0, 1, SIDE)] * 2, indexing="ij"), -1).reshape(-1, 2)
    for i in range(number):
        mesh = UsdGeom.Mesh.Define(stage, f"/g{i // 100}/m{i}")
        points = np.column_stack([flat, rng.normal(0, 0.03, len(flat))]).astype(np.float32)
        mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points))
        mesh.CreateFaceVertexCountsAttr(counts)
        mesh.CreateFaceVertexIndicesAttr(indices)
        mesh.CreateSubdivisionSchemeAttr("none" if i % 3 else "catmullClark")
        mesh.AddTranslateOp().Set(Gf.Vec3d(i % 100, i // 100, 0))
        if i % 4:
            mesh.AddRotateXYZOp().Set(Gf.Vec3f(*rng.random(3) * 30))
        primvars, each = UsdGeom.PrimvarsAPI(mesh), len(flat) if i % 2 else 1
        colors = rng.random((each, 3)).astype(np.float32)
        color = primvars.CreatePrimvar(
            "displayColor", Sdf.ValueTypeNames.Color3fArray, "vertex" if i % 2 else "constant"
        )
        color.Set(Vt.Vec3fArray.FromNumpy(colors))
        if i % 2 == 0:
            st = primvars.CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, "vertex")
            st.Set(Vt.Vec2fArray.FromNumpy(flat.astype(np.float32)))
        UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(materials[i % MATERIALS])
    stage.Save()


def stage_of_instances(path: Path, number: int) -> None:
    """Cubes that are turned and scaled."""
    from pxr import Usd, UsdGeom, Vt

    rng = np.random.default_rng(1)
    stage = Usd.Stage.CreateNew(str(path))
    instancer = UsdGeom.PointInstancer.Define(stage, "/many")
    UsdGeom.Cube.Define(stage, "/many/cube").CreateSizeAttr(0.01)
    instancer.CreatePrototypesRel().AddTarget("/many/cube")
    instancer.CreateProtoIndicesAttr(Vt.IntArray.FromNumpy(np.zeros(number, np.int32)))
    instancer.CreatePositionsAttr(Vt.Vec3fArray.FromNumpy(rng.random((number, 3)).astype(np.float32)))
    instancer.CreateScalesAttr(Vt.Vec3fArray.FromNumpy(rng.uniform(0.5, 1, (number, 3)).astype(np.float32)))
    turns = rng.normal(size=(number, 4))
    turns /= np.linalg.norm(turns, axis=1)[:, None]
    instancer.CreateOrientationsAttr(Vt.QuathArray.FromNumpy(turns.astype(np.float16)))
    stage.Save()


MAKERS: dict[str, Callable[[Path, int], None]] = {"meshes": stage_of_meshes, "instances": stage_of_instances}


def by_usd(path: Path) -> object:
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.Open(str(path))
    places = UsdGeom.XformCache(Usd.TimeCode(1))
    kept: list[object] = []
    for prim in stage.Traverse():
        if prim.IsA(UsdGeom.Mesh):
            values = (prim.GetAttribute(name).Get(1) for name in ARRAYS)
            kept.append([np.asarray(v) for v in values if v is not None])
            kept.append(np.array(places.GetLocalToWorldTransform(prim)))
        elif prim.IsA(UsdGeom.PointInstancer):
            kept.append(np.asarray(UsdGeom.PointInstancer(prim).ComputeInstanceTransformsAtTime(1, 1)))
    return kept


def by_kanuka(path: Path) -> object:
    from kanuka import usd

    return usd.load(path)


def timed(read: Callable[[Path], object], path: Path) -> tuple[float, float]:
    """Seconds by the clock, and of the processor."""
    gc.collect()
    clock, processor = time.perf_counter(), time.process_time()
    kept = read(path)
    found = time.perf_counter() - clock, time.process_time() - processor
    del kept
    return found


def measure(settings: Settings, scene: str, say: Say) -> Found:
    """For run.py."""
    number = NUMBERS[scene] // 100 if settings.quick else NUMBERS[scene]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "stage.usdc"
        MAKERS[scene](path, number)
        for read in (by_usd, by_kanuka):
            read(path)  # what is imported, compiled and cached
        ours, theirs = [], []
        for _ in range(1 if settings.quick else settings.rounds):
            theirs.append(timed(by_usd, path))
            ours.append(timed(by_kanuka, path))
    found: Found = {"number": number}
    for name, rounds in (("ours", ours), ("usd", theirs)):
        found[f"{name}_s"] = statistics.median(clock for clock, _ in rounds)
        found[f"{name}_processor_s"] = statistics.median(processor for _, processor in rounds)
    found["ratio"] = vars(intervals.of_ratio([p for _, p in ours], [p for _, p in theirs]))
    found["seconds"] = vars(intervals.of([clock for clock, _ in ours]))
    say(f"  {number:,} {scene}: {found['ours_s']:.2f} s, USD's own Python {found['usd_s']:.2f} s")
    return found
