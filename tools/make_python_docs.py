"""Writes what the package declares into the manual: lights into docs/python.md
and docs/shade.md, options into docs/options.md, attributes into docs/rib.md,
cameras into docs/camera.md."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import kanuka

DOCS = Path(__file__).resolve().parents[1] / "docs"
END = "<!-- end -->"


def light_rows() -> dict[str, dict[str, dict]]:
    """By parameter: what it is of each kind that has it."""
    rows: dict[str, dict[str, dict]] = {}
    for kind, about in kanuka.light_kinds().items():
        for parameter, declared in about["parameters"].items():
            rows.setdefault(parameter, {})[kind] = declared
    return rows


def lights() -> str:
    kinds = kanuka.light_kinds()
    lines = ["| kind | amount | is |", "|---|---|---|"]
    lines += [f"| `{name}` | {about['amount']} | {about['help']} |" for name, about in kinds.items()]
    lines += ["", "| parameter | default | takes | is | of |", "|---|---|---|---|---|"]
    for parameter, owners in light_rows().items():
        declared = next(iter(owners.values()))
        by_default: dict[str, list[str]] = {}
        for kind, about in owners.items():
            by_default.setdefault(written(about["default"]), []).append(kind)
        default = next(iter(by_default))
        if len(by_default) > 1:
            default = "; ".join(f"{value} ({', '.join(of)})" for value, of in by_default.items())
        takes = declared["unit"] if declared["unit"] and declared["type"].startswith("str") else declared["expected"]
        of = "all" if len(owners) == len(kinds) else ", ".join(owners)
        lines.append(f"| `{parameter}` | {default} | {takes} | {declared['help']} | {of} |")
    return "\n".join(lines) + "\n"


def light_shaders() -> str:
    lines = ["| shader | Python | parameters |", "|---|---|---|"]
    for name, about in kanuka.light_kinds().items():
        parameters = [" or ".join(declared["rib"]) for declared in about["parameters"].values() if declared["rib"]]
        lines.append(
            f"| `{about['shader']}` | `{name}` | {', '.join(parameters)} |".replace("intensity or ", "intensity, ")
        )
    return "\n".join(lines) + "\n"


def rib_name(name: str) -> str:
    category, parameter = name.split(":")
    return f'"{category}" "{parameter}"'


def written(default: object) -> str:
    if isinstance(default, tuple | list):
        return ", ".join(map(written, default))
    if isinstance(default, bool):
        return str(default).lower()
    if default is None or default == "":
        return "none"
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


def camera() -> str:
    lines = ["| Python | RIB | takes | default | is |", "|---|---|---|---|---|"]
    for name, about in kanuka.camera_parameters().items():
        rib = f"`{rib_name(about['rib'][0])}`" if ":" in about["rib"][0] else f"`{about['rib'][0]}`"
        lines.append(f"| `{name}` | {rib} | {about['expected']} | {written(about['default'])} | {about['help']} |")
    return "\n".join(lines) + "\n"


TABLES: dict[str, tuple[Path, Callable[[], str]]] = {
    "lights": (DOCS / "python.md", lights),
    "light shaders": (DOCS / "shade.md", light_shaders),
    "camera": (DOCS / "camera.md", camera),
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
