"""Answers about places of a survey, which many units share, and about what tasks have left there."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from functools import wraps
from typing import Generic, TypeVar
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


def kept_until(*stages: str) -> Callable[[Callable[[Survey, K], V]], Callable[[Survey, K], V]]:
    """Decorates a function of what tasks of some stages have left: it answers from memory until a record of one of these is learned."""

    def kept(function: Callable[[Survey, K], V]) -> Callable[[Survey, K], V]:
        known: WeakKeyDictionary[Survey, _Answers[K, V]] = WeakKeyDictionary()

        @wraps(function)
        def answer(survey: Survey, key: K) -> V:
            answers = known.get(survey)
            if answers is None:
                answers = known[survey] = _Answers()
            changes = tuple(map(survey.results.changes.__getitem__, stages))
            if answers.changes != changes or len(answers.found) >= MOST:
                answers.changes, answers.found = changes, {}
            if key not in answers.found:
                answers.found[key] = function(survey, key)
            return answers.found[key]

        return answer

    return kept


@dataclass(slots=True)
class _Answers(Generic[K, V]):
    """Since a record of a stage was learned last."""

    changes: tuple[int, ...] = ()
    found: dict[K, V] = field(default_factory=dict)
