"""Finds the tasks of a request by walking its graph, and stores them for `status`."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace

from cityflow.flow.exclusive import is_held
from cityflow.flow.ledger import Ledger
from cityflow.flow.some_units import SomeUnits
from cityflow.flow.state import State
from cityflow.flow.task import Record, Task
from cityflow.pipeline.city_part import CityPart
from cityflow.pipeline.city_source import CitySource
from cityflow.pipeline.pipeline import in_flow_order
from cityflow.reporting.asked_area import units_beyond
from cityflow.reporting.unused_edits import unused_edits
from cityflow.runs.asked import NOTE, Asked, circumstances, write_asked
from cityflow.runs.current import CurrentRecords, stored_records, walked
from cityflow.runs.prepare import Prepared
from cityflow.workflow.followed import FollowedCity


def note_asked(wanted: Prepared, ledger: Ledger) -> Asked:
    """Follow the graph as far as records lead; what is noted counts until a record, the description, an override or the program changes."""
    source = wanted.source(ledger)
    stale: dict[str, list[str]] = defaultdict(list)

    def look(task: Task, _record: Record) -> None:
        if ledger.state(task) is not State.DONE:
            stale[task.stage].append(task.unit)

    return _noted(wanted, ledger, source, walked(source, ledger, look), stale)


def note_run(wanted: Prepared, ledger: Ledger, run: FollowedCity) -> Asked:
    """The same when a run has come to its end, from what it has come to: all of that is done, and nothing is followed once more.

    Where something was changed meanwhile that decides about tasks, only the graph can tell.
    """
    now = wanted.source(ledger).survey
    if run.under != circumstances(wanted.store) or now.edits != run.city.survey.edits:
        return note_asked(wanted, ledger)
    return _noted(wanted, ledger, run.city, stored_records(ledger, run.seen), {})


def _noted(
    wanted: Prepared, ledger: Ledger, source: CitySource, records: CurrentRecords, stale: Mapping[str, Sequence[str]]
) -> Asked:
    """Written, unless a driver is at work. `stale`: stage → units of these records that are out of date."""
    tasks, expected = {s: records.units(s) for s in records.stages()}, source.expected_units()
    known = {s: ledger.units(s) for s in {*tasks, *expected}}
    # behind a task without a record, such as one that an earlier version did not have, nobody knows what is asked for: what stands there is of before
    unreached = {s: known[s] for s in expected if s not in tasks and known[s]}
    tasks |= unreached
    asked = Asked(
        wanted.catalog.title, wanted.workflow.name, {s: SomeUnits.of(tasks[s], known[s]) for s in in_flow_order(tasks)}, expected,
        {s: SomeUnits.of(units, known[s]) for s, units in sorted({**stale, **unreached}.items()) if units},
        units_beyond(records, wanted.area), [(edit.text, edit.remedy) for edit in unused_edits(wanted, records)],
        ledger.count_files(), circumstances(wanted.store), wanted.given_digest(source.survey.edits),
    )  # fmt: skip
    if not is_held(wanted.store):
        write_asked(wanted.store, asked)
    return asked


def note_part(wanted: Prepared, ledger: Ledger, asked: Asked | None, part: CityPart) -> Asked | None:
    """The note that counted before a part of the city ran, with what that has changed; None where it cannot be told without a look at the whole city.

    That is where there was no note, or where tiles have other units now.
    """
    if asked is None or part.renamed:
        wanted.store.remove(NOTE)
        return None
    made = part.walk.made
    done = {node for node in made if ledger.has(*node) and part.has_ended(node)}
    waiting = {node for node in part.walk.waiting() if ledger.has(*node)}
    tasks, stale = dict(asked.tasks), dict(asked.stale)
    for stage in {stage for stage, _ in made | waiting}:
        ended, gone, late = ([unit for s, unit in some if s == stage] for some in (done, made - done, waiting))
        tasks[stage] = tasks.get(stage, SomeUnits()).changed(ended, gone)
        stale[stage] = stale.get(stage, SomeUnits()).changed(late, [*ended, *gone])
    stale = {s: units for s, units in stale.items() if units != SomeUnits()}
    # of another catalog, or other edits, what was left may be out of date
    given = asked.given if asked.given == wanted.given_digest(part.city.survey.edits) else ""
    noted = replace(
        asked, tasks={s: tasks[s] for s in in_flow_order(tasks)}, stale=stale, records=ledger.count_files(),
        under=circumstances(wanted.store), given=given, is_at_work=False,
    )  # fmt: skip
    if not is_held(wanted.store):
        write_asked(wanted.store, noted)
    return noted
