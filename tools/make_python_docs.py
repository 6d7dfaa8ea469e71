"""Writes the tables of lights in docs/python.md as the package declares them."""

from __future__ import annotations

from pathlib import Path

import kanuka

MANUAL = Path(__file__).resolve().parents[1] / "docs" / "python.md"
BEGIN, END = "<!-- lights: made by tools/make_python_docs.py -->\n", "<!-- end of lights -->"


def tables() -> str:
    kinds = kanuka.light_kinds()
    lines = ["| kind | amount | is |", "|---|---|---|"]
    lines += [f"| `{name}` | {about['amount']} | {about['help']} |" for name, about in kinds.items()]
    lines += ["", "| parameter | default | unit | is | of |", "|---|---|---|---|---|"]
    rows: dict[str, tuple] = {}
    for name, about in kinds.items():
        for parameter, declared in about["parameters"].items():
            rows.setdefault(parameter, (declared, []))[1].append(name)
    for parameter, ((default, unit, words), owners) in rows.items():
        of = "all" if len(owners) == len(kinds) else ", ".join(owners)
        lines.append(f"| `{parameter}` | {default} | {unit} | {words} | {of} |")
    return "\n".join(lines) + "\n"


def updated(text: str) -> str:
    before, rest = text.split(BEGIN, 1)
    return before + BEGIN + tables() + END + rest.split(END, 1)[1]


if __name__ == "__main__":
    MANUAL.write_text(updated(MANUAL.read_text()))
