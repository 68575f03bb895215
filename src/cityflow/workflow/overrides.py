"""Values laid over the parameters of single units: kept in the RUN, part of the units' digests, until they are cleared."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from pydantic import ValidationError

from cityflow.core.parameters import merged
from cityflow.errors import WorkflowError
from cityflow.flow.records import quoted, unquoted
from cityflow.flow.store import Store
from cityflow.stages.parameters import CityParameters
from cityflow.workflow.settings import explain_invalid, parse_setting

FOLDER = "overrides"
Node = tuple[str, str]


def read_overrides(store: Store) -> dict[Node, dict[str, Any]]:
    """(stage, unit) → tree of parameter values."""
    found = {}
    for path in store.find(FOLDER):
        _, stage, name = path.split("/")
        found[unquoted(stage), unquoted(name.removesuffix(".json"))] = json.loads(store.read_bytes(path))
    return found


def add_overrides(store: Store, nodes: Iterable[Node], settings: Sequence[str], city: CityParameters) -> None:
    """Lay ``stage.key=value`` settings over the parameters of those of the `nodes` that are of that stage.

    Raises
    ------
    WorkflowError
        A setting names a stage none of whose units is chosen, an unknown key or a bad value. Nothing is written then.
    """
    old = read_overrides(store)
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
        for node in concerned:
            new[node] = merged(new.get(node, old.get(node, {})), tree)
    for (stage, _), tree in new.items():
        _check(city, stage, tree)
    for (stage, unit), tree in new.items():
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
            explain_invalid(error), where="--set", remedy="cityflow parameters lists every key"
        ) from None
