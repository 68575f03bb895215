"""A task less the results of others: it can be written down as soon as these are at work, and the worker that has their records completes it."""

from __future__ import annotations

import copyreg
import io
import pickle
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from cityflow.core.camera import OrientedImage
from cityflow.flow.draft import Draft
from cityflow.flow.kept import kept
from cityflow.flow.stage import Node
from cityflow.flow.task import Record, Task
from cityflow.survey.city import City
from cityflow.survey.results import Results
from cityflow.survey.survey import Survey


@dataclass(frozen=True, slots=True)
class Recipe:
    """What the survey knows of a task; each stage adds what else it needs, and how the task is made.

    Attributes
    ----------
    base : the task without its inputs and arguments
    """

    base: Task

    @property
    def reads(self) -> Sequence[Node]:
        """All tasks whose results `task` asks for."""
        raise NotImplementedError

    def task(self, results: Results) -> Task:
        """The whole task, from the results of all that it reads."""
        raise NotImplementedError


R = TypeVar("R", bound=Recipe)
RecipeOf = Callable[[Survey, str], R]


@dataclass(frozen=True, slots=True)
class Completed:
    """Completes a recipe; `known` holds what had ended when it was sent."""

    recipe: Recipe
    known: Results

    def __call__(self, records: Sequence[Record]) -> Task:
        for record in records:
            self.known.learn(record)
        return self.recipe.task(self.known)


K = TypeVar("K", bound=type)

_REDUCERS: dict[type, Callable[[Any], Any]] = dict(copyreg.dispatch_table)


def pickled_once(kind: K) -> K:
    """A kind of values that nobody changes and that many recipes have: each is pickled once, and recipes have its bytes."""
    _REDUCERS[kind] = _by_bytes
    return kind


@kept
def _bytes_of(value: object) -> bytes:
    return pickle.dumps(value, pickle.HIGHEST_PROTOCOL)


def _by_bytes(value: object) -> tuple[Callable[[bytes], Any], tuple[bytes]]:
    return pickle.loads, (_bytes_of(value),)


def _pickled(value: object) -> bytes:
    target = io.BytesIO()
    pickler = pickle.Pickler(target, pickle.HIGHEST_PROTOCOL)
    pickler.dispatch_table = _REDUCERS
    pickler.dump(value)
    return target.getvalue()


pickled_once(OrientedImage)


def task_by(recipe_of: RecipeOf[R]) -> Callable[[City, str], Task]:
    """Makes tasks whose inputs have ended: `Stage.task`."""
    return lambda city, unit: recipe_of(city.survey, unit).task(city.survey.results)


def draft_by(recipe_of: RecipeOf[R]) -> Callable[[City, str], Task]:
    """Makes drafts of tasks whose inputs are at work, and tasks where all have ended: `Stage.draft`."""

    def draft(city: City, unit: str) -> Task:
        recipe, results = recipe_of(city.survey, unit), city.survey.results
        ended = tuple(node for node in recipe.reads if node in results)
        awaited = tuple(node for node in recipe.reads if node not in results)
        if not awaited:
            return recipe.task(results)
        base = recipe.base
        sent = Completed(replace(recipe, base=replace(base, shared={})), results.part(ended))
        return Draft(
            base.stage, base.unit, base.function, base.version, limits=base.limits, in_place=base.in_place, shared=base.shared,
            awaited=awaited, ended=ended, recipe=_pickled(sent), made=lambda: task_by(recipe_of)(city, unit),
        )  # fmt: skip

    return draft
