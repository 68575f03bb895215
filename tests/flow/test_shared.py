"""Texts that many tasks read."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from cityflow.errors import RunError
from cityflow.flow.shared import SharedText, SharedTexts, read_shared
from cityflow.flow.store import Store
from cityflow.flow.task import Task


def test_a_text_is_written_once_and_leaves_the_task(tmp_path: Path) -> None:
    store, shared = Store.open(tmp_path), SharedText.of('{"a":1}')
    task = Task("texture", "unit", "m:f", 1, shared={shared.path: shared.text})
    texts = SharedTexts(store)
    assert texts.stored(task) == replace(task, shared={})
    assert read_shared(store, shared.path) == shared.text
    store.remove(shared.path)
    texts.stored(replace(task, unit="other"))
    assert not store.exists(shared.path), "a text is written once in a run"


def test_texts_do_not_change_the_digest(tmp_path: Path) -> None:
    task = Task("texture", "unit", "m:f", 1)
    assert replace(task, shared={"shared/x.json": "{}"}).digest == task.digest


def test_a_damaged_text_is_named_and_the_next_run_mends_it(tmp_path: Path) -> None:
    store, shared = Store.open(tmp_path), SharedText.of('{"a":1,"b":2}')
    task = Task("texture", "unit", "m:f", 1, shared={shared.path: shared.text})
    SharedTexts(store).stored(task)
    store.write_bytes(shared.path, shared.text[:5].encode())
    with pytest.raises(RunError, match="is not what was written"):
        read_shared(store, shared.path)
    SharedTexts(store).stored(task)
    assert read_shared(store, shared.path) == shared.text
