"""Current records are read one by one: names are in memory, nothing else."""

from __future__ import annotations

from pathlib import Path

import pytest

from cityflow.core.building import Status
from cityflow.flow.ledger import Ledger
from cityflow.flow.row import row_of
from cityflow.flow.store import Store
from cityflow.runs.current import CurrentRecords, StoredRecords
from flow.test_ledger import filled


@pytest.mark.parametrize("segment", [9, 4096])
def test_stored_records_are_those_of_the_ledger(tmp_path: Path, segment: int) -> None:
    store = Store.open(tmp_path)
    whole = filled(store)[:30]
    with Ledger.open(store, segment=segment) as ledger:
        while ledger.join():
            pass
        stored = StoredRecords(ledger, "toy", [record.unit for record in whole])
        current, held = CurrentRecords({"toy": stored}), CurrentRecords({"toy": whole})
        assert list(stored) == list(stored) == whole
        assert (len(stored), stored[3], stored[-1], list(stored[4:8])) == (30, whole[3], whole[-1], whole[4:8])
        assert list(current.units("toy")) == list(held.units("toy"))
        assert {row.unit: row for row in current.rows("toy")} == {r.unit: row_of(r) for r in whole}
        assert {row.unit: row for row in held.rows("toy")} == {r.unit: row_of(r) for r in whole}
        assert all(row.status is Status.DONE for row in current.rows("toy"))
        assert not list(current.rows("other"))
        for some in (stored, stored[4:8]):
            told, counted = CurrentRecords({"toy": some}).tally("toy"), CurrentRecords({"toy": list(some)}).tally("toy")
            assert (told.status, sorted(told.seconds), told.highest_mb) == (
                counted.status,
                sorted(counted.seconds),
                counted.highest_mb,
            )
        assert not current.of("other")
