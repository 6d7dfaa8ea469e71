"""RIB's tokens as bytes. Arrays are in the binary encodings of RISpec 3.2, appendix C.2, which NumPy writes whole and
which lose no bit; kanuka.convert_rib() makes text of them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

Value = object  # a number, a text, a list of texts, an array of numbers


def floats(values: object) -> bytes:
    array = np.ascontiguousarray(values, dtype=">f4").reshape(-1)
    return b"\xcb" + len(array).to_bytes(4, "big") + array.tobytes()  # 0310 + 3: the length has four bytes


def integers(values: object) -> bytes:
    array = np.ascontiguousarray(values, dtype=">i4").reshape(-1)
    coded = np.empty((len(array), 5), dtype=np.uint8)
    coded[:, 0] = 0o203  # a signed number of four bytes, none of them behind the point
    coded[:, 1:] = array.view(np.uint8).reshape(-1, 4)
    return b"[" + coded.tobytes() + b"]"


def text(value: str) -> bytes:
    quoted = value.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return b'"' + quoted.encode() + b'"'


def token(value: Value) -> bytes:
    """Numbers of arrays are floats but where their type is a whole number."""
    if isinstance(value, str):
        return text(value)
    if isinstance(value, bool):
        return str(int(value)).encode()
    if isinstance(value, int | np.integer):
        return str(int(value)).encode()
    if isinstance(value, float | np.floating):
        return repr(float(value)).encode()
    if isinstance(value, Sequence) and (not len(value) or isinstance(value[0], str)):
        return b"[" + b" ".join(text(each) for each in value) + b"]"
    array = np.asarray(value)
    return integers(array) if array.dtype.kind in "iub" else floats(array)


def request(name: str, *arguments: Value, parameters: Mapping[str, Value] | None = None) -> bytes:
    """One, with its line's end. Values of parameters are in brackets."""
    parts = [name.encode(), *(token(each) for each in arguments)]
    for key, value in (parameters or {}).items():
        coded = token(value)
        parts += [text(key), coded if coded[:1] in (b"[", b"\xcb") else b"[" + coded + b"]"]
    return b" ".join(parts) + b"\n"


def matrix(columns: object) -> np.ndarray:
    """A matrix that acts on columns, (4, 4) or (3, 4), as RIB has it: on rows. What is projective is not, as in
    kanuka.Scene."""
    full = np.eye(4)
    full[:3] = np.asarray(columns, dtype=float)[:3]
    return full.T


def moving(requests: Sequence[bytes], times: Sequence[float]) -> bytes:
    """One request for each time; alone, it does not move."""
    if len(requests) == 1:
        return requests[0]
    return request("MotionBegin", np.asarray(times, dtype=float)) + b"".join(requests) + request("MotionEnd")


def times_of(count: int, times: Sequence[float] | None) -> list[float]:
    return list(times) if times is not None else np.linspace(0, 1, count).tolist()


def placed(columns: object, times: Sequence[float] | None) -> bytes:
    """What puts a matrix, or one for each time, in front of the current one."""
    given = np.asarray(columns, dtype=float)
    each = given[None] if given.ndim == 2 else given
    made = [request("ConcatTransform", matrix(one)) for one in each]
    return moving(made, times_of(len(made), times))


def instances(
    handle: str, columns: np.ndarray, times: Sequence[float] | None, differences: Mapping[str, object] | None = None
) -> bytes:
    """ObjectInstance for each matrix, (N, 3 or 4, 4) or (T, N, 3 or 4, 4): rows of bytes that are alike but for it.
    `differences`: values of Attribute "instance", one or one for each; "primvars" are those of "instance:primvar"."""
    given = np.asarray(columns, dtype=np.float32)
    steps = given[None] if given.ndim == 3 else given
    count = steps.shape[1]
    full = np.zeros((len(steps), count, 4, 4), dtype=np.float32)
    full[..., 3, 3] = 1
    full[..., :3, :] = steps[..., :3, :]
    rows = _numbers(full.transpose(0, 1, 3, 2)).reshape(len(steps), count, 64)
    own = {name: values for name, values in (differences or {}).items() if values is not None}
    primvars = own.pop("primvars", {})
    parts = [_alike(b"AttributeBegin\n" if own or primvars else b"TransformBegin\n", count)]
    for name, values in own.items():
        kind = "color" if name == "tint" else "float"  # that of "unique" is a number, too
        parts += _each("instance", f"{kind} {name}", np.reshape(values, (-1, 3 if name == "tint" else 1)), count)
    for key, values in primvars.items():
        if holds_texts(values):
            parts += _each_text("instance:primvar", key, values, count)
        else:
            parts += _each("instance:primvar", *instance_variable(key, values, count), count)
    if len(steps) > 1:
        parts.append(_alike(request("MotionBegin", np.asarray(times_of(len(steps), times), dtype=float)), count))
    for row in rows:
        parts += [_alike(b"ConcatTransform \xcb" + (16).to_bytes(4, "big"), count), row, _alike(b"\n", count)]
    tail = (request("MotionEnd") if len(steps) > 1 else b"") + request("ObjectInstance", handle)
    tail += b"AttributeEnd\n" if own or primvars else b"TransformEnd\n"
    return np.concatenate([*parts, _alike(tail, count)], axis=1).tobytes()


def holds_texts(values: object) -> bool:
    """A text, or a list of texts, or of lists of them."""
    while not isinstance(values, str) and hasattr(values, "__len__") and getattr(values, "ndim", 1) and len(values):
        values = values[0]  # type: ignore[index]
    return isinstance(values, str)


def rows_of_matrices(values: object) -> np.ndarray:
    """Matrices that act on columns as RIB has them, 16 numbers each."""
    return np.asarray(values, dtype=np.float32).reshape(-1, 4, 4).transpose(0, 2, 1).reshape(-1, 16)


def instance_variable(key: str, values: object, count: int) -> tuple[str, np.ndarray]:
    """Its declaration, and its values in rows; types that are not said are what kanuka.Scene takes them for."""
    given = np.asarray(values, dtype=np.float32)
    *classes, name = key.split()
    kind = next((word for word in classes if word not in ("constant", "uniform")), "")
    one = given.shape == (4, 4) and count != 4
    if kind == "matrix" or (not kind and (one or (given.ndim > 1 and given.size == 16 * len(given)))):
        return f"matrix {name}", rows_of_matrices(given)
    triple = kind in ("color", "point", "vector", "normal") or (not kind and (count != 3 or name in ("Cs", "Os")))
    rows = (
        given.reshape(1, -1) if given.shape == (3,) and triple else given.reshape(len(given) if given.ndim else 1, -1)
    )
    width = rows.shape[1]
    return f"{kind or ('color' if width == 3 else 'float' if width == 1 else f'float[{width}]')} {name}", rows


def _each_text(category: str, key: str, values: object, count: int) -> list[np.ndarray]:
    """An Attribute of each instance; one text, or a list of those of an array, is that of all. Blanks behind the
    shorter ones make them as long as others."""
    *classes, name = key.split()
    kind = next((word for word in classes if word not in ("constant", "uniform")), "")
    alone = isinstance(values, str) or (isinstance(values[0], str) and kind not in ("", "string", "string[1]"))
    each = [values] if alone else values
    rows = [(text,) if isinstance(text, str) else tuple(text) for text in each]
    distinct = {row: number for number, row in enumerate(dict.fromkeys(rows))}
    coded = [token([str(text) for text in row]) for row in distinct]
    width = max(map(len, coded))
    table = np.frombuffer(b"".join(text.ljust(width) for text in coded), dtype=np.uint8).reshape(-1, width)
    numbers = np.fromiter((distinct[row] for row in rows), dtype=np.int32)
    size = f"[{len(rows[0])}]" if len(rows[0]) > 1 else ""
    said = f'Attribute "{category}" "uniform string{size} {name}" '.encode()
    shown = np.broadcast_to(table[numbers], (count, width))
    return [_alike(said, count), shown, _alike(b"\n", count)]


def _each(category: str, declaration: str, rows: np.ndarray, count: int) -> list[np.ndarray]:
    """An Attribute of each instance; one row is that of all."""
    width = rows.shape[1]
    each = _numbers(np.broadcast_to(np.asarray(rows, dtype=np.float32), (count, width)))
    coded = f'Attribute "{category}" "uniform {declaration}" '.encode() + b"\xc8" + bytes([width])
    return [_alike(coded, count), each.reshape(count, 4 * width), _alike(b"\n", count)]


def _numbers(values: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(values, dtype=">f4").view(np.uint8)


def _alike(coded: bytes, count: int) -> np.ndarray:
    return np.broadcast_to(np.frombuffer(coded, dtype=np.uint8), (count, len(coded)))
