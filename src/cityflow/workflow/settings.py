"""Workflow files: YAML to a checked tree of parameters, with overrides by ``--set``."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, get_args

import yaml
from pydantic import BaseModel, Field, ValidationError

from cityflow.core.parameters import Parameters, merged
from cityflow.errors import WorkflowError
from cityflow.stages.parameters import CityParameters


class Workflow(Parameters):
    """One workflow file: a name, the catalog it was written for, and the parameters of every stage."""

    name: str = Field(description="Name of the workflow; a RUN folder belongs to one workflow")
    catalog: str = Field(default="", description="Catalog folder or URL, relative to the workflow file")
    city: CityParameters = CityParameters()


def load_workflow(path: Path, settings: Sequence[str] = ()) -> Workflow:
    """Read a workflow file and apply ``key=value`` settings.

    Raises
    ------
    WorkflowError
        The file is missing or no YAML mapping, a key is unknown (the nearest known one is named), a value does not fit.
    """
    tree = _read_yaml(path)
    for setting in settings:
        tree = merged(tree, parse_setting(setting))
    return checked(tree, where=str(path))


def checked(tree: Mapping[str, Any], *, where: str) -> Workflow:
    """A workflow from a plain tree, with messages a person can act on."""
    try:
        return Workflow.model_validate(_with_city(tree))
    except ValidationError as error:
        raise WorkflowError(explain_invalid(error), where=where, remedy="cityflow parameters lists every key") from None


def _with_city(tree: Mapping[str, Any]) -> dict[str, Any]:
    """In files the stages stand at the top level, beside name and catalog; what they leave out is the city's default, which may not be the section's own."""
    top = {"name", "catalog"}
    city = merged(CityParameters().model_dump(mode="json"), {k: v for k, v in tree.items() if k not in top})
    return {**{k: v for k, v in tree.items() if k in top}, "city": city}


def parse_setting(text: str) -> dict[str, Any]:
    """``a.b=1`` to ``{"a": {"b": 1}}``; values are YAML.

    >>> parse_setting("reconstruct.methods=[extruded]")
    {'reconstruct': {'methods': ['extruded']}}
    """
    key, equals, value = text.partition("=")
    if not equals or not key.strip():
        raise WorkflowError(f"'{text}' is no setting", where="--set", remedy="write it as key.subkey=value")
    try:
        node: Any = yaml.safe_load(value)
    except yaml.YAMLError as error:
        raise WorkflowError(f"the value of '{text}' is no YAML: {error}", where="--set", remedy="quote it") from None
    for part in reversed(key.strip().split(".")):
        node = {part: node}
    return dict(node)


def _read_yaml(path: Path) -> dict[str, Any]:
    try:
        tree = yaml.safe_load(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise WorkflowError("no such workflow file", where=str(path), remedy="workflows/ has examples") from None
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise WorkflowError(f"not readable as YAML: {error}", where=str(path), remedy="mend the file") from None
    if not isinstance(tree, dict):
        raise WorkflowError("not a mapping of keys to values", where=str(path), remedy="workflows/ has examples")
    return tree


def explain_invalid(error: ValidationError, root: type[BaseModel] = CityParameters) -> str:
    """One sentence per fault: the key, the value, what is wrong; for an unknown key the nearest known one of `root`."""
    return "; ".join(_explain_one(dict(e), root) for e in error.errors())


def _explain_one(entry: Mapping[str, Any], root: type[BaseModel]) -> str:
    location = [str(part) for part in entry["loc"] if part != "city"]
    key = ".".join(location)
    if entry["type"] != "extra_forbidden":
        message = str(entry["msg"]).removeprefix("Value error, ")
        return f"{key} = {entry['input']!r}: {message}" if key else message
    model = model_at(root, location[:-1])
    at_top = len(location) == 1 and root is CityParameters
    known = [*model.model_fields] + (["name", "catalog"] if at_top else [])
    near = nearest(location[-1], known)
    return f"unknown key '{key}'; the nearest known one is '{'.'.join([*location[:-1], near])}'"


def nearest(name: str, known: Sequence[str]) -> str:
    """The name that is most like another one."""
    return next(iter(difflib.get_close_matches(name, known, n=1, cutoff=0.0)), "")


def model_at(model: type[BaseModel], path: Sequence[str]) -> type[BaseModel]:
    """The model of a section below another one, as far as there are sections on the way."""
    for part in path:
        field = model.model_fields.get(part)
        kinds = [field.annotation, *get_args(field.annotation)] if field else []
        below = [k for k in kinds if isinstance(k, type) and issubclass(k, BaseModel)]
        if not below:
            break
        model = below[0]
    return model
