"""Tasks of the last request of a run, stored beside its records, so that `status` need not walk the graph.

Units are named one by one only where they are few: a note says "all that have a record, but these". A note counts while `run.json`, the overrides and
the program are those that it was written under and no record came or went since; without one the graph is followed.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from hashlib import sha256
from typing import Any

from cityflow.flow.exclusive import is_held
from cityflow.flow.ledger import Ledger
from cityflow.flow.some_units import SomeUnits
from cityflow.flow.store import Store
from cityflow.runs.known_keys import sources_digest
from cityflow.runs.poses_note import NOTE as POSES

NOTE = "asked.json"
DESCRIPTION, OVERRIDES = "run.json", "overrides"
VERSION = 5


@dataclass(frozen=True, slots=True)
class Asked:
    """What a run was asked for.

    Attributes
    ----------
    title : of the catalog;  workflow : its name
    tasks : stage → units that have a record and are asked for, stages in the order of the flow
    expected : stage → tasks in all, stages in the order of the flow; None if unknown yet
    stale : stage → units whose record is of other inputs, parameters or versions than those of today, or has lost an output
    beyond : buildings outside the area of interest, modelled for what they share with those inside, or hide of them
    edits : what a person has drawn without effect, each with its remedy
    records : files of records when this was written
    under : digest of the circumstances
    given : digest of catalog and edits, for whoever asks for the same again
    is_at_work : a driver writes this while it works, and what it names is what it has come to
    is_former : noted under another program, other settings or other poses than those of today; what is out of date it does not say
    is_by_records : nothing was noted and nothing followed: what has a record counts as asked for, and of what is out of date an example stands for each stage
    """

    title: str
    workflow: str
    tasks: Mapping[str, SomeUnits]
    expected: Mapping[str, int | None]
    stale: Mapping[str, SomeUnits]
    beyond: Sequence[str] = ()
    edits: Sequence[tuple[str, str]] = ()
    records: int = 0
    under: str = ""
    given: str = ""
    is_at_work: bool = False
    is_by_records: bool = False
    is_former: bool = False
    version: int = VERSION


def write_asked(store: Store, asked: Asked) -> None:
    """Note it; a RUN that cannot be written goes without."""
    with suppress(OSError):
        store.write_bytes(NOTE, (json.dumps(asdict(asked), ensure_ascii=False) + "\n").encode())


def read_asked(store: Store, ledger: Ledger, *, left_behind: bool = False) -> Asked | None:
    """The note, where it counts.

    Parameters
    ----------
    left_behind : also that of a driver which was stopped or killed: what it had come to, with all records of stages of which it had come to all. What of the
        others is out of date it does not say
    """
    asked = _noted(store)
    if asked is None or asked.under != circumstances(store):
        return None
    if asked.is_at_work:
        return asked if left_behind or is_held(store) else None
    return asked if asked.records == ledger.count_files() else None


def read_former(store: Store) -> Asked | None:
    """The note of a request that was made under other circumstances than those of today; None where there is none."""
    asked = _noted(store)
    return None if asked is None or asked.under == circumstances(store) else replace(asked, is_former=True, stale={})


def _noted(store: Store) -> Asked | None:
    try:
        tree = json.loads(store.read_bytes(NOTE))
        units = {field: {s: _units(found) for s, found in tree.pop(field).items()} for field in ("tasks", "stale")}
        asked = Asked(**(tree | units))
    except (OSError, ValueError, TypeError, KeyError, AttributeError):
        return None
    return asked if asked.version == VERSION else None


def _units(tree: Mapping[str, Any]) -> SomeUnits:
    return SomeUnits(tuple(map(str, tree["names"])), bool(tree["all_but"]))


def circumstances(store: Store) -> str:
    """Digest of all that decides, beside records, which tasks are asked for and which of them are done."""
    overrides = [(path, store.read_bytes(path).decode()) for path in store.find(OVERRIDES)]
    poses = store.read_bytes(POSES).decode() if store.exists(POSES) else ""
    told = json.dumps([store.read_bytes(DESCRIPTION).decode(), overrides, sources_digest(), poses])
    return sha256(told.encode()).hexdigest()
