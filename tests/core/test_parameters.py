from __future__ import annotations

import numpy as np
import pytest
from pydantic import Field, ValidationError

from cityflow.core.parameters import Parameters, merged


class Inner(Parameters):
    reach_m: float = Field(1.0, gt=0, le=5)


class Outer(Parameters):
    inner: Inner = Inner()
    levels: int = 3


def test_only_named_leaves_change() -> None:
    base = Outer().model_dump()
    made = Outer.model_validate(merged(base, {"inner": {"reach_m": 2.0}}))
    assert (made.inner.reach_m, made.levels) == (2.0, 3)
    assert base == Outer().model_dump()


@pytest.mark.parametrize(
    ("base", "over", "out"),
    [
        ({}, {"a": {"b": 1}}, {"a": {"b": 1}}), ({"a": 1}, {}, {"a": 1}), ({"a": {"b": 1}}, {"a": None}, {"a": None}),
        ({"a": [1, 2]}, {"a": [3]}, {"a": [3]}), ({"a": 1}, {"a": {"b": 2}}, {"a": {"b": 2}}),
    ],
)  # fmt: skip
def test_what_is_no_mapping_on_both_sides_is_replaced(base: dict, over: dict, out: dict) -> None:  # type: ignore[type-arg]
    assert merged(base, over) == out


@pytest.mark.parametrize("given", [{"reach": 1.0}, {"reach_m": 0.0}, {"reach_m": 5.1}, {"reach_m": float("nan")}, {"reach_m": np.inf}])  # fmt: skip
def test_unknown_keys_and_values_beyond_their_bounds_are_refused(given: dict[str, float]) -> None:
    with pytest.raises(ValidationError):
        Inner.model_validate(given)


def test_parameters_do_not_change() -> None:
    with pytest.raises(ValidationError, match="frozen"):
        Inner().reach_m = 2.0  # type: ignore[misc]
