"""Trust in custom methods (``module:function``): code that a RUN's folder names is imported only on request."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from typing import Any

from cityflow.errors import RunError
from cityflow.pipeline.workflow_parameters import CityParameters
from cityflow.runs.overrides import read_overrides
from cityflow.runs.prepare import Prepared
from cityflow.runs.settings import parse_setting
from cityflow.stages import reconstruct


def refuse_untrusted(
    run: Prepared, settings: Sequence[str], *, of_the_run: bool, cleared: AbstractSet[tuple[str, str]] = frozenset()
) -> None:
    """Make sure that no function would be imported that only the RUN names.

    Parameters
    ----------
    settings : of the command line; whom they name is trusted
    of_the_run : the workflow is that of the RUN, too, and not a file that the user named
    cleared : stage and unit of the overrides that are removed before anything runs

    Raises
    ------
    RunError
        The workflow or an override names one.
    """
    own = set(_named(dict(_sections(settings))))
    if not of_the_run:
        own |= set(_named_in(run.workflow.city))
    in_run = [*_named_in(run.workflow.city), *(f for tree in _overrides(run, cleared) for f in _named(tree))]
    foreign = sorted(set(in_run) - own)
    if foreign:
        raise RunError(
            f"this run names a custom function, {foreign[0]}, which would be imported and run with your rights",
            where=run.store.root,
            remedy="look at it first; with --trust it is used",
        )


def _overrides(run: Prepared, cleared: AbstractSet[tuple[str, str]]) -> Iterator[Mapping[str, Any]]:
    for (stage, unit), tree in read_overrides(run.store).items():
        if stage == reconstruct.NAME and (stage, unit) not in cleared:
            yield tree


def _sections(settings: Sequence[str]) -> Iterator[tuple[str, Any]]:
    for setting in settings:
        tree = parse_setting(setting).get(reconstruct.NAME)
        yield from tree.items() if isinstance(tree, Mapping) else ()


def _named_in(city: CityParameters) -> list[str]:
    return [m for m in city.reconstruct.methods if ":" in m]


def _named(tree: Mapping[str, Any]) -> list[str]:
    methods = tree.get("methods", ())
    several = methods if isinstance(methods, list | tuple) else str(methods).split(",")
    return [str(m).strip() for m in several if ":" in str(m)]
