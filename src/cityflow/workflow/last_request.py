"""What a RUN was asked for last, as far as a command that only looks finds out: without imports or walks that take longer than its answer."""

from __future__ import annotations

from cityflow.flow.ledger import Ledger
from cityflow.flow.store import Store
from cityflow.runs.asked import Asked, read_asked, read_former

MOST_FOLLOWED = 20_000
"""Records up to which a command that only looks follows the graph where there is no note: some ten seconds. A larger RUN is told by its records."""
BY_RECORDS = (
    "This is what the records say by themselves: no note of the last request counts, and this many records are not followed. "
    "Buildings beyond an area of interest are counted, too. The command of the run, with `plan` in place of `run`, tells what is out of date or missing."
)
"""What a reader is told beside the counts."""
FORMER = (
    "This run is out of date: it was made by another version of cityflow, or with other settings or poses than now. Counts are those of its last request. "
    "The command of the run, with `plan` in place of `run`, tells which tasks have to run again."
)
"""The same of a run whose note is of other circumstances."""
LAST = ("export", "city")
"""The task that ends a run."""


def asked_of(url: str, store: Store, ledger: Ledger) -> Asked:
    """What the run was asked for: as noted, at the end or by a driver that did not come to it, under whatever circumstances; else by following its graph, or
    by a large one's records."""
    noted = read_asked(store, ledger, left_behind=True) or read_former(store)
    if noted is not None:
        return noted
    if ledger.count_files() > MOST_FOLLOWED:
        from cityflow.workflow.recorded import recorded

        return recorded(url, ledger)
    from cityflow.runs.run_folder import open_run
    from cityflow.workflow.note_asked import note_asked

    return note_asked(open_run(url), ledger)
