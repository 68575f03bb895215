"""Settings and workflow files as text, before they are checked."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cityflow.errors import WorkflowError
from cityflow.io.given_files import read_small, yaml_of


def split_setting(text: str) -> tuple[list[str], Any]:
    """Parts of the key, and the value as YAML reads it.

    >>> split_setting("surface.cell_m = 0.25")
    (['surface', 'cell_m'], 0.25)

    Raises
    ------
    WorkflowError
        There is no key or no value, or the value is no YAML.
    """
    key, equals, value = text.partition("=")
    if not equals or not key.strip():
        raise WorkflowError(f"'{text}' is no setting", where="--set", remedy="write it as key.subkey=value")
    try:
        return key.strip().split("."), yaml_of(value)
    except ValueError as error:
        raise WorkflowError(
            f"the value of '{text:.200}' is no YAML: {error}", where="--set", remedy="quote it"
        ) from None


def listed(value: Any) -> Any:
    """A value where several are wanted: ``a,b`` and ``a`` are lists, too; null and trees stay what they are.

    >>> listed("a, 2"), listed(3), listed(["a"]), listed(None)
    (['a', 2], [3], ['a'], None)
    """
    if isinstance(value, str):
        return [yaml_of(part) for part in value.split(",") if part.strip()]
    return value if value is None or isinstance(value, list | tuple | Mapping) else [value]


def read_tree(path: Path) -> dict[str, Any]:
    """A workflow file as a plain tree.

    Raises
    ------
    WorkflowError
        The file is missing or no YAML mapping.
    """
    try:
        tree = yaml_of(read_small(path, WorkflowError))
    except FileNotFoundError:
        raise WorkflowError("no such workflow file", where=str(path), remedy=_files_there(path)) from None
    except (OSError, ValueError) as error:
        raise WorkflowError(f"not readable as YAML: {error}", where=str(path), remedy="fix the file") from None
    if not isinstance(tree, dict):
        raise WorkflowError("not a mapping of keys to values", where=str(path), remedy="workflows/ has examples")
    if odd := [key for key in tree if not isinstance(key, str)]:
        raise WorkflowError(f"{odd[0]!r:.100} is no key", where=str(path), remedy="keys are names, such as surface")
    return tree


def _files_there(path: Path) -> str:
    """The workflow files in the folder that was named, else where examples are."""
    names = sorted(p.name for p in path.parent.glob("*.yaml")) if path.parent.is_dir() else []
    return f"{path.parent}/ has {', '.join(names)}" if names else "workflows/ has examples"
