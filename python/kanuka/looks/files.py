"""Files that reading a scene makes: shaders of its materials, pictures that lie in packages.

They lie beside the cache of compiled shaders, under names that their contents give, so that a second render finds the
same shaders, and what a store keeps of them.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from functools import cache
from pathlib import Path

import kanuka


@cache
def _temporary() -> tempfile.TemporaryDirectory:
    return tempfile.TemporaryDirectory(prefix="kanuka-usd-", ignore_cleanup_errors=True)


def writable(kept: Path) -> Path:
    """Of a cache; one that lasts until the program ends where nothing can be kept: scenes are rendered after they are
    read."""
    try:
        kept.mkdir(parents=True, exist_ok=True)
        if os.access(kept, os.W_OK):
            return kept
    except OSError:
        pass
    return Path(_temporary().name)


def folder() -> Path:
    shaders = kanuka.shader_cache_folder()
    return writable(Path(shaders).parent / "usd") if shaders else Path(_temporary().name)


def write(path: Path, data: bytes) -> None:
    """Whole or not at all: others may write the same."""
    with tempfile.NamedTemporaryFile(dir=path.parent, delete=False) as file:
        file.write(data)
    os.replace(file.name, path)


class Files:
    def __init__(self) -> None:
        self.folder = folder()

    def file_of(self, resolved: str) -> str:
        """A path that can be opened: what lies in a .usdz ("a.usdz[b.png]") is taken out."""
        _, bracket, inside = resolved.partition("[")
        if not bracket or Path(resolved).exists():
            return resolved
        from pxr import Ar

        asset = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(resolved))
        if asset is None:
            return resolved
        data = bytes(asset.GetBuffer())
        path = self.folder / (hashlib.sha256(data).hexdigest()[:16] + Path(inside.rstrip("]")).suffix)
        if not path.exists():
            write(path, data)
        return str(path)

    def tiles(self, resolved: list[tuple[str, str]]) -> str:
        """The name that stands for pictures of UDIM tiles, given as (path, number)."""
        path, number = resolved[0]
        if "[" not in path or Path(path).exists():
            head, _, tail = path.rpartition(number)
            return f"{head}<UDIM>{tail}"
        names = [Path(self.file_of(path)) for path, _ in resolved]
        together = hashlib.sha256("".join(name.name for name in names).encode()).hexdigest()[:16]
        for name, (_, number) in zip(names, resolved, strict=True):
            tile = self.folder / f"{together}.{number}{name.suffix}"
            if not tile.exists():
                write(tile, name.read_bytes())
        return str(self.folder / f"{together}.<UDIM>{names[0].suffix}")

    def shader(self, source: str) -> str:
        """The name of a shader whose text is `source`, where NAME stands for it: the same text, the same name."""
        name = "usd_" + hashlib.sha256(source.encode()).hexdigest()[:16]
        path = self.folder / f"{name}.sl"
        if not path.exists():
            write(path, source.replace("NAME", name).encode())
        return name
