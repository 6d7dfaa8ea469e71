"""Shading networks of USD as RSL: values, and the text of a shader.

Constants become parameters of the shader, so that materials of one structure share one shader, compiled once. What a
material reads of its geometry becomes varying parameters, which primvars are bound to by name.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TypeAlias

# How many numbers a kind has.
SIZES = {"float": 1, "float2": 2, "color": 3, "vector": 3, "color4": 4, "matrix33": 9, "matrix44": 16}
MATRICES = {"matrix33": 3, "matrix44": 4}  # and how many rows


@dataclass(frozen=True)
class Value:
    """An expression of a kind. Two kinds have a second: float2 one for each number, color4 that of its alpha."""

    kind: str
    text: str
    second: str = ""

    def number(self, index: int) -> str:
        if self.kind == "float":
            return self.text
        if self.kind == "float2":
            return (self.text, self.second, "0")[min(index, 2)]
        if self.kind == "color4" and index == 3:
            return self.second
        if self.kind in ("color", "color4"):
            return f"comp({self.text}, {index})"
        if rows := MATRICES.get(self.kind):
            return f"comp({self.text}, {index // rows}, {index % rows})"
        return f"{'xyz'[index]}comp({self.text})"

    def to(self, kind: str) -> Value:
        if kind == self.kind:
            return self
        if kind == "float":
            return Value("float", self.number(0))
        if kind == "float2":
            return Value("float2", self.number(0), self.number(0 if self.kind == "float" else 1))
        if kind == "color4":
            return Value(kind, self.to("color").text, self.text if self.kind == "float" else "1")
        if kind in MATRICES:
            return of_numbers(kind, [self.number(0)] * SIZES[kind])
        if self.kind == "float":
            return Value(kind, f"{kind}({self.text})")
        if (self.kind, kind) == ("color4", "color"):
            return Value(kind, self.text)
        return of_numbers(kind, [self.number(i) for i in range(3)])


def of_numbers(kind: str, texts: list[str]) -> Value:
    """A value of expressions, one for each of its numbers."""
    if kind == "float":
        return Value(kind, texts[0])
    if kind == "float2":
        return Value(kind, texts[0], texts[1])
    if kind == "matrix33":
        texts = [*texts[:3], "0", *texts[3:6], "0", *texts[6:9], "0", "0", "0", "0", "1"]
    if kind in MATRICES:
        return Value(kind, f"matrix({', '.join(texts)})")
    made = f"{'color' if kind == 'color4' else kind}({', '.join(texts[:3])})"
    return Value(kind, made, texts[3] if kind == "color4" else "")


def primvar_name(name: str) -> str:
    """A primvar's name in Kanuka: USD's may be a word of RSL, or no word at all."""
    return "usd_" + re.sub(r"\W", "_", name)


def halves(name: str) -> tuple[str, str]:
    """A primvar of two numbers is two of one: arrays do not vary over a primitive."""
    return f"{name}_0", f"{name}_1"


Corners: TypeAlias = "tuple[tuple[str, str], ...]"  # of an area of a picture, four: s and t

ZERO = {"float": "0", "color": "0", "vector": "0", "string": '""'}


@dataclass
class Stage:
    """The text of one of a shader's methods."""

    lines: list[str] = field(default_factory=list)
    known: dict[object, Value] = field(default_factory=dict)  # by what they are values of


class Writer:
    """Gathers a shader: its parameters with their values, and the statements of its stages."""

    def __init__(self) -> None:
        self.functions: dict[str, str] = {}  # of RSL that expressions call, by their names
        self.values: dict[str, object] = {}  # of parameters: "color p3" -> (1, 0, 0)
        self.declarations: list[str] = []
        self.members: list[str] = []  # variables that stages hand on to later ones
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
        if kind == "color4":
            *rgb, alpha = (float(x) for x in value)  # type: ignore[attr-defined]
            return Value("color4", self.constant("color", tuple(rgb)).text, self.constant("float", alpha).text)
        if kind in MATRICES:
            return of_numbers(kind, [f"{x:.9g}" for x in numbers_of(value)])  # rare: no parameter
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
        if kind == "color4":  # alphas are not bound
            return self.primvar(name, "color", fallback).to(kind)
        ours = primvar_name(name)
        if name not in self.primvars and kind in ("string", "matrix44"):
            self.primvars[name] = kind
            self.declarations.append(whole(kind, ours, fallback))
        elif name not in self.primvars:
            self.primvars[name] = kind
            numbers = [0.0, 0.0, 0.0] if fallback is None else numbers_of(fallback)
            if kind == "float2":
                self.declarations += [
                    f"varying float {n} = {x:.9g};" for n, x in zip(halves(ours), numbers, strict=False)
                ]
            else:
                self.declarations.append(f"varying {kind} {ours} = {literal(kind, numbers)};")
        kind = self.primvars[name]
        if kind == "matrix44":
            return of_numbers(kind, [f"{ours}[{i}]" for i in range(16)])
        return Value("float2", *halves(ours)) if kind == "float2" else Value(kind, ours)

    def texture(
        self,
        stage: Stage,
        file: str | Value,
        st: Value | Corners,
        wrap: str,
        space: str,
        channel: int | None,
        fill: float = 0,
        blur: str = "",
    ) -> Value:
        """A picture at st, whose t grows upwards, or over four corners: the colour, or one channel. `file`: a value,
        whose text may be empty: all is `fill` then; `space`: raw, srgb, auto; `blur`: part of the picture."""
        key = ("texture", file, st, wrap, space, channel, blur)
        if key not in stage.known:
            strings = {"file": file, "wrap": wrap, "space": space}
            texts = [
                value.text if isinstance(value, Value) else self.shared("string", (file, name, value), value).text
                for name, value in strings.items()
            ]
            options = f'"wrap", {texts[1]}, "colorspace", {texts[2]}, "fill", {fill:g}'
            options += f', "blur", {blur}' if blur else ""
            corners = ((st.text, st.second),) if isinstance(st, Value) else st
            where = ", ".join(f"{s}, 1 - ({t})" for s, t in corners)
            if channel is None:
                found = Value("color", f"color texture({texts[0]}, {where}, {options})")
            else:
                found = Value("float", f"float texture({texts[0]}[{channel}], {where}, {options})")
            if isinstance(file, Value):
                none = f"color({fill:g})" if channel is None else f"{fill:g}"
                found = Value(found.kind, f'{file.text} == "" ? {none} : {found.text}')
            stage.known[key] = self.let(stage, found)
        return stage.known[key]

    def let(self, stage: Stage, value: Value) -> Value:
        """The value in a variable."""
        if value.second:
            first = "color" if value.kind == "color4" else "float"
            return Value(value.kind, self._let(stage, first, value.text), self._let(stage, "float", value.second))
        return Value(value.kind, self._let(stage, "matrix" if value.kind in MATRICES else value.kind, value.text))

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


def whole(kind: str, name: str, fallback: object) -> str:
    """The declaration of what a primitive has one of: a text, or the numbers of a matrix, which are in no space."""
    if kind == "string":
        quoted = str(fallback or "").replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
        return f'uniform string {name} = "{quoted}";'
    numbers = [float(i % 5 == 0) for i in range(16)] if fallback is None else numbers_of(fallback)
    return f"uniform float {name}[16] = {{{', '.join(f'{x:.9g}' for x in numbers)}}};"


def shader_text(writer: Writer, methods: dict[str, list[str]]) -> str:
    """The whole class; methods by their heads. Parameters that nothing reads are left out, and so are their values."""
    functions = [text.strip() for text in writer.functions.values()]
    body = [line for lines in methods.values() for line in lines]
    words = set(re.findall(r"\w+", "\n".join(body)))
    declarations = [d for d in writer.declarations if d.split(" = ")[0].split()[-1].partition("[")[0] in words]
    writer.values = {name: value for name, value in writer.values.items() if name.split()[-1] in words}
    lines = [*functions, "class NAME(", *("    " + d for d in declarations), ") {"]
    lines += ["    " + member for member in writer.members]
    for head, body in methods.items():
        lines += [f"    public void {head} {{", *("        " + line for line in body), "    }"]
    return "\n".join([*lines, "}", ""])
