"""Workflow files: YAML to a checked tree of parameters, with overrides by ``--set``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar, get_args, get_origin

from pydantic import BaseModel, Field, ValidationError

from cityflow.core.parameters import Parameters, merged
from cityflow.errors import WorkflowError
from cityflow.pipeline.workflow_parameters import CityParameters
from cityflow.runs.known_keys import AT_TOP, unknown_key
from cityflow.runs.setting_text import listed, read_tree, split_setting

Model = TypeVar("Model", bound=BaseModel)

PLAIN = {
    "tuple_type": "needs several values, as [a, b] or a,b",
    "list_type": "needs several values, as [a, b] or a,b",
    "float_parsing": "wants a number",
    "float_type": "wants a number",
    "int_parsing": "needs a whole number",
    "int_type": "needs a whole number",
    "int_from_float": "needs a whole number",
    "bool_parsing": "needs true or false",
    "bool_type": "needs true or false",
    "string_type": "wants a text",
}
"""What is wrong with a value, where the library's own words are a programmer's."""

FORMER_NAMES: Mapping[str, Mapping[str, str]] = {"DtmParameters": {"windows": "morphological"}}
"""Model → key or value of an earlier version → its name now."""


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
    tree = read_tree(path)
    whole = tree
    for setting in settings:
        whole = merged(whole, parse_setting(setting))
    try:
        return checked(whole, where="--set" if settings else str(path))
    except WorkflowError:
        checked(tree, where=str(path))  # where the file itself is at fault, that is said
        raise


def checked(tree: Mapping[str, Any], *, where: str) -> Workflow:
    """A workflow from a plain tree, with messages a person can act on."""
    try:
        return Workflow.model_validate(_with_city(tree))
    except ValidationError as error:
        raise WorkflowError(
            explain_invalid(error), where=where, remedy="cityflow parameters --all lists every key"
        ) from None


def known_part(tree: Mapping[str, Any], root: type[BaseModel] = CityParameters) -> dict[str, Any]:
    """Without the keys that no model has, and with their present names: a RUN lists every parameter that its version had.

    >>> known_part({"name": "a", "surface": {"cell_m": 0.5, "gone": {"a": 1}}, "gone": 2})
    {'name': 'a', 'surface': {'cell_m': 0.5}}
    >>> known_part({"surface": {"dtm": {"method": "windows", "windows": {"step_m": 0.8}}}})
    {'surface': {'dtm': {'method': 'morphological', 'morphological': {'step_m': 0.8}}}}
    """
    top = AT_TOP if root is CityParameters else ()
    names = FORMER_NAMES.get(root.__name__, {})
    present = {
        names.get(key, key): names.get(value, value) if isinstance(value, str) else value for key, value in tree.items()
    }
    kept = {key: value for key, value in present.items() if key in (*root.model_fields, *top)}
    sections = {key: model_at(root, [key]) for key in kept}
    return {
        key: known_part(value, sections[key]) if sections[key] is not root and isinstance(value, Mapping) else value
        for key, value in kept.items()
    }


def _with_city(tree: Mapping[str, Any]) -> dict[str, Any]:
    """In files the stages stand at the top level, beside name and catalog; what they leave out is the city's default, which may not be the section's own."""
    top = {"name", "catalog"}
    city = merged(CityParameters().model_dump(mode="json"), {k: v for k, v in tree.items() if k not in top})
    return {**{k: v for k, v in tree.items() if k in top}, "city": city}


def parse_setting(text: str, root: type[BaseModel] = CityParameters) -> dict[str, Any]:
    """``a.b=1`` to ``{"a": {"b": 1}}``; values are YAML, and where `root` wants several, one alone or several with commas between will do.

    >>> parse_setting("reconstruct.methods=[extruded]") == parse_setting("reconstruct.methods=extruded")
    True
    >>> parse_setting("reconstruct.methods=volumetric,extruded")
    {'reconstruct': {'methods': ['volumetric', 'extruded']}}
    """
    path, value = split_setting(text)
    field = model_at(root, path[:-1]).model_fields.get(path[-1])
    node: Any = listed(value) if field is not None and takes_several(field.annotation) else value
    for part in reversed(path):
        node = {part: node}
    return dict(node)


def parameters_from(settings: Sequence[str], model: type[Model], remedy: str) -> Model:
    """A model of parameters from ``--set`` alone. Raises WorkflowError, with this remedy, where a key is unknown or a value does not fit."""
    tree: dict[str, Any] = {}
    for setting in settings:
        tree = merged(tree, parse_setting(setting, model))
    try:
        return model.model_validate(tree)
    except ValidationError as error:
        raise WorkflowError(explain_invalid(error, model), where="--set", remedy=remedy) from None


def takes_several(annotation: Any) -> bool:
    """Whether a field holds a list of values."""
    return any(get_origin(kind) in (tuple, list) for kind in (annotation, *get_args(annotation)))


def explain_invalid(error: ValidationError, root: type[BaseModel] = CityParameters) -> str:
    """One sentence per fault: the key, the value, what is wrong; for an unknown key the nearest known one of `root`."""
    return "; ".join(_explain_one(dict(e), root) for e in error.errors())


def _explain_one(entry: Mapping[str, Any], root: type[BaseModel]) -> str:
    location = [str(part) for part in entry["loc"] if part != "city"]
    key = ".".join(location)
    if entry["type"] != "extra_forbidden":
        message = PLAIN.get(str(entry["type"]), str(entry["msg"]).removeprefix("Value error, "))
        return f"{key} = {entry['input']!r}: {message.removeprefix('Input ')}" if key else message
    model = model_at(root, location[:-1])
    at_top = len(location) == 1 and root is CityParameters
    return unknown_key(location, [*model.model_fields, *(AT_TOP if at_top else ())])


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
