"""Materials that can be written down again."""

from __future__ import annotations

from collections.abc import Mapping

import kanuka


class MadeMaterial(kanuka.Material):
    """One of a shader's name and declared values, which it remembers: writers of other formats ask for them."""

    def __init__(self, shader: str, values: Mapping[str, object]) -> None:
        super().__init__(shader, parameters=dict(values))
        self.values = dict(values)
