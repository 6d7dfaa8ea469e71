"""Skins of UsdSkel: USD bakes them into points of their meshes."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from pxr import Gf, Sdf, Usd, UsdGeom

from .motion import Shutter
from .stage import Say

PROXIES = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)
UNDEFINED = Usd.PrimIsActive & Usd.PrimIsLoaded  # classes and overs as well


def pose(stage: Usd.Stage, shot: Shutter, say: Say) -> None:
    """At the times of the shutter; in a layer that goes with the stage."""
    with Usd.EditContext(stage, stage.GetSessionLayer()):
        taken_apart = take_apart(stage)
        if taken_apart:
            say("info", f"{taken_apart} instances have skins; each is read by itself")
        interval = Gf.Interval(shot.times[0].GetValue(), shot.times[-1].GetValue())
        kinds = [(prim, prim.GetTypeName()) for prim in stage.Traverse()]
        if any(kind == "SkelRoot" for _, kind in kinds):
            bake(stage.Traverse(), interval)
        instancers = [UsdGeom.PointInstancer(prim) for prim, kind in kinds if kind == "PointInstancer"]
        for prim in hidden_prototypes(stage, instancers):
            with defined(stage, prim.GetPath()):
                bake(Usd.PrimRange(stage.GetPrimAtPath(prim.GetPath())), interval)


def bake(prims: Usd.PrimRange, interval: Gf.Interval) -> None:
    from pxr import UsdSkel  # which most stages do without

    UsdSkel.BakeSkinning(prims, interval)


def has_skins(prims: Usd.PrimRange) -> bool:
    return any(prim.IsA("SkelRoot") or prim.HasAPI("SkelBindingAPI") for prim in prims)


def take_apart(stage: Usd.Stage) -> int:
    """USD bakes nothing into what instances share, and each of them may be animated in another way: those that have
    skins become prims of their own. How many were."""
    count = 0
    while True:
        shared = [p for p in stage.GetPrototypes() if has_skins(Usd.PrimRange(p, PROXIES))]
        # Those in others come to light when these are taken apart.
        found = [i for p in shared for i in p.GetInstances() if not i.IsInPrototype()]
        if not found:
            return count
        with Sdf.ChangeBlock():
            for path in [instance.GetPath() for instance in found]:
                Sdf.CreatePrimInLayer(stage.GetSessionLayer(), path).SetInfo("instanceable", False)
        count += len(found)


def hidden_prototypes(stage: Usd.Stage, instancers: list[UsdGeom.PointInstancer]) -> list[Usd.Prim]:
    """Prototypes with skins, below classes and overs: the stage's traversal does not meet them."""
    targets = {path for i in instancers for path in i.GetPrototypesRel().GetForwardedTargets()}
    found = [prim for path in sorted(targets) if (prim := stage.GetPrimAtPath(path))]
    found = [prim for prim in found if prim.IsAbstract() or not prim.IsDefined()]
    return [prim for prim in found if has_skins(Usd.PrimRange(prim, UNDEFINED))]


@contextmanager
def defined(stage: Usd.Stage, path: Sdf.Path) -> Iterator[None]:
    """Makes a prim one of those that USD bakes, for a while."""
    layer, specs = stage.GetSessionLayer(), []
    for above in path.GetPrefixes():
        if stage.GetPrimAtPath(above).GetSpecifier() != Sdf.SpecifierDef:
            spec = Sdf.CreatePrimInLayer(layer, above)
            specs.append((spec, spec.specifier))
            spec.specifier = Sdf.SpecifierDef
    try:
        yield
    finally:
        for spec, before in specs:
            spec.specifier = before
