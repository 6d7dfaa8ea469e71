"""The Python reference: signatures and docstrings of the package as a page of Markdown. Sources are parsed, not
imported, so that the page says what stands in them."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Iterator
from pathlib import Path

PACKAGE = Path(__file__).resolve().parent.parent / "python" / "kanuka"
# Sources of the modules, by the name that scripts import them by; docstrings of the first stand for all.
MODULES = {
    "kanuka": ("_native.pyi", "paths.py", "procedurals/__init__.py"),
    "kanuka.graph": ("graph/__init__.py", "graph/network.py"),
    "kanuka.usd": ("usd/__init__.py",),
    "kanuka.models": ("models.py",),
}
Documented = ast.Module | ast.ClassDef | ast.FunctionDef


def is_public(name: str) -> bool:
    return not name.startswith("_")


def signature(function: ast.FunctionDef, of: str = "") -> str:
    """As it is called: without self, one parameter a line where the line would be long."""
    parameters = ast.unparse(function.args).removeprefix("self").removeprefix(", ")
    result = f" -> {ast.unparse(function.returns)}" if function.returns else ""
    line = f"{of}{function.name}({parameters}){result}"
    if len(line) <= 100:
        return line
    arguments = function.args
    kept = [a for a in arguments.posonlyargs + arguments.args if a.arg != "self"]
    missing: list[ast.expr | None] = [None] * (len(kept) - len(arguments.defaults))
    named = [(a, d) for a, d in zip(kept, [*missing, *arguments.defaults], strict=False)]
    keywords = list(zip(arguments.kwonlyargs, arguments.kw_defaults, strict=True))

    def written(argument: ast.arg, default: ast.expr | None) -> str:
        typed = f"{argument.arg}: {ast.unparse(argument.annotation)}" if argument.annotation else argument.arg
        return typed + (f" = {ast.unparse(default)}" if default else "")

    lines = [written(*each) for each in named]
    if arguments.vararg or keywords:
        lines.append("*" + (written(arguments.vararg, None) if arguments.vararg else ""))
    lines += [written(*each) for each in keywords]
    if arguments.kwarg:
        lines.append("**" + written(arguments.kwarg, None))
    return f"{of}{function.name}(\n" + "".join(f"    {each},\n" for each in lines) + f"){result}"


def is_property(function: ast.FunctionDef) -> bool:
    return any(isinstance(d, ast.Name) and d.id == "property" for d in function.decorator_list)


def is_setter(function: ast.FunctionDef) -> bool:
    return any(isinstance(d, ast.Attribute) and d.attr == "setter" for d in function.decorator_list)


def text_of(node: Documented) -> str:
    return inspect.cleandoc(ast.get_docstring(node) or "") + "\n"


def code(text: str) -> str:
    return f"```python\n{text}\n```\n"


def class_page(node: ast.ClassDef) -> Iterator[str]:
    yield f"### {node.name}\n"
    yield text_of(node)
    properties, methods = [], []
    for each in node.body:
        if not isinstance(each, ast.FunctionDef) or is_setter(each):
            continue
        if is_property(each):
            properties.append(each)
        elif is_public(each.name) or each.name == "__init__":
            methods.append(each)
    if properties:
        yield "| property | type | is |\n|---|---|---|"
        for each in properties:
            kind = ast.unparse(each.returns) if each.returns else ""
            about = " ".join(text_of(each).split()).replace("|", "\\|")
            yield f"| `{each.name}` | `{kind}` | {about} |".replace("`` ", " ")
        yield ""
    for each in methods:
        name = node.name if each.name == "__init__" else f"{node.name[0].lower()}{node.name[1:]}.{each.name}"
        made = signature(each)
        yield code(made.replace(f"{each.name}(", f"{name}(", 1).removesuffix(" -> None"))
        yield text_of(each)


def module_page(name: str, files: tuple[str, ...]) -> Iterator[str]:
    yield f"## {name}\n"
    seen: set[str] = set()
    for file in files:
        path = PACKAGE / file
        if not path.exists():
            raise FileNotFoundError(f"{path} is missing: it comes with the build (make build)")
        tree = ast.parse(path.read_text())
        if file == files[0] and path.suffix == ".py":
            yield text_of(tree)
        for node in tree.body:
            if not isinstance(node, ast.ClassDef | ast.FunctionDef) or not is_public(node.name) or node.name in seen:
                continue
            seen.add(node.name)
            if isinstance(node, ast.ClassDef):
                yield from class_page(node)
            else:
                yield f"### {node.name}\n"
                yield code(signature(node, f"{name}."))
                yield text_of(node)


def page() -> str:
    parts = [
        "# Python reference\n",
        "Made from the signatures and docstrings of the package. [Python](python.md) is the tutorial.\n",
    ]
    for name, files in MODULES.items():
        parts += module_page(name, files)
    return "\n".join(parts)
