"""What the records of a large RUN say by themselves, where no note of the last request counts: nothing is followed, and no catalog is read."""

from __future__ import annotations

from cityflow.flow.ledger import Ledger
from cityflow.flow.some_units import ALL, SomeUnits
from cityflow.pipeline.pipeline import STAGES, in_flow_order
from cityflow.runs.asked import Asked
from cityflow.runs.run_folder import names_of_run
from cityflow.workflow.last_request import LAST


def recorded(url: str, ledger: Ledger) -> Asked:
    """All that has a record counts as asked for. How much there is to do is not known, unless the last task of all began after every other.

    Stages whose oldest record is of another version of their algorithm are out of date by at least this record; what else is, is not looked for.

    Raises
    ------
    RunError : there is no RUN, or its description is damaged
    """
    workflow, catalog = names_of_run(url)
    tallies = {stage: ledger.tally(stage) for stage in in_flow_order(ledger.stages()) if stage in STAGES}
    begun = {stage: tally.last_begun for stage, tally in tallies.items()}
    last = ledger.tally(LAST[0], [LAST[1]]).last_begun
    ended = last > 0 and last >= max(begun.values())
    tasks = dict.fromkeys(tallies, ALL)
    if last > 0 and not ended:
        tasks[LAST[0]] = SomeUnits((LAST[1],), all_but=True)
    stale = {stage: SomeUnits((t.oldest,)) for stage, t in tallies.items() if _is_outdated(ledger, stage, t.oldest)}
    expected = {stage: t.records if ended else None for stage, t in tallies.items()}
    return Asked(catalog, workflow, tasks, expected, stale, is_by_records=True)


def _is_outdated(ledger: Ledger, stage: str, unit: str) -> bool:
    record = ledger.latest(stage, unit)
    return record is not None and all(record.version != kind.version for kind in STAGES[stage].kinds)
