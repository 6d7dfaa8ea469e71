"""MaterialX's matrices. They act on row vectors, as those of the shading language do; one of 3 by 3 is the upper left
part of one of 4 by 4, whose rest is that of the identity. What has no inverse has the inverse 0."""

from __future__ import annotations

from kanuka.looks.rsl import MATRICES, SIZES, Stage, Value, of_numbers

from .network import Evaluate, Node

IDENTITY = {kind: tuple(float(i % (n + 1) == 0) for i in range(n * n)) for kind, n in MATRICES.items()}


def matrix(node: Node, name: str, stage: Stage, kind: str) -> Value:
    found = node.value(name, stage, kind, IDENTITY[kind])
    assert found
    return node.network.writer.let(stage, found)


def product(operator: str) -> Evaluate:
    def evaluate(node: Node, output: str, stage: Stage) -> Value | None:
        kind = node.kind(output)
        a, b = (matrix(node, name, stage, kind).text for name in ("in1", "in2"))
        return Value(kind, f"{a} {operator} {b}")

    return evaluate


def invert(node: Node, output: str, stage: Stage) -> Value | None:
    kind = node.kind(output)
    return Value(kind, f"1 / {matrix(node, 'in', stage, kind).text}")


def transpose(node: Node, output: str, stage: Stage) -> Value | None:
    kind = node.kind(output)
    m, n = matrix(node, "in", stage, kind), MATRICES[kind]
    return of_numbers(kind, [m.number(i % n * n + i // n) for i in range(n * n)])


def determinant(kind: str) -> Evaluate:
    def evaluate(node: Node, output: str, stage: Stage) -> Value | None:
        return Value("float", f"determinant({matrix(node, 'in', stage, kind).text})")

    return evaluate


def row(kind: str) -> Evaluate:
    """Of a matrix, by its number."""

    def evaluate(node: Node, output: str, stage: Stage) -> Value | None:
        m, n = matrix(node, "in", stage, kind), MATRICES[kind]
        at = min(max(int(node.number("index", 0)), 0), n - 1)
        return of_numbers(node.kind(output), [m.number(at * n + i) for i in range(n)])

    return evaluate


def of_rows(node: Node, output: str, stage: Stage) -> Value | None:
    """Rows of three numbers have a fourth where the matrix has: 0, and 1 in the last row."""
    kind, texts = node.kind(output), []
    n = MATRICES[kind]
    for i in range(n):
        own = node.number_kind(f"in{i + 1}", "vector" if n == 3 else "color4")
        found = node.value(f"in{i + 1}", stage, own, IDENTITY[kind][i * n : i * n + SIZES[own]])
        assert found
        texts += [found.number(j) if j < SIZES[own] else str(int(i == j)) for j in range(n)]
    return of_numbers(kind, texts)


def transform(kind: str) -> Evaluate:
    """A vector times a matrix, with ones for numbers that the vector lacks; nothing is divided by the fourth."""

    def evaluate(node: Node, output: str, stage: Stage) -> Value | None:
        m, n, own = matrix(node, "mat", stage, kind), MATRICES[kind], node.kind(output)
        v = node.value("in", stage, own, 0.0)
        assert v
        v, size = node.network.writer.let(stage, v), SIZES[own]
        given = [v.number(i) if i < size else "1" for i in range(n)]
        sums = [" + ".join(f"{x} * {m.number(i * n + j)}" for i, x in enumerate(given)) for j in range(size)]
        return of_numbers(own, sums)

    return evaluate


NODES: dict[str, Evaluate] = {
    "ND_transformmatrix_vector2M3": transform("matrix33"),
    "ND_transformmatrix_vector3": transform("matrix33"),
    "ND_transformmatrix_vector3M4": transform("matrix44"),
    "ND_transformmatrix_vector4": transform("matrix44"),
    "ND_creatematrix": of_rows,
    "ND_invertmatrix": invert,
    "ND_transpose": transpose,
} | {
    f"ND_{name}_{kind}": evaluate
    for kind in MATRICES
    for name, evaluate in {
        "multiply": product("*"),
        "divide": product("/"),
        "determinant": determinant(kind),
        "extract": row(kind),
    }.items()
}
