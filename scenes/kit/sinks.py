"""Where the parts of a scene go: into a kanuka.Scene, or into a folder of arrays that is one again later.

    sink = Folder("out/motu")          or  Live(kanuka.Scene())
    leaf = sink.group("leaf")
    leaf.mesh(points, faces, Look("leaf", {"color front": (0.1, 0.3, 0.05)}))
    sink.instances(leaf, matrices)     # (N, 3, 4)
    sink.close()
    scene = read("out/motu")

A folder holds an .npy file for each array, and index.json: the calls in order. Arrays are mapped, not read, so what
is loaded is copied once. An array that is given again (the faces of alike lattices) is one file.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np

import kanuka

VERSION = 1


@dataclass(frozen=True)
class Look:
    """A surface, and what displaces it: names of shaders and their parameters, declared where floats would not do."""

    surface: str
    parameters: dict = field(default_factory=dict)
    displacement: str = ""
    displacement_parameters: dict = field(default_factory=dict)
    bound: float = 0  # of the displacement

    def material(self) -> kanuka.Material:
        moved = kanuka.Shader(self.displacement, **self.displacement_parameters) if self.displacement else None
        given = {name: tuple(v) if isinstance(v, list) else v for name, v in self.parameters.items()}
        declared = {name: value for name, value in given.items() if " " in name}
        plain = {name: value for name, value in given.items() if " " not in name}
        return kanuka.Material(
            self.surface, displacement=moved, displacement_bound=self.bound, parameters=declared, **plain
        )


class Live:
    """Into a kanuka.Scene at once."""

    def __init__(self, scene: kanuka.Scene, into: kanuka.Scene | kanuka.Group | None = None) -> None:
        self.scene = scene
        self.into = scene if into is None else into
        self.ids: dict[str, int] = {}  # of what has a name, as in the picture's layer `id`

    def group(self, name: str) -> Live:
        return Live(self.scene, self.scene.add_group(name))

    def mesh(self, points: np.ndarray, faces: np.ndarray, look: Look, **more: object) -> None:
        self.ids[str(more.get("name", ""))] = self.into.add_mesh(points, faces, material=look.material(), **more)

    def curves(self, points: np.ndarray, counts: np.ndarray, look: Look, **more: object) -> None:
        self.into.add_curves(points, counts, material=look.material(), **more)

    def patches(self, points: np.ndarray, look: Look, **more: object) -> None:
        self.into.add_patches(points, material=look.material(), **more)

    def instances(self, group: Live, transforms: np.ndarray, **differences: np.ndarray) -> None:
        self.into.add_instances(group.into, transforms, **differences)

    def close(self) -> None:
        pass


class Nothing:
    """Nowhere: what would be made is counted, not kept."""

    def group(self, name: str) -> Nothing:
        return self

    def mesh(self, *given: object, **more: object) -> None:
        pass

    curves = patches = instances = mesh

    def close(self) -> None:
        pass


class FolderPart:
    """A group of a folder, or (number 0) its scene."""

    def __init__(self, folder: Folder, number: int) -> None:
        self.folder, self.number = folder, number

    def mesh(self, points: np.ndarray, faces: np.ndarray, look: Look, **more: object) -> None:
        self.folder.call(self.number, "mesh", {"points": points, "faces": faces, "look": look, **more})

    def curves(self, points: np.ndarray, counts: np.ndarray, look: Look, **more: object) -> None:
        self.folder.call(self.number, "curves", {"points": points, "counts": counts, "look": look, **more})

    def patches(self, points: np.ndarray, look: Look, **more: object) -> None:
        self.folder.call(self.number, "patches", {"points": points, "look": look, **more})

    def instances(self, group: FolderPart, transforms: np.ndarray, **differences: np.ndarray) -> None:
        self.folder.call(self.number, "instances", {"transforms": transforms, "of": group.number, **differences})


class Folder(FolderPart):
    """Into files, in the order of the calls. The same calls write the same bytes."""

    def __init__(self, path: str | Path, about: dict | None = None) -> None:
        super().__init__(self, 0)
        self.path = Path(path)
        self.path.mkdir(parents=True, exist_ok=True)
        (self.path / "index.json").unlink(missing_ok=True)  # until all is there again
        for old in self.path.glob("[0-9]*.npy"):
            old.unlink()
        self.about = about or {}
        self.groups: list[str] = []
        self.calls: list[dict] = []
        self.kept: dict[int, tuple[np.ndarray, str]] = {}  # by id(); the array is held, so that no other gets its id
        self.count = 0

    def group(self, name: str) -> FolderPart:
        self.groups.append(name)
        return FolderPart(self, len(self.groups))

    def file(self, array: np.ndarray, shared: bool) -> str:
        if shared and id(array) in self.kept:
            return self.kept[id(array)][1]
        name = f"{self.count:05d}.npy"
        self.count += 1
        kind = np.int32 if np.issubdtype(array.dtype, np.integer) else np.float32
        np.save(self.path / name, np.ascontiguousarray(array, kind))
        if shared:
            self.kept[id(array)] = array, name
        return name

    def call(self, number: int, what: str, given: dict) -> None:
        entry = {"group": number, "call": what}
        for name, value in given.items():
            if isinstance(value, np.ndarray):
                entry.setdefault("arrays", {})[name] = self.file(value, shared=name in ("faces", "counts"))
            elif isinstance(value, Look):
                entry["look"] = asdict(value)
            elif name == "primvars":
                entry["primvars"] = {k: self.file(np.asarray(v), shared=False) for k, v in value.items()}
            else:
                entry.setdefault("words", {})[name] = value
        self.calls.append(entry)

    def close(self) -> None:
        index = {"version": VERSION, "about": self.about, "groups": self.groups, "calls": self.calls}
        (self.path / "index.json").write_text(json.dumps(index, indent=1) + "\n")


def index_of(path: str | Path) -> dict:
    file = Path(path) / "index.json"
    if not file.is_file():
        raise FileNotFoundError(f"{file} is missing: what wrote the folder did not end, or it is none of these")
    index = json.loads(file.read_text())
    if index.get("version") != VERSION:
        raise ValueError(f"{file}: version {index.get('version')}, where {VERSION} is read: make the folder again")
    return index


def read(path: str | Path, sink: Live | None = None) -> tuple[kanuka.Scene, dict]:
    """The scene that a folder holds, and what was noted about it."""
    path = Path(path)
    index = index_of(path)
    sink = sink or Live(kanuka.Scene())
    parts = [sink] + [sink.group(name) for name in index["groups"]]

    def array(name: str) -> np.ndarray:
        return np.load(path / name, mmap_mode="r")

    for entry in index["calls"]:
        given = {name: array(file) for name, file in entry.get("arrays", {}).items()} | entry.get("words", {})
        if "look" in entry:
            given["look"] = Look(**entry["look"])
        if "primvars" in entry:
            given["primvars"] = {name: array(file) for name, file in entry["primvars"].items()}
        part = parts[entry["group"]]
        if entry["call"] == "instances":
            part.instances(parts[given.pop("of")], given.pop("transforms"), **given)
        else:
            getattr(part, entry["call"])(**given)
    return sink.scene, index["about"]
