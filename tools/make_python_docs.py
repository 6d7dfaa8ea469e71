"""Writes what the package declares into the manual: lights into docs/python.md, options into docs/options.md."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import kanuka

DOCS = Path(__file__).resolve().parents[1] / "docs"
END = "<!-- end -->"


def lights() -> str:
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


def rib_name(name: str) -> str:
    category, parameter = name.split(":")
    return f'"{category}" "{parameter}"'


def written(default: object) -> str:
    if isinstance(default, tuple | list):
        return ", ".join(map(written, default))
    if isinstance(default, bool):
        return str(default).lower()
    return f"{default:g}" if isinstance(default, float) else str(default)


def options() -> str:
    lines = ["| `scene.options.` | Option | `kanuka render` | takes | default | is |", "|---|---|---|---|---|---|"]
    for name, about in kanuka.option_parameters().items():
        rib = f"`{rib_name(about['rib'][0])}`" if about["rib"] else ""
        flag = f"`--{about['flag']}`" if about["flag"] else ""
        lines.append(
            f"| `{name}` | {rib} | {flag} | {about['expected']} | {written(about['default'])} | {about['help']} |"
        )
    return "\n".join(lines) + "\n"


def attributes() -> str:
    lines = ["| Attribute | takes | default | is |", "|---|---|---|---|"]
    for about in kanuka.attribute_parameters().values():
        if about["rib"]:
            names = ", ".join(f"`{rib_name(name)}`" for name in about["rib"])
            lines.append(f"| {names} | {about['expected']} | {written(about['default'])} | {about['help']} |")
    return "\n".join(lines) + "\n"


TABLES: dict[str, tuple[Path, Callable[[], str]]] = {
    "lights": (DOCS / "python.md", lights),
    "options": (DOCS / "options.md", options),
    "attributes": (DOCS / "rib.md", attributes),
}


def updated(name: str) -> str:
    page, make = TABLES[name]
    begin = f"<!-- {name}: made by tools/make_python_docs.py -->\n"
    before, rest = page.read_text().split(begin, 1)
    return before + begin + make() + END + rest.split(END, 1)[1]


if __name__ == "__main__":
    for name, (page, _) in TABLES.items():
        page.write_text(updated(name))
