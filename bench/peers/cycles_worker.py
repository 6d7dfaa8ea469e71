"""Cycles, by Blender's Python module."""

from __future__ import annotations

import math
import tempfile
import time
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix, Vector

import scenes
from peers import worker

say = worker.claim_stdout()
request = worker.Request.read()
figures = worker.Figures()


def settings(scene: scenes.Scene) -> None:
    render, cycles = bpy.context.scene.render, bpy.context.scene.cycles
    render.engine, cycles.device = "CYCLES", "CPU"
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.max_bounces = scene.depth - 1  # bounces after the first hit
    cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = scene.depth - 1
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    cycles.light_sampling_threshold = 0  # by default lights that bring little are left to chance
    cycles.blur_glossy = 0  # by default reflections of reflections are blurred
    cycles.pixel_filter_type, cycles.filter_width = "BOX", 1
    render.threads_mode, render.threads = "FIXED", request.thread_count()
    render.resolution_x, render.resolution_y = scene.resolution
    render.resolution_percentage = 100
    render.use_persistent_data = True  # so that a second picture costs rendering alone
    render.image_settings.file_format = "OPEN_EXR"
    render.image_settings.color_depth, render.image_settings.color_mode = "32", "RGB"
    bpy.context.scene.view_settings.view_transform = "Raw"


def material(mesh: scenes.Mesh) -> bpy.types.Material:
    made = bpy.data.materials.new(mesh.name)
    made.use_nodes = True
    tree = made.node_tree
    tree.nodes.clear()
    new, link = tree.nodes.new, tree.links.new
    output, diffuse = new("ShaderNodeOutputMaterial"), new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (*mesh.color, 1)
    if mesh.chain:
        link(noise_chain(tree, mesh.chain), diffuse.inputs["Color"])
    if mesh.finish:
        link(finish(tree, mesh).outputs[0], output.inputs["Surface"])
        return made
    if not mesh.radiance:
        link(diffuse.outputs[0], output.inputs["Surface"])
        return made
    # Light leaves the front alone; both sides reflect.
    strength = max(mesh.radiance)
    glow, both, choice = new("ShaderNodeEmission"), new("ShaderNodeAddShader"), new("ShaderNodeMixShader")
    glow.inputs["Color"].default_value = (*(c / strength for c in mesh.radiance), 1)
    glow.inputs["Strength"].default_value = strength
    link(glow.outputs[0], both.inputs[0])
    link(diffuse.outputs[0], both.inputs[1])
    link(new("ShaderNodeNewGeometry").outputs["Backfacing"], choice.inputs[0])
    link(both.outputs[0], choice.inputs[1])
    link(diffuse.outputs[0], choice.inputs[2])
    link(choice.outputs[0], output.inputs["Surface"])
    made.cycles.emission_sampling = "FRONT"
    return made


def finish(tree: bpy.types.NodeTree, mesh: scenes.Mesh) -> bpy.types.Node:
    given = mesh.finish
    roughness = given.alpha**0.5
    if given.kind == "glass":
        node = tree.nodes.new("ShaderNodeBsdfGlass")
        node.inputs["Roughness"].default_value, node.inputs["IOR"].default_value = roughness, given.ior
        return node
    node = tree.nodes.new("ShaderNodeBsdfPrincipled")
    node.inputs["Roughness"].default_value, node.inputs["IOR"].default_value = roughness, given.ior
    metal = given.kind == "metal"
    node.inputs["Base Color"].default_value = (*(given.metal_color if metal else mesh.color), 1)
    node.inputs["Metallic"].default_value = float(metal)
    return node


def noise_chain(tree: bpy.types.NodeTree, n: int) -> bpy.types.NodeSocket:
    new, link = tree.nodes.new, tree.links.new
    position = new("ShaderNodeTexCoord").outputs["Object"]
    first, links = scenes.chain(n)
    color: scenes.Color | bpy.types.NodeSocket = first
    for each in links:
        noise, mix = new("ShaderNodeTexNoise"), new("ShaderNodeMix")
        noise.inputs["Scale"].default_value, noise.inputs["Detail"].default_value = each.frequency, 3
        link(position, noise.inputs["Vector"])
        mix.data_type = "RGBA"
        link(noise.outputs[0], mix.inputs[0])
        a, b = (socket for socket in mix.inputs if socket.type == "RGBA")
        if isinstance(color, tuple):
            a.default_value = (*color, 1)
        else:
            link(color, a)
        b.default_value = (*each.color, 1)
        color = next(socket for socket in mix.outputs if socket.type == "RGBA")
    return color


def points_object(name: str, points: np.ndarray) -> bpy.types.Object:
    data = bpy.data.meshes.new(name)
    data.vertices.add(len(points))
    data.vertices.foreach_set("co", np.ascontiguousarray(points, np.float32).ravel())
    return bpy.data.objects.new(name, data)


def mesh_object(mesh: scenes.Mesh) -> bpy.types.Object:
    points, faces = mesh.triangles()
    made = points_object(mesh.name, points)
    made.data.loops.add(faces.size)
    made.data.loops.foreach_set("vertex_index", faces.ravel())
    made.data.polygons.add(len(faces))
    made.data.polygons.foreach_set("loop_start", np.arange(0, faces.size, 3, dtype=np.int32))
    made.data.update(calc_edges=False)
    made.data.shade_flat()
    made.data.materials.append(material(mesh))
    return made


def scatter(copies: scenes.Copies) -> bpy.types.Object:
    """Points at the copies' places with rotation and scale as attributes, and the mesh instanced on them."""
    m = copies.transforms
    made = points_object(f"{copies.mesh.name} copies", m[:, :3, 3])
    zero = np.zeros(len(m), np.float32)
    turn = made.data.attributes.new("turn", "FLOAT_VECTOR", "POINT")
    turn.data.foreach_set("vector", np.stack([zero, np.arctan2(m[:, 0, 2], m[:, 0, 0]), zero], -1).ravel())
    size = made.data.attributes.new("size", "FLOAT", "POINT")
    size.data.foreach_set("value", np.ascontiguousarray(m[:, 1, 1]))

    tree = bpy.data.node_groups.new("copies", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    new, link = tree.nodes.new, tree.links.new
    place, what = new("GeometryNodeInstanceOnPoints"), new("GeometryNodeObjectInfo")
    turn_in, size_in = new("GeometryNodeInputNamedAttribute"), new("GeometryNodeInputNamedAttribute")
    turn_in.data_type, size_in.data_type = "FLOAT_VECTOR", "FLOAT"
    turn_in.inputs[0].default_value, size_in.inputs[0].default_value = "turn", "size"
    what.inputs["Object"].default_value, what.inputs["As Instance"].default_value = mesh_object(copies.mesh), True
    rotation = new("FunctionNodeEulerToRotation")
    link(new("NodeGroupInput").outputs[0], place.inputs["Points"])
    link(what.outputs["Geometry"], place.inputs["Instance"])
    link(turn_in.outputs["Attribute"], rotation.inputs[0])
    link(rotation.outputs[0], place.inputs["Rotation"])
    link(size_in.outputs["Attribute"], place.inputs["Scale"])
    link(place.outputs[0], new("NodeGroupOutput").inputs[0])
    made.modifiers.new("copies", "NODES").node_group = tree
    return made


def camera(given: scenes.Camera) -> bpy.types.Object:
    data = bpy.data.cameras.new("camera")
    data.sensor_fit, data.angle = "HORIZONTAL", math.radians(given.fov)
    data.clip_start, data.clip_end = 1e-3, 1e5
    made = bpy.data.objects.new("camera", data)
    back = (Vector(given.origin) - Vector(given.target)).normalized()
    right = Vector(given.up).cross(back).normalized()
    axes = Matrix((right, back.cross(right), back)).transposed()
    made.matrix_world = Matrix.Translation(Vector(given.origin)) @ axes.to_4x4()
    return made


def sky(radiance: float) -> None:
    world = bpy.data.worlds.new("sky")
    world.use_nodes = True
    tree = world.node_tree
    tree.nodes.clear()
    background, output = tree.nodes.new("ShaderNodeBackground"), tree.nodes.new("ShaderNodeOutputWorld")
    background.inputs[0].default_value = (radiance, radiance, radiance, 1)
    tree.links.new(background.outputs[0], output.inputs[0])
    bpy.context.scene.world = world


def environment(path: Path) -> None:
    world = bpy.data.worlds.new("environment")
    world.use_nodes = True
    tree = world.node_tree
    tree.nodes.clear()
    new, link = tree.nodes.new, tree.links.new
    background, output = new("ShaderNodeBackground"), new("ShaderNodeOutputWorld")
    picture, turn = new("ShaderNodeTexEnvironment"), new("ShaderNodeMapping")
    picture.image = bpy.data.images.load(str(path))
    picture.image.colorspace_settings.name = "Non-Color"
    turn.vector_type = "POINT"
    turn.inputs["Scale"].default_value = (-1, 1, 1)  # its pictures run the other way round
    turn.inputs["Rotation"].default_value = Matrix(((0, 0, -1), (-1, 0, 0), (0, 1, 0))).to_euler()
    link(new("ShaderNodeTexCoord").outputs["Generated"], turn.inputs["Vector"])
    link(turn.outputs[0], picture.inputs["Vector"])
    link(picture.outputs[0], background.inputs[0])
    link(background.outputs[0], output.inputs[0])
    bpy.context.scene.world = world


def build(scene: scenes.Scene) -> None:
    if scene.stage:
        bpy.ops.wm.usd_import(filepath=str(scene.stage))
        bpy.context.scene.camera = next(each for each in bpy.data.objects if each.type == "CAMERA")
        return
    place = bpy.context.scene.collection.objects.link
    for mesh in scene.meshes:
        place(mesh_object(mesh))
    for copies in scene.copies:
        place(scatter(copies))
    bpy.context.scene.camera = camera(scene.camera)
    place(bpy.context.scene.camera)
    if scene.sky:
        sky(scene.sky)
    if scene.environment:
        environment(scene.environment)


log: list[tuple[float, str]] = []


def render(samples: int, seed: int, path: Path) -> tuple[float, float]:
    """Seconds until sampling began, and of sampling."""
    scene = bpy.context.scene
    scene.cycles.samples, scene.cycles.seed = samples, seed
    scene.update_tag()  # changed settings of Cycles do not invalidate the scene by themselves
    scene.render.filepath = str(path)
    log.clear()
    start = time.perf_counter()
    bpy.ops.render.render(write_still=True)
    begun = next(at for at, text in log if "Sample 0/" in text)
    finished = next(at for at, text in log if text.endswith("Finished"))  # writing the file comes after
    return begun - start, finished - begun


def read(path: Path, resolution: tuple[int, int]) -> np.ndarray:
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = "Non-Color"  # the file is linear Rec.709; no transform
    pixels = np.empty(resolution[0] * resolution[1] * 4, np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return pixels.reshape(resolution[1], resolution[0], 4)[::-1, :, :3]


bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.app.handlers.render_stats.append(lambda text, *_: log.append((time.perf_counter(), str(text))))
made = request.make_scene()
samples = request.samples or made.samples
settings(made)
with figures.time("load_s"):
    build(made)
with tempfile.TemporaryDirectory() as folder:
    path = Path(folder) / "picture.exr"
    figures["build_s"], figures["first_s"] = render(1, 1000, path)
    figures["first_picture_s"] = figures["load_s"] + figures["build_s"] + figures["first_s"]
    pictures, figures["render_s"] = [], []
    for seed in request.seeds:
        figures["render_s"].append(render(samples, seed, path)[1])
        pictures.append(read(path, made.resolution))
figures["version"] = bpy.app.version_string
figures["settings"] = {
    "sampler": bpy.context.scene.cycles.sampling_pattern.lower(),
    "roulette": f"by throughput, from bounce {bpy.context.scene.cycles.min_light_bounces + 1} on",
    "depth": made.depth,
    "light tree": bpy.context.scene.cycles.use_light_tree,
    "light threshold, glossy filter, clamps": 0,
}
figures["samples"] = samples
worker.finish(say, request, figures, pictures)
