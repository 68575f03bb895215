"""Benchmarks are not run here, but what they name exists: methods are renamed more often than a benchmark is run."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import pytest

from cityflow.surface.dtm import METHODS

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"
METHOD_OPTIONS = ("--method", "--methods")
WHOLE = ("model", "choose")
"""Names of `benchmarks/reconstruct_methods.py` for the choice among all methods."""


def _defaults(text: str) -> Iterator[str]:
    """Method names that are the default of an option, and those of the literal ``"methods": [...]``."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Call) and any(
            isinstance(a, ast.Constant) and a.value in METHOD_OPTIONS for a in node.args
        ):
            yield from (n for k in node.keywords if k.arg == "default" for n in _names(k.value))
        if isinstance(node, ast.Dict):
            for key, value in zip(node.keys, node.values, strict=True):
                if isinstance(key, ast.Constant) and key.value == "methods":
                    yield from _names(value)


def _names(node: ast.expr) -> Iterator[str]:
    for part in node.elts if isinstance(node, ast.List | ast.Tuple) else [node]:
        if isinstance(part, ast.Constant) and isinstance(part.value, str):
            yield from part.value.replace("=", ",").replace("+", ",").split(",")


def _exists(name: str) -> bool:
    return name in METHODS or name in WHOLE or find_spec(f"cityflow.reconstruction.{name}") is not None


@pytest.mark.parametrize("path", sorted(BENCHMARKS.glob("*.py")), ids=lambda p: p.stem)
def test_default_methods_exist(path: Path) -> None:
    assert [n for n in _defaults(path.read_text()) if not _exists(n)] == []


def test_a_method_that_is_gone_is_found() -> None:
    text = 'o.add_argument("--methods", nargs="+", default=["windows", "model=volumetric+monolithic"])\nx = {"methods": ("extruded", "gone")}'
    assert [n for n in _defaults(text) if not _exists(n)] == ["windows", "gone"]
