"""What all tables are made of."""

from __future__ import annotations

TITLES = {
    "load_s": "load",
    "build_s": "build",
    "first_picture_s": "first picture",
    "render_s": "render",
    "error": "error",
    "error_x_time": "error × render",
    "peak_bytes": "peak memory",
}
NOT_MEASURED = "(not measured)"


def show(name: str, value: object) -> str:
    if not isinstance(value, int | float):
        return "–" if value is None else str(value)
    if name.endswith("_bytes"):
        return f"{value / 1e9:.2f} GB" if value >= 1e9 else f"{value / 1e6:.0f} MB"
    return f"{value:.3g} s" if name.endswith("_s") and not name.endswith("per_s") else f"{value:.3g}"


def table(head: list[str], rows: list[list[str]]) -> str:
    if not rows:
        return NOT_MEASURED
    lines = ["| " + " | ".join(cells) + " |" for cells in (head, *rows)]
    return "\n".join([lines[0], "|" + "---|" * len(head), *lines[1:]])
