"""Processor time of named functions of the program, each without what it calls of the others; and what numba compiles meanwhile.

Functions are wrapped wherever a module has them under their name. One that the program no longer has is listed in `gone`, and its time
stands with its caller, so the table of a benchmark stays whole when the code changes.
"""

from __future__ import annotations

import importlib
import sys
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import wraps
from typing import Any

from numba.core import event

REST = "the rest"
COMPILING = "compiling kernels"


@dataclass(frozen=True, slots=True)
class Step:
    """A function whose time is wanted.

    Attributes
    ----------
    name : of the step in the table; several functions may share one. May have ``{}`` for what `detail` says
    where : ``module:function`` or ``module:Class.method``
    detail : arguments of a call → the part of its step's name that depends on them
    count : arguments of a call → work done, summed up in `StepTimes.counted` under the step's name
    """

    name: str
    where: str
    detail: Callable[..., str] | None = None
    count: Callable[..., float] | None = None


@dataclass
class StepTimes(event.Listener):  # type: ignore[misc]
    """Times of steps, as long as `watched` is open.

    Attributes
    ----------
    seconds : step → seconds of the processor, all threads of the process;  calls, counted : step → number of calls, work
    compiled : names of the kernels that were compiled, not read from numba's cache
    gone : functions that the program does not have
    """

    steps: Sequence[Step] = ()
    seconds: defaultdict[str, float] = field(default_factory=lambda: defaultdict(float))
    calls: Counter[str] = field(default_factory=Counter)
    counted: defaultdict[str, float] = field(default_factory=lambda: defaultdict(float))
    compiled: list[str] = field(default_factory=list)
    gone: list[str] = field(default_factory=list)
    _open: list[str] = field(default_factory=lambda: [REST])
    _last: float = 0.0

    @contextmanager
    def watched(self) -> Iterator[StepTimes]:
        """Functions are wrapped while this is open; the time between them stands under `REST`."""
        former = [self._wrap(step) for step in self.steps]
        event.register("numba:compile", self)
        self._last = time.process_time()
        try:
            yield self
        finally:
            self._note()
            event.unregister("numba:compile", self)
            for places in reversed(former):
                for holder, name, function in places:
                    setattr(holder, name, function)

    @contextmanager
    def within(self, name: str) -> Iterator[None]:
        """Time goes to this step until it ends, but for that of steps within."""
        self._note()
        self._open.append(name)
        self.calls[name] += 1
        try:
            yield
        finally:
            self._note()
            self._open.pop()

    def on_start(self, started: Any) -> None:
        self._note()
        self._open.append(COMPILING)
        self.compiled.append(started.data["dispatcher"].py_func.__qualname__)

    def on_end(self, _ended: Any) -> None:
        self._note()
        self._open.pop()

    def _note(self) -> None:
        now = time.process_time()
        self.seconds[self._open[-1]] += now - self._last
        self._last = now

    def _wrap(self, step: Step) -> list[tuple[Any, str, Any]]:
        """Put the watched function everywhere the program has it; returns where, and what stood there."""
        module_name, _, path = step.where.partition(":")
        owner_name, _, name = path.rpartition(".")
        try:
            module = importlib.import_module(module_name)
            owner = getattr(module, owner_name) if owner_name else module
            function = vars(owner)[name]
        except (ImportError, AttributeError, KeyError):
            self.gone.append(step.where)
            return []
        watched = self._watched(step, function)
        holders = [owner] if owner_name else [m for n, m in sys.modules.items() if n.startswith("cityflow")]
        places = [(h, n, function) for h in holders for n, v in list(vars(h).items()) if v is function]
        for holder, found, _ in places:
            setattr(holder, found, watched)
        return places

    def _watched(self, step: Step, function: Callable[..., Any]) -> Callable[..., Any]:
        @wraps(function)
        def call(*args: Any, **named: Any) -> Any:
            name = step.name if step.detail is None else step.name.format(step.detail(*args, **named))
            if step.count is not None:
                self.counted[name] += step.count(*args, **named)
            with self.within(name):
                return function(*args, **named)

        return call


def share_table(times: StepTimes, total: float, unit: str) -> list[str]:
    """Lines of a table: step, calls, seconds and share of `total`, which is without compiling; the dearest first."""
    lines = [f"{'step':<34} {'calls':>7} {'s ' + unit:>12} {'share':>7}"]
    for name, seconds in sorted(times.seconds.items(), key=lambda item: -item[1]):
        lines.append(f"{name:<34} {times.calls[name]:>7} {seconds:>12.2f} {seconds / max(total, 1e-9):>7.1%}")
    return [*lines, *(f"not found in the program: {where}" for where in times.gone)]
