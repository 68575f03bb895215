"""The stage as a value: its tasks, what each waits for, what starts it, its costs and limits."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Generic, TypeVar

from cityflow.core.parameters import Parameters
from cityflow.flow.task import Limits, Task
from cityflow.flow.task_kind import TaskKind

Node = tuple[str, str]
"""Stage and unit."""


class Nodes:
    """Nodes by stage, looked up without a pair for each: a task may wait for hundreds.

    >>> list(Nodes(("surface", ["1_2", "1_3"]), ("ingest", ["a"])))
    [('surface', '1_2'), ('surface', '1_3'), ('ingest', 'a')]
    """

    __slots__ = ("by_stage",)

    def __init__(self, *by_stage: tuple[str, Sequence[str]]) -> None:
        self.by_stage = by_stage

    def __iter__(self) -> Iterator[Node]:
        return ((stage, unit) for stage, units in self.by_stage for unit in units)


START: Node = ("", "")
"""What has happened when a run begins."""


def turn_of(place: str) -> Node:
    """What happens when the next part of the work begins, one place after the other: what starts there is asked for before anything of later places."""
    return "", place


C = TypeVar("C")
"""What tasks are made from: the names and digests that the driver knows."""


@dataclass(frozen=True, slots=True)
class Cost:
    """Of one task on one core, before the RUN has measured its own: seconds, memory of its process, disk that it leaves."""

    seconds: float
    memory_mb: float
    disk_mb: float


USUAL = Limits(memory_mb=6000.0)
"""What a task may take where its stage says nothing else."""


class Place(Enum):
    """What a unit of a stage is in a survey."""

    FILE = "file"
    IMAGE = "image"
    TILE = "ground tile, or several of them"
    FRAME_TILE = "tile of a local reference frame"
    OUTLINE = "outline that is split"
    UNIT = "building"
    ATLAS_CELL = "atlas cell"


def nobody(_context: object, _node: Node) -> Iterable[str]:
    """No unit: a stage whose tasks run because others need them."""
    return ()


def always(_context: object, _unit: str) -> bool:
    """A stage that every request has, for all its units."""
    return True


def no_tiles(_context: object, _unit: str) -> Iterable[str]:
    """A stage that looks at no unit of another tile."""
    return ()


def no_halo(_context: object) -> float:
    """A stage whose units do not depend on how near others are."""
    return 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Stage(Generic[C]):
    """A step of the flow: its kinds of tasks, and when and where each of them runs.

    Attributes
    ----------
    name : as a person reads it
    unit : what there is a task of, for people
    place : what that is in a survey
    text : what it reads → what it leaves, for people
    kinds : what its tasks run, each with its version and the dataclass of its arguments
    task : (context, unit) → the task, of one of its kinds; None where there is nothing to do, and those who wait go on
    needs : what a task waits for, step after step: a step may ask what only the results of the step before tell. Each takes (context, unit) and gives
        the nodes; every one of them is wanted, too
    draft : (context, unit) → the task before what it waits for has ended (`flow.draft`); None where
        it cannot be told yet, or where there are needs beyond the first step
    begins : (context, turn) → units that run now, whoever needs them; `START` is the first, then come the turns of the places (`turn_of`)
    starts : (context, node that has ended) → the same when a task has ended
    asked : (context, unit) → whether the request has such a task: a record may be of an earlier one
    supplied : (context, unit) → whether earlier stages have left, in this request, what its task is made of
    sees : (context, unit) → tiles, beyond its own, whose units it looks at
    halo_m : (context) → metres around a unit within which others count
    until_export : whether, after the export of a tile, nothing asks for what this has left of its units
    count : (context) → number of tasks; None if unknown yet. Without it, those are counted that others need
    parameters : models of its parameters; several where it has several kinds of tasks
    cost : what a task takes, by experience
    limits : what it may take
    """

    name: str
    unit: str
    place: Place
    text: str
    kinds: Sequence[TaskKind]
    task: Callable[[C, str], Task | None]
    needs: Sequence[Callable[[C, str], Iterable[Node]]] = ()
    draft: Callable[[C, str], Task | None] | None = None
    begins: Callable[[C, Node], Iterable[str]] = nobody
    starts: Callable[[C, Node], Iterable[str]] = nobody
    asked: Callable[[C, str], bool] = always
    supplied: Callable[[C, str], bool] = always
    sees: Callable[[C, str], Iterable[str]] = no_tiles
    halo_m: Callable[[C], float] = no_halo
    until_export: bool = False
    count: Callable[[C], int | None] | None = None
    parameters: Sequence[type[Parameters]] = ()
    cost: Cost
    limits: Limits = USUAL
