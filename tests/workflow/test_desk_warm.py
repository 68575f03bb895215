"""Processes that begin before a rerun needs them: it gets its words, its options and the workers that are there."""

from __future__ import annotations

import io
import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import psutil
import pytest

from cityflow import __version__
from cityflow.cli import prepared
from cityflow.flow.child import resolve
from cityflow.workflow import desk_warm
from cityflow.workflow.desk_warm import Warm

ADDRESS = "tcp://127.0.0.1:9"
STAND_IN = f"""
import sys
if sys.argv[1] == "workers":
    print("a line of a library", flush=True)
    if sys.argv[2] == "13":
        sys.exit(1)
    print("{ADDRESS}", flush=True)
words = sys.stdin.read()
print("heard", words, flush=True)
"""


@pytest.fixture
def begun(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[subprocess.Popen[str]]]:
    """Processes that stand in for those of the desk; all have ended at the end."""
    found: list[subprocess.Popen[str]] = []

    def waiting(*words: str) -> subprocess.Popen[str]:
        pipe = subprocess.PIPE
        found.append(subprocess.Popen([sys.executable, "-c", STAND_IN, *words], stdin=pipe, stdout=pipe, text=True))
        return found[-1]

    monkeypatch.setattr(desk_warm, "_waiting", waiting)
    yield found
    assert all(process.poll() is not None for process in found)


def heard(process: subprocess.Popen[str]) -> list[str]:
    assert process.stdout is not None
    *_, last = process.stdout.read().splitlines()
    process.wait(20)
    return list(json.loads(last.removeprefix("heard ")))


def test_a_rerun_gets_the_process_that_waits_and_the_workers_that_are_there(begun: list[subprocess.Popen[str]]) -> None:
    warm = Warm("a run", ["--workers=3", "--trust"], is_open=True)
    warm.prepare()
    assert len(begun) == 2
    warm.prepare()
    assert len(begun) == 2, "both are there"
    process = warm.begin(["rerun", "a run", "--unit=-5 7"])
    assert process is begun[0]
    assert heard(process) == ["rerun", "a run", "--unit=-5 7", "--trust", f"--scheduler={ADDRESS}"]
    assert heard(warm.begin(["rerun"])) == ["rerun", "--trust", f"--scheduler={ADDRESS}"], (
        "a new process, the same workers"
    )
    assert len(begun) == 3
    warm.close()
    warm.prepare()
    assert len(begun) == 3, "nothing begins after the end"


def test_another_scheduler_has_its_own_workers_and_without_a_head_start_all_goes_on(
    begun: list[subprocess.Popen[str]],
) -> None:
    warm = Warm("a run", ["--scheduler=tcp://far:1"], is_open=True)
    assert heard(warm.begin(["rerun"])) == ["rerun", "--scheduler=tcp://far:1"]
    warm.close()
    assert heard(Warm("a run", ["--workers=3"]).begin(["rerun"])) == ["rerun", "--workers=3"]
    unlucky = Warm("a run", ["--workers=13"], is_open=True)
    assert heard(unlucky.begin(["rerun"])) == ["rerun", "--workers=13"], "workers that could not begin"
    unlucky.close()


def test_the_process_that_waits_is_cityflow() -> None:
    waiting = desk_warm._waiting("rerun", "no run")
    text, _ = waiting.communicate(json.dumps(["--version"]), timeout=300)
    assert (waiting.returncode, text.strip()) == (0, __version__)


def test_without_words_it_ends(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO())
    prepared.wait_for_words("no run")
    assert capsys.readouterr() == ("", "")


@dataclass
class Cluster:
    """A Dask client that notes what is submitted."""

    names: tuple[str, ...]
    sent: list[dict[str, Any]] = field(default_factory=list)

    def scheduler_info(self, n_workers: int = -1) -> dict[str, Any]:
        assert n_workers == -1, "else Dask tells of five"
        return {"address": ADDRESS, "workers": {name: {} for name in self.names}}

    def submit(self, function: Callable[[str], bool], name: str, **how: Any) -> None:
        assert resolve(name) is not None
        self.sent.append({"function": function, **how})


@pytest.mark.parametrize(("free_mb", "ready"), [(100_000, 3), (4000, 2), (1000, 0)])
def test_every_worker_gets_a_child_that_is_ready_as_far_as_memory_is_free(
    monkeypatch: pytest.MonkeyPatch, free_mb: int, ready: int
) -> None:
    monkeypatch.setattr(psutil, "virtual_memory", lambda: SimpleNamespace(available=free_mb * 2**20))
    cluster = Cluster(("c", "a", "b"))
    prepared.ready(cluster)
    assert [one["workers"] for one in cluster.sent] == [["a"], ["b"], ["c"]][:ready]
    assert all(one["priority"] < -1_000_000 and not one["pure"] for one in cluster.sent), "tasks of a rerun come before"


@pytest.mark.parametrize("lines", [0, 2])
def test_workers_are_held_and_made_ready_at_each_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], lines: int
) -> None:
    made = Cluster(("a", "b"))
    monkeypatch.setattr("cityflow.flow.cluster.connect", lambda scheduler, count: nullcontext(made))
    monkeypatch.setattr(sys, "stdin", io.StringIO(lines * "\n"))
    prepared.hold_workers(2)
    assert capsys.readouterr().out == f"{ADDRESS}\n"
    assert len(made.sent) == 2 * lines
