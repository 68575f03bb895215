"""Finds units by their names, or by unique parts of names."""

from __future__ import annotations

import shlex
from collections.abc import Sequence

from cityflow.errors import RunError
from cityflow.flow.ledger import Ledger
from cityflow.flow.store import Store

BUILDINGS = "reconstruct"
MOST_NAMED = 5


def named_units(url: str, names: Sequence[str]) -> list[str]:
    """The units of a RUN that are meant by some names, in their order.

    Raises
    ------
    RunError
        No unit, or more than one, has this in its name.
    """
    if not names:
        return []
    with Ledger.open(Store.open(url)) as ledger:
        return named_in(url, names, ledger)


def named_in(url: str, names: Sequence[str], ledger: Ledger) -> list[str]:
    """The same, of a RUN that is open."""
    return [_named(url, name, ledger) for name in names]


def _named(url: str, name: str, ledger: Ledger) -> str:
    """A unit of exactly this name, else the one building, else the one unit of any stage, that has it in its name."""
    stages = sorted(ledger.stages(), key=lambda stage: stage != BUILDINGS)
    if any(ledger.latest(stage, name) is not None for stage in stages):
        return name
    for part in ([BUILDINGS], stages):
        found = sorted({u for stage in part for u in ledger.units(stage) if name.lower() in u.lower()})
        if len(found) == 1:
            return found[0]
        if found:
            more = ", …" if len(found) > MOST_NAMED else ""
            raise RunError(
                f"'{name}' is in the names of {len(found)} units: {', '.join(found[:MOST_NAMED])}{more}", where=url, remedy="give more of it"
            )  # fmt: skip
    raise RunError(
        f"no unit has '{name}' in its name", where=url, remedy=f"cityflow status {shlex.quote(url)} --units lists them"
    )
