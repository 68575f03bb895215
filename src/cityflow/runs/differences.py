"""Why a task is not done: differences between it and an earlier record."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cityflow.flow.state import State
from cityflow.flow.task import Record, Task

NAMED = 3
"""How many differing inputs are named before the rest is counted."""


def why(task: Task, state: State, record: Record | None) -> str:
    """One phrase, e.g. ``parameters changed: methods ['a'] → ['b']``; empty where the task is done."""
    if state is State.DONE:
        return ""
    if state is State.SPOILED:
        return "an attempt died midway"
    if state is State.LOST:
        return "an output is gone"
    if record is None:
        return "never done"
    if record.version != task.version:
        return f"algorithm version {record.version} → {task.version}"
    parameters = changed(record.parameters, task.parameters)
    if parameters:
        return "parameters changed: " + _named([f"{k} {a!r} → {b!r}" for k, a, b in parameters])
    inputs = changed(record.inputs, task.inputs)
    return "inputs changed: " + _named([k for k, _, _ in inputs])


def changed(old: Mapping[str, Any], new: Mapping[str, Any], prefix: str = "") -> list[tuple[str, Any, Any]]:
    """Leaves that differ: dotted key, old value, new value (None where there is none)."""
    found: list[tuple[str, Any, Any]] = []
    for key in sorted({*old, *new}):
        a, b = old.get(key), new.get(key)
        if isinstance(a, Mapping) and isinstance(b, Mapping):
            found += changed(a, b, f"{prefix}{key}.")
        elif a != b:
            found.append((prefix + key, a, b))
    return found


def _named(names: list[str]) -> str:
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return ", ".join(names[:NAMED]) + more
