"""Answers for values that nobody changes, kept by identity: nearly all units of a stage share one tree of parameters."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import TypeVar

MOST = 1024
"""A few stages at a time, units with overrides of their own, and images of a few tiles; some megabytes, set by hand."""

A = TypeVar("A")
R = TypeVar("R")


def kept(function: Callable[[A], R]) -> Callable[[A], R]:
    """The function, which answers from memory for objects that it was asked about lately.

    >>> calls = []
    >>> length = kept(lambda values: calls.append(1) or len(values))
    >>> same = [3, 4]
    >>> length(same), length(same), length([3, 4]), len(calls)
    (2, 2, 2, 2)
    """
    answers: dict[int, tuple[A, R]] = {}

    @wraps(function)
    def answer(value: A) -> R:
        found = answers.get(id(value))
        if found is None:
            if len(answers) >= MOST:
                answers.clear()
            # the value is held, so that its id stays its own
            found = answers[id(value)] = value, function(value)
        return found[1]

    return answer
