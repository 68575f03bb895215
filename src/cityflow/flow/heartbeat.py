"""Signs of life of a driver: a thread writes ``driver.json`` now and then, and obeys when somebody asks to cancel."""

from __future__ import annotations

import os
import signal
import socket
import threading
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from types import TracebackType
from typing import Any
from uuid import uuid4

from cityflow.errors import CityflowError, RunError
from cityflow.flow.driver_note import (
    CANCEL,
    DriverNote,
    Phase,
    beat_s,
    described,
    is_alive,
    is_cancelled,
    read_note,
    write_note,
)
from cityflow.flow.exclusive import is_held
from cityflow.flow.run_news import RunNews
from cityflow.flow.store import Store

NEWS_EVERY_S = 1.0
FAILURES_NOTED = 20


@dataclass
class Heartbeat:
    """Around the whole work of a driver; the thread begins with `begin`, when the RUN is this driver's.

    Attributes
    ----------
    request : of the command; a driver that Dask starts anew has that of the one before
    page : address of the run's page
    """

    store: Store
    request: str = field(default_factory=lambda: uuid4().hex)
    page: str = ""
    _note: DriverNote | None = None
    _news: Mapping[str, Any] = field(default_factory=dict)
    _thread: threading.Thread | None = None
    _end: threading.Event = field(default_factory=threading.Event)
    _stopped_by: str = ""

    def begin(self) -> None:
        """Take the RUN, and give signs from now on; called while no other driver of this machine can have it.

        Raises
        ------
        RunError : a driver elsewhere is at work in it
        KeyboardInterrupt : the request was cancelled before it began
        """
        if self._thread is not None:
            return
        self._refuse_another()
        if is_cancelled(self.store, self.request):
            self._stopped_by = "cancelled"
            raise KeyboardInterrupt("cancelled before it began")
        self.store.remove(CANCEL)
        now = time.time()
        place = f"{socket.gethostname()}, process {os.getpid()}"
        self._note = DriverNote(self.request, Phase.AT_WORK, uuid4().hex, place, self.page, now, now)
        write_note(self.store, self._note)
        self._thread = threading.Thread(target=self._beat, name="cityflow-heartbeat", daemon=True)
        self._thread.start()

    def hear(self, news: RunNews) -> None:
        """What the next sign tells."""
        summary = news.summary()
        self._news = {**summary, "failures": summary["failures"][-FAILURES_NOTED:]}

    def __enter__(self) -> Heartbeat:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._thread is None:
            if self._stopped_by and (note := read_note(self.store)) is not None:
                write_note(self.store, replace(note, phase=Phase.CANCELLED))
            return
        self._end.set()
        self._thread.join()
        if self._stopped_by == "replaced":
            remedy = f"it goes on there: cityflow status {self.store.root} --watch"
            raise RunError("another driver has taken this run", where=self.store.root, remedy=remedy) from error
        with suppress(Exception):
            self._write(*self._ending(error))
        if self._stopped_by and isinstance(error, KeyboardInterrupt):
            raise KeyboardInterrupt("cancelled; a later run continues here") from error

    def _ending(self, error: BaseException | None) -> tuple[Phase, str]:
        if error is None:
            return Phase.ENDED, ""
        if isinstance(error, KeyboardInterrupt):
            return (Phase.CANCELLED if self._stopped_by else Phase.INTERRUPTED), ""
        return Phase.FAILED, str(error) if isinstance(error, CityflowError) else f"{type(error).__name__}: {error}"

    def _refuse_another(self) -> None:
        """Only where the RUN has no lock that holds: an object store, some network file systems."""
        note = read_note(self.store)
        if note is None or is_held(self.store) or not is_alive(self.store, note):
            return
        remedy = f"cityflow status {self.store.root} --watch follows it, cityflow cancel {self.store.root} stops it"
        problem = f"another run is using this folder: {described(note, time.time())}"
        raise RunError(problem, where=self.store.root, remedy=remedy)

    def _beat(self) -> None:
        while not self._end.wait(beat_s(self.store)):
            # a store that does not answer now may answer at the next beat; every kind of store has exceptions of its own
            with suppress(Exception):
                self._stopped_by = self._stopped_by or self._stop()
                self._write(Phase.AT_WORK)
            if self._stopped_by and not self._end.is_set():
                # as Ctrl-C: what workers are just doing still writes its records
                os.kill(os.getpid(), signal.SIGINT)
                self._end.wait()

    def _stop(self) -> str:
        assert self._note is not None
        if is_cancelled(self.store, self.request):
            return "cancelled"
        found = read_note(self.store)
        is_other = found is not None and found.phase is Phase.AT_WORK and found.driver != self._note.driver
        return "replaced" if is_other else ""

    def _write(self, phase: Phase, text: str = "") -> None:
        assert self._note is not None
        if self._stopped_by != "replaced":
            self._note = replace(
                self._note, phase=phase, text=text, news=self._news, told=time.time(), beat=self._note.beat + 1
            )
            write_note(self.store, self._note)
