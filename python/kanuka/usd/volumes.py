"""UsdVol: what volumes a stage has. They are told, not rendered."""

from __future__ import annotations

from pxr import Usd

FIELDS = frozenset({"OpenVDBAsset", "Field3DAsset"})
MOST_NAMED = 8


def told(volumes: list[Usd.Prim], frame: Usd.TimeCode) -> str:
    """One line about all volumes of a stage, with the files of their fields."""
    named = "; ".join(f"{prim.GetPath()} ({fields_of(prim, frame)})" for prim in volumes[:MOST_NAMED])
    more = f"; and {len(volumes) - MOST_NAMED} more" if len(volumes) > MOST_NAMED else ""
    count = "1 volume is" if len(volumes) == 1 else f"{len(volumes)} volumes are"
    return f"{count} not rendered yet: {named}{more}"


def fields_of(volume: Usd.Prim, frame: Usd.TimeCode) -> str:
    """Names of fields with what they are: "density of smoke.vdb"."""
    from pxr import UsdVol  # which most stages do without

    found = []
    for name, path in UsdVol.Volume(volume).GetFieldPaths().items():
        field = volume.GetStage().GetPrimAtPath(path)
        if not field:
            found.append(f"{name}: there is nothing at {path}")
            continue
        asset, own = (field.GetAttribute(key).Get(frame) for key in ("filePath", "fieldName"))
        if asset is None or not asset.path:
            found.append(f"{name}: {field.GetPath()} names no file")
            continue
        missing = "" if asset.resolvedPath else ", which is not found"
        found.append(f"{own or name} of {asset.path}{missing}")
    return ", ".join(found) or "no fields"
