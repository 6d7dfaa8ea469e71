"""How many of everything: the numbers of the public Moana island at scale 1, shared out among the parts of this one.

Walt Disney Animation Studios published the data set in 2018. GPU-Motunui (2020) counts 90 million quads, 5 million
curves, 28 million instances in three levels, and 15 billion primitives with all instances.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

QUADS, CURVES, INSTANCES, PRIMITIVES = 90e6, 5e6, 28e6, 15e9
LEAST, MOST = 0.005, 1.0

ROCK_KINDS, ROCK_SHARE, ROCKS = 26, 0.17, 520  # exemplars, their part of all quads, how many are placed
CORAL_KINDS, CORAL_SHARE, CORALS = 36, 0.22, 2600
TREES = {"palm": 0.28, "hau": 0.29, "kamani": 0.29, "ironwood": 0.14}  # of all trees
UNDERGROWTH = 8e6
FLOOR_SHARE = 0.5  # of the litter lies below trees, the rest on the beach


def shared(total: int, shares: np.ndarray) -> np.ndarray:
    """Whole numbers in the proportion of shares that add up to total."""
    exact = total * np.asarray(shares, float) / np.sum(shares)
    whole = np.floor(exact).astype(np.int64)
    whole[np.argsort(whole - exact, kind="stable")[: total - whole.sum()]] += 1
    return whole


def stone_side(scale: float, share: float, kinds: int) -> int:
    """Quads along a side of a ball of six squares."""
    return max(4, round(np.sqrt(QUADS * scale * share / kinds / 6)))


@dataclass(frozen=True)
class Plan:
    scale: float
    rock_side: int
    coral_side: int
    ground_rows: int
    ground_columns: int
    blades: int  # of grass, each a curve of its own
    placed: dict[str, np.ndarray]  # kind: how many of each exemplar
    quads: int
    curves: int
    instances: int  # matrices that are stored
    primitives: int  # with all instances

    def told(self) -> dict[str, object]:
        """For --count."""
        kinds = {name: int(many.sum()) for name, many in self.placed.items()}
        ground = self.ground_rows * self.ground_columns
        return {
            "scale": self.scale, "quads": self.quads, "curves": self.curves, "instances": self.instances,
            "primitives": self.primitives, "ground": ground, "blades": self.blades, **kinds,
        }  # fmt: skip


def planned(scale: float, kinds: dict, small: dict[str, int], sea: int) -> Plan:
    """`kinds`: exemplars by name; `small`: quads, curves and rows of all of them; `sea`: quads of the water."""
    if not LEAST <= scale <= MOST:
        raise ValueError(f"a scale of {scale}: there are islands from {LEAST:g} to {MOST:g}")
    rock, coral = stone_side(scale, ROCK_SHARE, ROCK_KINDS), stone_side(scale, CORAL_SHARE, CORAL_KINDS)
    placed = {"rock": shared(ROCKS, np.ones(ROCK_KINDS)), "coral": shared(CORALS, np.ones(CORAL_KINDS))}
    quads = small["quads"] + 6 * (ROCK_KINDS * rock**2 + CORAL_KINDS * coral**2) + sea
    rest = QUADS * scale - quads
    columns = round(np.sqrt(rest))
    rows = round(rest / columns)
    blades = round(CURVES * scale) - small["curves"]
    if min(rest, blades) <= 0:
        raise ValueError(f"a scale of {scale}: exemplars alone have more than that")
    placed["undergrowth"] = shared(round(UNDERGROWTH * scale), kinds["undergrowth"].shares)

    # The rest of the rows are trees and litter; that many trees that the primitives are as many as they should be.
    rows_left = round(INSTANCES * scale) - small["rows"] - ROCKS - CORALS - round(UNDERGROWTH * scale)
    tree = sum(share * kinds[name].mean_primitives for name, share in TREES.items())
    lying = FLOOR_SHARE * kinds["floor"].mean_primitives + (1 - FLOOR_SHARE) * kinds["beach"].mean_primitives
    others = rows * columns + sea + blades + all_of(kinds["undergrowth"], placed["undergrowth"])
    others += 6 * (rock**2 * ROCKS + coral**2 * CORALS)
    trees = round((PRIMITIVES * scale - others - rows_left * lying) / (tree - lying))
    if trees <= 0 or trees > rows_left:
        raise ValueError(f"a scale of {scale}: {trees} trees among {rows_left} instances")
    for name, many in zip(TREES, shared(trees, list(TREES.values())), strict=True):
        placed[name] = shared(many, kinds[name].shares)
    for name, many in zip(("floor", "beach"), shared(rows_left - trees, [FLOOR_SHARE, 1 - FLOOR_SHARE]), strict=True):
        placed[name] = shared(many, kinds[name].shares)
    primitives = rows * columns + sea + blades + 6 * (rock**2 * ROCKS + coral**2 * CORALS)
    primitives += sum(all_of(kinds[name], many) for name, many in placed.items() if name not in ("rock", "coral"))
    return Plan(
        scale, rock, coral, rows, columns, blades, placed,
        quads=quads + rows * columns,
        curves=small["curves"] + blades,
        instances=small["rows"] + sum(int(many.sum()) for many in placed.values()),
        primitives=int(primitives),
    )  # fmt: skip


def all_of(kind: object, many: np.ndarray) -> int:
    return sum(int(n) * e.primitives for n, e in zip(many, kind.exemplars, strict=True))
