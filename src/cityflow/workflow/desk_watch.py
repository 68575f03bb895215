"""What a driver does to a RUN while people look at it: its note, stages, and the state of each ground tile."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Collection
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from cityflow.core.building import Status
from cityflow.errors import CityflowError
from cityflow.flow.driver_note import DriverNote, described, read_note
from cityflow.flow.exclusive import is_held
from cityflow.flow.ledger import Ledger
from cityflow.flow.stage import Place
from cityflow.flow.store import Store
from cityflow.pipeline.pipeline import PIPELINE
from cityflow.stages import export

LOOK_EVERY_S, TILES_EVERY_S = 1.0, 3.0
WAITING, AT_WORK, FINISHED, FAILED = "waiting", "at work", "done", "failed"

Json = Any


@dataclass
class Watch:
    """Looks at a RUN as long as somebody listens.

    Attributes
    ----------
    asked : tiles that are asked for, as far as known
    tell : hears of everything new
    ended : called when a driver that was at work has ended
    """

    store: Store
    asked: Collection[str]
    tell: Callable[[Json], None]
    ended: Callable[[], None]
    is_heard: Callable[[], bool]
    _stop: threading.Event = field(default_factory=threading.Event)

    def start(self) -> None:
        threading.Thread(target=self._look, daemon=True, name="watch").start()

    def close(self) -> None:
        self._stop.set()

    def _look(self) -> None:
        told: tuple[str, int, str] | None = None
        was_at_work, is_old, due = False, False, 0.0
        while not self._stop.wait(LOOK_EVERY_S):
            if not self.is_heard() and not was_at_work:
                continue
            note = read_note(self.store)
            now = (note.driver, note.beat, str(note.phase)) if note is not None else None
            if now != told:
                told, is_old = now, True
                self.tell({"driver": told_of(self.store, note)})
            if is_old and (time.monotonic() >= due or (note is not None and not note.is_open)):
                begun, is_old = time.monotonic(), False
                with suppress(CityflowError, OSError):
                    self.tell({"tiles": tiles_of(self.store, self.asked)})
                due = time.monotonic() + max(TILES_EVERY_S, 20 * (time.monotonic() - begun))
            is_at_work = is_held(self.store)
            if was_at_work and not is_at_work:
                self.ended()
            was_at_work = is_at_work


def told_of(store: Store, note: DriverNote | None) -> Json:
    """What the driver tells of itself; None where none ever drove."""
    if note is None:
        return None
    is_at_work = note.is_open and (is_held(store) or not store.is_local)
    if note.is_open and not is_at_work:
        note = read_note(store) or note  # it may have ended after it was read
    lost = "gives no sign any more: " if note.is_open and not is_at_work else ""
    news = note.news
    return {
        "is_at_work": is_at_work, "text": lost + described(note, time.time()), "page": note.page if is_at_work else "",
        "overall": note.overall, "share": news.get("share"), "stages": news.get("stages", {}),
        "failures": news.get("failures", [])[::-1], "since": round(max(note.told - note.begun, 0.0), 1),
    }  # fmt: skip


def tiles_of(store: Store, asked: Collection[str]) -> dict[str, str]:
    """State of each ground tile, by the records: waiting, at work, done, failed."""
    found = dict.fromkeys(asked, WAITING)
    with Ledger.open(store) as ledger:
        for stage in (s for s in PIPELINE if s.place is Place.TILE):
            for row in ledger.rows(stage.name):
                name = row.unit.split(".", 1)[0]
                if not _is_tile(name) or (asked and name not in found):
                    continue
                if row.status is Status.FAILED or found.get(name) == FAILED:
                    found[name] = FAILED
                else:
                    found[name] = (
                        FINISHED if stage.name == export.NAME and name == row.unit else found.get(name, AT_WORK)
                    )
                    if found[name] == WAITING:
                        found[name] = AT_WORK
    return found


def _is_tile(name: str) -> bool:
    """
    >>> _is_tile("12_-3"), _is_tile("city"), _is_tile("d8_0_0")
    (True, False, False)
    """
    col, _, row = name.partition("_")
    return all(part.removeprefix("-").isdecimal() for part in (col, row))
