"""From a stage to a scene: its camera, picture and light, around what is in it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from pxr import Usd, UsdGeom, UsdRender

import kanuka
from kanuka import standins

from . import cameras, color_config
from .motion import Shutter
from .reader import PURPOSES, Reader
from .render_products import chosen as chosen_products
from .render_products import product_of
from .settings import Settings, settings_of
from .skins import pose
from .spaces import Spaces, rendering_space
from .stage import Say, first_frame, input_error, open_stage
from .transforms import Transforms


def read(
    scene: kanuka.Scene,
    path: str,
    say: Say,
    *,
    frame: float | None,
    camera: str,
    variants: Mapping[str, str],
    mask: Sequence[str],
    purposes: Sequence[str],
    resolution: tuple[int, int] | None = None,
    color_space: str = "",
    product: Sequence[str] = (),
    moving: Callable[[list[kanuka.Camera]], object] = kanuka.Camera.moving,
) -> None:
    """Into an empty scene: the stage at a frame (None: its first), seen by `camera` (empty: its first one), with the
    settings of the first `product` and what all of them show."""
    stage = open_stage(path, say, variants, mask, product)
    time = first_frame(stage) if frame is None else frame
    settings = settings_of(stage, say)
    config = color_config.chosen(stage, say)
    scene.options.color_space = rendering_space(stage, color_space, say, config)
    wanted = chosen_products(stage, settings, product, say, path)
    made = [product_of(prim, settings, time, say) for prim in (wanted if product else wanted[:1])]
    settings = made[0].settings if made else settings
    settings = replace(settings, resolution=resolution or settings.resolution)
    chosen = find_camera(stage, camera, settings.camera, path, say)
    opened, closed = shutter(chosen, time) if settings.motion_blur else (0.0, 0.0)
    times = (time + opened, time + closed) if closed > opened else (time + opened,)
    shot = Shutter(Usd.TimeCode(time if closed > opened else time + opened), tuple(Usd.TimeCode(t) for t in times))
    pose(stage, shot, say)
    shown = tuple(dict.fromkeys(each for one in made for each in one.shown))
    if chosen is not None and is_flat(chosen, shot):
        say("error", f"{chosen.GetPath()}: it is scaled to nothing; the stage is seen from the front instead")
        chosen = None
    shows = tuple(purposes or settings.purposes or PURPOSES)
    spaces = Spaces(say, scene.options.color_space, config)
    reader = Reader(stage, scene, say, shot, spaces, shows, shown)
    if len(times) > 1:
        scene.options.shutter = (0, 1)
    scene.options.shader_path = [*scene.options.shader_path, str(reader.files.folder)]
    scene.options.texture_path = [str(Path(path).resolve().parent)]
    reader.read()
    settle(scene, reader, chosen, settings, time, moving)


def find_camera(stage: Usd.Stage, wanted: str, usual: str, path: str, say: Say) -> Usd.Prim | None:
    """The one that is wanted, else that of the settings, else the first."""
    everyone = [p for p in stage.Traverse(Usd.TraverseInstanceProxies()) if p.IsA(UsdGeom.Camera)]
    for name in filter(None, (wanted, usual)):
        for prim in everyone:
            if name in (str(prim.GetPath()), prim.GetName()):
                return prim
        names = ", ".join(str(p.GetPath()) for p in everyone) or "none"
        if wanted:
            raise input_error(f'there is no camera "{wanted}"; it has {names}', path)
        say("warning", f"{usual}: the settings' camera is not there; the stage has {names}")
    return everyone[0] if everyone else None


def shutter(camera: Usd.Prim | None, time: float) -> tuple[float, float]:
    """Relative to the frame, in time codes."""
    if camera is None:
        return 0.0, 0.0
    schema = UsdGeom.Camera(camera)
    opened, closed = schema.GetShutterOpenAttr().Get(time), schema.GetShutterCloseAttr().Get(time)
    return float(opened or 0), float(closed or 0)


def is_flat(camera: Usd.Prim, shot: Shutter) -> bool:
    matrices = Transforms(shot.frame, shot.times).within(camera, camera.GetStage().GetPseudoRoot())
    return not (np.abs(np.linalg.det(matrices)) > 1e-12).all()


def settle(
    scene: kanuka.Scene,
    reader: Reader,
    camera: Usd.Prim | None,
    settings: Settings,
    time: float,
    moving: Callable[[list[kanuka.Camera]], object],
) -> None:
    """Camera, picture and light, where the stage has none as well."""
    if camera is not None:
        settings = look_through(scene, reader, camera, settings, time, moving)
    else:
        look_from_front(scene, reader, settings)
    scene.options.pixel_aspect = settings.pixel_aspect
    if settings.crop:
        scene.options.crop = settings.crop
    if not reader.lights and not reader.mesh_lights.number:
        standins.lights(scene)
        reader.say("info", "the stage has no lights: it is lit by a white sky and a sun")


def look_through(
    scene: kanuka.Scene,
    reader: Reader,
    camera: Usd.Prim,
    settings: Settings,
    time: float,
    moving: Callable[[list[kanuka.Camera]], object],
) -> Settings:
    """Returns the settings as they are with the camera's aperture."""
    schema, path = UsdGeom.Camera(camera), camera.GetPath()
    across, up = schema.GetHorizontalApertureAttr().Get(time), schema.GetVerticalApertureAttr().Get(time)
    aspect = across / up if across > 0 and up > 0 else 0
    if not 1 / 64 <= aspect <= 64:
        reader.say("warning", f"{path}: apertures of {across:g} by {up:g} make no picture; 16 by 9 stands in")
        aspect = cameras.DEFAULT_ASPECT
    height = max(1, round(cameras.DEFAULT_WIDTH / aspect))
    scene.resolution = settings.resolution or (cameras.DEFAULT_WIDTH, height)
    size = scene.resolution
    if settings.conform == UsdRender.Tokens.adjustPixelAspectRatio:
        settings = replace(settings, pixel_aspect=aspect * size[1] / size[0])
    placed = reader.world @ reader.transforms.within(camera, reader.stage.GetPseudoRoot())
    slices = [placed] if placed.ndim == 2 else list(placed)
    made = [
        cameras.camera_of(camera, matrix, at, size[0] / size[1] * settings.pixel_aspect, settings)
        for matrix, at in zip(slices, reader.shutter.times, strict=False)
    ]
    scene.camera = made[0] if len(made) == 1 else moving(made)
    scene.options.exposure_gain = float(schema.ComputeLinearExposureScale(reader.shutter.frame))
    return settings


def look_from_front(scene: kanuka.Scene, reader: Reader, settings: Settings) -> None:
    scene.resolution = settings.resolution or (cameras.DEFAULT_WIDTH, 540)
    bounds = scene.bounds()
    if bounds is None:
        reader.say("warning", "the stage has nothing to look at")
        scene.camera = kanuka.Camera((0, 0, 5), (0, 0, 0))
        return
    width, height = scene.resolution
    scene.camera = standins.camera(bounds, width / height * settings.pixel_aspect)
    reader.say("info", "the stage has no camera: it is seen from the front, so that all of it is in the picture")
