"""Finds the tasks of a request by walking its graph, and stores them for `status`."""

from __future__ import annotations

from collections import Counter

from cityflow.flow.exclusive import is_held
from cityflow.flow.ledger import Ledger, State
from cityflow.flow.task import Record, Task
from cityflow.pipeline.pipeline import in_flow_order
from cityflow.reporting.asked_area import units_beyond
from cityflow.reporting.unused_edits import unused_edits
from cityflow.runs.asked import Asked, circumstances, write_asked
from cityflow.runs.current import walked
from cityflow.runs.prepare import Prepared


def note_asked(wanted: Prepared, ledger: Ledger) -> Asked:
    """Follow the graph as far as records lead; what is noted counts until a record, the description, an override or the program changes."""
    source = wanted.source()
    stale: Counter[str] = Counter()

    def count(task: Task, _record: Record) -> None:
        stale[task.stage] += ledger.state(task) is not State.DONE

    records = walked(source, ledger, count)
    tasks, expected = {s: records.units(s) for s in records.stages()}, source.expected_units()
    # behind a task without a record, such as one that an earlier version did not have, nobody knows what is asked for: what stands there is of before
    unreached = {s: units for s in expected if s not in tasks and (units := ledger.units(s))}
    stale.update({s: len(units) for s, units in unreached.items()})
    tasks |= unreached
    asked = Asked(
        wanted.catalog.title, wanted.workflow.name, {s: tasks[s] for s in in_flow_order(tasks)}, expected,
        {s: n for s, n in sorted(stale.items()) if n}, units_beyond(records, wanted.area), [(edit.text, edit.remedy) for edit in unused_edits(wanted, records)],
        ledger.count_files(), circumstances(wanted.store),
    )  # fmt: skip
    if not is_held(wanted.store):
        write_asked(wanted.store, asked)
    return asked
