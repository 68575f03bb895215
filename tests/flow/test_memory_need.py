from __future__ import annotations

from cityflow.flow.memory_need import MemoryNeeds
from cityflow.flow.offers import Offers
from cityflow.flow.task import Limits, Task
from flow.toy_stages import toy


def task(bytes_read: int = 0) -> Task:
    return toy("u", limits=Limits(30, 6000, 0), expected={"work/a": (bytes_read, "0" * 64)} if bytes_read else {})


def test_the_limit_stands_where_nothing_is_known_and_the_word_of_the_stage_before_it() -> None:
    assert MemoryNeeds({}).of(task()) == 6000
    assert MemoryNeeds({"toy": 900.0}).of(task()) == 900
    assert MemoryNeeds({"toy": 9000.0}).of(task()) == 6000


def test_what_tasks_really_took_corrects_the_next() -> None:
    needs = MemoryNeeds({"toy": 3000.0})
    for k in range(18):
        needs.learn(task(), 400 + k)
    assert needs.of(task()) > 2900, "eighteen measurements do not say that the stage was wrong"
    for _ in range(20):
        needs.learn(task(), 419)
    assert 419 <= needs.of(task()) < 1.06 * 419


def test_one_task_in_twenty_may_take_more_and_two_may_not() -> None:
    needs = MemoryNeeds({})
    for k in range(200):
        needs.learn(task(), 2000 if k % 40 == 0 else 300)
    assert needs.of(task()) < 320
    for _ in range(20):
        needs.learn(task(), 2000)
    assert 2000 <= needs.of(task()) < 2110


def test_a_larger_input_than_any_before_needs_more_in_proportion_and_a_smaller_one_no_more() -> None:
    needs = MemoryNeeds({"toy": 200.0})
    for _ in range(40):
        needs.learn(task(1000), 500)
    assert 2000 <= needs.of(task(4000)) <= 2110
    assert needs.of(task(10**9)) == 6000
    assert 500 <= needs.of(task(10)) < 530


def test_a_task_never_asks_for_more_than_the_largest_worker_has() -> None:
    assert Offers().asked(500) == 0
    assert Offers(0, 4000).asked(500) == 0, "a worker that says nothing would get nothing to do"
    assert Offers(0, 4000).asked(4000, must=True) == 4000, "one that says nothing was too small"
    assert Offers().asked(500, must=True) == 0
    assert Offers(1000, 4000).asked(500) == 0, "one task at a time, and all workers are large enough"
    assert Offers(1000, 4000).asked(2000) == 2000
    assert Offers(1000, 4000).asked(9000) == 4000
    assert Offers(4000, 4000, is_alone=False).asked(500) == 500
