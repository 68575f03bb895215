"""Errors that a user can act on.

Bad *data* of one unit becomes an `Outcome` with a reason (see ``flow``); these exceptions are for what stops a command.
"""

from __future__ import annotations


class CityflowError(Exception):
    """A problem that the user can fix: what is wrong, where, and what to do about it.

    Parameters
    ----------
    problem : str
        What is wrong, with the value.
    where : str
        File, key or unit concerned; empty where the problem has no place.
    remedy : str
        What to do.
    """

    def __init__(self, problem: str, *, where: str = "", remedy: str = "") -> None:
        self.problem, self.where, self.remedy = problem, where, remedy
        super().__init__(problem, where, remedy)

    def __str__(self) -> str:
        place = f"{self.where}: " if self.where else ""
        advice = f" → {self.remedy}" if self.remedy else ""
        return f"{place}{self.problem}{advice}"

    def __reduce__(self) -> tuple[object, ...]:
        return _rebuild, (type(self), self.problem, self.where, self.remedy)


def _rebuild(kind: type[CityflowError], problem: str, where: str, remedy: str) -> CityflowError:
    return kind(problem, where=where, remedy=remedy)


class CatalogError(CityflowError):
    """A catalog, or a file that it names, is missing, unreadable or contradictory."""


class WorkflowError(CityflowError):
    """A workflow file or a ``--set`` override cannot be used."""


class RunError(CityflowError):
    """A RUN folder, a scheduler or a ledger cannot be used."""


class RefusedUnit(CityflowError):
    """The input of this one unit cannot be a building; the run goes on (status ``refused``)."""
