"""Instances of USD: native ones, and those of PointInstancers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from pxr import Usd, UsdGeom

from .arrays import Colors, primvar
from .items import Above, is_each
from .motion import Shutter, together
from .stage import Gathered, Say
from .transforms import Transforms, columns

MOST = 9e5  # of a difference
STEP = 1 << 14  # matrices at a time, where there may be millions


DIFFERENCES = {"variant": 1, "tint": 3, "roughness": 1}  # primvars:kanuka:… that instances differ by; their widths


def differences_of(prim: Usd.Prim, frame: Usd.TimeCode, count: int, say: Say) -> dict[str, np.ndarray | bool]:
    """As Scene.add_instances() takes them: one value, or one for each of `count` instances."""
    found = {}
    for name, width in DIFFERENCES.items():
        attribute = prim.GetAttribute(f"primvars:kanuka:{name}")
        if not attribute or not attribute.HasAuthoredValue():
            continue
        values = UsdGeom.Primvar(attribute).ComputeFlattened(frame)
        try:
            numbers = np.asarray(values if values is not None else [], dtype=np.float32).reshape(-1)
        except (TypeError, ValueError):  # of another type
            numbers = np.empty(0, dtype=np.float32)
        if len(numbers) not in (width, width * count) or not np.isfinite(numbers).all():
            text = f"expected {'a number' if width == 1 else 'a colour'}, or one for each of {count} instances"
            say("warning", f"{prim.GetPath()}: primvars:kanuka:{name}: {text}. It has no effect")
            continue
        found[name] = np.clip(numbers, -1 if name == "roughness" else 0, MOST).reshape((-1, width) if width > 1 else -1)
    if prim.HasAttribute("primvars:kanuka:unique") and prim.GetAttribute("primvars:kanuka:unique").Get(frame):
        found["unique"] = True
    return found


class Variables:
    """Plain primvars of a PointInstancer that materials of its prototypes read."""

    def __init__(self, prim: Usd.Prim, frame: Usd.TimeCode, colors: Colors, gathered: Gathered) -> None:
        self.prim, self.frame, self.colors, self.gathered = prim, frame, colors, gathered
        indices = UsdGeom.PointInstancer(prim).GetProtoIndicesAttr().Get(frame)
        self.count = len(indices) if indices is not None else 0
        self._found: dict[tuple[str, str, str], dict[str, np.ndarray]] = {}

    def of(self, which: np.ndarray, named: dict[str, tuple[str, str]], below: bool) -> dict[str, np.ndarray]:
        """As Scene.add_instances() takes them, of some instances. `named`: Kanuka's names and kinds of what is read;
        `below`: the prototype inherits what is constant."""
        found = {}
        for name, (ours, kind) in named.items():
            have = UsdGeom.Primvar(self.prim.GetAttribute(f"primvars:{name}"))
            if not have or not have.HasAuthoredValue():
                continue
            if below and have.GetInterpolation() == UsdGeom.Tokens.constant and not is_each(have, self.frame):
                continue
            found |= self._values(name, ours, kind, have)
        return {key: values[which] if len(values) > 1 else values for key, values in found.items()}

    def _values(self, name: str, ours: str, kind: str, have: UsdGeom.Primvar) -> dict[str, np.ndarray]:
        if (name, ours, kind) not in self._found:
            made = primvar(have, ours, kind, self.frame, self.colors)
            if not made or any(len(values) not in (1, self.count) for values in made.values()):
                sort = kind.removesuffix("44")
                text = f"primvar {name}: materials take a {sort}, or one for each instance. It has no effect"
                self.gathered.note(text, str(self.prim.GetPath()))
                made = {}
            self._found[name, ours, kind] = {key.split(" ", 1)[1]: values for key, values in made.items()}
        return self._found[name, ours, kind]


def together_of(each: Sequence[dict]) -> dict:
    """Differences of instances that stand alone, as one has them of all: of the same names."""
    first = each[0]
    made = {
        name: value if isinstance(value, bool) else np.concatenate([of[name] for of in each])
        for name, value in first.items()
        if name != "primvars"
    }
    if "primvars" in first:
        keys = first["primvars"]
        made["primvars"] = {key: np.concatenate([of["primvars"][key] for of in each]) for key in keys}
    return made


@dataclass
class Placed:
    """Instances of a prototype: matrices are (N, 3, 4), or (T, N, 3, 4) of what moves. `which`: their numbers."""

    prototype: Usd.Prim
    matrices: np.ndarray
    which: np.ndarray
    differences: dict[str, np.ndarray | bool] = field(default_factory=dict)


@dataclass
class Instancer:
    """A PointInstancer. `root`: what `above` is relative to, with what is above that."""

    prim: Usd.Prim
    above: Above
    root: tuple[Usd.Prim, Above]
    shutter: Shutter
    transforms: Transforms
    say: Say

    def __post_init__(self) -> None:
        self.schema = UsdGeom.PointInstancer(self.prim)
        self.path = self.prim.GetPath()

    def placed(self) -> Iterator[Placed]:
        """Places of each prototype, one after the other: together they may fill the memory. The matrix of a prototype
        is in those of its instances; what is above it counts for nothing."""
        targets = self.schema.GetPrototypesRel().GetForwardedTargets()
        indices = self.schema.GetProtoIndicesAttr().Get(self.shutter.frame)
        if not targets or indices is None or not len(indices):
            return
        indices = np.asarray(indices)
        if (wrong := ~((indices >= 0) & (indices < len(targets)))).any():
            self.say("error", f"{self.path}: {int(wrong.sum())} protoIndices name no prototype. Those are left out")
        if (places := self.places(len(indices))) is None:
            return
        differences = differences_of(self.prim, self.shutter.frame, len(indices), self.say)
        mask = np.asarray(self.schema.ComputeMaskAtTime(self.shutter.frame), dtype=bool)
        for index, target in enumerate(targets):
            mine = indices == index
            which = np.flatnonzero(mine & mask if len(mask) == len(mine) else mine)
            if not len(which):
                continue
            prototype = self.prim.GetStage().GetPrimAtPath(target)
            if not prototype:
                self.say("error", f"{self.path}: its prototype {target} is not there")
                continue
            matrices = places.of(which, prototype)
            # A sum has no number where one of its parts has none; as a product it takes a tenth of the time.
            sums = matrices.reshape(-1, 12) @ np.ones(12, dtype=np.float32)
            finite = np.isfinite(sums).reshape(-1, len(which)).all(axis=0)
            if not finite.all():
                self.say("error", f"{self.path}: {int((~finite).sum())} places are no numbers. Those are left out")
                matrices, which = matrices[..., finite, :, :], which[finite]
            own = {
                name: each[which] if np.size(each) > DIFFERENCES.get(name, 1) else each
                for name, each in differences.items()
            }
            yield Placed(prototype, matrices, which, own)

    def places(self, count: int) -> Still | Moving | None:
        """None: there are not as many positions as instances."""
        numbers = {}
        for name, width in (("positions", 3), ("scales", 3), ("orientations", 4)):
            values = self.value(name)
            if values is not None and len(values) and len(values) != count:
                effect = "It is left out" if name == "positions" else "They have no effect"
                severity = "error" if name == "positions" else "warning"
                self.say(severity, f"{self.path}: {count} protoIndices, but {len(values)} {name}. {effect}")
                if name == "positions":
                    return None
            elif values is not None and len(values):
                numbers[name] = np.asarray(values).reshape(-1, width)
        if "positions" not in numbers:
            self.say("error", f"{self.path}: {count} protoIndices, but no positions. It is left out")
            return None
        self.tell_rates(count)
        times = self.times()
        if len(times) == 1:
            outer = self.above.columns
            return Still(outer, self.transforms, **numbers)
        outer = self.above.columns
        if outer.ndim == 3 and len(outer) != len(times):
            outer = self.root[1].columns @ self.transforms.within(self.prim, self.root[0], times)
        return Moving(outer, self.schema, times, self.shutter.frame)

    def tell_rates(self, count: int) -> None:
        """What USD makes nothing of: rates of other instances, or of what has no time to start from."""
        if len(self.shutter.times) == 1:
            return
        starts = {"velocities": ("positions",), "angularVelocities": ("orientations", "orientationsf")}
        for name, of in starts.items():
            values = self.prim.GetAttribute(name).Get(self.shutter.frame)
            if values is None or not len(values):
                continue
            if len(values) != count:
                self.say("warning", f"{self.path}: {count} protoIndices, but {len(values)} {name}. They have no effect")
            elif not any(self.prim.GetAttribute(base).GetNumTimeSamples() for base in of):
                text = f"{name} start from time samples of {of[0]}, and there are none; they have no effect"
                self.say("warning", f"{self.path}: {text}")

    def value(self, name: str):
        """Of an attribute. Orientations: those of higher precision, where there are some (UsdGeomPointInstancer)."""
        if name == "orientations":
            precise = self.prim.GetAttribute("orientationsf")
            if precise and (values := precise.Get(self.shutter.frame)):
                return values
        return self.prim.GetAttribute(name).Get(self.shutter.frame)

    def times(self) -> tuple[Usd.TimeCode, ...]:
        """At which instances are looked up: more than two where they do not move along straight lines."""
        if len(self.shutter.times) == 1:
            return self.shutter.times
        bent = ("accelerations", "angularVelocities")
        if len(self.above.matrices) > 1 or any(self.prim.GetAttribute(n).HasAuthoredValue() for n in bent):
            return self.shutter.curved(self.prim)
        names = ("positions", "orientations", "orientationsf", "scales", "velocities")
        moving = any(self.prim.GetAttribute(name).ValueMightBeTimeVarying() for name in names)
        if moving or self.prim.GetAttribute("velocities").HasAuthoredValue() or self.prototypes_move():
            return self.shutter.times
        return (self.shutter.frame,)

    def prototypes_move(self) -> bool:
        stage = self.prim.GetStage()
        found = (stage.GetPrimAtPath(target) for target in self.schema.GetPrototypesRel().GetForwardedTargets())
        return any(prim and UsdGeom.Xformable(prim).TransformMightBeTimeVarying() for prim in found)


class Moving:
    """Places at several times, by USD: positions from velocities, orientations from angular velocities."""

    def __init__(self, outer: np.ndarray, schema: UsdGeom.PointInstancer, times, frame) -> None:
        self.outer = np.broadcast_to(outer, (len(times), 4, 4))
        found = schema.ComputeInstanceTransformsAtTimes(
            list(times), frame, UsdGeom.PointInstancer.IncludeProtoXform, UsdGeom.PointInstancer.IgnoreMask
        )
        self.found = [np.asarray(matrices).reshape(-1, 4, 4) for matrices in found]

    def of(self, which: np.ndarray, prototype: Usd.Prim) -> np.ndarray:
        made = np.empty((len(self.found), len(which), 3, 4), dtype=np.float32)
        for slice_, outer, found in zip(made, self.outer, self.found, strict=True):
            for first in range(0, len(which), STEP):
                chosen = which[first : first + STEP]
                slice_[first : first + STEP] = (outer @ found[chosen].transpose(0, 2, 1))[:, :3]
        return together(list(made))


class Still:
    """Places at one time. USD makes matrices of doubles of them, 128 bytes each; here they are made some at a time, in
    the order of UsdGeomPointInstancer: the prototype's own matrix, scale, orientation, position."""

    def __init__(self, outer: np.ndarray, transforms: Transforms, positions, scales=None, orientations=None) -> None:
        self.outer, self.transforms = outer, transforms
        self.positions, self.scales, self.orientations = positions, scales, orientations

    def of(self, which: np.ndarray, prototype: Usd.Prim) -> np.ndarray:
        inner = columns(self.transforms.local(prototype))
        # Row by row, a matrix between two others is a vector that a Kronecker product acts on.
        around = np.kron(self.outer[:3, :3], inner[:3, :3].T).T.astype(np.float32)
        turned = np.kron(self.outer[:3, :3], inner[:3, 3]).T
        plain = np.array_equal(around, np.eye(9))
        made = np.empty((len(which), 3, 4), dtype=np.float32)
        with np.errstate(invalid="ignore", over="ignore"):  # what is no number is looked for afterwards
            for first in range(0, len(which), STEP):
                chosen = which[first : first + STEP]
                out, axes = made[first : first + STEP], self.axes(chosen)
                out[:, :, :3] = axes if plain else (axes.reshape(-1, 9) @ around).reshape(-1, 3, 3)
                place = self.positions[chosen] @ self.outer[:3, :3].T + self.outer[:3, 3]
                out[:, :, 3] = place + axes.reshape(-1, 9) @ turned if turned.any() else place
        return made

    def axes(self, which: np.ndarray) -> np.ndarray:
        """(N, 3, 3): scaled, then turned. Quaternions are not made unit length, as USD leaves them."""
        axes = np.zeros((len(which), 3, 3), dtype=np.float32)
        if self.orientations is None:
            axes[:, (0, 1, 2), (0, 1, 2)] = 1
        else:
            x, y, z, w = self.orientations[which].T.astype(np.float32, order="C")
            axes[:, 0] = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], axis=-1)
            axes[:, 1] = np.stack([2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)], axis=-1)
            axes[:, 2] = np.stack([2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], axis=-1)
        if self.scales is not None:
            axes *= self.scales[which, None, :]
        return axes
