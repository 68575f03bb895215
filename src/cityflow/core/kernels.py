"""Compiled functions of numba, cached until they change, or anything that they call or use as a constant."""

from __future__ import annotations

import hashlib
import inspect
import os
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any

import numba
from numba.core import types
from numba.core.bytecode import FunctionIdentity
from numba.core.registry import CPUDispatcher
from numba.extending import _Intrinsic

CONSTANTS = (int, float, str, tuple)
NAMES = "numbers by process"
"""How machine code is named; part of every cached kernel's stamp."""
_CACHED: list[Any] = []
"""Kernels of this process whose machine code is kept on disk."""


def _count_from_elsewhere() -> None:
    """Give the functions that this process compiles numbers that no other process gives.

    numba counts functions from 1 in each process and names their machine code by that number. So of two cached kernels that two processes compiled, one
    may bear the name of a part of the other. A third process that loads both then runs the first in place of the second: a sort in place of an argsort.
    """
    FunctionIdentity._unique_ids = count(int.from_bytes(os.urandom(7), "big"))


_count_from_elsewhere()
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_count_from_elsewhere)


def njit(**options: Any) -> Any:
    """`numba.njit`, whose cache knows the functions and constants that come from other files.

    numba compares the function's own file alone: an old kernel that calls a changed one crashes or counts wrongly. And a call with
    a constant is like any other here: numba would compile the kernel once more for it. C never calls a kernel: what would let it is
    not compiled.
    """

    def compiled(function: Callable[..., Any]) -> Any:
        kernel = numba.njit(no_cfunc_wrapper=True, no_cpython_wrapper=False, **options)(function)
        kernel.get_call_template = partial(_template_by_types, kernel.get_call_template)
        if options.get("cache"):
            kept = kernel._cache._cache_file
            parts = [repr(kept._source_stamp), NAMES, *sorted(_parts(function))]
            kept._source_stamp = hashlib.sha256("\n".join(parts).encode()).hexdigest()
            _CACHED.append(kernel)
        return kernel

    return compiled


def load_cached() -> int:
    """Load what the cache has of the kernels of all modules imported so far, as the first call of each would; the number of kernels loaded for some types."""
    loaded = 0
    for kernel in _CACHED:
        kept = kernel._cache
        for key in kept._cache_file._load_index():
            if key == kept._index_key(key[0], kernel.targetctx.codegen()) and key[0] not in kernel.overloads:
                kernel.compile(key[0])
                loaded += 1
    return loaded


def _template_by_types(template: Callable[..., Any], args: Iterable[Any], kws: Mapping[str, Any]) -> Any:
    """What a kernel is to another that calls it: of a constant, only its type counts."""
    return template([types.unliteral(a) for a in args], {name: types.unliteral(a) for name, a in kws.items()})


def _parts(function: Callable[..., Any]) -> set[str]:
    """What stands for the other kernels and the constants that a function's file has by now."""
    found = set()
    for name, value in function.__globals__.items():
        if isinstance(value, CPUDispatcher):
            kept: Any = vars(value)["_cache"]
            found.add(str(kept._cache_file._source_stamp) if hasattr(kept, "_cache_file") else name)
        elif isinstance(value, _Intrinsic):
            found.add(f"{name} = {hashlib.sha256(Path(inspect.getfile(value._defn)).read_bytes()).hexdigest()}")
        elif name in function.__code__.co_names and isinstance(value, CONSTANTS):
            found.add(f"{name} = {value!r}")
    return found
