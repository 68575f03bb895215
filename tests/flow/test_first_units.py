from __future__ import annotations

import pytest

from cityflow.core.unit_status import Status
from cityflow.errors import RunError
from cityflow.flow.first_units import FirstUnits, signature_of
from cityflow.flow.task import Record
from flow.test_records import a_record


def failed(i: int, reason: str = "ValueError: bad", traceback: str = 'File "x.py", line 3\nValueError: bad') -> Record:
    return a_record(f"unit{i:03d}", status=Status.FAILED, reason=reason, traceback=traceback)


def feed(records: list[Record]) -> None:
    watch = FirstUnits()
    for record in records:
        watch.add(record)


def test_twenty_equal_exceptions_stop_the_run_and_say_where() -> None:
    feed([failed(i) for i in range(19)])
    with pytest.raises(RunError, match="first 20 units of stage reconstruct") as caught:
        feed([failed(i) for i in range(20)])
    assert caught.value.where == 'File "x.py", line 3'


def test_names_and_numbers_of_units_make_no_difference() -> None:
    with pytest.raises(RunError):
        feed([failed(i, f"KeyError: 'unit{i:03d}' has {i} planes at 0x7f{i:04x}") for i in range(20)])
    assert signature_of(failed(1, "KeyError: a")) != signature_of(failed(1, "KeyError: b"))


def test_crashes_count_and_limits_and_bad_data_do_not() -> None:
    with pytest.raises(RunError):
        feed([failed(i, "crashed with signal SIGSEGV", "") for i in range(20)])
    feed([failed(i, "timeout: killed after 600 s") for i in range(30)])
    feed([failed(i, "memory: killed at 4100 MB (limit 4000 MB)") for i in range(30)])
    feed([failed(i, "no method gave a model", "") for i in range(30)])
    feed([a_record(str(i), status=Status.REFUSED, reason="outline of 0 m²") for i in range(30)])


@pytest.mark.parametrize("where", [0, 10, 19])
def test_one_other_unit_lets_the_stage_go_on_for_good(where: int) -> None:
    records = [failed(i) for i in range(60)]
    records[where] = a_record("good")
    feed(records)


def test_stages_are_counted_apart() -> None:
    feed([a_record(str(i), stage=f"stage{i % 2}", status=Status.FAILED, reason="E", traceback="t") for i in range(38)])
