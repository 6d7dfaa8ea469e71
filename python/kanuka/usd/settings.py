"""UsdRender: the settings of a stage, which its picture is made by."""

from __future__ import annotations

from dataclasses import dataclass, field

from pxr import Usd, UsdRender

from .stage import Say


@dataclass
class Settings:
    """What stands in the stage's settings; None = they do not say."""

    camera: str = ""
    resolution: tuple[int, int] | None = None
    pixel_aspect: float = 1
    crop: tuple[float, float, float, float] | None = None  # left, right, bottom, top of UsdRender, from the top here
    motion_blur: bool = True
    depth_of_field: bool = True
    purposes: tuple[str, ...] = ()
    unread: list[str] = field(default_factory=list)


def settings_of(stage: Usd.Stage, say: Say) -> Settings:
    """Those that the stage names; the defaults where it names none."""
    found = UsdRender.Settings.GetStageRenderSettings(stage)
    if not found:
        if stage.HasAuthoredMetadata("renderSettingsPrimPath"):
            say("warning", f"there are no settings at {stage.GetMetadata('renderSettingsPrimPath')}")
        return Settings()
    path, made = found.GetPath(), Settings()
    width, height = found.GetResolutionAttr().Get() or (0, 0)
    if found.GetResolutionAttr().HasAuthoredValue():
        if 0 < width <= 1 << 16 and 0 < height <= 1 << 16:
            made.resolution = int(width), int(height)
        else:
            say("warning", f"{path}: a resolution of {width} by {height} makes no picture; the camera's stands in")
    aspect = found.GetPixelAspectRatioAttr().Get()
    if aspect and aspect > 0:
        made.pixel_aspect = float(aspect)
    if found.GetDataWindowNDCAttr().HasAuthoredValue():
        left, bottom, right, top = (min(max(float(x), 0.0), 1.0) for x in found.GetDataWindowNDCAttr().Get())
        if left < right and bottom < top:
            made.crop = left, right, 1 - top, 1 - bottom
        else:
            say("warning", f"{path}: a data window of nothing; all is rendered")
    if targets := found.GetCameraRel().GetForwardedTargets():
        made.camera = str(targets[0])
    made.motion_blur = not found.GetDisableMotionBlurAttr().Get()
    made.depth_of_field = not found.GetDisableDepthOfFieldAttr().Get()
    if found.GetIncludedPurposesAttr().HasAuthoredValue():
        made.purposes = tuple(str(purpose) for purpose in found.GetIncludedPurposesAttr().Get())
    if products := found.GetProductsRel().GetForwardedTargets():
        names = ", ".join(str(target) for target in products)
        say("info", f"{path}: its products ({names}) are not made: -o names the picture, `aovs` of render() its layers")
    return made
