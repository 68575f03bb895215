"""Task, outcome and digest: the values of the engine."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

from cityflow.core.unit_status import Status
from cityflow.flow.kept import kept
from cityflow.flow.typed import from_json

Json = Any
"""Anything that `json.dumps` takes."""

T = TypeVar("T")

_ENCODER = json.JSONEncoder(sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)


@dataclass(frozen=True, slots=True)
class Limits:
    """What a task may use before its process is killed; never an input to the result."""

    time_s: float = 600.0
    memory_mb: float = 4000.0
    retries: int = 1


@dataclass(frozen=True, slots=True)
class Task:
    """One unit of one stage.

    Attributes
    ----------
    stage, unit : names a person understands; together they name the task (`reconstruct-0503100000012345`)
    function : ``module:name`` of ``f(workspace, task) -> Outcome``
    version : number of the stage's algorithm, raised when its results change
    parameters : the stage's parameters with the unit's overrides applied, JSON (`flow.typed.as_json`)
    inputs : name → digest of the contents of everything that the result depends on
    arguments : where to find the inputs, a dataclass of the stage as JSON; may change without making the result stale
    expected : RUN-relative path → bytes and SHA-256 of the inputs that other tasks left, filled in by the driver; what
        the task reads is held against it
    shared : RUN-relative path → text of what its arguments name and other tasks read, too (`flow.shared`); the driver writes it before the task is sent
    in_place : the task writes into a shared store (its own chunk of a Zarr array), so that an attempt that died
        midway spoils what an earlier one had left
    """

    stage: str
    unit: str
    function: str
    version: int
    parameters: Mapping[str, Json] = field(default_factory=dict)
    inputs: Mapping[str, str] = field(default_factory=dict)
    arguments: Mapping[str, Json] = field(default_factory=dict)
    limits: Limits = Limits()
    in_place: bool = False
    shared: Mapping[str, str] = field(default_factory=dict)
    expected: Mapping[str, tuple[int, str]] = field(default_factory=dict)

    @property
    def name(self) -> str:
        return f"{self.stage}-{self.unit}"

    @property
    def digest(self) -> str:
        """SHA-256 over stage, unit, version, parameters and inputs; 64 hexadecimal digits."""
        head, inputs = _canonical([self.stage, self.unit, self.version]), _canonical(dict(self.inputs))
        text = f"{head[:-1]},{_of_parameters(self.parameters)},{inputs}]"
        return hashlib.sha256(text.encode()).hexdigest()

    def arguments_as(self, kind: type[T]) -> T:
        """The arguments as the stage's dataclass. Raises ValueError, which names stage, unit and field."""
        return from_json(kind, self.arguments, f"{self.name}: what it is given")

    def parameters_as(self, kind: type[T]) -> T:
        """The parameters as the stage's model. Raises ValueError, which names stage, unit and field."""
        return from_json(kind, self.parameters, f"{self.name}: its parameters")


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a stage function returns.

    Attributes
    ----------
    status, reason : see ARCHITECTURE.md, section 3
    outputs : RUN-relative path → SHA-256 of its contents
    result : small JSON value that later tasks and the driver need (ids of units, a measured figure)
    sizes : RUN-relative path → bytes of the file
    sums : RUN-relative path → SHA-256 of the file, where that of its contents is of something else (the values of a Zarr chunk)
    """

    status: Status = Status.DONE
    reason: str = ""
    outputs: Mapping[str, str] = field(default_factory=dict)
    result: Mapping[str, Json] = field(default_factory=dict)
    sizes: Mapping[str, int] = field(default_factory=dict)
    sums: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Record:
    """One finished attempt of one task: immutable, written last, the truth about what happened.

    Attributes
    ----------
    attempt : 1, 2, … per stage and unit, over all runs into the same folder
    digest : that of the task
    parameters : of the task, so that a record explains itself
    sizes, sums : of the outcome; a record of an older version has none, and nothing is checked by it
    traceback : of an unexpected exception, else empty
    started : ISO 8601, UTC;  seconds, peak_mb : of the process that ran it
    worker : address or process that ran it
    """

    stage: str
    unit: str
    attempt: int
    digest: str
    version: int
    status: Status
    reason: str
    outputs: Mapping[str, str]
    result: Mapping[str, Json]
    parameters: Mapping[str, Json]
    inputs: Mapping[str, str]
    traceback: str = ""
    started: str = ""
    seconds: float = 0.0
    peak_mb: float = 0.0
    worker: str = ""
    sizes: Mapping[str, int] = field(default_factory=dict)
    sums: Mapping[str, str] = field(default_factory=dict)


def digest_of(value: Json) -> str:
    """SHA-256 of the canonical JSON text (sorted keys, no spaces) of a value.

    >>> digest_of({"b": 1, "a": 2}) == digest_of({"a": 2, "b": 1})
    True
    """
    return hashlib.sha256(_canonical(value).encode()).hexdigest()


def member_of(name: str, value: Json) -> str:
    """A name and a value as canonical JSON has them: written once where they are in many mappings."""
    return _canonical({name: value})[1:-1]


def digest_of_members(members: Iterable[str]) -> str:
    """`digest_of` a mapping, from what `member_of` wrote, in the order of the names.

    >>> digest_of_members([member_of("a", 2), member_of("b", 1)]) == digest_of({"b": 1, "a": 2})
    True
    """
    return hashlib.sha256(f"{{{','.join(members)}}}".encode()).hexdigest()


def _canonical(value: Json) -> str:
    return _ENCODER.encode(value)


@kept
def _of_parameters(parameters: Mapping[str, Json]) -> str:
    return _canonical(dict(parameters))
