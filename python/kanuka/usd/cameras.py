"""Cameras of a stage."""

from __future__ import annotations

import math

import numpy as np
from pxr import Usd, UsdGeom

import kanuka

from .settings import Settings

DEFAULT_WIDTH = 960
DEFAULT_ASPECT = 16 / 9
TENTH = 0.1  # apertures and focal lengths are in tenths of the stage's unit


def camera_of(
    prim: Usd.Prim, world_from_camera: np.ndarray, time: Usd.TimeCode, aspect: float, settings_of_stage: Settings
) -> kanuka.Camera:
    """As it is at one time; `aspect` is the picture's width by its height. Where the aperture has another, the settings
    say which of its sides gives way."""
    schema = UsdGeom.Camera(prim)

    def value(attribute: Usd.Attribute, default: float) -> float:
        found = attribute.Get(time)
        return default if found is None else float(found)

    width = max(value(schema.GetHorizontalApertureAttr(), 20.955), 1e-6)
    height = max(value(schema.GetVerticalApertureAttr(), 15.2908), 1e-6)
    right, up = value(schema.GetHorizontalApertureOffsetAttr(), 0), value(schema.GetVerticalApertureOffsetAttr(), 0)
    narrow, policy = width / height < aspect, settings_of_stage.conform
    if policy == "adjustApertureWidth" or (policy != "adjustApertureHeight" and narrow != (policy == "cropAperture")):
        width = height * aspect
    else:
        height = width / aspect
    focal_length = max(value(schema.GetFocalLengthAttr(), 50), 1e-6)
    clipping = schema.GetClippingRangeAttr().Get(time)
    near, far = (clipping[0], clipping[1]) if clipping is not None else (1.0, 1e6)
    settings: dict[str, object] = {"near_clip": max(float(near), 1e-4), "far_clip": max(float(far), 1e-3)}
    if schema.GetProjectionAttr().Get(time) == UsdGeom.Tokens.orthographic:
        half = (width / 2 * TENTH, height / 2 * TENTH)
        shift = (right * TENTH, up * TENTH)
        window = (shift[0] - half[0], shift[0] + half[0], shift[1] - half[1], shift[1] + half[1])
        return kanuka.Camera.from_matrix(
            unscaled(world_from_camera), projection="orthographic", screen_window=window, **settings
        )
    settings["fov"] = math.degrees(2 * math.atan(width / 2 / focal_length))
    settings["fov_axis"] = "x"
    if right or up:
        # In units of half of the shorter side.
        unit = min(width, height) / 2
        settings["fov"] = math.degrees(2 * math.atan(unit / focal_length))
        settings["fov_axis"] = "smaller"
        settings["screen_window"] = (
            (right - width / 2) / unit,
            (right + width / 2) / unit,
            (up - height / 2) / unit,
            (up + height / 2) / unit,
        )
    f_stop, focus = value(schema.GetFStopAttr(), 0), value(schema.GetFocusDistanceAttr(), 0)
    if settings_of_stage.depth_of_field and f_stop > 0 and focus > 0:
        settings |= {"f_stop": f_stop, "focal_length": focal_length * TENTH, "focal_distance": focus}
    return kanuka.Camera.from_matrix(unscaled(world_from_camera), **settings)


def unscaled(matrix: np.ndarray) -> np.ndarray:
    """A camera's matrix without scale and shear, which no lens has."""
    matrix = matrix.copy()
    x, y = matrix[:3, 0], matrix[:3, 1]
    x = x / np.linalg.norm(x)
    y = y - x * (x @ y)
    y = y / np.linalg.norm(y)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2] = x, y, np.cross(x, y)
    return matrix
