"""RIB with its binary arrays of floats (RISpec 3.2, C.2): what plug-ins give, made of arrays without a loop."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np


def floats(values: np.ndarray) -> bytes:
    """An array of floats: 0310 + w, the count in w + 1 bytes, big-endian numbers."""
    array = np.ascontiguousarray(values, dtype=">f4").ravel()
    return b"\xcb" + len(array).to_bytes(4, "big") + array.tobytes()


def integers(values: np.ndarray) -> bytes:
    """An array of integers; as text, which is the one form that takes them all."""
    array = np.asarray(values).ravel()
    if len(array) and np.all(array == array[0]):
        return b"[" + (str(int(array[0])).encode() + b" ") * len(array) + b"]"
    return b"[" + " ".join(map(str, array.tolist())).encode() + b"]"


def string(text: str) -> bytes:
    return b'"' + text.replace("\\", "\\\\").replace('"', '\\"').encode() + b'"'


def parameters(values: dict[str, np.ndarray]) -> bytes:
    """Inline declarations and their values: {"varying float width": array}."""
    return b" ".join(string(name) + b" " + floats(v) for name, v in values.items())


CATMULL_ROM = b'Basis "catmull-rom" 1 "catmull-rom" 1\n'


def curves(points: np.ndarray, values: dict[str, np.ndarray], run: int = 50_000) -> Iterable[bytes]:
    """Cubic curves through points (curves, points, 3); the basis is Catmull-Rom. `values` have a row a curve.

    The curve before the first point and behind the last goes on straight, so that it reaches both.
    """
    first, last = 2 * points[:, :1] - points[:, 1:2], 2 * points[:, -1:] - points[:, -2:-1]
    whole = np.concatenate([first, points, last], axis=1).astype(np.float32)
    yield CATMULL_ROM
    for begin in range(0, len(whole), run):
        part = slice(begin, begin + run)
        count = len(whole[part])
        given = {"vertex point P": whole[part], **{name: v[part] for name, v in values.items()}}
        yield b'Curves "cubic" ' + integers(np.full(count, whole.shape[1])) + b' "nonperiodic" '
        yield parameters(given) + b"\n"


def mesh(counts: np.ndarray, indices: np.ndarray, points: np.ndarray, values: dict[str, np.ndarray]) -> bytes:
    given = {"vertex point P": points, **values}
    return b"PointsPolygons " + integers(counts) + b" " + integers(indices) + b" " + parameters(given) + b"\n"


def instances(handle: str, matrices: np.ndarray) -> bytes:
    """ObjectInstance at each of the (N, 4, 4) matrices, which act on columns."""
    before = b"TransformBegin ConcatTransform \xc8\x10"
    after = b" ObjectInstance " + string(handle) + b" TransformEnd\n"
    n = len(matrices)
    record = np.empty((n, len(before) + 64 + len(after)), np.uint8)
    record[:, : len(before)] = np.frombuffer(before, np.uint8)
    rows = np.ascontiguousarray(np.swapaxes(matrices, 1, 2).reshape(n, 16), dtype=">f4")  # RIB's act on rows
    record[:, len(before) : len(before) + 64] = rows.view(np.uint8).reshape(n, 64)
    record[:, len(before) + 64 :] = np.frombuffer(after, np.uint8)
    return record.tobytes()
