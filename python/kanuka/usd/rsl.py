"""Shading networks of USD as RSL: values, and the text of a shader.

Constants become parameters of the shader, so that materials of one structure share one shader, compiled once. What a
material reads of its geometry becomes varying parameters, which primvars are bound to by name.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

KINDS = ("float", "float2", "color", "vector", "string")
# How many numbers a kind has.
SIZES = {"float": 1, "float2": 2, "color": 3, "vector": 3}


@dataclass(frozen=True)
class Value:
    """An expression of a kind; float2 has two, one for each number."""

    kind: str
    text: str
    second: str = ""

    def number(self, index: int) -> str:
        if self.kind == "float":
            return self.text
        if self.kind == "float2":
            return (self.text, self.second, "0")[min(index, 2)]
        if self.kind == "color":
            return f"comp({self.text}, {index})"
        return f"{'xyz'[index]}comp({self.text})"

    def to(self, kind: str) -> Value:
        if kind == self.kind:
            return self
        if kind == "float":
            return Value("float", self.number(0))
        if kind == "float2":
            return Value("float2", self.number(0), self.number(0 if self.kind == "float" else 1))
        if self.kind == "float":
            return Value(kind, f"{kind}({self.text})")
        numbers = ", ".join(self.number(i) for i in range(3))
        return Value(kind, f"{kind}({numbers})")


def primvar_name(name: str) -> str:
    """A primvar's name in Kanuka: USD's may be a word of RSL, or no word at all."""
    return "usd_" + re.sub(r"\W", "_", name)


def halves(name: str) -> tuple[str, str]:
    """A primvar of two numbers is two of one: arrays do not vary over a primitive."""
    return f"{name}_0", f"{name}_1"


ZERO = {"float": "0", "color": "0", "vector": "0", "string": '""'}


@dataclass
class Stage:
    """The text of one of a shader's methods."""

    lines: list[str] = field(default_factory=list)
    known: dict[object, Value] = field(default_factory=dict)  # by what they are values of


class Writer:
    """Gathers a shader: its parameters with their values, and the statements of its stages."""

    def __init__(self) -> None:
        self.values: dict[str, object] = {}  # of parameters: "color p3" -> (1, 0, 0)
        self.declarations: list[str] = []
        self.primvars: dict[str, str] = {}  # USD's name -> kind
        self._names = 0
        self._shared: dict[object, Value] = {}

    def fresh(self, prefix: str = "v") -> str:
        self._names += 1
        return f"{prefix}{self._names}"

    def constant(self, kind: str, value: object) -> Value:
        name = self.fresh("p")
        if kind == "float2":
            a, b = (float(x) for x in value)  # type: ignore[attr-defined]
            return Value("float2", self.constant("float", a).text, self.constant("float", b).text)
        self.declarations.append(f"{kind} {name} = {ZERO[kind]};")
        self.values[f"{kind} {name}"] = value
        return Value(kind, name)

    def shared(self, kind: str, key: object, value: object) -> Value:
        """A constant that is one parameter, however often it is wanted."""
        if key not in self._shared:
            self._shared[key] = self.constant(kind, value)
        return self._shared[key]

    def primvar(self, name: str, kind: str, fallback: object = None) -> Value:
        """What the geometry has under a name; zero, or the fallback's constant, where it has nothing."""
        ours = primvar_name(name)
        if name not in self.primvars:
            self.primvars[name] = kind
            numbers = [0.0, 0.0, 0.0] if fallback is None else numbers_of(fallback)
            if kind == "float2":
                self.declarations += [
                    f"varying float {n} = {x:.9g};" for n, x in zip(halves(ours), numbers, strict=False)
                ]
            else:
                self.declarations.append(f"varying {kind} {ours} = {literal(kind, numbers)};")
        kind = self.primvars[name]
        return Value("float2", *halves(ours)) if kind == "float2" else Value(kind, ours)

    def let(self, stage: Stage, value: Value) -> Value:
        """The value in a variable."""
        if value.kind == "float2":
            return Value("float2", self._let(stage, "float", value.text), self._let(stage, "float", value.second))
        return Value(value.kind, self._let(stage, value.kind, value.text))

    def _let(self, stage: Stage, kind: str, text: str) -> str:
        if re.fullmatch(r"\w+", text):
            return text
        name = self.fresh()
        stage.lines.append(f"{kind} {name} = {text};")
        return name


def numbers_of(value: object) -> list[float]:
    return [float(value)] if isinstance(value, (int, float, bool)) else [float(x) for x in value]  # type: ignore


def literal(kind: str, numbers: list[float]) -> str:
    texts = [f"{x:.9g}" for x in numbers]
    if kind == "float":
        return texts[0]
    return f"{kind}({', '.join(texts[:3] if len(texts) >= 3 else texts[:1])})"


def shader_text(writer: Writer, methods: dict[str, list[str]], functions: str = "") -> str:
    """The whole class; methods by their heads."""
    lines = [functions.strip()] if functions.strip() else []
    lines += ["class NAME(", *("    " + d for d in writer.declarations), ") {"]
    for head, body in methods.items():
        lines += [f"    public void {head} {{", *("        " + line for line in body), "    }"]
    return "\n".join([*lines, "}", ""])
