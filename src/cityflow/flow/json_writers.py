"""JSON trees of values by their declared types: the trees of pydantic, in a fraction of its time where a type is plain."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from functools import cache
from operator import attrgetter
from types import NoneType, UnionType
from typing import Annotated, Any, Union, get_args, get_origin, get_type_hints

from pydantic import PlainSerializer, TypeAdapter

from cityflow.flow.kept import kept

Writer = Callable[[Any], Any]
"""From a value of a type to its tree, which nobody changes."""

PLAIN = (str, int, bool, NoneType)

SHARED = "one object in many tasks"
"""Marks the type of a field (`Annotated`) whose value is one object for many tasks: it is written once, and the trees of these tasks share what was written."""


def same(value: Any) -> Any:
    """The value is its own tree."""
    return value


@cache
def writer_of(kind: Any) -> Writer:
    """The writer of a type.

    Plain are texts, numbers, optional values, tuples, mappings with texts as keys, and dataclasses of these. What says itself how it is
    written (`PlainSerializer`), or is marked as `SHARED`, is written once for an object; anything else is left to pydantic.
    """
    origin, inner = get_origin(kind), get_args(kind)
    if kind in PLAIN:
        return same
    if kind is float:
        return float
    if origin is Annotated:
        if SHARED in inner[1:]:
            return kept(writer_of(inner[0]))
        own = [m for m in inner[1:] if isinstance(m, PlainSerializer)]
        return kept(own[0].func) if len(own) == 1 else _by_pydantic(kind)  # type: ignore[arg-type]
    if origin is tuple and inner:
        return _tuple_writer(inner)
    if origin in (Mapping, dict) and inner[0] is str:
        return _mapping_writer(writer_of(inner[1]))
    if origin in (Union, UnionType) and len(inner) == 2 and NoneType in inner:
        return _optional_writer(writer_of(next(k for k in inner if k is not NoneType)))
    if isinstance(kind, type) and is_dataclass(kind):
        return _fields_writer(kind)
    return _by_pydantic(kind)


def _tuple_writer(inner: tuple[Any, ...]) -> Writer:
    if len(inner) == 2 and inner[1] is Ellipsis:
        one = writer_of(inner[0])
        return list if one is same else lambda values: [one(v) for v in values]
    each = [writer_of(kind) for kind in inner]
    return lambda values: [write(v) for write, v in zip(each, values, strict=True)]


def _mapping_writer(one: Writer) -> Writer:
    return dict if one is same else lambda values: {name: one(v) for name, v in values.items()}


def _optional_writer(one: Writer) -> Writer:
    return same if one is same else lambda value: None if value is None else one(value)


def _fields_writer(kind: type) -> Writer:
    try:
        hints = get_type_hints(kind, include_extras=True)
    except NameError:  # a class within a function: its types are known there only
        return _by_pydantic(kind)
    names = [f.name for f in fields(kind)]
    each = [writer_of(hints[name]) for name in names]
    if len(names) < 2:
        return lambda value: {name: write(getattr(value, name)) for name, write in zip(names, each, strict=True)}
    values_of = attrgetter(*names)
    if all(write is same for write in each):
        return lambda value: dict(zip(names, values_of(value), strict=True))
    return lambda value: {n: write(v) for n, write, v in zip(names, each, values_of(value), strict=True)}


def _by_pydantic(kind: Any) -> Writer:
    adapter = TypeAdapter[Any](kind)
    return lambda value: adapter.dump_python(value, mode="json")
