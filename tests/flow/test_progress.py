from __future__ import annotations

import io

from rich.console import Console

from cityflow.core.unit_status import Status
from cityflow.flow.progress import Bars, Lines, Watcher, watcher
from flow.test_records import a_record
from flow.toy_stages import toy


def play(watch: Watcher) -> None:
    for i in range(5):
        watch.ready(toy(f"{i}", stage="reconstruct"))
    watch.finished(a_record("0"), fresh=False)
    watch.finished(a_record("1"), fresh=True)
    watch.tick()
    watch.finished(a_record("2", status=Status.FAILED), fresh=True)
    watch.finished(a_record("3", status=Status.DEGRADED), fresh=True)
    watch.message("dashboard: http://127.0.0.1:8787/status [not markup]")
    watch.close()


def test_lines_state_counts_by_status() -> None:
    stream = io.StringIO()
    play(Lines(stream))
    message, line = stream.getvalue().splitlines()
    assert message == "dashboard: http://127.0.0.1:8787/status [not markup]"
    assert line.split() == [
        "reconstruct",
        "4/5",
        "2",
        "done,",
        "1",
        "degraded,",
        "1",
        "failed",
        "(1",
        "from",
        "before)",
    ]


def test_lines_come_at_most_every_few_seconds() -> None:
    stream = io.StringIO()
    watch = Lines(stream, every_s=3600)
    for i in range(100):
        watch.ready(toy(f"{i}", stage="reconstruct"))
        watch.finished(a_record(f"{i}"), fresh=True)
        watch.tick()
    watch.close()
    assert stream.getvalue().count("\n") == 1


def test_bars_show_the_same_on_a_terminal() -> None:
    stream = io.StringIO()
    play(Bars(Console(file=stream, force_terminal=True, width=120)))
    text = stream.getvalue()
    assert "[not markup]" in text
    last = [line for line in text.splitlines() if "reconstruct" in line][-1]
    assert "4/5" in last
    assert "2 done, 1 degraded, 1 failed (1 from before)" in last


def test_a_pipe_gets_lines() -> None:
    assert isinstance(watcher(io.StringIO()), Lines)
