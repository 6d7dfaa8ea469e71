"""The test bench for shaders: runs one over a small grid and says in text what came out, for tests/test_shaders.py and
tools/make_shader_references.py."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

import kanuka

SHADERS = Path(__file__).resolve().parent / "shaders"
WIDTH, HEIGHT = 5, 4
# Shaders of scenes, which have no expected output of their own.
SCENE_SHADERS = {"micro_bumps", "microscope", "sticky_texture"}
TOLERANCE = 1e-5


def names() -> list[str]:
    return sorted(p.stem for p in SHADERS.glob("*.sl") if p.stem not in SCENE_SHADERS)


def outcome(name: str, lanes: int = 0, opt_level: int = 2, path: Path | None = None) -> dict[str, object]:
    """Arrays by name, and "messages". A probe's two lobes are r, of any sign."""
    path = path or SHADERS / f"{name}.sl"
    journal = kanuka.Journal()
    shader = kanuka.compile_shader(path, lanes=lanes, opt_level=opt_level, use_cache=False, journal=journal)
    result = shader.run(WIDTH, HEIGHT, journal=journal)
    slots = dict(result["slots"])
    varying = {s["name"] for s in result["program"]["slots"] if not s["uniform"]}
    values: dict[str, object] = {}
    if "minus.radiance" in slots:
        slots["r"] = slots.pop("plus.radiance") - slots.pop("minus.radiance")
        if "plus.radiance" in varying:
            varying.add("r")
        slots = {k: v for k, v in slots.items() if not k.endswith(".weight")}
    for key, array in slots.items():
        values[key] = array if key in varying else array[:1, :1]
    rest = np.stack(np.meshgrid(np.linspace(0, 1, WIDTH), np.linspace(0, 1, HEIGHT)), axis=-1)
    if not np.allclose(result["P"][:, :, :2], rest, atol=1e-6) or np.any(result["P"][:, :, 2]):
        values["P"] = result["P"]
    if not np.array_equal(result["N"], np.broadcast_to(np.float32([0, 0, 1]), result["N"].shape)):
        values["N"] = result["N"]
    if result["program"]["interior"]:
        for key, value in result["program"]["interior"].items():
            if isinstance(value, str):
                continue
            values[f"interior.{key}"] = np.float32(value).reshape(1, 1, -1)
    messages = [re.sub(r"^\S*/|; searched in .*", "", str(m).split("\n")[0]) for m in journal]
    values["messages"] = [f"{m.severity}: {text}" for m, text in zip(journal, messages, strict=True)]
    return values


def text(values: dict[str, object]) -> str:
    """One line a row of the grid; one value where all vertices share it."""
    lines = []
    for name, array in values.items():
        if name == "messages":
            continue
        array = array if array.ndim == 3 else array[:, :, None]
        lines.append(f"{name}:" + (" uniform" if array.shape[:2] == (1, 1) else ""))
        for row in array:
            lines.append("  " + "  ".join("(" + " ".join(f"{x + 0.0:.6g}" for x in vertex) + ")" for vertex in row))
    return "\n".join([*lines, *values["messages"]]) + "\n"


def parse(reference: str) -> dict[str, object]:
    values: dict[str, object] = {"messages": []}
    rows: list[list[list[float]]] | None = None
    for line in reference.splitlines():
        if line.startswith("  "):
            rows.append([[float(x) for x in vertex.split()] for vertex in re.findall(r"\(([^)]*)\)", line)])
        elif re.fullmatch(r"\S+:( uniform)?", line):
            rows = values[line.partition(":")[0]] = []
        elif line:
            values["messages"].append(line)
    return values


def difference(got: dict[str, object], expected: dict[str, object]) -> str:
    """What differs, in words; nothing if all agree."""
    if set(got) != set(expected):
        return f"outputs {sorted(set(got) - {'messages'})}, expected {sorted(set(expected) - {'messages'})}"
    if got["messages"] != expected["messages"]:
        return f"messages {got['messages']}, expected {expected['messages']}"
    for name, array in got.items():
        if name == "messages":
            continue
        a = np.asarray(array if array.ndim == 3 else array[:, :, None], dtype=np.float64)
        b = np.asarray(expected[name], dtype=np.float64)
        if b.ndim == 2:
            b = b[:, :, None]
        if a.shape != b.shape:
            return f"{name} has shape {a.shape}, expected {b.shape}"
        wrong = ~(np.abs(a - b) <= TOLERANCE * np.maximum(1, np.abs(b)))
        if wrong.any():
            at = tuple(np.argwhere(wrong)[0])
            return f"{name} at row {at[0]}, column {at[1]}: {a[at[:2]]}, expected {b[at[:2]]}"
    return ""
