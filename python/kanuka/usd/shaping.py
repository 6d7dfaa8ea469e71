"""UsdLuxShapingAPI: how a light shines by the angle to its axis, -z.

By USD's documentation of the schema (OpenUSD 25.05 on): emission is multiplied by

    1 - smoothstep(cone (1 - softness), cone, theta)        the cone
    lerp(tint, 1, |cos theta|^focus)                        the focus; each colour by itself
    the file's intensity at the scaled theta and phi        a photometric file
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from pxr import Sdf, Usd, UsdLux

from kanuka.looks.files import Files, write

from . import photometry
from .photometry import FINEST, Photometry
from .spaces import Spaces
from .stage import Say
from .values import decimal, resolved

ALL_ROUND = 180.0  # degrees: a cone that leaves nothing out


@dataclass(eq=False)
class Shaping:
    cone: float = ALL_ROUND  # degrees from the axis to the edge
    softness: float = 0.0
    focus: float = 0.0
    tint: np.ndarray = field(default_factory=lambda: np.zeros(3))
    profile: Photometry | None = None
    angle_scale: float = 0.0
    gain: float = 1.0  # of the profile

    @property
    def shapes(self) -> bool:
        return self.cone < ALL_ROUND or self.softness > 0 or self.focus > 0 or self.profile is not None

    def parts(self) -> list[tuple[np.ndarray, float]]:
        """Colours with the focus that each has: their sum is the focus with its tint."""
        if self.focus <= 0 or not self.tint.any():
            return [(np.ones(3), self.focus)]
        found = [(1 - self.tint, self.focus), (self.tint, 0.0)]
        return [(color, focus) for color, focus in found if color.any()]

    def weight(self, theta: np.ndarray, phi: np.ndarray, focus: float) -> np.ndarray:
        """At angles in degrees, which are broadcast."""
        found = np.abs(np.cos(np.radians(theta))) ** focus + 0 * phi
        if self.softness > 0:
            t = np.clip((theta - self.cone * (1 - self.softness)) / (self.cone * self.softness), 0, 1)
            found = found * (1 - t * t * (3 - 2 * t))
        else:
            found = found * (theta <= self.cone)
        if self.profile is not None:
            found = found * self.profile.at(self.scaled(theta), phi) * self.gain
        return found

    def scaled(self, theta: np.ndarray) -> np.ndarray:
        """Where the profile is looked up: stretched from below, or, where the scale is negative, from above."""
        if self.angle_scale > 0:
            return theta / self.angle_scale
        return (theta - 180) / -self.angle_scale + 180 if self.angle_scale < 0 else theta


class Shapings:
    """Of a stage's lights; those of a prototype are read once for all of its instances."""

    def __init__(self, time: Usd.TimeCode, folder: Files, spaces: Spaces) -> None:
        self._time, self._folder, self._spaces = time, folder, spaces
        self._found: dict[Sdf.Path, Shaping] = {}

    def of(self, prim: Usd.Prim, say: Say) -> Shaping:
        """Raises ValueError where no light can have that shape."""
        path = (prim.GetPrimInPrototype() if prim.IsInstanceProxy() else prim).GetPath()
        if path not in self._found:
            self._found[path] = self._read(prim, say)
        return self._found[path]

    def _read(self, prim: Usd.Prim, say: Say) -> Shaping:
        """An edge that nobody wrote is none, though the schema's fallback is 90 degrees: its documentation of the focus
        says that spheres shine backwards as well."""
        api, made, time = UsdLux.ShapingAPI(prim), Shaping(), self._time
        if api.GetShapingConeAngleAttr().HasAuthoredValue():
            made.cone = min(decimal(api.GetShapingConeAngleAttr(), time, ALL_ROUND), ALL_ROUND)
            if made.cone <= 0:
                raise ValueError(f"a cone of {made.cone:g} degrees leaves no light")
            made.softness = min(max(decimal(api.GetShapingConeSoftnessAttr(), time, 0), 0), 1)
        made.focus = max(decimal(api.GetShapingFocusAttr(), time, 0), 0)
        tint = self._spaces.light(api.GetShapingFocusTintAttr(), time, (0, 0, 0))
        if not np.isfinite(tint).all():
            raise ValueError(f"inputs:shaping:focusTint is {', '.join(f'{x:g}' for x in tint)}, which is no colour")
        made.tint = np.clip(tint, 0, 1)
        if file := resolved(api.GetShapingIesFileAttr(), time, self._folder, say):
            try:
                made.profile = photometry.read(file)
            except ValueError as error:
                say("error", f"{prim.GetPath()}: {error}. It shines as without it")
                return made
            made.angle_scale = decimal(api.GetShapingIesAngleScaleAttr(), time, 0)
            if api.GetShapingIesNormalizeAttr().Get(time):
                made.gain = 1 / made.profile.mean()
        return made


@lru_cache(maxsize=64)
def tabulated(shaping: Shaping, focus: float, of_body: Callable[..., np.ndarray], folder: Path) -> tuple[str, float]:
    """A photometric file of a light whose body sends of_body(theta, phi) of its radiance to a direction, shaped; and
    how much is sent where most is."""
    theta, phi = np.arange(0, 180 + FINEST / 2, FINEST), np.arange(0.0, 361.0)
    if shaping.softness == 0:
        # A hard edge is the cone's own: the table goes on beyond it, or it would blur it.
        shaping = replace(shaping, cone=ALL_ROUND)
    values = np.broadcast_to(shaping.weight(theta, phi[:, None], focus) * of_body(theta, phi[:, None]), (361, 361))
    if np.ptp(values, axis=0).max() < 1e-9 * values.max():
        phi, values = phi[:1], values[:1]
    data = photometry.text_of(Photometry(theta, phi, values))
    path = folder / f"{hashlib.sha256(data).hexdigest()[:16]}.ies"
    if not path.exists():
        write(path, data)
    return str(path), float(values.max())
