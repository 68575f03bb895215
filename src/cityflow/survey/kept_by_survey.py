"""Answers about places of a survey, which many units share."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from functools import wraps
from typing import TypeVar
from weakref import WeakKeyDictionary

from cityflow.survey.survey import Survey

MOST = 256
"""Answers of a kind that stay at hand: tiles that are at work, and what lies between them; set by hand."""

K = TypeVar("K", bound=Hashable)
V = TypeVar("V")


def kept_by_survey(function: Callable[[Survey, K], V]) -> Callable[[Survey, K], V]:
    """The function, which answers from memory for keys that it was asked about lately; its answers follow from catalog and parameters alone."""
    kept: WeakKeyDictionary[Survey, dict[K, V]] = WeakKeyDictionary()

    @wraps(function)
    def answer(survey: Survey, key: K) -> V:
        known = kept.get(survey)
        if known is None:
            known = kept[survey] = {}
        if key not in known:
            if len(known) >= MOST:
                known.clear()
            known[key] = function(survey, key)
        return known[key]

    return answer
