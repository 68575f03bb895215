"""The examples in docstrings are true."""

from __future__ import annotations

import doctest
import importlib
import re
from pathlib import Path

import pytest

import cityflow

PACKAGE = Path(cityflow.__file__).parent


def with_examples() -> list[str]:
    """Names of the modules that have some."""
    found = (p for p in sorted(PACKAGE.rglob("*.py")) if re.search(r"^\s+>>> ", p.read_text("utf-8"), re.MULTILINE))
    parts = (p.relative_to(PACKAGE.parent).with_suffix("").parts for p in found)
    return [".".join(names[:-1] if names[-1] == "__init__" else names) for names in parts]


@pytest.mark.parametrize("name", with_examples())
def test_examples_are_true(name: str) -> None:
    result = doctest.testmod(importlib.import_module(name))
    assert result.attempted
    assert not result.failed
