"""Meshes on their way to files: where they stand, what they are called, which way they face."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

CREASE = 40  # degrees: where faces meet at more, the edge is sharp
MANY = 64  # faces around a vertex, of which none is compared with the others


@dataclass
class Mesh:
    name: str
    kind: str
    id: int
    micropolygons: int
    points: np.ndarray  # (N, 3), about the origin of its group
    colors: np.ndarray  # (N, 3), linear Rec.709
    triangles: np.ndarray  # (N, 3)
    error: float = 0.0

    def area(self) -> float:
        return float(np.linalg.norm(face_normals(self.points, self.triangles), axis=1).sum() / 2)


@dataclass
class Instances:
    group: int
    matrices: np.ndarray  # (N, 4, 4), acting on columns: the group's points, about its origin, to those of the parent

    def largest_scale(self) -> float:
        if not len(self.matrices):
            return 0.0
        return float(np.sqrt((self.matrices[:, :3, :3] ** 2).sum(1)).max())


@dataclass
class Group:
    name: str
    origin: np.ndarray
    meshes: list[Mesh]
    instances: list[Instances] = field(default_factory=list)
    copies: int = 0  # in the world
    scale: float = 1.0  # of the largest of these

    def placed(self) -> np.ndarray:
        """What brings its points into its own space."""
        return translation(self.origin)


def translation(by: np.ndarray) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, 3] = by
    return matrix


def group_from(made: dict) -> Group:
    surfaces = [Mesh(**surface) for surface in made["surfaces"]]
    group = Group(made["name"], np.array(made["origin"]), [mesh for mesh in surfaces if len(mesh.triangles)])
    for child, rows in made["instances"]:
        matrices = np.tile(np.eye(4), (len(rows), 1, 1))
        matrices[:, :3] = rows
        group.instances.append(Instances(child, matrices))
    return group


def name_all(groups: list[Group]) -> None:
    """A name of its own for each, of letters, digits and _."""
    taken: set[str] = set()
    for number, group in enumerate(groups):
        group.name = unique(
            group.name if re.match(r"[A-Za-z_]", group.name) else f"group_{group.name or number}", taken
        )
    for group in groups:
        for mesh in group.meshes:
            mesh.name = unique(mesh.name or f"{mesh.kind}_{mesh.id}", taken)


def unique(name: str, taken: set[str]) -> str:
    plain = re.sub(r"[^A-Za-z0-9_]", "_", name)
    if not re.match(r"[A-Za-z_]", plain):
        plain = "_" + plain
    candidate, number = plain, 2
    while candidate in taken:
        candidate, number = f"{plain}_{number}", number + 1
    taken.add(candidate)
    return candidate


def all_placed(groups: list[Group]) -> Iterator[tuple[Mesh, np.ndarray]]:
    """Each mesh once for each place in the world, with (4, 4) matrices that bring its points there."""

    def walk(group: Group, matrix: np.ndarray) -> Iterator[tuple[Mesh, np.ndarray]]:
        for mesh in group.meshes:
            yield mesh, matrix
        for instances in group.instances:
            for each in instances.matrices:
                yield from walk(groups[instances.group], matrix @ each)

    yield from walk(groups[-1], groups[-1].placed())


def transformed(matrix: np.ndarray, mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Points in double precision, and triangles whose outside stays outside where the matrix mirrors."""
    points = mesh.points.astype(float) @ matrix[:3, :3].T + matrix[:3, 3]
    mirrors = np.linalg.det(matrix[:3, :3]) < 0
    return points, mesh.triangles[:, [0, 2, 1]] if mirrors else mesh.triangles


def face_normals(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """As long as twice the area."""
    corners = points.astype(float)[triangles.astype(np.int64)]
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def smooth_normals(points: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Normals (M, 3), the vertex that each is of (M,), and which of them each corner has (N, 3).

    A corner has the mean of the faces around its vertex that its own meets at less than CREASE; corners of one vertex
    with the same faces share theirs.
    """
    faces = face_normals(points, triangles)
    lengths = np.linalg.norm(faces, axis=1)
    unit = faces / np.maximum(lengths, 1e-300)[:, None]
    vertex = triangles.astype(np.int64).ravel()
    order = np.argsort(vertex, kind="stable")  # corners by vertex
    owner = vertex[order]
    face_of = order // 3
    first = np.flatnonzero(np.r_[True, owner[1:] != owner[:-1]])
    sizes = np.diff(np.r_[first, len(owner)])
    size, start = np.repeat(sizes, sizes), np.repeat(first, sizes)
    whole = np.add.reduceat(faces[face_of], first, axis=0)
    sums = np.repeat(whole, sizes, axis=0)
    few = size <= MANY
    at = np.flatnonzero(few)
    pair_a = np.repeat(at, size[at])
    step = np.arange(len(pair_a)) - np.repeat(np.cumsum(size[at]) - size[at], size[at])
    pair_b = start[pair_a] + step
    a, b = face_of[pair_a], face_of[pair_b]
    near = (unit[a] * unit[b]).sum(1) > np.cos(np.radians(CREASE))
    near |= a == b
    of_few = np.zeros((len(order), 3))
    for axis in range(3):  # in a fixed order
        of_few[:, axis] = np.bincount(pair_a[near], faces[b[near], axis], minlength=len(order))
    sums[few] = of_few[few]
    norm = np.linalg.norm(sums, axis=1)
    normals = np.where(norm[:, None] > 0, sums / np.maximum(norm, 1e-300)[:, None], [0.0, 0.0, 1.0])
    keys = np.column_stack([owner, np.round(normals * 1e4).astype(np.int64)])
    _, chosen, number = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    corners = np.empty(len(order), dtype=np.int64)
    corners[order] = number.ravel()
    return normals[chosen], owner[chosen], corners.reshape(-1, 3)


def srgb(colors: np.ndarray) -> np.ndarray:
    c = np.clip(colors.astype(float), 0, 1)
    return np.where(c <= 0.0031308, c * 12.92, 1.055 * c ** (1 / 2.4) - 0.055)
