"""What moves while the shutter is open, as UsdGeomPointBased and UsdGeomMotionAPI document it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pxr import Usd, UsdGeom

from .arrays import rows
from .items import Item
from .stage import Say

MOST_SAMPLES = 64


@dataclass(frozen=True)
class Shutter:
    """When a picture is taken. Topology, materials and all else that has one value a picture are read at the frame;
    velocities start from there."""

    frame: Usd.TimeCode
    times: tuple[Usd.TimeCode, ...]  # of opening and closing; or one

    def curved(self, prim: Usd.Prim) -> tuple[Usd.TimeCode, ...]:
        """Times of what does not move along straight lines."""
        if len(self.times) == 1:
            return self.times
        count = UsdGeom.MotionAPI(prim).ComputeNonlinearSampleCount(self.frame)
        opens, closes = self.times[0].GetValue(), self.times[-1].GetValue()
        return tuple(Usd.TimeCode(t) for t in np.linspace(opens, closes, min(max(count, 2), MOST_SAMPLES)))

    def points(self, item: Item, say: Say) -> np.ndarray | None:
        """(N, 3), or (T, N, 3) where they move; None: the prim has none."""
        if len(self.times) > 1 and "velocities" in item.names:
            rates = [name for name in ("velocities", "accelerations") if name in item.names]
            if all(self._usable(item, name, say) for name in rates):
                times = self.times if len(rates) == 1 else self.curved(item.prim)
                found = UsdGeom.PointBased(item.prim).ComputePointsAtTimes(list(times), self.frame)
                return together([rows(values, 3) for values in found]) if found else None
        return self.values(item, "points", 3)

    def _usable(self, item: Item, name: str, say: Say) -> bool:
        """Whether velocities or accelerations are those of the points."""
        values, count = rows(item.value(name, self.frame) or (), 3), len(item.value("points", self.frame) or ())
        if not values.any():
            return True
        if len(values) != count:
            say("warning", f"{item.path}: {len(values)} {name} for {count} points; they have no effect")
            return False
        if not np.isfinite(values).all():
            say("warning", f"{item.path}: some of its {name} are no numbers; they have no effect")
            return False
        if not item.prim.GetAttribute("points").GetNumTimeSamples():
            # USD's own computation takes the same view: a value without a time is the same at all times.
            say(
                "warning",
                f"{item.path}: {name} start from time samples of points, and there are none; they have no effect",
            )
            return False
        return True

    def values(self, item: Item, name: str, width: int) -> np.ndarray | None:
        """(N, width), or (T, N, width) where an attribute moves; None if it has no value. What changes its number of
        rows while the shutter is open is as at the frame."""
        still = item.authored(name, self.frame)
        if still is None:
            return None
        still = rows(still, width)
        if len(self.times) == 1 or not (attribute := item.prim.GetAttribute(name)).ValueMightBeTimeVarying():
            return still
        arrays = [rows(found, width) for time in self.times if (found := attribute.Get(time)) is not None]
        if len(arrays) < len(self.times) or any(a.shape != still.shape for a in arrays):
            return still
        return together(arrays)


def together(arrays: list[np.ndarray]) -> np.ndarray:
    """One array if all are the same, else all, with time as the first axis."""
    first = arrays[0]
    if any(a.shape != first.shape for a in arrays[1:]):
        return first
    return first if all(np.array_equal(a, first) for a in arrays[1:]) else np.stack(arrays)
