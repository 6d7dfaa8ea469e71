"""UsdRender: the settings of a stage, which its pictures are made by."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from pxr import Usd, UsdRender

from .stage import Say

POLICIES = ("adjustPixelAspectRatio", "adjustApertureWidth", "adjustApertureHeight", "expandAperture", "cropAperture")


@dataclass(frozen=True)
class Settings:
    """What stands in the stage's settings, or in those of a product; None = they do not say."""

    camera: str = ""
    resolution: tuple[int, int] | None = None
    pixel_aspect: float = 1
    conform: str = "expandAperture"  # what gives way where the aperture has another shape than the picture
    crop: tuple[float, float, float, float] | None = None  # left, right, bottom, top of UsdRender, from the top here
    motion_blur: bool = True
    depth_of_field: bool = True
    purposes: tuple[str, ...] = ()
    products: tuple[str, ...] = ()


def settings_of(stage: Usd.Stage, say: Say) -> Settings:
    """Those that the stage names; the defaults where it names none."""
    found = UsdRender.Settings.GetStageRenderSettings(stage)
    if not found:
        if stage.HasAuthoredMetadata("renderSettingsPrimPath"):
            say("warning", f"there are no settings at {stage.GetMetadata('renderSettingsPrimPath')}")
        return Settings()
    made = overridden(Settings(), found.GetPrim(), say)
    if found.GetIncludedPurposesAttr().HasAuthoredValue():
        purposes = found.GetIncludedPurposesAttr().Get() or ()
        made = replace(made, purposes=tuple(str(purpose) for purpose in purposes))
    return replace(made, products=tuple(str(target) for target in found.GetProductsRel().GetForwardedTargets()))


def overridden(settings: Settings, prim: Usd.Prim, say: Say) -> Settings:
    """With what a prim of UsdRender says itself in their place: a product's fallbacks are not above its settings."""
    base, path = UsdRender.SettingsBase(prim), prim.GetPath()
    changed: dict[str, object] = {}
    if base.GetResolutionAttr().HasAuthoredValue():
        width, height = base.GetResolutionAttr().Get() or (0, 0)
        if 0 < width <= 1 << 16 and 0 < height <= 1 << 16:
            changed["resolution"] = int(width), int(height)
        else:
            say("warning", f"{path}: a resolution of {width} by {height} makes no picture; the camera's stands in")
    if base.GetPixelAspectRatioAttr().HasAuthoredValue():
        aspect = float(base.GetPixelAspectRatioAttr().Get() or 0)
        if 0 < aspect < math.inf:
            changed["pixel_aspect"] = aspect
        else:
            say("warning", f"{path}: a pixelAspectRatio of {aspect:g} makes no picture; 1 stands in")
    if base.GetAspectRatioConformPolicyAttr().HasAuthoredValue():
        policy = str(base.GetAspectRatioConformPolicyAttr().Get())
        if policy in POLICIES:
            changed["conform"] = policy
        else:
            say("warning", f'{path}: there is no aspectRatioConformPolicy "{policy}"; expandAperture stands in')
    if base.GetDataWindowNDCAttr().HasAuthoredValue():
        given = [float(x) for x in base.GetDataWindowNDCAttr().Get()]
        left, bottom, right, top = (min(max(x, 0.0), 1.0) for x in given)
        if min(given) < 0 or max(given) > 1:
            say("warning", f"{path}: a data window beyond the picture is cut at its edges: there is no overscan")
        if left < right and bottom < top:
            changed["crop"] = left, right, 1 - top, 1 - bottom
        else:
            say("warning", f"{path}: a data window of nothing; all is rendered")
    if targets := base.GetCameraRel().GetForwardedTargets():
        changed["camera"] = str(targets[0])
    # instantaneousShutter is the old name of disableMotionBlur.
    for attribute in (base.GetInstantaneousShutterAttr(), base.GetDisableMotionBlurAttr()):
        if attribute.HasAuthoredValue():
            changed["motion_blur"] = not attribute.Get()
    if base.GetDisableDepthOfFieldAttr().HasAuthoredValue():
        changed["depth_of_field"] = not base.GetDisableDepthOfFieldAttr().Get()
    return replace(settings, **changed)  # type: ignore[arg-type]
