"""Totals that are known beforehand, the share of the work, the time that is left, failures on the way."""

from __future__ import annotations

import io

import pytest

from cityflow.core.unit_status import Status
from cityflow.flow.progress import EveryTask, Lines, Silent, watcher
from cityflow.flow.progress_counts import Counts, Expected
from cityflow.flow.talk import Talk
from flow.test_records import a_record
from flow.toy_stages import toy


def test_totals_are_those_of_the_plan_and_grow_only_where_more_comes() -> None:
    counts = Counts()
    counts.expect({"surface": Expected(2, 6.0), "reconstruct": Expected(160, 0.1)}, 2)
    counts.ready["reconstruct"] += 10
    assert counts.total("reconstruct") == 160
    counts.ready["reconstruct"] += 200
    assert counts.total("reconstruct") == 210
    assert counts.stages() == ["surface", "reconstruct"]


def test_the_share_is_of_work_and_not_of_tasks(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = [0.0]
    monkeypatch.setattr("cityflow.flow.progress_counts.time.monotonic", lambda: clock[0])
    counts = Counts()
    counts.expect({"slow": Expected(2, 30.0), "fast": Expected(40, 1.0)}, 2)
    assert counts.overall() == "0 %, about 50 s left"
    for i in range(10):
        counts.add(a_record(f"{i}", stage="fast", seconds=1.0), fresh=True)
    clock[0] = 5.0  # two workers, as expected
    assert counts.share() == pytest.approx(0.1)
    assert counts.overall() == "10 %, about 45 s left"
    clock[0] = 50.0  # ten times as long: the machine is shared
    assert float(counts.overall().split("about ")[1].split(" s")[0]) > 60
    counts.add(a_record("bad", stage="fast", seconds=1.0, status=Status.FAILED), fresh=True)
    assert "1 failed" in counts.overall()


def test_what_an_earlier_run_did_is_no_work_of_this_one() -> None:
    counts = Counts()
    counts.expect({"fast": Expected(4, 1.0)}, 1)
    for i in range(3):
        counts.add(a_record(f"{i}", stage="fast", seconds=1.0), fresh=False)
    assert counts.share() == 0.0
    assert counts.words("fast") == "3 done (3 from before)"


def test_stages_that_nobody_knows_yet_are_said_to_be_so() -> None:
    counts = Counts()
    counts.expect({"surface": Expected(1, 60.0), "reconstruct": Expected(0, 1.0, is_known=False)}, 1)
    assert counts.overall() == "0 %, about 60 s left for what is known so far"
    assert counts.total_text("reconstruct") == "?"
    counts.ready["reconstruct"] += 3
    assert counts.total_text("reconstruct") == "3+"


def test_lines_go_by_the_order_of_the_flow_and_end_with_all() -> None:
    stream = io.StringIO()
    watch = Lines(stream)
    watch.expect({"surface": Expected(1, 6.0), "outline": Expected(1, 0.2), "export": Expected(2, 5.0)}, 1)
    for stage in ("export", "outline", "surface"):
        watch.ready(toy("1", stage=stage))
        watch.finished(
            a_record("1", stage=stage, status=Status.FAILED if stage == "outline" else Status.DONE), fresh=True
        )
    watch.close()
    lines = stream.getvalue().splitlines()
    assert [line.split()[0] for line in lines] == ["surface", "outline", "export", "all"]
    assert lines[2].split()[1] == "1/2"
    assert "1 failed" in lines[3]


def test_quiet_says_nothing_and_verbose_names_every_task() -> None:
    stream = io.StringIO()
    silent = watcher(stream, Talk.QUIET)
    assert type(silent) is Silent
    silent.message("Dashboard")
    loud = watcher(stream, Talk.VERBOSE)
    assert isinstance(loud, EveryTask)
    loud.finished(a_record("b1", status=Status.FAILED, reason="no points"), fresh=True)
    loud.finished(a_record("b2"), fresh=False)
    assert "reconstruct-b1 failed" in stream.getvalue()
    assert "no points" in stream.getvalue()
    assert "b2" not in stream.getvalue()
