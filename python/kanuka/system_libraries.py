"""Debian's libraries that the compiled parts need, and what is said where one is missing."""

from __future__ import annotations

import ctypes
import re
from pathlib import Path

# Library: package of Debian 12. tools/runtime_packages.py finds them, and a test holds this table to what was built.
PACKAGES = {
    "libLLVM.so.19.1": "libllvm19",
    "libOpenEXR-3_1.so.30": "libopenexr-3-1-30",
    "libOpenImageIO.so.2.4": "libopenimageio2.4",
    "libOpenImageIO_Util.so.2.4": "libopenimageio2.4",
    "libembree3.so.3": "libembree3-3",
    "libosdCPU.so.3.5.0": "libosdcpu3.5.0",
    "libspng.so.0": "libspng0",
    "libtbb.so.12": "libtbb12",
    "libz.so.1": "zlib1g",
    "libzstd.so.1": "libzstd1",
}


def install_command(packages: list[str] | None = None) -> str:
    """What installs them on Debian 12; by default all."""
    return "apt-get install " + " ".join(packages or sorted(set(PACKAGES.values())))


def explained(error: ImportError) -> ImportError:
    """An error of importing the native module, in words that say what would do."""
    text = str(error)
    if match := re.match(r"(\S+\.so[.\d]*): cannot open shared object file", text):
        missing = [match[1], *(name for name in PACKAGES if name != match[1] and not _loads(name))]
        wanted = sorted({PACKAGES[name] for name in missing if name in PACKAGES})
        text = f"kanuka needs {', '.join(missing)}, which this machine lacks; on Debian 12: {install_command(wanted)}"
    elif isinstance(error, ModuleNotFoundError) and error.name == "kanuka._native":
        others = ", ".join(sorted(path.name for path in Path(__file__).parent.glob("_native*.so")))
        if others:
            text = f"the native module of kanuka was built for another Python: {others}"
        else:
            text = "the native module of kanuka is not built: `make build` in the checkout does it"
    else:
        return error
    return type(error)(text, name=error.name, path=error.path)


def _loads(name: str) -> bool:
    try:
        ctypes.CDLL(name)
    except OSError:
        return False
    return True
