"""A RUN that has come to its end: what its note says where nothing has changed since, and whether all that it left is there."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from cityflow.flow.exclusive import exclusive
from cityflow.flow.ledger import Ledger
from cityflow.flow.left_there import all_left_there
from cityflow.flow.some_units import SomeUnits
from cityflow.runs.asked import Asked, read_asked
from cityflow.runs.prepare import Prepared
from cityflow.runs.run_folder import is_described
from cityflow.workflow.followed import prepare_surface
from cityflow.workflow.last_request import LAST

NOTHING = "Nothing to run: all of it is done."


def finished(wanted: Prepared, ledger: Ledger) -> Asked | None:
    """The note of a RUN that was asked for the same before (workflow, catalog, area, edits, program), where all of it is done by records that still stand.

    None where the graph has to be followed. Outputs that somebody has removed since are not missed; `ended` misses them.
    """
    if not is_described(wanted):
        return None
    asked = read_asked(wanted.store, ledger)
    if asked is None or asked.is_at_work or asked.stale:
        return None
    if LAST[1] not in asked.tasks.get(LAST[0], SomeUnits()) or not ledger.has(*LAST):
        return None
    return asked if asked.given == wanted.given_digest(wanted.edits()) else None


def ended(wanted: Prepared, ledger: Ledger, client: Any, begin: Callable[[], object]) -> Asked | None:
    """The same, where a run would find nothing to do: every record can be read, and all outputs have their sizes, as `Ledger.state` wants of each task.

    Parameters
    ----------
    begin : called when no other run is at work in the folder

    Raises
    ------
    RunError : one is
    """
    asked = finished(wanted, ledger)
    if asked is None or ledger.problems():
        return None
    with exclusive(wanted.store):
        begin()
        ledger.mend()  # tables that a killed driver did not come to
        prepare_surface(wanted, wanted.source().survey)
        return asked if all_left_there(ledger, asked.tasks, client) else None
