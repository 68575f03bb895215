"""Failed units as tasks of their own that Dask shows as erred.

The task of a unit always finishes, with a record, since Dask never runs what depends on an erred task and a city goes on without a building. So that
Dask's own dashboard names what failed, a leaf that nothing depends on raises the reason of each record.
"""

# mypy: disable-error-code="no-untyped-call"
from __future__ import annotations

import time
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager, suppress
from typing import Any
from uuid import uuid4

from distributed import Client

from cityflow.core.credentials import without_credentials
from cityflow.core.unit_status import Status
from cityflow.flow.stage import Node
from cityflow.flow.task import Record

MOST = 1000
"""Failed units that are shown, the newest."""
EVERY_S = 1.0
"""Leaves are submitted together, as tasks are."""
PUBLISH_S = 10.0
"""So often, at most, the scheduler is told to keep them: the driver waits for its answer, with up to `MOST` names; set by hand."""
PRIORITY = 100
"""Before what waits: a leaf takes a millisecond."""


class FailedUnit(Exception):
    """What a unit failed of; its text is the reason in the unit's record."""


def raise_reason(reason: str) -> None:
    """The leaf: runs on a worker."""
    raise FailedUnit(reason)


class ErredLeaves:
    """The newest failed units of a RUN on its scheduler.

    They outlive the driver, also one that is killed, but for those of its last seconds, until the next run into the same RUN, which shows those that are
    failed then (`others_kept` around it: and those that it never came to).

    Parameters
    ----------
    client : of the scheduler
    run : names the RUN
    """

    def __init__(self, client: Client, run: str) -> None:
        self._client = client
        self._name = _name(run)
        self._held: dict[tuple[str, str], Any] = {}
        self._new: dict[tuple[str, str], str] = {}
        self._next = self._publish_at = 0.0
        self._changed = False
        self._token = uuid4().hex[:8]
        self._count = 0

    def begin(self) -> None:
        """Let go what an earlier run has left."""
        self._client.unpublish_dataset(self._name)

    def note(self, record: Record) -> None:
        """A unit has ended: shown where it failed, no longer where it failed before."""
        if record.status is not Status.FAILED and not self._held and not self._new:
            return
        node = record.stage, record.unit
        self._new.pop(node, None)
        if (future := self._held.pop(node, None)) is not None:
            future.release()
            self._changed = True
        if record.status is Status.FAILED:
            self._new[node] = record.reason
            if len(self._new) > MOST:
                del self._new[next(iter(self._new))]

    def tick(self) -> None:
        """Submit what failed since, at most once a second; now and then have the scheduler keep them."""
        if self._new and time.monotonic() >= self._next:
            self._show()
            self._next = time.monotonic() + EVERY_S
        if self._changed and time.monotonic() >= self._publish_at:
            self._publish()
            self._publish_at = time.monotonic() + PUBLISH_S

    def end(self) -> None:
        """Leave them to the scheduler, which shows them after this driver has gone."""
        if self._client.status != "running":
            return
        with suppress(OSError):  # a scheduler that goes now shows nothing any more
            self._show()
            if self._changed:
                self._publish()

    def _publish(self) -> None:
        with suppress(OSError):  # a scheduler that goes now keeps nothing any more; the driver notices by itself
            self._client.publish_dataset(dict(self._held), name=self._name, override=True)
            self._changed = False

    def _show(self) -> None:
        if not self._new:
            return
        keys = [f"{readable_key(*node)}-failed-{self._token}{self._count + k}" for k, node in enumerate(self._new)]
        self._count += len(keys)
        futures = self._client.map(
            raise_reason, list(self._new.values()), key=keys, pure=False, retries=0, priority=PRIORITY
        )
        self._held.update(zip(self._new, futures, strict=True))
        self._new.clear()
        self._changed = True
        while len(self._held) > MOST:
            self._held.pop(next(iter(self._held))).release()


@contextmanager
def others_kept(client: Client, run: str, ended: Callable[[], Collection[Node]]) -> Iterator[None]:
    """Around a run that comes to a few units only: the leaves of all others stay as they are.

    Parameters
    ----------
    ended : stage and unit of those that ran, asked at the end: failed anew, or healed
    """
    before = client.get_dataset(_name(run), default=None)
    try:
        yield
    finally:
        # an older version has left a list without names
        if isinstance(before, dict) and client.status == "running":
            healed = set(ended())
            others = {node: future for node, future in before.items() if node not in healed}
            kept = {**others, **(client.get_dataset(_name(run), default=None) or {})}
            if kept:
                client.publish_dataset(kept, name=_name(run), override=True)


def _name(run: str) -> str:
    return f"cityflow failed units of {without_credentials(run)}"


def readable_key(stage: str, unit: str) -> str:
    """``reconstruct-0503100000012345``: what the dashboard shows, grouped by stage.

    Dask takes leading words of letters for the group's name; a unit that starts with one is put in brackets.
    """
    word = unit.split("-", 1)[0]
    return f"{stage}-[{unit}]" if word.isalpha() else f"{stage}-{unit}"
