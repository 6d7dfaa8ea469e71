"""Configurations of OpenColorIO: colour spaces by the names that they have there. They need the package opencolorio.

A space that is a curve and a matrix is read as those that have names here (looks/colors.py); pictures in any other are
converted by the configuration's own processor, once (looks/pictures.py).
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from pxr import Usd

from kanuka.looks import colors, pictures
from kanuka.looks.colors import CODES, LINEAR, PRIMARIES, SRGB, Curve, Space
from kanuka.looks.files import Files

from .stage import INSTALL, Say, one_line

LINEAR_ROLE, COMMON = "scene_linear", "ACES2065-1"  # the latter by the name that it has in OpenColorIO itself
LARGEST = 1e9  # where a curve goes to infinity
NEAR = 1e-5  # how well a curve and a matrix are to do what the processor does
# Colours to compare them by: dark and bright ones, beyond 1 and below 0; and greys, for tables with many steps.
PROBES = np.concatenate(
    [
        np.stack(np.meshgrid(*[[-0.25, 0.0, 0.002, 0.03, 0.04, 0.1, 0.35, 0.7, 1.0, 3.0]] * 3), -1).reshape(-1, 3),
        np.linspace(0, 1, 2001)[:, None].repeat(3, axis=1),
    ]
)


@dataclass(frozen=True)
class Configured(Space):
    """A space as a configuration has it. `matrix_of`: to the space that is rendered in, after `curve`; empty: no curve
    and matrix do it. `below`: they do it for numbers below 0 too. `key` tells its conversion from others."""

    matrix_of: tuple[tuple[float, ...], ...] = ()
    below: bool = False
    convert: Callable[[np.ndarray], np.ndarray] | None = None
    key: str = ""

    @property
    def is_data(self) -> bool:
        return self.convert is None

    def fits(self, file: str) -> bool:
        """Whether the curve and the matrix do what there is to do for a file."""
        return self.is_data or bool(self.matrix_of and (self.below or file.lower().endswith(CODES)))

    def rendered(self, space: str) -> np.ndarray:
        return np.array(self.matrix_of)

    def converted(self, values: np.ndarray, space: str) -> np.ndarray:
        if self.convert is None:
            return values
        values = np.asarray(values, dtype=float)
        return np.concatenate([self.convert(values[..., :3]), values[..., 3:]], axis=-1)

    def picture(self, file: str) -> str:
        """The file that stands for one in this space: light of the space that is rendered in."""
        assert self.convert is not None
        convert = self.convert
        return pictures.made_of(file, self.key, lambda given: pictures.by_rows(given.rgb, convert))


class Configuration:
    """`path` is what it is told by."""

    def __init__(self, config, path: str) -> None:
        self._config, self.path = config, path
        self._spaces: dict[tuple[str, str], Space] = {}
        self.is_anchored = True
        try:
            self._processor(LINEAR_ROLE)
        except errors():
            # What its linear space is cannot be told: it is taken for that which is rendered in.
            self.is_anchored = False

    def named(self, name: str, rendered: str) -> Space | None:
        """By a name, an alias or a role; None: there is none of that name. Raises ValueError where it cannot be
        converted."""
        found = self._config.getColorSpace(name)
        if found is None:
            return None
        key = found.getName(), rendered
        if key not in self._spaces:
            self._spaces[key] = Space("raw") if found.isData() else self._read(found.getName(), rendered)
        return self._spaces[key]

    def of_file(self, file: str) -> str:
        """The name of a file's space, by the configuration's rules."""
        return str(self._config.getColorSpaceFromFilepath(file)[0])

    def rendered(self, name: str) -> str | None:
        """Which of the spaces that are rendered in it is, by its way to that of ACES."""
        if not self.is_anchored or self._config.getColorSpace(name) is None:
            return None
        for ours in colors.RENDERED:
            space = self.named(name, ours)
            linear = isinstance(space, Configured) and space.curve == LINEAR and len(space.matrix_of) == 3
            if linear and np.allclose(space.matrix_of, np.eye(3), atol=1e-3):  # published ones are rounded
                return ours
        return None

    def _processor(self, name: str):
        """To ACES's space, by its role in a configuration or by what OpenColorIO finds out about those that have no
        such role."""
        import PyOpenColorIO as ocio

        if self.is_anchored:
            return ocio.Config.GetProcessorToBuiltinColorSpace(self._config, name, COMMON)
        return self._config.getProcessor(name, LINEAR_ROLE)

    def _read(self, name: str, rendered: str) -> Space:
        import PyOpenColorIO as ocio

        try:
            processor = self._processor(name)
            cpu = processor.getOptimizedCPUProcessor(ocio.OPTIMIZATION_LOSSLESS)
            steps = list(processor.createGroupTransform())
        except errors() as error:
            raise ValueError(one_line(str(error))) from None
        last = Space("ap0", LINEAR, PRIMARIES["ap0"]).rendered(rendered) if self.is_anchored else np.eye(3)

        def convert(values: np.ndarray) -> np.ndarray:
            packed = np.array(values, dtype=np.float32, order="C")
            cpu.applyRGB(packed)
            return np.nan_to_num(packed.astype(float), nan=0.0, posinf=LARGEST, neginf=-LARGEST) @ last.T

        key = f"{name} {processor.getCacheID()} {last.round(9).tolist()}"
        unique = f"{name}_{hashlib.sha256(key.encode()).hexdigest()[:8]}"
        curve, matrix, below = fitted(convert, candidates(steps, ocio))
        return Configured(unique, curve, (), tuple(map(tuple, matrix)), below, convert, key)


def candidates(steps: list, ocio) -> list[Curve]:
    """Curves that a processor may have, by its steps."""
    found = [LINEAR, SRGB]
    for step in steps:
        forwards = step.getDirection() == ocio.TRANSFORM_DIR_FORWARD
        if isinstance(step, ocio.ExponentTransform):
            if (power := step.getValue()[0]) > 0:
                found.append(Curve(power if forwards else 1 / power))
        elif isinstance(step, ocio.ExponentWithLinearTransform) and forwards:
            found.append(colors.biased(step.getGamma()[0], step.getOffset()[0]))
    return found


def fitted(convert: Callable[[np.ndarray], np.ndarray], curves: list[Curve]) -> tuple[Curve, np.ndarray, bool]:
    """The curve, and the matrix after it, that do the same, and whether they do below 0 too; a matrix of nothing where
    there are none. All curves have 0 and 1 where they are."""
    matrix, expected = convert(np.eye(3)).T, convert(PROBES)
    if np.allclose(matrix, np.eye(3), atol=NEAR):
        matrix = np.eye(3)
    for curve in curves:
        alike = np.isclose(curve.decoded(PROBES) @ matrix.T, expected, rtol=NEAR, atol=NEAR).all(axis=1)
        if alike[(PROBES >= 0).all(axis=1)].all() and (curve != LINEAR or alike.all()):
            return curve, matrix, bool(alike.all())
    return LINEAR, np.empty((0, 3)), False


def errors() -> tuple[type[Exception], ...]:
    import PyOpenColorIO as ocio

    return ocio.Exception, ocio.ExceptionMissingFile, UnicodeDecodeError


# ---- which one


def chosen(stage: Usd.Stage, say: Say) -> Configuration | None:
    """That of the stage, whose names are its own, else that of $OCIO. What cannot be read is told."""
    path, shown = named_by(stage)
    if not path:
        return None
    try:
        import PyOpenColorIO as ocio
    except ImportError as error:
        text = f"configurations of OpenColorIO are not read without the package opencolorio ({error}): {INSTALL}"
        say("info", f"{shown}: {text}; spaces are known by name")
        return None
    try:
        found = Configuration(ocio.Config.CreateFromFile(path), shown)
    except errors() as error:
        text = f"the configuration of OpenColorIO is not read ({one_line(str(error))})"
        say("warning", f"{shown}: {text}; spaces are known by name")
        return None
    if not found.is_anchored:
        text = f'it has no role "aces_interchange": its {LINEAR_ROLE} is taken for the space that is rendered in'
        say("warning", f"{shown}: {text}")
    return found


def named_by(stage: Usd.Stage) -> tuple[str, str]:
    """The path of a configuration, and how it was written."""
    asset = stage.GetColorConfiguration()
    if not asset.path:
        written = os.environ.get("OCIO", "").strip()
        return written, f"$OCIO ({written})"
    if asset.path.startswith("ocio://"):
        return asset.path, asset.path
    resolved = asset.resolvedPath or stage.GetRootLayer().ComputeAbsolutePath(asset.path)
    return Files().file_of(resolved), asset.path
