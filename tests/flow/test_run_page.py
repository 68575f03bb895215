# mypy: disable-error-code="no-untyped-call"
"""What a run tells of itself on the dashboard's port: all tasks of all stages, what failed, the map, memory of the children."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from typing import Any
from urllib.request import urlopen

import pytest
from distributed import Client, LocalCluster, Scheduler

from cityflow.core.unit_status import Status
from cityflow.flow.child_memory import METRIC
from cityflow.flow.cluster import connect
from cityflow.flow.progress import Silent
from cityflow.flow.run_news import MOST_FAILURES, RunNews
from cityflow.flow.run_page import page_address, page_of, publisher
from cityflow.flow.runs_told import MOST_RUNS, RunsTold
from cityflow.flow.store import Store
from flow.test_records import a_record
from flow.told_town import BUILDINGS, TILES, TownPlaces, run_town
from flow.toy_stages import toy


@pytest.fixture(scope="module")
def client() -> Iterator[Client]:
    with connect(None, 1) as client:
        yield client


def told(client: Client) -> Any:
    address = page_address(client).replace("/cityflow?run=", "/cityflow/runs.json")
    return json.loads(urlopen(address, timeout=60).read())


def known_places(run: str, dask_scheduler: Scheduler) -> dict[str, list[int]]:
    return dict(page_of(dask_scheduler).runs.runs[run].places)


def children(dask_scheduler: Scheduler) -> list[float]:
    return [worker.metrics.get(METRIC, 0.0) for worker in dask_scheduler.workers.values()]


@pytest.mark.cluster
def test_two_runs_tell_of_themselves_and_are_kept_apart(client: Client, store: Store) -> None:
    run_town(client, store, "first")
    run_town(client, store, "s3://bucket/second run")  # the same folder: all is from before
    page = told(client)
    assert list(page) == ["first", "s3://bucket/second run"]
    first, second = page.values()
    assert first["stages"]["reconstruct"] == {
        "total": TILES * BUILDINGS, "finished": TILES * BUILDINGS, "done": TILES * BUILDINGS - 1, "degraded": 0,
        "failed": 1, "refused": 0, "from_before": 0,
    }  # fmt: skip
    assert second["stages"]["reconstruct"]["from_before"] == TILES * BUILDINGS
    ((stage, unit, reason),) = first["failures"]
    assert (stage, unit) == ("reconstruct", f"003/{BUILDINGS - 1:04d}")
    assert "file is cut short" in reason
    assert not first["is_at_work"]
    places = client.run_on_scheduler(known_places, "first")
    tasks = 1 + BUILDINGS
    assert places == {"0_0": [tasks, tasks, 0, 1, 1], "1_0": [tasks, tasks, 0, 1, 1], "0_1": [tasks, tasks, 0, 1, 1],
                      "1_1": [tasks, tasks, 1, 1, 1], "2_2": [0, 0, 0, 0, 1]}  # fmt: skip


@pytest.mark.cluster
def test_workers_tell_the_memory_of_their_children(client: Client, store: Store) -> None:
    run_town(client, store, "memory")
    deadline = time.monotonic() + 60
    while (found := client.run_on_scheduler(children)) == [0.0]:
        assert time.monotonic() < deadline
        time.sleep(0.1)
    assert 5 < found[0] < 2000, "a process of Python, in MB"


@pytest.mark.cluster
def test_a_scheduler_without_a_dashboard_has_json() -> None:
    with (
        LocalCluster(n_workers=0, protocol="tcp", scheduler_kwargs={"dashboard": False}, dashboard_address="127.0.0.1:0") as cluster,
        Client(cluster) as client,
    ):  # fmt: skip
        publisher(client, "run")(RunNews(Silent()))
        assert list(told(client)) == ["run"]
        assert json.loads(urlopen(page_address(client, "run"), timeout=60).read()) == told(client)


@pytest.mark.cluster
def test_a_scheduler_that_preloads_the_page_shows_what_it_is_told() -> None:
    """It starts plugins of preloads once more."""
    preloaded = {"dashboard": True, "preload": ["cityflow.flow.run_page"], "preload_argv": [[]]}
    with (
        LocalCluster(
            n_workers=0, protocol="tcp", scheduler_kwargs=preloaded, dashboard_address="127.0.0.1:0"
        ) as cluster,
        Client(cluster) as client,
    ):
        publisher(client, "run")(RunNews(Silent()))
        assert list(told(client)) == ["run"]


def test_only_places_that_changed_are_told_again() -> None:
    news = RunNews(Silent(), TownPlaces())
    assert len(news.changed_places()) == 5
    assert news.changed_places() == {}
    news.ready(toy("001/0000", stage="reconstruct"))
    news.finished(a_record("001/0000", status=Status.FAILED), fresh=True)
    assert news.changed_places() == {"1_0": [1, 1, 1, 1, 1]}


def test_the_newest_failures_are_told() -> None:
    news = RunNews(Silent())
    for k in range(2 * MOST_FAILURES):
        news.finished(a_record(f"{k}", status=Status.FAILED), fresh=True)
    assert [unit for _, unit, _ in news.summary()["failures"]] == [
        str(k) for k in range(MOST_FAILURES, 2 * MOST_FAILURES)
    ]


def test_of_many_runs_the_newest_are_kept_with_their_pace() -> None:
    def said(count: int, driver: str = "a") -> dict[str, Any]:
        return {"driver": driver, "is_at_work": True, "stages": {"match": {"finished": count + 5, "from_before": 5}}}

    runs = RunsTold()
    for k in range(MOST_RUNS + 3):
        runs.hear(f"run {k}", said(k), {}, 0.0)
    assert list(runs.runs) == [f"run {k}" for k in range(3, MOST_RUNS + 3)]
    for seconds in range(0, 200, 2):
        runs.hear("run 5", said(seconds * 3), {"0_0": [seconds, 0, 0, 0, 1]}, float(seconds))
    assert list(runs.runs)[-1] == "run 5"
    assert runs.runs["run 5"].a_minute("match") == pytest.approx(180)
    assert runs.runs["run 5"].places == {"0_0": [198, 0, 0, 0, 1]}
    runs.hear("run 5", said(0, "b"), {}, 200.0)
    assert runs.runs["run 5"].a_minute("match") == 0, "another driver counts from its own beginning"
