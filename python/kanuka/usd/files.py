"""Files that reading a stage makes: shaders of its materials, pictures that lie in packages.

They stay until the program ends, since scenes are rendered after they are read.
"""

from __future__ import annotations

import hashlib
import tempfile
from functools import cache
from pathlib import Path


@cache
def _folder() -> tempfile.TemporaryDirectory:
    return tempfile.TemporaryDirectory(prefix="kanuka-usd-", ignore_cleanup_errors=True)


class Files:
    def __init__(self) -> None:
        self.folder = Path(_folder().name)

    def file_of(self, resolved: str) -> str:
        """A path that can be opened: what lies in a .usdz ("a.usdz[b.png]") is taken out."""
        package, bracket, inside = resolved.partition("[")
        if not bracket or Path(resolved).exists():
            return resolved
        from pxr import Ar

        asset = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(resolved))
        if asset is None:
            return resolved
        name = hashlib.sha256(package.encode()).hexdigest()[:12] + "_" + Path(inside.rstrip("]")).name
        path = self.folder / name
        if not path.exists():
            with asset.GetBuffer() as buffer:
                path.write_bytes(bytes(buffer))
        return str(path)

    def shader(self, source: str) -> str:
        """The name of a shader whose text is `source`, where NAME stands for it: the same text, the same name."""
        name = "usd_" + hashlib.sha256(source.encode()).hexdigest()[:16]
        path = self.folder / f"{name}.sl"
        if not path.exists():
            path.write_text(source.replace("NAME", name))
        return name
