"""Photometric files (IESNA LM-63, type C) as functions of direction, and such files of functions.

Theta is the vertical angle, from the light's -z; phi the horizontal one, from its +x, anticlockwise as seen from +z.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

FINEST = 0.5  # degrees between the vertical angles that are written: Kanuka's own table is no finer


@dataclass
class Photometry:
    """Luminous intensity, (horizontal, vertical), at angles in degrees."""

    vertical: np.ndarray
    horizontal: np.ndarray
    candela: np.ndarray

    def at(self, theta: np.ndarray, phi: np.ndarray) -> np.ndarray:
        """Linear between angles, 0 beyond the vertical ones. What is not given mirrors what is: horizontal angles up to
        90 degrees hold for all quadrants, up to 180 for both halves (LM-63-2002, 5.14)."""
        theta, phi = np.broadcast_arrays(np.asarray(theta, dtype=float), np.mod(phi, 360))
        last = self.horizontal[-1]
        if last <= 180:
            phi = np.where(phi > 180, 360 - phi, phi)
        if last <= 90:
            phi = np.where(phi > 90, 180 - phi, phi)
        v, fv = cells(self.vertical, theta)
        h, fh = cells(self.horizontal, phi)
        columns, rows = self.candela.shape
        v1, h1 = np.minimum(v + 1, rows - 1), np.minimum(h + 1, columns - 1)
        low = self.candela[h, v] * (1 - fv) + self.candela[h, v1] * fv
        high = self.candela[h1, v] * (1 - fv) + self.candela[h1, v1] * fv
        inside = (theta >= self.vertical[0] - FINEST / 2) & (theta <= self.vertical[-1] + FINEST / 2)
        return np.where(inside, low * (1 - fh) + high * fh, 0.0)

    def mean(self) -> float:
        """Of all directions, of those of a hemisphere if the file has no more: what `normalize` divides by in hdEmbree,
        USD's reference (the documentation speaks of the power alone, which would leave a factor of 4 pi)."""
        theta = np.arange(FINEST / 2, 180, FINEST)
        phi = np.arange(0.5, 360)
        weight = np.sin(np.radians(theta))
        whole = self.vertical[-1] - self.vertical[0] > 90 + 1e-3
        return float((self.at(theta, phi[:, None]).mean(0) * weight).sum() / weight.sum() * (1 if whole else 2))


def cells(rising: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where values lie among rising ones: the one below, and the fraction to the next."""
    if len(rising) < 2:
        return np.zeros(x.shape, dtype=int), np.zeros(x.shape)
    at = np.clip(np.searchsorted(rising, x, side="right") - 1, 0, len(rising) - 2)
    return at, np.clip((x - rising[at]) / (rising[at + 1] - rising[at]), 0, 1)


def read(path: str | Path) -> Photometry:
    """Raises ValueError with what is wrong."""
    try:
        text = Path(path).read_text(encoding="latin-1")
    except OSError as error:
        raise ValueError(f"the photometric file {path} cannot be read: {error.strerror}") from None
    _, tilt, rest = text.partition("TILT=")
    if not tilt:
        raise ValueError(f"{path} has no TILT=: it is no photometric file (IES LM-63)")
    kind, _, rest = rest.partition("\n")
    try:
        numbers = np.array(rest.replace(",", " ").split(), dtype=float)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    kind = kind.strip()
    if kind == "INCLUDE":  # a lamp's output by its tilt: it hangs as it was measured
        pairs = int(numbers[1]) if len(numbers) > 1 else 0
        numbers = numbers[2 + 2 * max(pairs, 0) :]
    elif kind != "NONE":
        raise ValueError(f"{path}: TILT={kind[:40]}: tilt files are not read")
    return of_numbers(numbers, str(path))


def of_numbers(numbers: np.ndarray, path: str) -> Photometry:
    """What follows the tilt: thirteen numbers, vertical angles, horizontal angles, intensities."""
    if len(numbers) < 13 or not np.isfinite(numbers).all():
        raise ValueError(f"{path} ends too early, or has numbers that are none")
    rows, columns, kind = (int(x) for x in numbers[3:6])
    if kind != 1:
        raise ValueError(f"{path}: photometric type {kind} (B or A) is not read; type C (1) is")
    if rows < 1 or columns < 1 or len(numbers) < 13 + rows + columns + rows * columns:
        raise ValueError(f"{path} has {len(numbers) - 13} numbers for {rows} by {columns} angles")
    vertical, horizontal = numbers[13 : 13 + rows], numbers[13 + rows : 13 + rows + columns]
    if (np.diff(vertical) <= 0).any() or (np.diff(horizontal) <= 0).any():
        raise ValueError(f"{path}: its angles do not rise")
    start = 13 + rows + columns
    candela = numbers[start : start + rows * columns].reshape(columns, rows)
    candela = np.maximum(candela * numbers[2] * numbers[10], 0)  # the multiplier, and the ballast's factor
    if not (candela > 0).any():
        raise ValueError(f"{path}: no intensity is above 0")
    return Photometry(vertical, horizontal, candela)


def text_of(table: Photometry) -> bytes:
    """A file of it, its largest value made 1."""
    values = table.candela / table.candela.max()
    head = f"1 0 1 {len(table.vertical)} {len(table.horizontal)} 1 2 0 0 0\n1 1 0\n"
    lines = [" ".join(f"{x:.7f}" for x in row) for row in (table.vertical, table.horizontal, *values)]
    return ("IESNA:LM-63-2002\nTILT=NONE\n" + head + "\n".join(lines) + "\n").encode()
