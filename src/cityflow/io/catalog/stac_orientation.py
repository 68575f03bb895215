"""Figures of an orientation in the collection of its catalog."""

from __future__ import annotations

from typing import Any

from pydantic import TypeAdapter

from cityflow.core.orientation_figures import OrientationFigures

ORIENTATION = "cityflow:orientation"
"""Key of the collection."""
_ADAPTER = TypeAdapter(OrientationFigures)


def orientation_tree(figures: OrientationFigures) -> dict[str, Any]:
    """As JSON."""
    tree: dict[str, Any] = _ADAPTER.dump_python(figures, mode="json")
    return tree


def orientation_of(tree: Any) -> OrientationFigures | None:
    """What `orientation_tree` wrote; None where there is nothing. Raises ValueError where it is something else."""
    return None if tree is None else _ADAPTER.validate_python(tree)
