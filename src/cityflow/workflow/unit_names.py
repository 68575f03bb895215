"""Finds units by their names, or by unique parts of names."""

from __future__ import annotations

import os
import shlex
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import unquote

from cityflow.errors import RunError

if TYPE_CHECKING:
    from cityflow.flow.ledger import Ledger

BUILDINGS = "reconstruct"
MOST_NAMED = 5
RECORDS, SEGMENTS = "records", "segments"
"""Folders of a RUN, as `flow.records` and `flow.record_segments` name them: these would be imported with all that reads records."""


def named_units(url: str, names: Sequence[str]) -> list[str]:
    """The units of a RUN that are meant by some names, in their order.

    Raises
    ------
    RunError
        No unit, or more than one, has this in its name.
    """
    if not names:
        return []
    from cityflow.flow.ledger import Ledger
    from cityflow.flow.store import Store

    with Ledger.open(Store.open(url)) as ledger:
        return named_in(url, names, ledger)


def look_at_names(url: str, stage: str, names: Sequence[str]) -> None:
    """Make sure, before heavy imports, that a local RUN has a stage and units of these names.

    Names are those of the folders of records; a RUN whose records are joined in segments is not looked at, since only the ledger knows all.

    Raises
    ------
    RunError
        It has not.
    """
    folder = Path(url).expanduser()
    if "://" in url or not (folder / RECORDS).is_dir() or (folder / SEGMENTS).exists():
        return
    stages = {unquote(found.name): Path(found) for found in os.scandir(folder / RECORDS) if found.is_dir()}
    refuse_unknown_stage(stage, sorted(stages))
    units = {s: partial(_names_in, path) for s, path in stages.items()}
    for name in names:
        _found(url, name, units)


def _names_in(folder: Path) -> list[str]:
    """Units that have a folder of records; names that are too long for one, and so are cut, as they are."""
    return [unquote(entry.name) if entry.name != "%" else "" for entry in os.scandir(folder)]


def refuse_unknown_stage(stage: str, known: Sequence[str]) -> None:
    """Raise RunError where a stage is named that is none of those known."""
    if stage and stage not in known:
        raise RunError(f"no stage '{stage}' in this run", where="--stage", remedy=f"known: {', '.join(known)}")


def named_in(url: str, names: Sequence[str], ledger: Ledger) -> list[str]:
    """The same, of a RUN that is open."""
    known = {stage: partial(ledger.units, stage) for stage in ledger.stages()}
    return [name if any(ledger.has(s, name) for s in known) else _found(url, name, known) for name in names]


def _found(url: str, name: str, known: Mapping[str, Callable[[], Iterable[str]]]) -> str:
    """A unit of exactly this name, else the one building, else the one unit of any stage, that has it in its name; `known`: stage → lists its units."""
    stages = sorted(known, key=lambda stage: stage != BUILDINGS)
    listed = {stage: list(known[stage]()) for stage in stages}
    if any(name in units for units in listed.values()):
        return name
    for part in ([BUILDINGS], stages):
        found = sorted({u for stage in part for u in listed.get(stage, ()) if name.lower() in u.lower()})
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
