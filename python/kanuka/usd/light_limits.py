"""What lights of a stage ask for that Kanuka's have not, told: a light's filters by their names, the rest once."""

from __future__ import annotations

import math

from pxr import Usd, UsdLux

from .stage import Gathered, Say

# What filters do, by words in the names of their types (RenderMan's, Arnold's).
FILTERS = {
    "barn": "barn doors",
    "block": "a blocker",
    "combiner": "others together",
    "cookie": "a picture in the beam",
    "decay": "another falloff",
    "gobo": "a picture in the beam",
    "intmult": "a factor",
    "ramp": "a ramp by distance",
    "rod": "a blocker",
}


def tell(lights: list[Usd.Prim], time: Usd.TimeCode, say: Say, gathered: Gathered) -> None:
    """A light of a prototype is told of once."""
    seen = set()
    for light in lights:
        key = light.GetPrimInPrototype().GetPath() if light.IsInstanceProxy() else light.GetPath()
        if key not in seen:
            seen.add(key)
            tell_filters(light, say)
            for text in limits(light, time):
                gathered.note(text, str(light.GetPath()))


def tell_filters(light: Usd.Prim, say: Say) -> None:
    targets = UsdLux.LightAPI(light).GetFiltersRel().GetForwardedTargets()
    if not targets:
        return
    names = ", ".join(f"{path} ({filter_kind(light.GetStage().GetPrimAtPath(path))})" for path in targets)
    say("warning", f"{light.GetPath()}: it shines as without its filters, which are not read: {names}")


def filter_kind(prim: Usd.Prim) -> str:
    if not prim:
        return "which is not there"
    attribute = prim.GetAttribute("lightFilter:shaderId")
    kind = (attribute.Get() if attribute else "") or str(prim.GetTypeName()) or "of no type"
    does = next((what for word, what in FILTERS.items() if word in kind.lower()), "")
    return f"{kind}, {does}" if does else kind


def limits(light: Usd.Prim, time: Usd.TimeCode) -> list[str]:
    api, shadow, found = UsdLux.LightAPI(light), UsdLux.ShadowAPI(light), []
    if shadow.GetShadowEnableAttr().Get(time) is not False:
        color = shadow.GetShadowColorAttr().Get(time)
        if color is not None and any(color):
            found.append("shadows have no colour but black")
        distance = shadow.GetShadowDistanceAttr().Get(time)
        if distance is not None and distance >= 0 and math.isfinite(distance):
            found.append("shadows reach as far as light does: no distance or falloff of them is read")
    if any(inp.HasConnectedSource() for inp in api.GetInputs()):
        found.append("what inputs of lights are connected to is not read: their own values stand")
    return found
