"""What the run at a desk can be compared with: another run, its own states before updates, the candidates of other methods."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from cityflow.core.building import Lod
from cityflow.errors import RunError
from cityflow.evaluation.change_pairs import EpochUnit
from cityflow.evaluation.changes import changes_of
from cityflow.flow.ledger import Ledger
from cityflow.flow.store import Store
from cityflow.handover.epoch_rows import decode_epoch
from cityflow.reporting.change_report import FormerState, compare_states, in_words
from cityflow.reporting.compared import rows_of, triangles_of
from cityflow.reporting.desk_list import DeskList
from cityflow.reporting.epoch import epoch_rows, unlisted_tiles
from cityflow.reporting.unit_pages import candidates_of, shown_model
from cityflow.reporting.view_frame import PageFrame
from cityflow.runs.asked import read_asked
from cityflow.runs.current import CurrentRecords, known_records
from cityflow.runs.prepare import Prepared
from cityflow.runs.run_folder import open_run
from cityflow.stages import reconstruct
from cityflow.workflow.former_state import former_folder, former_state, read_update, update_numbers

RUN, UPDATE = "run", "update-"
"""Another run; the state before an update, with its number behind."""
FOLDER = "with"
"""First part of the addresses of another run's files."""

Json = Any
Query = Mapping[str, str]


@dataclass
class Others:
    """Comparisons of one RUN; `run` gives it as it is now, `other` is the address of another one, or empty."""

    run: Callable[[], Prepared]
    list: DeskList
    other: str = ""
    _kept: dict[str, Json] = field(default_factory=dict)
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def __post_init__(self) -> None:
        if self.other:
            _refuse_elsewhere(self.run(), open_run(self.other))

    def answers(self) -> Mapping[str, Callable[[Query], Json]]:
        """What a page may ask for."""
        return {"others": self._listed, "differences": self._differences, "former": self._former, "candidate": self._candidate}  # fmt: skip

    def forget(self) -> None:
        """The run has gone on."""
        with self._lock:
            self._kept.clear()

    @property
    def _store(self) -> Store:
        return self.run().store

    def _listed(self, _: Query) -> Json:
        """All states of the whole city: `key`, `title`, and where the files of another run's page are."""
        found = [{"key": RUN, "title": "/".join(self.other.rstrip("/").split("/")[-2:]), "base": f"../{FOLDER}/view/"}] if self.other else []  # fmt: skip
        for number in reversed(update_numbers(self._store)):
            of = read_update(self._store, number)
            found.append({"key": f"{UPDATE}{number}", "title": f"before update {number}: {of.former_title}, {of.former_date}", "base": ""})  # fmt: skip
        return found

    def _differences(self, query: Query) -> Json:
        key = query.get("of", "")
        with self._lock:
            if key not in self._kept:
                self._kept[key] = self._compared(key)
            return self._kept[key]

    def _compared(self, key: str) -> Json:
        run = self.run()
        with self._state(key) as former, Ledger.open(run.store) as ledger:
            found = compare_states(run, _records(run, ledger), former)
        before = DeskList(Store.open(self.other)).rows() if key == RUN else []
        rows = rows_of(found, self._frame(), before, self.list.rows())
        c = found.changes
        return {
            "rows": rows, "compared": c.compared, "untouched": found.untouched, "without_model": list(c.without_model), "unclear": list(found.unclear),
            "offset_m": round(c.offset_m, 3), "scatter_m": round(c.scatter_m, 3),
        }  # fmt: skip

    @contextmanager
    def _state(self, key: str) -> Iterator[FormerState]:
        """The buildings of the other state, as long as the context lasts."""
        if key == RUN and self.other:
            other = open_run(self.other)
            with Ledger.open(other.store) as ledger:
                records = _records(other, ledger)
                unlisted = frozenset(unlisted_tiles(other, records))
                yield FormerState(lambda: (row for _, rows in epoch_rows(other, records) for row in rows), unlisted)
            return
        yield former_state(self._store, read_update(self._store, self._number(key)))

    def _number(self, key: str) -> int:
        number = key.removeprefix(UPDATE)
        if not number.isdecimal() or int(number) not in update_numbers(self._store):
            raise RunError(f"nothing to compare with is called {key!r}", where=self._store.root, remedy="choose one of the list")  # fmt: skip
        return int(number)

    def _former(self, query: Query) -> Json:
        """Models of a ground tile before an update."""
        folder = former_folder(read_update(self._store, self._number(query.get("of", ""))))
        path = f"{folder}/{query.get('tile', '')}.ndjson"
        rows = decode_epoch(self._store.read_bytes(path)) if path in set(self._store.find(folder)) else ()
        return triangles_of((b for row in rows if (b := row.building) is not None), self._frame())

    def _candidate(self, query: Query) -> Json:
        """The model of a building by another method, and how the one that was kept differs from it."""
        unit, method, run = query.get("unit", ""), query.get("method", ""), self.run()
        with Ledger.open(run.store) as ledger:
            record = ledger.latest(reconstruct.NAME, unit)
        solids = {} if record is None else candidates_of(run.store, record)
        if record is None or method not in solids:
            raise RunError(f"{unit} has no model by {method!r}", where=run.store.root, remedy="choose another candidate")  # fmt: skip
        kept = shown_model(run.store, record, solids)
        made = triangles_of([solids[method]], self._frame())
        if kept is None:
            return {"models": made, "what": "no model was kept"}
        pair = [EpochUnit(unit, b.footprint, b, 0.1) for b in (solids[method], kept) if Lod.LOD22 in b.solids]
        found = changes_of([(pair[0], pair[1])], run.workflow.city.changes).found if len(pair) == 2 else ()
        return {"models": made, "what": "; ".join(in_words(c.kind, c.figures) for c in found)}

    def _frame(self) -> PageFrame:
        run = self.run()
        return PageFrame.over(run.catalog.reference, run.source().survey.lattice.bounds)


def _records(run: Prepared, ledger: Ledger) -> CurrentRecords:
    return known_records(run, ledger, read_asked(run.store, ledger))


def _refuse_elsewhere(run: Prepared, other: Prepared) -> None:
    """Two runs stand in one scene where both are in the same system."""
    ours, theirs = run.catalog.reference, other.catalog.reference
    if (ours.code, ours.horizontal_epsg) != (theirs.code, theirs.horizontal_epsg):
        raise RunError(
            f"it is in {theirs.name}, the run in {ours.name}", where=other.store.root, remedy="compare runs of one coordinate reference system"
        )  # fmt: skip
