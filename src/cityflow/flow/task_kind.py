"""One kind of task of a stage: what it runs, in which version, and from what."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from cityflow.flow.task import Json, Limits, Outcome, Task
from cityflow.flow.typed import TaskInputs, as_json
from cityflow.flow.workspace import Workspace

_NOTHING: Mapping[str, str] = {}


@dataclass(frozen=True, slots=True)
class TaskKind:
    """A kind of task, stated once. All tasks of a stage are made by one of its kinds.

    Attributes
    ----------
    stage : name of the stage
    version : number of the algorithm, raised when its results change
    run : what a worker calls: (workspace, task) → outcome
    arguments : what it is given to find its inputs, a frozen dataclass
    in_place : it writes into a store that others share, its own part of it (`Task.in_place`)
    function : ``module:name`` of `run`, as a worker finds it
    """

    stage: str
    version: int
    run: Callable[[Workspace, Task], Outcome]
    arguments: type[TaskInputs]
    in_place: bool = False
    function: str = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "function", f"{self.run.__module__}:{self.run.__qualname__}")

    def task(
        self,
        unit: str,
        given: TaskInputs | None = None,
        *,
        parameters: Mapping[str, Json] = _NOTHING,
        inputs: Mapping[str, str] = _NOTHING,
        limits: Limits,
        shared: Mapping[str, str] = _NOTHING,
    ) -> Task:
        """A task of this kind.

        Parameters
        ----------
        given : the arguments; None for a draft, whose recipe adds them later
        parameters, inputs, limits, shared : as in `Task`
        """
        arguments = {} if given is None else as_json(given)
        return Task(
            self.stage, unit, self.function, self.version, parameters, inputs, arguments, limits, self.in_place, shared
        )
