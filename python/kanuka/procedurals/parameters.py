"""What a procedural takes: one table, from which reading, messages and the manual derive."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Parameter:
    name: str
    default: Any  # its type is the parameter's: int, float, str, or a tuple of floats
    doc: str
    low: float | None = None  # values beyond are clamped
    high: float | None = None
    choices: tuple[str, ...] = ()

    def read(self, given: Any) -> Any:
        """From text ("0.2", "0.2,0.1,0.1") or a RIB value (a number, an array, text)."""
        try:
            value = self._typed(given)
        except (TypeError, ValueError):
            raise ValueError(f"{self.name}={given}: expected {self.type_name}") from None
        if self.choices and value not in self.choices:
            raise ValueError(f"{self.name}={value}: it is one of {', '.join(self.choices)}")
        if isinstance(value, int | float):
            low = value if self.low is None else type(value)(self.low)
            high = value if self.high is None else type(value)(self.high)
            return min(max(value, low), max(value, low) if self.high is None else high)
        return value

    def _typed(self, given: Any) -> Any:
        if isinstance(self.default, str):
            return given if isinstance(given, str) else ",".join(map(str, given))
        numbers = [float(x) for x in given.split(",")] if isinstance(given, str) else np.ravel(given).tolist()
        if isinstance(self.default, tuple):
            if len(numbers) == 1:
                numbers *= len(self.default)
            if len(numbers) != len(self.default) or not np.all(np.isfinite(numbers)):
                raise ValueError
            return tuple(numbers)
        if len(numbers) != 1:
            raise ValueError
        if not np.isfinite(numbers[0]):
            raise ValueError
        return int(numbers[0]) if isinstance(self.default, int) else float(numbers[0])

    @property
    def type_name(self) -> str:
        if isinstance(self.default, tuple):
            return f"{len(self.default)} numbers"
        return {int: "an integer", float: "a number", str: "text"}[type(self.default)]

    @property
    def default_text(self) -> str:
        if isinstance(self.default, tuple):
            return ",".join(f"{x:g}" for x in self.default)
        return f"{self.default:g}" if isinstance(self.default, float) else str(self.default)


def words(data: str) -> dict[str, str]:
    """ "surface=head.rib density=200" as a dictionary."""
    found = {}
    for word in data.split():
        name, equals, value = word.partition("=")
        if not equals:
            raise ValueError(f'"{word}" is not name=value')
        found[name] = value
    return found


def read(table: tuple[Parameter, ...], data: str, typed: Mapping[str, Any] = {}) -> SimpleNamespace:
    """The values of all parameters: of `data`, over them the typed ones of Procedural2, else the defaults."""
    known = {p.name: p for p in table}
    values = {p.name: p.default for p in table}
    for name, given in {**words(data), **typed}.items():
        if name not in known:
            near = difflib.get_close_matches(name, known, 1)
            hint = f"; did you mean {near[0]}?" if near else f"; there are {', '.join(known)}"
            raise ValueError(f'there is no parameter "{name}"{hint}')
        values[name] = known[name].read(given)
    return SimpleNamespace(**values)


def markdown(table: tuple[Parameter, ...]) -> str:
    """The table of the manual."""
    lines = ["| parameter | default | is |", "|---|---|---|"]
    for p in table:
        doc = p.doc + (f": {', '.join(p.choices)}" if p.choices else "")
        lines.append(f"| `{p.name}` | {p.default_text or '—'} | {doc} |")
    return "\n".join(lines)
