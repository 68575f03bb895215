"""``cityflow parameters``: every key that a workflow may set, in words."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from enum import Enum
from fnmatch import fnmatchcase
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt, MaxLen, MinLen
from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import to_jsonable_python

from cityflow.errors import WorkflowError
from cityflow.stages.parameters import CityParameters
from cityflow.workflow.settings import model_at, nearest

WILD = "*?["


def described_parameters(model: type[BaseModel] = CityParameters, wanted: str = "") -> str:
    """Keys with default, meaning, unit and what they may be, a line each; of `wanted` only those that it names.

    Parameters
    ----------
    wanted : a key, the beginning of one, a part of one, or a pattern with ``*``, ``?`` and ``[…]``; empty: every key

    Raises
    ------
    WorkflowError
        No key is named so; the nearest known one is.
    """
    fields = dict(_fields(model, ""))
    chosen = _chosen(list(fields), wanted)
    if not chosen:
        parts = {".".join(key.split(".")[:n]) for key in fields for n in range(1, key.count(".") + 2)}
        raise WorkflowError(
            f"no parameter is called '{wanted}'",
            where="parameters",
            remedy=f"the nearest is '{nearest(wanted, sorted(parts))}'; `cityflow parameters` without a name lists all",
        )
    return "\n".join(_described(key, fields[key]) for key in chosen)


def _chosen(keys: Sequence[str], wanted: str) -> list[str]:
    """Keys of a section before those that only hold the text somewhere."""
    if not wanted:
        return list(keys)
    if any(c in wanted for c in WILD):
        return [k for k in keys if fnmatchcase(k, wanted) or fnmatchcase(k, f"*.{wanted}")]
    section = [k for k in keys if k == wanted or k.startswith(f"{wanted.rstrip('.')}.")]
    return section or [k for k in keys if wanted.lower() in k.lower()]


def _fields(model: type[BaseModel], prefix: str) -> Iterator[tuple[str, FieldInfo]]:
    for name, field in model.model_fields.items():
        below = model_at(model, [name])
        if below is model:
            yield prefix + name, field
        else:
            yield from _fields(below, f"{prefix}{name}.")


def _described(key: str, field: FieldInfo) -> str:
    default = field.get_default(call_default_factory=True)
    said = "no default" if field.is_required() else json.dumps(to_jsonable_python(default), ensure_ascii=False)
    may_be = "; ".join(part for part in (_choices(field.annotation), bounds_text(field.metadata)) if part)
    nothing = " or null" if may_be and type(None) in get_args(field.annotation) else ""
    return f"{key} = {said}  {field.description or ''}{f'  ({may_be}{nothing})' if may_be else ''}"


def bounds_text(limits: Sequence[Any]) -> str:
    """What a value may be, as a person says it.

    >>> bounds_text([Ge(0), Le(90)]), bounds_text([Gt(0)]), bounds_text([Gt(0), Le(1)]), bounds_text([MinLen(1)])
    ('0 to 90', '> 0', '> 0, at most 1', 'at least 1 value')
    """
    least, above = _limit(limits, Ge, "ge"), _limit(limits, Gt, "gt")
    most, below = _limit(limits, Le, "le"), _limit(limits, Lt, "lt")
    if least is not None and most is not None:
        texts = [f"{_number(least)} to {_number(most)}"]
    else:
        texts = [
            *([f"at least {_number(least)}"] if least is not None else []),
            *([f"> {_number(above)}"] if above is not None else []),
            *([f"at most {_number(most)}"] if most is not None else []),
            *([f"< {_number(below)}"] if below is not None else []),
        ]
    return ", ".join([*texts, *_lengths(limits)])


def _lengths(limits: Sequence[Any]) -> Iterator[str]:
    fewest, most = _limit(limits, MinLen, "min_length"), _limit(limits, MaxLen, "max_length")
    if fewest is not None and fewest == most:
        yield f"{fewest} values"
    else:
        if fewest is not None:
            yield f"at least {fewest} {'value' if fewest == 1 else 'values'}"
        if most is not None:
            yield f"at most {most} {'value' if most == 1 else 'values'}"


def _limit(limits: Sequence[Any], kind: type, name: str) -> Any:
    return next((getattr(limit, name) for limit in limits if isinstance(limit, kind)), None)


def _number(value: float) -> str:
    """Without needless digits.

    >>> _number(1e6), _number(0.0001), _number(90.0)
    ('1000000', '0.0001', '90')
    """
    return f"{value:.0f}" if float(value).is_integer() and abs(value) < 1e9 else f"{value:g}"


def _choices(annotation: Any) -> str:
    """The values of a choice; of several at once, that; nothing where any value fits."""
    if get_origin(annotation) is tuple:
        each = _values(get_args(annotation)[0])
        return f"any of {', '.join(each)}" if each else ""
    found = _values(annotation)
    return f"one of {', '.join(found)}" if found else "true or false" if annotation is bool else ""


def _values(annotation: Any) -> list[str]:
    if get_origin(annotation) is Literal:
        return [str(value) for value in get_args(annotation)]
    if get_origin(annotation) in (Union, UnionType):
        return [value for part in get_args(annotation) for value in _values(part)]
    if isinstance(annotation, type) and issubclass(annotation, Enum):
        return [str(member.value) for member in annotation]
    return []
