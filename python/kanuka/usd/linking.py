"""UsdLux's linking: which lights do not shine on a prim, and which shine through it.

What is instanced counts as where it is placed: below its instance, or below the instancer that places it (as its
prototype, where that lies there; else as a child of the prototype's name). So the parts of a group are lit alike
wherever the rules below its places are alike: signature().
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

from pxr import Sdf, Usd, UsdGeom, UsdLux

from .stage import Say


class Query(Protocol):
    """As of a UsdCollectionMembershipQuery."""

    def IsPathIncluded(self, path: Sdf.Path) -> bool: ...
    def UsesPathExpansionRuleMap(self) -> bool: ...
    def GetAsPathExpansionRuleMap(self) -> dict: ...


class Nothing:
    """What casts shadows of a light that has none."""

    def IsPathIncluded(self, path: Sdf.Path) -> bool:
        return False

    def UsesPathExpansionRuleMap(self) -> bool:
        return True

    def GetAsPathExpansionRuleMap(self) -> dict:
        return {}


class Links:
    """The lights of a stage that do not light all of it, or whose light not all of it stops."""

    def __init__(self, lights: list[Usd.Prim], time: Usd.TimeCode, say: Say) -> None:
        self._lights: dict[str, tuple[Query | None, Query | None]] = {}
        self._rules: dict[int, list[tuple[Sdf.Path, str]] | None] = {}  # of queries; None: they are expressions
        self._stage = lights[0].GetStage() if lights else None
        self._here: tuple[Sdf.Path, Sdf.Path] | None = None
        seen: set[str] = set()
        for prim in lights:
            name, solid = name_of(prim), is_geometry(prim)
            if name in seen:
                continue  # a mesh in another instance: one light, linked as in the first
            seen.add(name)
            api = UsdLux.LightAPI(prim)
            light, shadow = query(api.GetLightLinkCollectionAPI()), query(api.GetShadowLinkCollectionAPI())
            if UsdLux.ShadowAPI(prim).GetShadowEnableAttr().Get(time) is False:
                shadow = Nothing()
            if shadow and solid:
                say("warning", f"{name}: shadows of meshes that shine cannot be linked or turned off")
                shadow = None
            if light or shadow:
                self._lights[name] = light, shadow
        for each in (q for pair in self._lights.values() for q in pair if q):
            mapped = each.UsesPathExpansionRuleMap()
            self._rules[id(each)] = list(each.GetAsPathExpansionRuleMap().items()) if mapped else None

    def of(self, prim: Usd.Prim) -> dict[str, list[str]]:
        """Names of lights, as settings of what is added to a scene."""
        if not self._lights:
            return {}
        path = self.path_of(prim)
        found: dict[str, list[str]] = {}
        for name, (light, shadow) in self._lights.items():
            if light and not self._has(light, path):
                found.setdefault("lights_off", []).append(name)
            if shadow and not self._has(shadow, path):
                found.setdefault("shadows_off", []).append(name)
        return found

    def _has(self, query: Query, path: Sdf.Path) -> bool:
        """Expressions ask for prims; what is none, below an instancer, counts as the nearest that there is."""
        if self._rules[id(query)] is None:
            while self._stage and not self._stage.GetPrimAtPath(path):
                path = path.GetParentPath()
        return query.IsPathIncluded(path)

    def chooses_shadows(self, light: Usd.Prim) -> bool:
        return self._lights.get(name_of(light), (None, None))[1] is not None

    # ---- where what is instanced counts as being

    @contextmanager
    def placed(self, top: Sdf.Path, at: Sdf.Path) -> Iterator[None]:
        """While what lies below `top` is added, it counts as below `at`."""
        before, self._here = self._here, (top, at)
        try:
            yield
        finally:
            self._here = before

    def path_of(self, prim: Usd.Prim) -> Sdf.Path:
        return prim.GetPath().ReplacePrefix(*self._here) if self._here else prim.GetPath()

    def path_in(self, instancer: Usd.Prim, prototype: Usd.Prim) -> Sdf.Path:
        """Of a prototype that an instancer places."""
        at, path = self.path_of(instancer), prototype.GetPath()
        if path.HasPrefix(instancer.GetPath()):
            return path.ReplacePrefix(instancer.GetPath(), at)
        return at.AppendChild(prototype.GetName())

    def signature(self, at: Sdf.Path, top: Usd.Prim) -> tuple:
        """The same for two places of `top` where all in it is linked alike."""
        return tuple(self._sign(query, at, top) for pair in self._lights.values() for query in pair if query)

    def _sign(self, query: Query, at: Sdf.Path, top: Usd.Prim) -> tuple:
        rules = self._rules[id(query)]
        if rules is None:
            return tuple(self._has(query, path) for path in self._paths(at, top))
        below = sorted((str(path.MakeRelativePath(at)), str(rule)) for path, rule in rules if path.HasPrefix(at))
        return query.IsPathIncluded(at), *below

    def _paths(self, at: Sdf.Path, top: Usd.Prim) -> list[Sdf.Path]:
        """Of shapes in `top`, where they count as being."""
        found, prims = [], iter(Usd.PrimRange(top, Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)))
        with self.placed(top.GetPath(), at):
            for prim in prims:
                if prim.IsA(UsdGeom.Gprim):
                    found.append(self.path_of(prim))
                elif prim.IsA(UsdGeom.PointInstancer):
                    prims.PruneChildren()
                    found += self._paths_of_instancer(prim)
        return found

    def _paths_of_instancer(self, instancer: Usd.Prim) -> list[Sdf.Path]:
        targets = UsdGeom.PointInstancer(instancer).GetPrototypesRel().GetForwardedTargets()
        inner = [prim for path in targets if (prim := instancer.GetStage().GetPrimAtPath(path))]
        # A prototype that holds its instancer has no end; it is told where it is added.
        return [
            path
            for prim in inner
            if not instancer.GetPath().HasPrefix(prim.GetPath())
            for path in self._paths(self.path_in(instancer, prim), prim)
        ]


def is_geometry(light: Usd.Prim) -> bool:
    return light.IsA(UsdGeom.Gprim) or light.GetTypeName() == "GeometryLight"


def name_of(light: Usd.Prim) -> str:
    """A light's in the scene. Meshes that shine are one light in all instances."""
    shared = light.IsInstanceProxy() and is_geometry(light)
    return str((light.GetPrimInPrototype() if shared else light).GetPath())


def query(collection: Usd.CollectionAPI) -> Usd.CollectionMembershipQuery | None:
    """None: it has everything."""
    if not collection.IsInExpressionMode():
        root = collection.GetIncludeRootAttr()
        whole = not root.HasAuthoredValue() or root.Get()
        if whole and not collection.GetExcludesRel().HasAuthoredTargets():
            return None
    return collection.ComputeMembershipQuery()
