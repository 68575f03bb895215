"""Values with named fields to and from JSON, exact to the last bit: inputs and parameters of tasks."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, TypeAdapter, ValidationError

from cityflow.flow.json_writers import writer_of
from cityflow.flow.kept import kept

T = TypeVar("T")

_ADAPTERS: dict[type, TypeAdapter[Any]] = {}


class TaskInputs:
    """The base of what a task is given to find its inputs; subclasses are frozen dataclasses with slots, and so are the values in their fields.

    A field may hold numbers, texts, tuples and mappings of these, models of parameters, and dataclasses. What else there is says itself how it
    becomes JSON (`handover.field_types`).
    """

    __slots__ = ()
    __pydantic_config__ = ConfigDict(extra="forbid")


def as_json(value: object, without: Collection[str] = ()) -> dict[str, Any]:
    """The fields of a dataclass or of a model of parameters; nothing is checked, as its constructor made it. Nobody changes the tree.

    Parameters
    ----------
    without : fields to leave out; ``a.b`` is the field b of the field a
    """
    kind: Any = type(value)
    tree: dict[str, Any]
    if without:
        tree = _adapter(kind).dump_python(value, mode="json", exclude=_tree_of(without))
    else:
        tree = _of_model(value) if isinstance(value, BaseModel) else writer_of(kind)(value)
    return tree


@kept
def _of_model(model: BaseModel) -> dict[str, Any]:
    return model.model_dump(mode="json")


def from_json(kind: type[T], tree: Any, where: str) -> T:
    """What `as_json` wrote.

    Parameters
    ----------
    where : stage and unit, for the message

    Raises
    ------
    ValueError
        A field is missing, unknown or of another kind; the message names stage, unit and field.
    """
    try:
        found: T = _adapter(kind).validate_python(tree)
    except ValidationError as error:
        problems = (f"{'.'.join(map(str, e['loc'])) or kind.__name__}: {e['msg']}" for e in error.errors())
        raise ValueError(f"{where} cannot be read as {kind.__name__}: {'; '.join(problems)}") from error
    return found


def _adapter(kind: Any) -> TypeAdapter[Any]:
    """Made once for each kind: that takes longer than to use it a hundred times."""
    if kind not in _ADAPTERS:
        _ADAPTERS[kind] = TypeAdapter(kind)
    return _ADAPTERS[kind]


def _tree_of(names: Collection[str]) -> dict[str, Any] | None:
    """What pydantic takes as fields to leave out."""
    tree: dict[str, Any] = {}
    for name in names:
        outer, _, inner = name.partition(".")
        tree[outer] = {inner} if inner else True
    return tree or None
