"""Processor time of the driver by step and stage: its functions are wrapped, and what they call counts for the innermost."""

from __future__ import annotations

import time
from collections import Counter, defaultdict
from collections.abc import Callable
from functools import cached_property, wraps
from typing import Any

from cityflow.flow.executor import _Run
from cityflow.flow.inputs import Inputs
from cityflow.flow.joining import Joining
from cityflow.flow.ledger import Ledger
from cityflow.flow.memory_need import MemoryNeeds
from cityflow.flow.ready import Ready
from cityflow.flow.sealed import Sealed
from cityflow.flow.submission import Submission
from cityflow.flow.task import Task
from cityflow.survey.city import City

MANY = "of many"


class Steps:
    """Seconds by step and stage, of this thread.

    Attributes
    ----------
    is_elsewhere : the time now is a worker's, and counts nowhere
    """

    def __init__(self) -> None:
        self.seconds: defaultdict[tuple[str, str], float] = defaultdict(float)
        self._within: list[float] = []
        self.is_elsewhere = False

    def timed(self, step: str, stage_of: Callable[..., str], function: Callable[..., Any]) -> Callable[..., Any]:
        @wraps(function)
        def timed(*given: Any, **named: Any) -> Any:
            if self.is_elsewhere:
                return function(*given, **named)
            self._within.append(0.0)
            begun = time.thread_time()
            found = None
            try:
                found = function(*given, **named)
                return found
            finally:
                spent = time.thread_time() - begun
                inner = self._within.pop()
                self.seconds[step, stage_of(found, *given)] += spent - inner
                if self._within:
                    self._within[-1] += spent

        return timed

    def follow(self) -> None:
        """Wrap the driver's functions, for the rest of the process."""

        def wrap(owner: Any, name: str, step: str, stage_of: Callable[..., str]) -> None:
            setattr(owner, name, self.timed(step, stage_of, getattr(owner, name)))

        def many(*_: Any) -> str:
            return MANY

        def of_argument(_found: Any, _self: Any, value: Any, *_: Any) -> str:
            return str(value.stage)

        wrap(Ready, "next", "task made", lambda found, *_: found[0].stage if found is not None else MANY)
        wrap(_Run, "_checked", "held against its record", of_argument)
        wrap(Inputs, "ready", "files that it reads", of_argument)
        wrap(MemoryNeeds, "of", "need of memory", of_argument)
        wrap(Submission, "send", "sent", many)
        wrap(_Run, "_settle", "followed", lambda _found, _self, job, *_: job.task.stage)
        wrap(Inputs, "learn", "files that it left", of_argument)
        wrap(Ledger, "add", "into the index", of_argument)
        wrap(City, "learn", "learned", of_argument)
        wrap(Ledger, "commit", "committed", many)
        wrap(Joining, "tick", "joined", many)
        wrap(Joining, "end", "joined", many)
        digest: Any = Task.digest
        setattr(Task, "digest", property(self.timed("digest", lambda _found, task: task.stage, digest.fget)))  # noqa: B010
        record: Any = vars(Sealed)["record"]
        opened = cached_property(self.timed("record read", lambda found, _: found.stage, record.func))
        opened.__set_name__(Sealed, "record")
        setattr(Sealed, "record", opened)  # noqa: B010

    def left_out(self, seconds: float) -> None:
        """Time that is not the driver's, within what is being timed now."""
        if self._within:
            self._within[-1] += seconds

    def table(self, tasks: Counter[str], total_s: float) -> str:
        """Milliseconds a task: steps down, stages with the most time across; last all, over all tasks."""
        spent = Counter[str]()
        for (_, stage), seconds in self.seconds.items():
            spent[stage] += seconds  # type: ignore[assignment]
        stages = [stage for stage, _ in spent.most_common() if stage in tasks][:8]
        steps = sorted(
            {step for step, _ in self.seconds}, key=lambda s: -sum(v for (k, _), v in self.seconds.items() if k == s)
        )
        lines = [f"{'ms a task':<26}" + "".join(f"{stage:>12}" for stage in stages) + f"{'all':>12}"]
        for step in steps:
            row = [1e3 * self.seconds.get((step, stage), 0.0) / tasks[stage] for stage in stages]
            whole = 1e3 * sum(v for (k, _), v in self.seconds.items() if k == step) / tasks.total()
            lines.append(f"{step:<26}" + "".join(f"{v:12.3f}" for v in [*row, whole]))
        rest = 1e3 * (total_s - sum(self.seconds.values())) / tasks.total()
        lines.append(f"{'the rest, other threads':<26}" + " " * 12 * len(stages) + f"{rest:12.3f}")
        return "\n".join(lines)
