"""What the heads of pictures say of where they were taken from."""

from __future__ import annotations

import struct

import numpy as np

EXR, TIFFS = b"\x76\x2f\x31\x01", {b"II*\0": "<", b"MM\0*": ">"}
# The second is what older writers of EXR called the first.
NAMES = ("worldtoscreen", "worldToNDC")
TIFF_TAG = 33306  # PIXAR_MATRIX_WORLDTOSCREEN of LibTIFF: 16 floats
TIFF_FLOATS = {11: "f", 12: "d"}
LARGEST_HEAD = 1 << 20


def world_to_screen(path: str) -> np.ndarray:
    """(4, 4), on rows: from the model's space to clip space. Raises ValueError where the picture has none."""
    with open(path, "rb") as file:
        head = file.read(LARGEST_HEAD)
        numbers = None
        if head[:4] == EXR:
            numbers = of_exr(head)
        elif (order := TIFFS.get(head[:4])) is not None:
            numbers = of_tiff(file, order)
    if numbers is None or len(numbers) != 16 or not np.isfinite(numbers).all():
        raise ValueError("it has no matrix worldtoscreen")
    return np.array(numbers, dtype=float).reshape(4, 4)


def of_exr(head: bytes) -> tuple[float, ...] | None:
    """OpenEXR File Layout: attributes are a name, a type, a size and the bytes; an empty name ends them."""
    found, at = {}, 8
    while 0 <= at < len(head) and head[at]:
        name_end = head.find(b"\0", at)
        type_end = head.find(b"\0", name_end + 1)
        if name_end < 0 or type_end < 0 or type_end + 5 > len(head):
            break
        name, kind = head[at:name_end].decode("latin-1"), head[name_end + 1 : type_end]
        (size,) = struct.unpack_from("<i", head, type_end + 1)
        data = head[type_end + 5 : type_end + 5 + max(size, 0)]
        letter = {b"m44f": "f", b"m44d": "d", b"floatvector": "f"}.get(kind)
        if name in NAMES and letter and len(data) == 16 * struct.calcsize(letter):
            found[name] = struct.unpack(f"<16{letter}", data)
        if size < 0:
            break
        at = type_end + 5 + size
    return next((found[name] for name in NAMES if name in found), None)


def of_tiff(file, order: str) -> tuple[float, ...] | None:
    """TIFF 6.0: the first directory's entries are a tag, a type, a count and where the values are."""
    file.seek(4)
    file.seek(struct.unpack(f"{order}I", file.read(4))[0])
    count = struct.unpack(f"{order}H", file.read(2).ljust(2, b"\0"))[0]
    entries = file.read(12 * count)
    for at in range(0, len(entries) - 11, 12):
        tag, kind, values, where = struct.unpack_from(f"{order}HHII", entries, at)
        if tag == TIFF_TAG and values == 16 and kind in TIFF_FLOATS:
            layout = f"{order}16{TIFF_FLOATS[kind]}"
            file.seek(where)
            data = file.read(struct.calcsize(layout))
            return struct.unpack(layout, data) if len(data) == struct.calcsize(layout) else None
    return None
