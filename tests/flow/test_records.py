from __future__ import annotations

import contextlib
import dataclasses
import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cityflow.core.unit_status import Status
from cityflow.flow.records import (
    MAX_NAME_BYTES,
    decode,
    encode,
    plain_outcome,
    quoted,
    read_record,
    record_path,
    unquoted,
    write_record,
)
from cityflow.flow.store import Store
from cityflow.flow.task import Outcome, Record


def a_record(unit: str = "0503", attempt: int = 1, **changes: object) -> Record:
    record = Record(
        stage="reconstruct",
        unit=unit,
        attempt=attempt,
        digest="d" * 64,
        version=3,
        status=Status.DONE,
        reason="",
        outputs={"work/a": "0" * 64},
        result={"planes": 4, "nmad": 0.039},
        parameters={"max_planes": 60},
        inputs={"points": "1" * 64},
        seconds=0.25,
        peak_mb=120.5,
    )
    return dataclasses.replace(record, **changes)  # type: ignore[arg-type]


@given(st.text(max_size=30))
def test_any_id_is_a_file_name_and_comes_back(name: str) -> None:
    try:
        name.encode()
    except UnicodeEncodeError:
        return
    text = quoted(name)
    assert text not in ("", ".", "..")
    assert not set(text) & set('/\\:*?"<>| \n')
    assert not text.startswith(".")
    assert len(text) > MAX_NAME_BYTES or "~" in text or unquoted(text) == name


@given(st.text(max_size=8), st.text(max_size=8))
def test_different_ids_have_different_names(one: str, other: str) -> None:
    try:
        assert (quoted(one) == quoted(other)) == (one == other)
    except UnicodeEncodeError:
        return


def test_long_ids_stay_short_and_distinct() -> None:
    one, other = quoted("é" * 500), quoted("é" * 501)
    assert one != other
    assert max(len(one), len(other)) <= MAX_NAME_BYTES


def test_a_record_comes_back_equal(store: Store) -> None:
    record = a_record("a/b:ü", 12, status=Status.REFUSED, reason="Fläche 0 m²", traceback="line\nline")
    path = write_record(store, record)
    assert path == record_path("reconstruct", "a/b:ü", 12) == "records/reconstruct/a%2Fb%3A%C3%BC/0012.json"
    assert read_record(store, "reconstruct", "a/b:ü", 12) == record
    assert read_record(store, "reconstruct", "a/b:ü", 13) is None


@pytest.mark.parametrize("data", [b"", b"{", b"null", b"[]", b'{"stage": "x"}', encode(a_record())[:-20], b"\xff\xfe"])
def test_what_a_crash_cut_short_is_no_record(store: Store, data: bytes) -> None:
    store.write_bytes(record_path("s", "u", 1), data)
    assert read_record(store, "s", "u", 1) is None


def test_fields_of_later_versions_are_ignored() -> None:
    fields = json.loads(encode(a_record()))
    del fields["check"]
    assert decode(json.dumps({"colour": "blue", **fields}).encode()) == a_record()


def test_a_record_that_was_changed_is_none(store: Store) -> None:
    """Every single bit of it counts."""
    data = encode(a_record())
    for bit in range(8 * len(data)):
        flipped = bytearray(data)
        flipped[bit // 8] ^= 1 << bit % 8
        with contextlib.suppress(ValueError):
            assert decode(bytes(flipped)) == a_record(), f"bit {bit}: only in the name of the checksum itself"


@pytest.mark.parametrize(
    "changes", [{"outputs": []}, {"stage": 7}, {"attempt": "1"}, {"status": "fine"}, {"seconds": "soon"}]
)
def test_fields_of_other_kinds_are_no_record(changes: dict[str, object]) -> None:
    fields = {**json.loads(encode(a_record())), **changes}
    del fields["check"]
    with pytest.raises(ValueError):  # noqa: PT011 - which sentence does not matter, it is never shown
        decode(json.dumps(fields).encode())


def test_a_text_without_end_is_no_record() -> None:
    with pytest.raises(ValueError, match="recursion"):
        decode(b"[" * 100_000)


def test_an_outcome_is_what_json_gives_back() -> None:
    outcome = Outcome(Status.DEGRADED, "why", {"a": "0"}, {"n": np.int64(3), "x": np.float32(0.5), "pair": (1, 2)})
    plain = plain_outcome(outcome)
    assert plain == Outcome(Status.DEGRADED, "why", {"a": "0"}, {"n": 3, "x": 0.5, "pair": [1, 2]})
    assert type(plain.result["n"]) is int


@pytest.mark.parametrize("value", [float("nan"), float("inf"), {1, 2}, np.zeros(3), b"bytes"])
def test_what_is_no_json_is_refused(value: object) -> None:
    with pytest.raises((TypeError, ValueError), match="JSON"):
        plain_outcome(Outcome(result={"x": value}))
