"""The digest of a task is that of the canonical JSON of what its result depends on."""

from __future__ import annotations

from cityflow.flow.task import Task, digest_of


def test_parameters_whose_text_is_kept_give_the_digest_of_all() -> None:
    shared = {"b": 1.5, "a": {"ü": [1, None, "x"]}}
    for unit in ("one", "two"):
        for parameters in (shared, {}, {"b": 2}):
            task = Task("stage", unit, "m:f", 3, parameters, {"points": "0" * 64, "a": unit})
            assert task.digest == digest_of(["stage", unit, 3, parameters, dict(task.inputs)])


def test_many_trees_of_parameters_do_not_mix() -> None:
    tasks = [Task("stage", "unit", "m:f", 1, {"k": number}, {}) for number in range(300)]
    assert len({task.digest for task in tasks}) == 300
    assert [task.digest for task in tasks] == [digest_of(["stage", "unit", 1, {"k": n}, {}]) for n in range(300)]
