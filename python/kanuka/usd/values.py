"""Values of attributes, looked at before they are used."""

from __future__ import annotations

import math

import numpy as np
from pxr import Usd, UsdShade

from .stage import Say


def decimal(attribute: Usd.Attribute, time: Usd.TimeCode, default: float) -> float:
    """Raises ValueError where it is no number."""
    found = attribute.Get(time) if attribute else None
    if found is None:
        return default
    if not math.isfinite(found):
        raise ValueError(f"{attribute.GetName()} is {float(found):g}, which is no number to render with")
    return float(found)


def size(attribute: Usd.Attribute, time: Usd.TimeCode, *, positive: bool = True) -> float:
    """Raises ValueError where there can be nothing of that size."""
    found = decimal(attribute, time, 0)
    if found < 0 or (positive and found == 0):
        raise ValueError(f"{attribute.GetName()} is {found:g}; it must be {'above 0' if positive else '0 or more'}")
    return found


def resolved(attribute: Usd.Attribute, time: Usd.TimeCode, folder, say: Say) -> str:
    """The path of a file, or nothing."""
    asset = attribute.Get(time) if attribute else None
    if asset is None or not asset.path:
        return ""
    if UsdShade.UdimUtils.IsUdimIdentifier(asset.path):
        layer = next((spec.layer for spec in attribute.GetPropertyStack(time)), None)
        tiles = UsdShade.UdimUtils.ResolveUdimTilePaths(asset.path, layer)
        if not tiles:
            say("warning", f'{attribute.GetPath()}: no tile of "{asset.path}" is found')
            return ""
        return folder.tiles(tiles)
    if not asset.resolvedPath:
        say("warning", f'{attribute.GetPath()}: the file "{asset.path}" is not found')
        return ""
    return folder.file_of(asset.resolvedPath)


def as_numbers(value: object, most: int) -> np.ndarray | None:
    """Of a number, a tuple or a matrix; None: it is none of them, has more, or is not finite."""
    try:
        found = np.array(value, dtype=float)
    except (TypeError, ValueError):
        return None
    return found if 0 < found.size <= most and np.isfinite(found).all() else None
