"""UsdLux's linking: which lights do not shine on a prim, and which shine through it."""

from __future__ import annotations

from pxr import Usd, UsdLux


class Links:
    """The lights of a stage that do not light all of it, or whose light not all of it stops."""

    def __init__(self, lights: list[Usd.Prim]) -> None:
        self._lights = []
        for prim in lights:
            api = UsdLux.LightAPI(prim)
            light, shadow = query(api.GetLightLinkCollectionAPI()), query(api.GetShadowLinkCollectionAPI())
            if light or shadow:
                self._lights.append((str(prim.GetPath()), light, shadow))

    def __bool__(self) -> bool:
        return bool(self._lights)

    def of(self, prim: Usd.Prim) -> dict[str, list[str]]:
        """Names of lights, as settings of what is added to a scene."""
        path = prim.GetPath()
        found: dict[str, list[str]] = {}
        for name, light, shadow in self._lights:
            if light and not light.IsPathIncluded(path):
                found.setdefault("lights_off", []).append(name)
            if shadow and not shadow.IsPathIncluded(path):
                found.setdefault("shadows_off", []).append(name)
        return found


def query(collection: Usd.CollectionAPI) -> Usd.CollectionMembershipQuery | None:
    """None: it has everything."""
    root = collection.GetIncludeRootAttr()
    whole = not root.HasAuthoredValue() or root.Get()
    if whole and not collection.GetExcludesRel().HasAuthoredTargets():
        return None
    return collection.ComputeMembershipQuery()
