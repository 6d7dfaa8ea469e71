"""Lights of Scene.add_light() as light shaders of RIB."""

from __future__ import annotations

import math

import numpy as np

import kanuka

from .encode import matrix, request

KINDS = kanuka.light_kinds()
# These are placed by points, and their intensity is the amount over pi: docs/python.md, add_light_shader().
BY_POINTS = ("distant", "point", "spot")
# From RISpec's pictures of the sky to OpenEXR's: base/latlong.h.
OPENEXR_FROM_RISPEC = np.array([[0, 1, 0, 0], [0, 0, 1, 0], [-1, 0, 0, 0], [0, 0, 0, 1]], dtype=float)
APART = ("amount", "position", "direction", "transform", "name", "cone_angle", "cone_delta_angle")


def light(kind: str, handle: str, given: dict[str, object]) -> bytes:
    declared = KINDS[kind]["parameters"]
    values: dict[str, object] = {}
    for name, value in given.items():
        if name in APART or name not in declared or value is None or value == "":
            continue
        rib = declared[name]["rib"][0]
        if isinstance(value, str | kanuka.Spectrum) or hasattr(value, "__fspath__"):
            values[f"string {rib}"] = str(value)
        elif np.ndim(value):
            values[f"vector {rib}"] = np.asarray(value, dtype=float)
        else:
            values[f"float {rib}"] = float(value)  # type: ignore[arg-type]
    for name, rib in (("cone_angle", "coneangle"), ("cone_delta_angle", "conedeltaangle")):
        if name in declared:
            values[f"float {rib}"] = math.radians(float(given.get(name, declared[name]["default"])))  # type: ignore
    amount = np.broadcast_to(np.asarray(given.get("amount", 1.0), dtype=float), 3)
    values["float intensity"] = 1.0
    values["color lightcolor"] = amount / (math.pi if kind in BY_POINTS and not given.get("unit") else 1)
    place = b"" if kind == "ambient" else request("ConcatTransform", matrix(world_from_light(kind, given)))
    shader = request("LightSource", KINDS[kind]["shader"], handle, parameters=values)
    return b"TransformBegin\n" + place + shader + b"TransformEnd\n"


def world_from_light(kind: str, given: dict[str, object]) -> np.ndarray:
    """RISpec's lights shine along +z of their space, those of add_light() along -z (src/python/lights.cpp)."""
    transform = given.get("transform")
    outer = np.eye(4) if transform is None else np.asarray(transform, dtype=float)
    if kind == "environment":
        return outer @ OPENEXR_FROM_RISPEC
    z = np.asarray(given.get("direction", (0, 0, -1)), dtype=float)
    z = z / np.linalg.norm(z)
    up = np.array([0.0, 1, 0]) if abs(z[1]) < 0.9999 else np.array([0.0, 0, -1 if z[1] < 0 else 1])
    x = np.cross(up, z)
    x /= np.linalg.norm(x)
    frame = np.eye(4)
    frame[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    frame[:3, 3] = np.asarray(given.get("position", (0, 0, 0)), dtype=float)
    return outer @ frame
