"""A task whose inputs are still at work: it goes to the scheduler behind them, and the worker that has their records makes it."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass

from cityflow.flow.stage import Node
from cityflow.flow.task import Outcome, Record, Task
from cityflow.flow.workspace import Workspace

Recipe = Callable[[Sequence[Record]], Task]
"""Makes a task from the records of what it awaits, in the same order. It travels as a pickle."""


def _unknown() -> Task:
    raise NotImplementedError


@dataclass(frozen=True, slots=True)
class Draft(Task):
    """A task without inputs and arguments, which follow from results that are still to come.

    Attributes
    ----------
    awaited : stage and unit of the tasks that had not ended when it was drafted, at least one; all of them are submitted already
    ended : those that had ended, and left files that it reads
    recipe : makes the task from their records: pickled, since driver and scheduler need not know its code
    made : makes the task in the driver, when all that it awaits has ended
    """

    awaited: tuple[Node, ...] = ()
    ended: tuple[Node, ...] = ()
    recipe: bytes = b""
    made: Callable[[], Task] = _unknown

    @property
    def digest(self) -> str:
        """Raises TypeError: nobody knows it yet."""
        raise TypeError(f"{self.name} is a draft: its digest follows from results that are still to come")


MAKER = f"{__name__}:make"


def make(_workspace: Workspace, request: Task) -> Outcome:
    """The task of a recipe, as the result; runs in the child, which has the code of the stages."""
    recipe: Recipe = pickle.loads(request.arguments["recipe"])
    return Outcome(result=asdict(recipe(request.arguments["records"])))
