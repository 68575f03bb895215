"""``RUN/driver.json``: who drives a run, how far it is, and its last sign of life. Whoever reaches the RUN reaches its driver: ``RUN/cancel.json`` stops it."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from typing import Any

from cityflow.core.credentials import stripped, without_credentials
from cityflow.flow.progress_counts import duration
from cityflow.flow.store import Store

NOTE, CANCEL = "driver.json", "cancel.json"
LOCAL_BEAT_S, REMOTE_BEAT_S = 1.0, 5.0
"""Time between two signs of life, in a folder and on an object store."""
SILENT_BEATS = 3.0
"""A driver that gives no sign for so many beats is not at work."""


class Phase(StrEnum):
    """Where a request stands."""

    SUBMITTED = "submitted"
    AT_WORK = "at work"
    ENDED = "ended"
    FAILED = "failed"
    CANCELLED = "cancelled"
    INTERRUPTED = "interrupted"
    """By Ctrl-C."""


_ENDINGS = {
    Phase.ENDED: "has ended", Phase.FAILED: "has failed", Phase.CANCELLED: "was cancelled", Phase.INTERRUPTED: "was stopped by Ctrl-C",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class DriverNote:
    """What a driver tells in its RUN.

    Attributes
    ----------
    request : one command; every driver that Dask starts for it has the same
    driver : one process
    place : host and process id
    page : address of the run's page
    begun, told : seconds since the epoch, by the clock of its host
    beat : number of the sign of life
    text : why it failed
    news : counts by stage, share and time left, failures, as `flow.run_news.RunNews.summary`
    """

    request: str
    phase: Phase
    driver: str = ""
    place: str = ""
    page: str = ""
    begun: float = 0.0
    told: float = 0.0
    beat: int = 0
    text: str = ""
    news: Mapping[str, Any] = field(default_factory=dict)

    @property
    def is_open(self) -> bool:
        return self.phase in (Phase.SUBMITTED, Phase.AT_WORK)

    @property
    def overall(self) -> str:
        return str(self.news.get("overall", ""))


def write_note(store: Store, note: DriverNote) -> None:
    """Keep the note; addresses in it lose users, passwords and keys."""
    store.write_bytes(NOTE, (json.dumps(stripped(asdict(note)), ensure_ascii=False) + "\n").encode())


def read_note(store: Store) -> DriverNote | None:
    """The note; None where there is none, or none that can be read."""
    try:
        tree = json.loads(store.read_bytes(NOTE))
        return DriverNote(**{**tree, "phase": Phase(tree["phase"])})
    except (OSError, ValueError, TypeError, KeyError):
        return None


def ask_to_cancel(store: Store, request: str) -> None:
    """Every driver of this request stops, the one at work and those that Dask may start for it."""
    store.write_bytes(CANCEL, json.dumps({"request": request}).encode())


def is_cancelled(store: Store, request: str) -> bool:
    """Whether somebody has asked for it; the request of another command does not count."""
    try:
        return bool(json.loads(store.read_bytes(CANCEL))["request"] == request)
    except (OSError, ValueError, TypeError, KeyError):
        return False


def beat_s(store: Store) -> float:
    return LOCAL_BEAT_S if store.is_local else REMOTE_BEAT_S


def is_alive(store: Store, note: DriverNote) -> bool:
    """Watch whether a driver gives a sign: the clocks of two hosts need not agree. Takes up to some beats where it does not."""
    if note.phase is not Phase.AT_WORK:
        return False
    end = time.monotonic() + SILENT_BEATS * beat_s(store)
    while time.monotonic() < end:
        time.sleep(0.2 * beat_s(store))
        now = read_note(store)
        if now is not None and (now.driver, now.beat) != (note.driver, note.beat):
            return now.phase is Phase.AT_WORK
    return False


def described(note: DriverNote, now: float) -> str:
    """What the driver does or how it has ended, to be read behind its name.

    Parameters
    ----------
    now : seconds since the epoch
    """
    if note.phase is Phase.SUBMITTED:
        return f"submitted {duration(max(now - note.told, 0))} ago, no worker has begun with it yet"
    if note.phase is Phase.AT_WORK:
        sign = f"last sign {duration(max(now - note.told, 0))} ago"
        return f"at work on {note.place}, {sign}" + (f"; {note.page}" if note.page else "")
    return _ENDINGS[note.phase] + (f": {without_credentials(note.text)}" if note.text else "")
