"""Values of USD as NumPy arrays, and primvars as Kanuka names them."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from pxr import Sdf, Usd, UsdGeom

from kanuka.looks.files import Files
from kanuka.looks.rsl import halves

Colors: TypeAlias = "Callable[[Usd.Attribute, np.ndarray], np.ndarray]"
_SIZES = {"float": 1, "float2": 2, "color": 3, "vector": 3, "normal": 3, "matrix44": 16}
_CLASSES = {
    UsdGeom.Tokens.constant: "constant",
    UsdGeom.Tokens.uniform: "uniform",
    UsdGeom.Tokens.varying: "varying",
    UsdGeom.Tokens.vertex: "vertex",
    UsdGeom.Tokens.faceVarying: "facevarying",
}


def is_list(values: object) -> bool:
    """Whether there is something in it; an attribute of another type than its schema's may hold a number alone."""
    return hasattr(values, "__len__") and len(values) > 0


def rows(values: object, width: int) -> np.ndarray:
    """(N, width) float32; shares the values' memory where it can."""
    array = np.asarray(values, dtype=np.float32)
    return array.reshape(-1, width)


def whole(values: object) -> np.ndarray:
    """(N,) int32."""
    return np.asarray(values if values is not None else (), dtype=np.int32).reshape(-1)


def extremes(values: np.ndarray) -> tuple[int, int]:
    """The least and the greatest of some. NumPy's reductions take several times as long where there are few."""
    return int(values[values.argmin()]), int(values[values.argmax()])


def class_of(interpolation: str) -> str:
    """The storage class; empty where USD has no such interpolation."""
    return _CLASSES.get(interpolation, "")


def primvar(
    found: UsdGeom.Primvar, name: str, kind: str, time: Usd.TimeCode, colors: Colors | None = None
) -> dict[str, np.ndarray]:
    """`{"facevarying color name": array}`; nothing for values that are not of the kind. What has more numbers than
    wanted (colours with alpha) gives its first ones; two numbers are two primvars (rsl.halves). `colors`: what is made
    of an attribute's colours."""
    storage = _CLASSES.get(found.GetInterpolation())
    if kind == "string":
        values = texts(found, time)
        return {f"{storage} string {name}": values} if storage is not None and len(values) else {}
    values = found.ComputeFlattened(time)
    if storage is None or values is None or isinstance(values, str):
        return {}
    try:
        array = np.asarray(values, dtype=np.float32)
    except (TypeError, ValueError):  # texts
        return {}
    if not type(values).__name__.endswith("Array"):  # of Vt
        array = array.reshape(1, -1)
    if array.ndim != 2:
        array = array.reshape(len(array), math.prod(array.shape[1:]))
    if colors is not None and array.shape[1] in (3, 4):
        array = colors(found.GetAttr(), array)
    if (size := found.GetElementSize()) > 1 and len(array) % size == 0:
        array = array.reshape(len(array) // size, -1)
    if not len(array) or array.shape[1] < _SIZES[kind]:
        return {}
    if kind == "matrix44":  # USD's act on rows
        return {f"{storage} matrix {name}": array[:, :16].reshape(-1, 4, 4).transpose(0, 2, 1).astype(np.float32)}
    if kind == "float2":
        return {f"{storage} float {half}": array[:, i].astype(np.float32) for i, half in enumerate(halves(name))}
    return {f"{storage} {kind} {name}": np.ascontiguousarray(array[:, : _SIZES[kind]], dtype=np.float32)}


def texts(found: UsdGeom.Primvar, time: Usd.TimeCode) -> np.ndarray:
    """Those of strings, tokens and files, which are resolved; none where the values are of another type. Each that
    differs is one object, however many have it."""
    values = found.Get(time)
    each = [values] if isinstance(values, (str, Sdf.AssetPath)) else values
    if not is_list(each) or not isinstance(each[0], (str, Sdf.AssetPath)):
        return np.empty(0, dtype=object)
    known: dict[object, str] = {}
    made = np.empty(len(each), dtype=object)
    for i, value in enumerate(each):
        if (text := known.get(value)) is None:
            text = known[value] = text_of(value)
        made[i] = text
    indices = whole(found.GetIndices(time)) if found.IsIndexed() else None
    if indices is None:
        return made
    return made[indices] if len(indices) and indices.min() >= 0 and indices.max() < len(made) else made[:0]


def text_of(value: str | Sdf.AssetPath) -> str:
    """A file that lies in a package is taken out of it."""
    if not isinstance(value, Sdf.AssetPath):
        return str(value)
    path = str(value.resolvedPath or value.path)
    return Files().file_of(path) if "[" in path else path
