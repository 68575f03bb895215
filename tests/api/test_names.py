"""What `import cityflow` offers: names that load when they are used, known to type checkers by a stub."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import cityflow

STUB = Path(cityflow.__file__).with_suffix(".pyi")


def test_the_stub_names_what_the_module_names_from_the_same_places() -> None:
    stub = ast.parse(STUB.read_text(encoding="utf-8"))
    found = {(n.module, a.name) for n in stub.body if isinstance(n, ast.ImportFrom) for a in n.names}
    assert found == {(module, name) for name, module in vars(cityflow)["_MODULE_OF"].items()}


@pytest.mark.parametrize("name", [n for n in cityflow.__all__ if n != "__version__"])
def test_every_name_loads_and_says_what_it_is(name: str) -> None:
    assert getattr(cityflow, name).__doc__
    assert name in dir(cityflow)


def test_an_unknown_name_is_refused() -> None:
    with pytest.raises(AttributeError, match="no attribute 'open_town'"):
        getattr(cityflow, "open_town")  # noqa: B009 - a type checker knows that it is not there


def test_the_import_alone_loads_no_library() -> None:
    heavy = "{'numpy', 'shapely', 'numba', 'dask', 'pydantic'} & sys.modules.keys()"
    done = subprocess.run([sys.executable, "-c", f"import sys, cityflow; sys.exit(len({heavy}))"], check=False)
    assert done.returncode == 0
