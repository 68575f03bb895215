"""What holds for all compiled functions."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import cityflow

PACKAGE = Path(cityflow.__file__).parent


def kernels() -> Iterator[tuple[str, ast.FunctionDef]]:
    """File and definition of every function that numba compiles."""
    for path in sorted(PACKAGE.rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(text)) if "@njit" in text else ():
            if isinstance(node, ast.FunctionDef) and any("njit" in ast.unparse(d) for d in node.decorator_list):
                yield str(path.relative_to(PACKAGE)), node


def test_no_kernel_has_a_default_that_every_process_compiles_anew() -> None:
    """What is compiled is kept by the types of its arguments, and an argument left out has its default as type: NaN is not equal to itself."""
    found = list(kernels())
    assert len(found) > 300
    bad = [f"{path}: {k.name}" for path, k in found for d in k.args.defaults if "nan" in ast.unparse(d).lower()]
    assert bad == []
