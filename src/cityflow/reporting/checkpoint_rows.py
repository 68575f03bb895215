"""``checkpoints.json`` of a run as rows: the residuals of its products at points of known position."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from cityflow.errors import RunError
from cityflow.flow.store import Store
from cityflow.viewer.image_rows import CheckpointRow

CHECKPOINTS = "checkpoints.json"


def checkpoint_rows(store: Store) -> tuple[CheckpointRow, ...]:
    """Rows in the order of the file; none where there is no such file.

    Raises
    ------
    RunError
        The file is there but no JSON object.
    """
    if not store.exists(CHECKPOINTS):
        return ()
    try:
        tree = json.loads(store.read_bytes(CHECKPOINTS))
    except ValueError as error:
        raise _damaged(store, str(error)) from error
    if not isinstance(tree, dict):
        raise _damaged(store, "not an object")
    return tuple(_rows(tree, ""))


def _rows(tree: dict[str, Any], name: str) -> Iterator[CheckpointRow]:
    """Every object that has residuals, named by the keys that lead to it."""
    if any(isinstance(tree.get(key), int | float) for key in ("bias", "rmse", "le95")):
        count = tree.get("n", tree.get("count"))
        measures = (_number(tree.get(key)) for key in ("bias", "rmse", "le95"))
        yield CheckpointRow(name or "all", int(count) if isinstance(count, int) else None, *measures)
        return
    for key, value in tree.items():
        if isinstance(value, dict):
            yield from _rows(value, f"{name} {key}".strip())


def _number(value: Any) -> float | None:
    return float(value) if isinstance(value, int | float) else None


def _damaged(store: Store, problem: str) -> RunError:
    return RunError(
        f"{CHECKPOINTS} is damaged: {problem}", where=store.root, remedy="evaluate the run again, or remove the file"
    )
