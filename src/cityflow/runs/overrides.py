"""Parameter values of single units: stored in the RUN, part of the units' digests, until they are cleared."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from pydantic import ValidationError

from cityflow.core.parameters import merged
from cityflow.errors import RunError, WorkflowError
from cityflow.flow.records import quoted, unquoted
from cityflow.flow.stage import Node
from cityflow.flow.store import Store
from cityflow.pipeline.workflow_parameters import CityParameters
from cityflow.runs.settings import explain_invalid, known_part, parse_setting

FOLDER = "overrides"

CITY_WIDE: Mapping[str, tuple[str, ...]] = {
    "surface": ("cell_m",),
    "outline": ("source", "noding_tolerance_m", "walls_in"),
    "split": ("when",),
    "texture": ("when",),
    "windows": ("when",),
    "atlas": ("cell_m", "placement"),
}
"""Keys that single units cannot have for themselves: tiles share one grid, outlines are noded together, patches are made for the pages there are."""


def read_overrides(store: Store) -> dict[Node, dict[str, Any]]:
    """(stage, unit) → tree of parameter values, without keys that are gone since they were set."""
    found = {}
    for path in store.find(FOLDER):
        quoted_stage, _, name = path.removeprefix(f"{FOLDER}/").partition("/")
        stage = unquoted(quoted_stage)
        if tree := known_part({stage: _tree(store, path)}).get(stage):
            found[stage, unquoted(name.removesuffix(".json"))] = tree
    return found


def _tree(store: Store, path: str) -> dict[str, Any]:
    try:
        tree = json.loads(store.read_bytes(path))
    except (ValueError, RecursionError):
        tree = None
    if not isinstance(tree, dict):
        raise RunError(
            "no overrides as cityflow writes them", where=store.url(path), remedy="remove the file, or restore it"
        )
    return tree


def overrides_for(
    nodes: Iterable[Node], settings: Sequence[str], old: Mapping[Node, Mapping[str, Any]], city: CityParameters
) -> dict[Node, dict[str, Any]]:
    """``stage.key=value`` settings for those of the `nodes` that are of that stage, laid over the values that they have.

    Raises
    ------
    WorkflowError
        A setting names a stage none of whose units is chosen, a key that only the whole run has, an unknown key or a bad value.
    """
    chosen = sorted(set(nodes))
    new: dict[Node, dict[str, Any]] = {}
    for setting in settings:
        stage, tree = next(iter(parse_setting(setting).items()))
        concerned = [node for node in chosen if node[0] == stage]
        if not concerned or not isinstance(tree, Mapping):
            raise WorkflowError(
                f"'{setting}' concerns none of the chosen units (of the stages {', '.join(sorted({s for s, _ in chosen})) or 'none'})",
                where="--set", remedy="begin the key with the stage of the units, e.g. reconstruct.methods=[extruded]",
            )  # fmt: skip
        wide = [f"{stage}.{key}" for key in CITY_WIDE.get(stage, ()) if key in tree]
        if wide:
            raise WorkflowError(
                f"{wide[0]} is one value for the whole run", where="--set", remedy="set it with `cityflow run … --set`"
            )
        for node in concerned:
            new[node] = merged(new.get(node, old.get(node, {})), tree)
    for (stage, _), tree in new.items():
        _check(city, stage, tree)
    return new


def write_overrides(store: Store, values: Mapping[Node, Mapping[str, Any]]) -> None:
    """Keep the values of these units in the RUN."""
    for (stage, unit), tree in values.items():
        text = json.dumps(tree, sort_keys=True, ensure_ascii=False) + "\n"
        store.write_bytes(f"{FOLDER}/{quoted(stage)}/{quoted(unit)}.json", text.encode())


def clear_overrides(store: Store, nodes: Iterable[Node]) -> int:
    """Forget the values of these units; returns how many had some."""
    old = read_overrides(store)
    concerned = [node for node in sorted(set(nodes)) if node in old]
    for stage, unit in concerned:
        store.remove(f"{FOLDER}/{quoted(stage)}/{quoted(unit)}.json")
    return len(concerned)


def _check(city: CityParameters, stage: str, tree: Mapping[str, Any]) -> None:
    try:
        CityParameters.model_validate(merged(city.model_dump(mode="json"), {stage: tree}))
    except ValidationError as error:
        raise WorkflowError(
            explain_invalid(error), where="--set", remedy="cityflow parameters --all lists every key"
        ) from None
