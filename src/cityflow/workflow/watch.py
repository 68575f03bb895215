"""``cityflow status --watch``: what the driver of a RUN tells of itself, as long as it is at work, wherever it is."""

from __future__ import annotations

import time
from collections.abc import Iterator

from rich.console import Console, Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from cityflow.core.building import Status
from cityflow.flow.driver_note import SILENT_BEATS, DriverNote, beat_s, described, read_note
from cityflow.flow.progress_counts import duration
from cityflow.flow.store import Store

LOOK_EVERY_S = 1.0


def watch_run(url: str, console: Console) -> None:
    """Print progress until the driver has ended: a table that changes on a terminal, else a line whenever something has changed."""
    store = Store.open(url)
    if console.is_terminal:
        with Live(console=console, auto_refresh=False) as live:
            for note, silent_s in _signs(store):
                live.update(Group(_table(note), Text(_line(note, silent_s))), refresh=True)
        return
    shown = ""
    for note, silent_s in _signs(store):
        line = _progress(note)
        if line != shown or silent_s:
            console.print(_line(note, silent_s), markup=False, highlight=False, soft_wrap=True)
        shown = line


def _signs(store: Store) -> Iterator[tuple[DriverNote, float]]:
    """The note about once a second, and for how long the driver has given no sign, 0 where that is short; the last when it has ended.

    A note that cannot be read now counts as no sign: the store may answer again.
    """
    beat, heard, told = (-1, ""), time.monotonic(), 0.0
    note = read_note(store)
    while note is not None:
        now = time.monotonic()
        if (note.beat, note.driver) != beat:
            beat, heard, told = (note.beat, note.driver), now, 0.0
        silent = now - heard
        is_news = silent > max(2 * told, 2 * SILENT_BEATS * beat_s(store))  # said ever more seldom
        told = silent if is_news else told
        yield note, silent if is_news and note.is_open else 0.0
        if not note.is_open:
            return
        time.sleep(LOOK_EVERY_S)
        note = read_note(store) or note


def _progress(note: DriverNote) -> str:
    stages = note.news.get("stages", {})
    counts = ", ".join(
        f"{stage} {n['finished']}/{n['total']}" for stage, n in stages.items() if n["finished"] < n["total"]
    )
    words = note.overall or str(note.phase)
    return f"{words} ({counts})" if counts else words


def _line(note: DriverNote, silent_s: float) -> str:
    if silent_s:
        return f"No sign of the driver for {duration(silent_s)}: {described(note, time.time())}"
    if note.is_open:
        return f"{_progress(note)}" if note.news else described(note, time.time())
    return f"The driver {described(note, time.time())}"


def _table(note: DriverNote) -> Table:
    table = Table("stage", "finished", *map(str, Status), box=None, padding=(0, 2, 0, 0))
    for stage, n in note.news.get("stages", {}).items():
        table.add_row(stage, f"{n['finished']}/{n['total']}", *(str(n[str(s)]) for s in Status))
    return table
