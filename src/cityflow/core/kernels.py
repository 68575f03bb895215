"""Compiled functions of numba, cached until they change, or anything that they call or use as a constant."""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numba
from numba.core import types
from numba.core.registry import CPUDispatcher
from numba.extending import _Intrinsic

CONSTANTS = (int, float, str, tuple)


def njit(**options: Any) -> Any:
    """`numba.njit`, whose cache knows the functions and constants that come from other files.

    numba compares the function's own file alone: an old kernel that calls a changed one crashes or counts wrongly. And a call with
    a constant is like any other here: numba would compile the kernel once more for it. C never calls a kernel: what would let it is
    not compiled.
    """

    def compiled(function: Callable[..., Any]) -> Any:
        kernel = numba.njit(no_cfunc_wrapper=True, **options)(function)
        kernel.get_call_template = partial(_template_by_types, kernel.get_call_template)
        if options.get("cache"):
            kept = kernel._cache._cache_file
            parts = [repr(kept._source_stamp), *sorted(_parts(function))]
            kept._source_stamp = hashlib.sha256("\n".join(parts).encode()).hexdigest()
        return kernel

    return compiled


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
