"""UsdRender: RenderProducts, the pictures that a stage asks for."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from pxr import Usd, UsdRender

from .render_vars import Shown, var_of
from .settings import Settings, overridden
from .stage import Say, input_error


@dataclass(frozen=True)
class Product:
    """A picture that a stage asks for, at one frame.

    path: of the prim. name: of the file, as authored, with the frame's number in it. settings: camera, resolution, …;
    products of equal settings are made by one render. layers: what its file has, for Picture.write(); none = all.
    aovs: what render() is asked for.
    """

    path: str
    name: str
    settings: Settings
    layers: tuple[str, ...] = ()
    aovs: tuple[str, ...] = ()
    shown: tuple[Shown, ...] = ()


def chosen(stage: Usd.Stage, settings: Settings, wanted: Sequence[str], say: Say, file: str) -> list[Usd.Prim]:
    """Products by path or name, or those of the settings, as far as they are pictures.

    Raises Error where one that is wanted is not there, or is no picture.
    """
    if wanted:
        return [_wanted(stage, name, file) for name in wanted]
    found = []
    for path in settings.products:
        prim = stage.GetPrimAtPath(path)
        if not prim or not prim.IsA(UsdRender.Product):
            say("warning", f"{path}: the settings name it as a product, but there is no RenderProduct")
        elif (kind := kind_of(prim)) != UsdRender.Tokens.raster:
            say("warning", f"{path}: products of type {kind} are not made, only raster")
        else:
            found.append(prim)
    return found


def _wanted(stage: Usd.Stage, name: str, file: str) -> Usd.Prim:
    everyone = [prim for prim in stage.Traverse() if prim.IsA(UsdRender.Product)]
    for prim in everyone:
        if name in (str(prim.GetPath()), prim.GetName()):
            if (kind := kind_of(prim)) != UsdRender.Tokens.raster:
                raise input_error(f"{prim.GetPath()}: products of type {kind} are not made, only raster", file)
            return prim
    names = ", ".join(str(prim.GetPath()) for prim in everyone) or "none"
    raise input_error(f'there is no product "{name}"; it has {names}', file)


def kind_of(prim: Usd.Prim) -> str:
    return str(UsdRender.Product(prim).GetProductTypeAttr().Get())


def product_of(prim: Usd.Prim, settings: Settings, time: float, say: Say) -> Product:
    """`settings` are the stage's, which the product's own go over."""
    schema, path = UsdRender.Product(prim), str(prim.GetPath())
    name = str(schema.GetProductNameAttr().Get(time) or "").strip()
    if not name:
        say("warning", f"{path}: it has no productName; its prim's name stands in")
        name = prim.GetName()
    layers, shown, aovs = _vars(prim, schema.GetOrderedVarsRel().GetForwardedTargets(), say)
    return Product(path, numbered(name, time), overridden(settings, prim, say), layers, aovs, shown)


def _vars(prim: Usd.Prim, targets: Iterable, say: Say) -> tuple[tuple, tuple, tuple]:
    """Layers of a product, primvars that they show, what render() is asked for: each once, in the product's order."""
    layers: dict[str, Shown | None] = {}
    aovs: dict[str, None] = {}
    targets = list(targets)
    for target in targets:
        found = prim.GetStage().GetPrimAtPath(target)
        if not found or not found.IsA(UsdRender.Var):
            say("warning", f"{prim.GetPath()}: there is no RenderVar {target}")
            continue
        var = var_of(found, say)
        if var.shown and layers.get(var.shown.layer, var.shown) != var.shown:
            say("warning", f'{target}: the product has another layer "{var.shown.layer}" already; it is left out')
            continue
        layers |= dict.fromkeys(var.layers, var.shown)
        aovs |= dict.fromkeys(var.aovs)
    if targets and not layers:
        say("warning", f"{prim.GetPath()}: none of its vars can be had; colour and alpha stand in")
        layers = {"rgb": None, "alpha": None}
    return tuple(layers), tuple(shown for shown in layers.values() if shown), tuple(aovs)


def numbered(name: str, time: float) -> str:
    """With the frame's number in place of a row of #, %04d, $F4 or <F4>: USD has time samples for that, and its
    tools and hosts have these."""

    def number(width: int) -> str:
        return f"{math.floor(time):0{width}d}"

    name = re.sub(r"#+", lambda m: number(len(m[0])), name)
    return re.sub(r"%0?(\d?)d|\$F(\d?)|<F(\d?)>", lambda m: number(int(m[1] or m[2] or m[3] or 1)), name)
