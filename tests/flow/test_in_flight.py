from __future__ import annotations

from unittest.mock import Mock

import pytest

from cityflow.errors import RunError
from cityflow.flow import in_flight
from cityflow.flow.in_flight import InFlight, check_alive


class Clock:
    def __init__(self) -> None:
        self.now = 1000.0

    def monotonic(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr(in_flight, "time", clock)
    return clock


def a_client(threads: dict[str, int]) -> Mock:
    client = Mock(nthreads=Mock(side_effect=lambda: threads), status="running", cluster=None)
    client.scheduler.address = "tcp://there:8786"
    client.scheduler_info = lambda n_workers: {"workers": {name: {"nthreads": n} for name, n in threads.items()}}
    return client


def test_the_number_follows_the_workers(clock: Clock) -> None:
    threads = {"a": 1}
    limit = InFlight(a_client(threads), None)
    assert limit.now() == 32
    threads["b"] = 100
    assert limit.now() == 32, "the scheduler is not asked at every task"
    clock.now += 6
    assert limit.now() == 1616
    assert InFlight(a_client(threads), 7).now() == 7


def test_a_run_without_workers_says_so_and_gives_up_after_minutes(clock: Clock) -> None:
    threads = {"a": 1}
    limit, watch = InFlight(a_client(threads), 4), Mock()
    for _ in range(100):
        clock.now += 60
        limit.check_workers(watch)
    watch.message.assert_not_called()
    threads.clear()
    for _ in range(29):
        clock.now += 10
        limit.check_workers(watch)
    watch.message.assert_called_once()
    assert "tcp://there:8786" in watch.message.call_args.args[0]
    clock.now += 20
    with pytest.raises(RunError, match="no worker for 3"):
        limit.check_workers(watch)


def test_workers_that_come_back_end_the_wait(clock: Clock) -> None:
    threads: dict[str, int] = {}
    limit, watch = InFlight(a_client(threads), 4), Mock()
    clock.now += 200
    limit.check_workers(watch)
    threads["a"] = 1
    clock.now += 6
    limit.check_workers(watch)
    clock.now += 200
    limit.check_workers(watch)


def test_a_local_cluster_is_asked_for_the_workers_that_it_had(clock: Clock) -> None:
    threads = {"a": 1, "b": 1}
    client = a_client(threads)
    client.cluster = Mock(worker_spec={0: {}, 1: {}})
    limit = InFlight(client, None)
    limit.now()
    client.cluster.scale.assert_not_called()
    del threads["a"]
    clock.now += 6
    limit.now()
    client.cluster.scale.assert_called_once_with(2)


def test_a_closed_client_is_a_lost_scheduler() -> None:
    client = a_client({})
    check_alive(client)
    client.status = "connecting"
    with pytest.raises(RunError, match="lost the connection") as caught:
        check_alive(client)
    assert caught.value.where == "tcp://there:8786"
