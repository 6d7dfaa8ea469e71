"""Files of OBJ, PLY and USD. Each appears under its name when it is whole."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import BinaryIO

import numpy as np

from .meshes import Group, Mesh, all_placed, smooth_normals, srgb, transformed, translation


@contextlib.contextmanager
def whole(path: Path) -> Iterator[BinaryIO]:
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent or ".")
    try:
        with os.fdopen(handle, "wb") as file:
            yield file
        umask = os.umask(0)
        os.umask(umask)
        os.chmod(name, 0o666 & ~umask)
        os.replace(name, path)
    except BaseException:
        with contextlib.suppress(OSError):
            os.unlink(name)
        raise


def lines(form: str, *columns: np.ndarray) -> bytes:
    rows = zip(*(column.tolist() for array in columns for column in array.T), strict=True)
    return "".join([form % row for row in rows]).encode()


def copy_names(groups: list[Group]) -> Iterator[tuple[str, Mesh, np.ndarray]]:
    seen: dict[str, int] = {}
    for mesh, matrix in all_placed(groups):
        seen[mesh.name] = seen.get(mesh.name, 0) + 1
        yield (mesh.name if seen[mesh.name] == 1 else f"{mesh.name}.{seen[mesh.name]}"), mesh, matrix


# ---- OBJ


def write_obj(path: Path, groups: list[Group]) -> int:
    """An object for each primitive; colours, in sRGB, follow the positions."""
    vertices = normals = 0
    with whole(path) as file:
        file.write(b"# Kanuka: surfaces with the albedo of their materials; colours of vertices are sRGB\n")
        for name, mesh, matrix in copy_names(groups):
            points, triangles = transformed(matrix, mesh)
            directions, _, corners = smooth_normals(points, triangles)
            file.write(f"o {name}\n".encode())
            file.write(lines("v %.9g %.9g %.9g %.4f %.4f %.4f\n", points, srgb(mesh.colors)))
            file.write(lines("vn %.4f %.4f %.4f\n", directions))
            at, facing = triangles.astype(np.int64) + vertices + 1, corners + normals + 1
            both = np.stack([at, facing], 2).reshape(-1, 6)
            file.write(lines("f %d//%d %d//%d %d//%d\n", both))
            vertices += len(points)
            normals += len(directions)
    return vertices


# ---- PLY


def write_ply(path: Path, groups: list[Group]) -> int:
    """One mesh: faces say which primitive they are of. Where an edge is sharp there is a vertex for each side."""
    vertex = np.dtype([("p", "<f4", 3), ("n", "<f4", 3), ("c", "u1", 3)])
    face = np.dtype([("count", "u1"), ("v", "<i4", 3), ("primitive", "<i4")])
    names, all_vertices, all_faces, total = [], [], [], 0
    for name, mesh, matrix in copy_names(groups):
        points, triangles = transformed(matrix, mesh)
        normals, owner, corners = smooth_normals(points, triangles)
        here = np.empty(len(owner), vertex)
        here["p"], here["n"] = points[owner], normals
        here["c"] = np.round(srgb(mesh.colors)[owner] * 255)
        faces = np.empty(len(corners), face)
        faces["count"], faces["v"], faces["primitive"] = 3, corners + total, len(names)
        names.append(name)
        all_vertices.append(here)
        all_faces.append(faces)
        total += len(owner)
    head = ["ply", "format binary_little_endian 1.0", "comment Kanuka: surfaces with the albedo of their materials"]
    head += [f"comment primitive {number} {name}" for number, name in enumerate(names)]
    head += [f"element vertex {total}", *(f"property float {name}" for name in ("x", "y", "z", "nx", "ny", "nz"))]
    head += [f"property uchar {name}" for name in ("red", "green", "blue")]
    head += [f"element face {sum(map(len, all_faces))}", "property list uchar int vertex_indices"]
    head += ["property int primitive", "end_header", ""]
    with whole(path) as file:
        file.write("\n".join(head).encode())
        for array in (*all_vertices, *all_faces):
            file.write(array.tobytes())
    return total


# ---- USD

USD_HEAD = """#usda 1.0
(
    defaultPrim = "World"
    doc = "Kanuka: surfaces with the albedo of their materials"
    metersPerUnit = 1
    upAxis = "Y"
)

"""


def write_usd(path: Path, groups: list[Group]) -> int:
    """Text, which files named .usd may be as well. Groups are prims that instances refer to."""
    used = [group for group in groups[:-1] if group.copies]
    with whole(path) as file:
        file.write(USD_HEAD.encode())
        if used:
            file.write(b'over "Prototypes"\n{\n')
            for group in used:
                write_group(file, group, groups)
            file.write(b"}\n\n")
        world = groups[-1]
        world.name = "World"
        write_group(file, world, groups)
    return sum(len(mesh.points) for group in groups if group.copies for mesh in group.meshes)


def write_group(file: BinaryIO, group: Group, groups: list[Group]) -> None:
    file.write(f'def Xform "{group.name}"\n{{\n'.encode())
    for mesh in group.meshes:
        write_mesh(file, mesh, group.placed())
    for number, instances in enumerate(group.instances):
        child = groups[instances.group]
        if not child.copies:
            continue
        # Points of a group are in its own space here, not about its origin.
        before, after = group.placed(), translation(-child.origin)
        for k, matrix in enumerate(instances.matrices):
            rows = (before @ matrix @ after).T
            text = ", ".join("(" + ", ".join(f"{x:.9g}" for x in row) + ")" for row in rows.tolist())
            name = f"{child.name}_{number}_{k}"
            file.write(
                f'def Xform "{name}" (\n    instanceable = true\n'
                f"    prepend references = </Prototypes/{child.name}>\n)\n{{\n"
                f"    matrix4d xformOp:transform = ( {text} )\n"
                '    uniform token[] xformOpOrder = ["xformOp:transform"]\n}\n'.encode()
            )
    file.write(b"}\n")


def values(form: str, array: np.ndarray) -> bytes:
    return lines(form, array).rstrip(b", ")


def write_mesh(file: BinaryIO, mesh: Mesh, matrix: np.ndarray) -> None:
    points, triangles = transformed(matrix, mesh)
    normals, owner, corners = smooth_normals(points, triangles)
    sharp = len(owner) != len(points)
    of_normals = normals[corners.ravel()] if sharp else normals
    low, high = points.min(0), points.max(0)
    extent = ", ".join("(" + ", ".join(f"{x:.9g}" for x in corner) + ")" for corner in (low, high))
    put = file.write
    put(f'def Mesh "{mesh.name}"\n{{\n'.encode())
    put(b'    uniform token subdivisionScheme = "none"\n    uniform token orientation = "rightHanded"\n')
    put(f"    float3[] extent = [{extent}]\n".encode())
    put(b"    int[] faceVertexCounts = [" + b", ".join([b"3"] * len(triangles)) + b"]\n")
    put(b"    int[] faceVertexIndices = [" + values("%d, %d, %d, ", triangles) + b"]\n")
    put(b"    point3f[] points = [" + values("(%.9g, %.9g, %.9g), ", points) + b"]\n")
    put(b"    normal3f[] normals = [" + values("(%.4f, %.4f, %.4f), ", of_normals) + b"] (\n")
    put(f'        interpolation = "{"faceVarying" if sharp else "vertex"}"\n    )\n'.encode())
    put(b"    color3f[] primvars:displayColor = [")
    put(values("(%.5g, %.5g, %.5g), ", np.clip(mesh.colors, 0, 1)) + b"] (\n")
    put(b'        interpolation = "vertex"\n    )\n}\n')


WRITERS: dict[str, Callable[[Path, list[Group]], int]] = {
    ".obj": write_obj,
    ".ply": write_ply,
    ".usd": write_usd,
    ".usda": write_usd,
}
