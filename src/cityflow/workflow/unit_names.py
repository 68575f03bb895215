"""Finds units by their names, or by unique parts of names."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path

from cityflow.errors import RunError
from cityflow.flow.index import FILE
from cityflow.flow.ledger import Ledger
from cityflow.flow.store import Store

BUILDINGS = "reconstruct"
MOST_NAMED = 5
MOST_LOOKED_AT_BYTES = 64 * 2**20
"""Of an index of records that is opened for a first look alone: about 100,000 records."""


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


def look_at_names(url: str, stage: str, names: Sequence[str]) -> None:
    """Make sure, before heavy imports, that a local RUN of usual size has a stage and units of these names.

    Raises
    ------
    RunError
        It has not.
    """
    index = Path(url).expanduser() / FILE
    if "://" in url or not index.is_file() or index.stat().st_size > MOST_LOOKED_AT_BYTES:
        return
    with Ledger.open(Store.open(url)) as ledger:
        refuse_unknown_stage(stage, ledger.stages())
        named_in(url, names, ledger)


def refuse_unknown_stage(stage: str, known: Sequence[str]) -> None:
    """Raise RunError where a stage is named that is none of those known."""
    if stage and stage not in known:
        raise RunError(f"no stage '{stage}' in this run", where="--stage", remedy=f"known: {', '.join(known)}")


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
