"""Who is guilty of the deaths of its workers, and who is only unlucky."""

from __future__ import annotations

from unittest.mock import Mock

import numpy as np
import pytest
from distributed import KilledWorker

from cityflow.flow import suspects
from cityflow.flow.suspects import MOST_DEATHS, Job, Suspects
from flow.toy_stages import toy

KEY = "toy-u-"


class Cluster:
    """Two or more workers that die at times, as the scheduler logs it; one of them has the suspect."""

    def __init__(self, workers: int, rate: float, rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now, self.workers, self.rate, self.rng = 1000.0, workers, rate, rng
        self.log: list[tuple[float, dict[str, object]]] = []
        self.client = Mock(get_events=lambda topic: self.log)
        monkeypatch.setattr(suspects, "time", Mock(monotonic=lambda: self.now))

    def lose(self, *tasks: str) -> None:
        event = {"action": "remove-worker", "expected": False, "processing-tasks": set(tasks)}
        self.log.append((self.now + 7e8, event))  # its clock is another

    def run_alone(self, seconds: float, dies_at: float) -> bool:
        """Whether the suspect ends; the others die by themselves, and its worker too, if it does not kill it before."""
        end = self.now + seconds
        while True:
            pause = self.rng.exponential(1 / (self.rate * self.workers)) if self.rate else np.inf
            if self.now + min(pause, dies_at) >= end:
                self.now = end
                return True
            own = dies_at < pause or self.rng.integers(self.workers) == 0
            self.now += min(pause, dies_at)
            self.lose(*([f"{KEY}1"] if own else []))
            if own:
                return False


def judged(cluster: Cluster, seconds: float, dies_at: float = np.inf) -> tuple[str, int]:
    """Why it is guilty (empty: it has ended), and how often its worker died."""
    found, job = Suspects(cluster.client, lambda: cluster.workers), Job(toy("u"), 1, since=cluster.now)
    cluster.now += 5.0
    deaths = 0
    while True:
        if deaths:
            (job,) = found.next()
        while cluster.run_alone(seconds, dies_at) is False:
            deaths += 1
            if deaths % 4 == 0:
                break
        else:
            return "", deaths
        if guilt := found.died(job, Mock(spec=KilledWorker, allowed_failures=3), KEY):
            return guilt, deaths


@pytest.mark.parametrize(("workers", "most"), [(1, 4 + MOST_DEATHS), (2, 16), (8, 8)])
def test_the_guilty_is_named_soon(workers: int, most: int, monkeypatch: pytest.MonkeyPatch) -> None:
    guilt, deaths = judged(Cluster(workers, 0.0, np.random.default_rng(1), monkeypatch), 10.0, dies_at=1.0)
    assert guilt.startswith(f"the worker died {deaths} times while it ran the task, {deaths - 4} of them with nothing")
    assert guilt.endswith("other workers died 0 times meanwhile")
    assert deaths <= most


def test_the_guilty_is_named_where_others_die_too(monkeypatch: pytest.MonkeyPatch) -> None:
    guilt, deaths = judged(Cluster(4, 0.1, np.random.default_rng(2), monkeypatch), 10.0, dies_at=0.5)
    assert guilt
    assert deaths <= 4 + MOST_DEATHS


def test_the_unlucky_is_not_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """Workers die every four seconds on average, two of them, and the task takes eight: every second try is lost."""
    found = [judged(Cluster(2, 0.125, np.random.default_rng(k), monkeypatch), 8.0) for k in range(300)]
    assert sum(bool(guilt) for guilt, _ in found) <= 3, "chance alone names one in a thousand"
    assert max(deaths for _, deaths in found) > 8, "giving up after eight would have named some"


def test_who_died_beside_others_was_not_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """What waited for a suspect runs when that has ended: one of it kills the worker of both, and the other is not blamed."""
    cluster = Cluster(100, 0.0, np.random.default_rng(3), monkeypatch)
    found = Suspects(cluster.client, lambda: cluster.workers)
    suspect, poison, innocent = (Job(toy(name), 1, since=cluster.now) for name in ("suspect", "poison", "innocent"))
    killed = Mock(spec=KilledWorker, allowed_failures=3)
    cluster.now += 100
    assert not found.died(suspect, killed, "toy-suspect-")
    assert [job.node for job in found.next()] == [suspect.node]
    for _ in range(4):
        cluster.now += 1
        cluster.lose("toy-poison-1", "toy-innocent-1")
    assert not found.died(poison, killed, "toy-poison-")
    assert not found.died(innocent, killed, "toy-innocent-")
    (alone,) = found.next()
    for _ in range(4):
        cluster.now += 1
        cluster.lose("toy-poison-2")
    assert found.died(alone, killed, "toy-poison-").startswith("the worker died 8 times while it ran the task, 4 of")
    assert [job.node for job in found.next()] == [innocent.node]
