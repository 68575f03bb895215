"""What holds for all compiled functions."""

from __future__ import annotations

import ast
import importlib.util
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import cityflow
from cityflow.core.kernels import njit

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


def test_all_kernels_know_what_they_call() -> None:
    """numba's own `njit` keeps a kernel whatever becomes of those that it calls."""
    files = [p for p in PACKAGE.rglob("*.py") if "import njit" in p.read_text(encoding="utf-8")]
    assert len(files) > 80
    assert [p for p in files if "from cityflow.core.kernels import njit\n" not in p.read_text(encoding="utf-8")] == []


def loaded(folder: Path, caller: str = "caller") -> tuple[int, int]:
    """What a caller's kernel gives, in modules as new as those of another process; and how many kernels were read from their cache."""
    modules = {}
    for name in ("called", caller):
        spec = importlib.util.spec_from_file_location(name, folder / f"{name}.py")
        assert spec is not None
        assert spec.loader is not None
        modules[name] = sys.modules[name] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(modules[name])
    kernel = modules[caller].twice
    return kernel(1), sum(kernel.stats.cache_hits.values())


def test_a_kernel_is_compiled_anew_where_one_that_it_calls_has_changed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    for name in ("called", "caller"):
        monkeypatch.setitem(sys.modules, name, None)
    head = "from cityflow.core.kernels import njit\n"
    (tmp_path / "caller.py").write_text(
        head + "from called import MORE, one\n\n@njit(cache=True)\ndef twice(x):\n    return 2 * one(x) + MORE\n"
    )
    called = head + "MORE = {}\n\n@njit(cache=True)\ndef one(x):\n    return x + {}\n"
    for more, step, kept in ((0, 0, 0), (0, 0, 1), (0, 5, 0), (3, 5, 0), (3, 5, 1)):
        (tmp_path / "called.py").write_text(called.format(more, step))
        assert loaded(tmp_path) == (2 * (1 + step) + more, kept)


def test_kernels_that_two_processes_compiled_do_not_take_each_others_parts(tmp_path: Path) -> None:
    """numba's counts of both processes are led to where the parts of a sort and of an argsort would have one name."""
    for name in ("sort", "argsort"):
        (tmp_path / f"by_{name}.py").write_text(
            f"import numpy as np\nfrom cityflow.core.kernels import njit\n\n@njit(cache=True)\ndef first(a):\n    return np.{name}(a)[0]\n"
        )
    begin = "import sys; sys.dont_write_bytecode = True; import numpy as np; from numba.core.bytecode import FunctionIdentity; a = np.array([3.0, 1.0, 2.0]); "
    skip = "[next(FunctionIdentity._unique_ids) for _ in range({})]; "
    for words in (
        f"import by_sort; {skip.format(0)} print(by_sort.first(a))",
        f"import by_argsort; {skip.format(3)} print(by_argsort.first(a))",
        "from by_sort import first as one; from by_argsort import first as two; "
        "print(one(a), two(a), one.stats.cache_hits.total(), two.stats.cache_hits.total())",
    ):
        path = f"{PACKAGE.parent}{os.pathsep}{tmp_path}"
        found = subprocess.run(
            [sys.executable, "-c", begin + words],
            env={**os.environ, "PYTHONPATH": path}, cwd=tmp_path, capture_output=True, text=True, check=True,
        )  # fmt: skip
    assert found.stdout.split() == ["1.0", "1", "1", "1"]


def test_a_kernel_is_compiled_anew_where_an_intrinsic_that_it_calls_has_changed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    for name in ("called", "caller"):
        monkeypatch.setitem(sys.modules, name, None)
    head = "from cityflow.core.kernels import njit\n"
    (tmp_path / "caller.py").write_text(
        head + "from called import more\n\n@njit(cache=True)\ndef twice(x):\n    return 2 * more(x)\n"
    )
    called = """from numba.extending import intrinsic

@intrinsic
def more(typing, x):
    def generate(context, builder, signature, args):
        return builder.add(args[0], args[0].type({}))
    return x(x), generate
"""
    for step, kept in ((1, 0), (1, 1), (5, 0)):
        (tmp_path / "called.py").write_text(called.format(step))
        assert loaded(tmp_path) == (2 * (1 + step), kept)


def test_what_the_cache_has_is_loaded_before_the_first_call(tmp_path: Path) -> None:
    head = "from cityflow.core.kernels import njit\n\n@njit(cache=True)\ndef twice(x):\n    return {} * x\n"
    begin = "import sys; sys.dont_write_bytecode = True; from cityflow.core.kernels import load_cached; from called import twice; "
    known = (
        "print(load_cached(), len(twice.signatures), twice.stats.cache_hits.total(), twice.stats.cache_misses.total())"
    )

    def said(words: str) -> str:
        path = f"{PACKAGE.parent}{os.pathsep}{tmp_path}"
        return subprocess.run(
            [sys.executable, "-c", begin + words],
            env={**os.environ, "PYTHONPATH": path}, cwd=tmp_path, capture_output=True, text=True, check=True,
        ).stdout.strip()  # fmt: skip

    (tmp_path / "called.py").write_text(head.format(2))
    assert said(f"{known}; print(twice(1), twice(1.5))") == "0 0 0 0\n2 3.0", "nothing is kept yet"
    assert said(f"{known}; print(twice(2.5), load_cached())") == "2 2 2 0\n5.0 0", "both kinds, and nothing compiled"
    (tmp_path / "called.py").write_text(head.format(3))
    assert said(known) == "0 0 0 0", "the code of before is no longer that of the kernel"


@njit(cache=False)  # type: ignore[untyped-decorator]
def halved(x: float, often: int, whole: bool) -> float:
    for _ in range(often):
        x = x // 2 if whole else x / 2
    return x


@njit(cache=False)  # type: ignore[untyped-decorator]
def halves(x: float) -> float:
    often = 0
    while halved(x, often, False) > 1:
        often += 1
    total: float = halved(x, 1, True) + halved(x, often=2, whole=False)
    return total


def test_constants_are_numbers_like_others() -> None:
    """numba would compile a kernel for every constant that others call it with."""
    assert halves(9.0) == 4 + 2.25
    assert len(halved.signatures) == 1
