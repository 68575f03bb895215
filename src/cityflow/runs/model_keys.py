"""Every key that a workflow may set, read from the models: default, meaning, unit, bounds."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from enum import Enum
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt, MaxLen, MinLen
from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import to_jsonable_python

from cityflow.pipeline.workflow_parameters import CityParameters
from cityflow.runs.known_keys import FUNCTION, SYNTH, Key
from cityflow.runs.settings import model_at, takes_several

KINDS = {float: "number", int: "whole", bool: "flag", str: "text", type(None): "null"}


def model_of(of: str) -> type[BaseModel]:
    """The model behind `known_keys.CITY` or `known_keys.SYNTH`."""
    if of == SYNTH:
        from cityflow.stages.synth.synthetic_survey import SynthParameters

        return SynthParameters
    return CityParameters


def model_keys(model: type[BaseModel]) -> dict[str, Key]:
    """Dotted keys of a model with what is said of each, in the order of its fields."""
    return {name: _key(field, default) for name, field, default in _fields(model, "", None)}


def _fields(model: type[BaseModel], prefix: str, section: BaseModel | None) -> Iterator[tuple[str, FieldInfo, Any]]:
    """Dotted key, field and default; `section`: the default of a section as a whole, which counts before those of its fields."""
    for name, field in model.model_fields.items():
        default = field.get_default(call_default_factory=True) if section is None else getattr(section, name)
        below = model_at(model, [name])
        if below is model:
            yield prefix + name, field, default
        else:
            yield from _fields(below, f"{prefix}{name}.", default if isinstance(default, below) else None)


def _key(field: FieldInfo, default: Any) -> Key:
    shown = "no default" if field.is_required() else json.dumps(to_jsonable_python(default), ensure_ascii=False)
    may_be = "; ".join(part for part in (_choices(field.annotation), bounds_text(field.metadata)) if part)
    nothing = " or null" if may_be and type(None) in get_args(field.annotation) else ""
    several = takes_several(field.annotation)
    bounds = [_limit(field.metadata, *kind) for kind in ((Ge, "ge"), (Gt, "gt"), (Le, "le"), (Lt, "lt"))]
    each = _inner(field.annotation) if several else field.annotation
    extra = field.json_schema_extra
    known = extra.get("functions") if isinstance(extra, dict) else None
    return Key(
        shown,
        field.description or "",
        f"{may_be}{nothing}",
        several,
        *((["choice", FUNCTION], known) if isinstance(known, list) else _kinds(each)),
        *([None] * 4 if several else bounds),
    )


def _inner(annotation: Any) -> Any:
    """What a list holds."""
    of = next(kind for kind in (annotation, *get_args(annotation)) if get_origin(kind) in (tuple, list))
    inner = set(get_args(of)) - {Ellipsis}
    return inner.pop() if len(inner) == 1 else Any


def _kinds(annotation: Any) -> tuple[list[str], list[Any]]:
    """Kinds of values, and the choices among them; no kinds where only the model can tell."""
    parts = get_args(annotation) if get_origin(annotation) in (Union, UnionType) else (annotation,)
    choices = [to_jsonable_python(value) for part in parts for value in _values(part)]
    kinds = ["choice" if _values(part) else KINDS.get(part, "") for part in parts]
    return (list(dict.fromkeys(kinds)) if all(kinds) else [], choices)


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
