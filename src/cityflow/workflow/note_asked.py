"""What a run was asked for, found by following its graph, and noted for the next one who wants to know its status."""

from __future__ import annotations

from collections import Counter

from cityflow.flow.exclusive import is_held
from cityflow.flow.ledger import Ledger, State
from cityflow.flow.task import Record, Task
from cityflow.workflow.asked import Asked, circumstances, write_asked
from cityflow.workflow.asked_area import units_beyond
from cityflow.workflow.current import walked
from cityflow.workflow.prepare import Prepared
from cityflow.workflow.unused_edits import unused_edits


def note_asked(wanted: Prepared, ledger: Ledger) -> Asked:
    """Follow the graph as far as records lead; what is noted counts until a record, the description, an override or the program changes."""
    source = wanted.source()
    stale: Counter[str] = Counter()

    def count(task: Task, _record: Record) -> None:
        stale[task.stage] += ledger.state(task) is not State.DONE

    records = walked(source, ledger, count)
    asked = Asked(
        wanted.catalog.title, wanted.workflow.name, {s: [r.unit for r in records.of(s)] for s in records.stages()}, source.expected_units(),
        {s: n for s, n in sorted(stale.items()) if n}, units_beyond(records, wanted.area), [(edit.text, edit.remedy) for edit in unused_edits(wanted, records)],
        ledger.count_files(), circumstances(wanted.store),
    )  # fmt: skip
    if not is_held(wanted.store):
        write_asked(wanted.store, asked)
    return asked
