"""Check of the catalog that a command will take, before heavy imports: it is named, it is there, and the workflow can use it."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from cityflow.errors import CityflowError, WorkflowError
from cityflow.io.catalog.catalog_kinds import kinds_in
from cityflow.io.given_files import json_of, read_small
from cityflow.runs.catalog_fits import SOURCES, Holding, refuse_holding
from cityflow.runs.first_look import COLLECTION, DESCRIPTION, RUNS, look_at_catalog
from cityflow.runs.known_keys import kept_keys
from cityflow.runs.setting_text import read_tree, split_setting

SOURCE, OUTLINES = "points.source", "outline.source"


def look_at_survey(workflow: Path, settings: Sequence[str], catalog: str, out: str) -> None:
    """Make sure that a catalog is named by the command, the workflow or the RUN, that a local one is there, and that the workflow can use it.

    Raises
    ------
    WorkflowError, CatalogError
    """
    tree = read_tree(workflow)
    own, name = _value(tree, settings, "catalog"), _value(tree, settings, "name")
    named = catalog or resolved(own, workflow) or _of_run(out or f"{RUNS}/{name}")
    if named is None:
        raise unnamed(workflow)
    if not named or "://" in named:
        return
    look_at_catalog(named)
    keys = kept_keys()
    source, outlines = (
        _value(tree, settings, key) or (json.loads(keys[key].default) if keys and key in keys else None)
        for key in (SOURCE, OUTLINES)
    )
    kinds = kinds_in(Path(named) if named.endswith(".json") else Path(named) / COLLECTION)
    if kinds is not None and (source == "auto" or source in SOURCES) and isinstance(outlines, str):
        refuse_holding(source, outlines, Holding.of_kinds(str(named), kinds))


def resolved(catalog: Any, workflow: Path) -> str:
    """The catalog that a workflow names, from the folder of its file; empty where it names none."""
    if not isinstance(catalog, str) or not catalog or "://" in catalog or Path(catalog).is_absolute():
        return catalog if isinstance(catalog, str) else ""
    return os.path.normpath(workflow.parent / catalog)


def unnamed(workflow: Path) -> WorkflowError:
    """Neither the command nor the workflow nor the RUN names a catalog."""
    return WorkflowError(
        "names no catalog", where=str(workflow), remedy="give one with --catalog, or as `catalog:` in the file"
    )


def _of_run(out: str) -> str | None:
    """The catalog that a RUN was made from; None where there is no RUN, empty where only those who read it can tell."""
    if "://" in out:
        return ""
    path = Path(out).expanduser() / DESCRIPTION
    if not path.is_file():
        return None
    try:
        tree = json_of(read_small(path))
    except (OSError, ValueError, CityflowError):
        return ""
    found = tree.get("catalog", "") if isinstance(tree, Mapping) else ""
    return found if isinstance(found, str) else ""


def _value(tree: Mapping[str, Any], settings: Sequence[str], key: str) -> Any:
    """Of a key in the tree, after the settings; None where nothing names it."""
    parts = key.split(".")
    found = _below(tree, parts)
    for setting in settings:
        path, value = split_setting(setting)
        if parts[: len(path)] == path and (told := _below(value, parts[len(path) :])) is not None:
            found = told
    return found


def _below(value: Any, parts: Sequence[str]) -> Any:
    for part in parts:
        value = value.get(part) if isinstance(value, Mapping) else None
    return value
