"""``cityflow submit``: hands a run to the scheduler's side and returns; ``cityflow cancel``: stops a run from anywhere."""

from __future__ import annotations

import shlex
import time
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any
from uuid import uuid4

from rich.console import Console

from cityflow.core.credentials import without_credentials
from cityflow.errors import RunError
from cityflow.flow.cluster import connect
from cityflow.flow.driver_note import DriverNote, Phase, ask_to_cancel, described, is_alive, read_note
from cityflow.flow.driver_task import driver_key, knows, submit_driver
from cityflow.flow.exclusive import exclusive
from cityflow.flow.ledger import Ledger
from cityflow.flow.run_page import RunPage, page_address
from cityflow.flow.store import Store
from cityflow.runs.prepare import Prepared
from cityflow.runs.request import Request
from cityflow.runs.run_folder import describe_run, open_run
from cityflow.workflow.rerun import Rerun, chosen_units, why_nothing
from cityflow.workflow.run import Extras, requested

CANCEL_WAITS_S = 60.0
LOOK_EVERY_S = 0.3
MODULE = "cityflow.workflow.driven"


def submit_run(asked: Request, scheduler: str, console: Console, extras: Extras) -> None:
    """Check the request as `run` does, describe it in the RUN, and let a worker drive it.

    Raises
    ------
    WorkflowError, CatalogError, RunError
        As `run`, before anything is written; or a driver is at work in the RUN or waits for a worker.
    """
    wanted = requested(asked, console)
    given = {"verify": extras.verify, "performance": extras.performance}
    _hand_over(wanted, given, scheduler, console)


def submit_rerun(url: str, asked: Rerun, scheduler: str, console: Console) -> None:
    """Check the request as `rerun` does, and let a worker drive it.

    Raises
    ------
    RunError, WorkflowError
        As `rerun`; or a driver is at work in the RUN or waits for a worker.
    """
    wanted = open_run(url)
    with Ledger.open(wanted.store) as ledger:
        if not chosen_units(wanted, ledger, asked).nodes:
            console.print(f"Nothing to run again: {why_nothing(asked.selection)}.", markup=False, soft_wrap=True)
            return
    _hand_over(wanted, {"rerun": asdict(asked)}, scheduler, console)


def _hand_over(wanted: Prepared, given: Mapping[str, Any], scheduler: str, console: Console) -> None:
    """Give the scheduler a driver for a request that was checked, and say how to follow it."""
    store, request = wanted.store, uuid4().hex
    _refuse_password(wanted.catalog.href)
    with connect(scheduler, 0) as client:
        before = read_note(store)
        if before is not None and _is_driven(client, store, before):
            _refuse(store, before)
        with exclusive(store):
            describe_run(wanted)
        client.register_plugin(RunPage())
        submit_driver(client, store, request, MODULE, {**given, "run": store.root, "request": request})
        page = page_address(client, store.root)
    run = shlex.quote(store.root)
    for line in (
        f"Submitted to {scheduler}: {run}",
        f"This run: {page}",
        f"Follow it: cityflow status {run} --watch",
        f"Stop it: cityflow cancel {run}",
    ):
        console.print(line, markup=False, highlight=False, soft_wrap=True)


def _refuse_password(href: str) -> None:
    """A RUN keeps no password, so the driver that a worker starts could not read its catalog."""
    if without_credentials(href) != href:
        raise RunError(
            "the address of the catalog holds a user, password or key, which no RUN keeps", where=href,
            remedy="name the catalog without it, and give it to the workers and here by the environment: docs/deploy.md, Passwords",
        )  # fmt: skip


def _is_driven(client: object, store: Store, note: DriverNote) -> bool:
    return note.is_open and (bool(client.run_on_scheduler(knows, driver_key(note.request))) or is_alive(store, note))  # type: ignore[attr-defined]


def _refuse(store: Store, note: DriverNote) -> None:
    run = shlex.quote(store.root)
    remedy = f"cityflow status {run} --watch follows it, cityflow cancel {run} stops it"
    raise RunError(f"this run is driven already: {described(note, time.time())}", where=store.root, remedy=remedy)


def cancel_run(url: str, console: Console, waits_s: float = CANCEL_WAITS_S) -> None:
    """Ask the driver of a RUN to stop, wherever it is, and wait until it has.

    Raises
    ------
    RunError
        No driver is at work here, or it does not answer.
    """
    store = Store.open(url)
    note = read_note(store)
    if note is None or not note.is_open:
        state = f"; the last driver {described(note, time.time())}" if note is not None else ""
        raise RunError(
            f"nothing to cancel: no driver is at work here{state}",
            where=url,
            remedy="cityflow status says how far the run is",
        )
    ask_to_cancel(store, note.request)
    end = time.monotonic() + waits_s
    while (found := read_note(store)) is None or (found.request == note.request and found.is_open):
        if time.monotonic() > end:
            remedy = "it stops as soon as it is at work again; a driver that is gone needs no more"
            raise RunError(
                f"no driver answers for {waits_s:.0f} s: {described(note, time.time())}", where=url, remedy=remedy
            )
        time.sleep(LOOK_EVERY_S)
    text = "Cancelled" if found.phase is Phase.CANCELLED else f"The driver {described(found, time.time())}"
    end_text = "What was finished is recorded, and a later run continues here"
    console.print(f"{text}. {end_text}", markup=False, soft_wrap=True)
