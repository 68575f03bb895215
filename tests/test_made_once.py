from __future__ import annotations

import os
import tempfile
from pathlib import Path

import pytest

from made_once import TEST_RUN, forget, made_once


def number() -> int:
    """Another one in each call."""
    return int.from_bytes(os.urandom(8), "big")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def test_whoever_comes_later_has_what_the_first_has_made() -> None:
    mine = made_once("number", number, "run")
    assert made_once("number", number, "run") == mine
    assert made_once("another", number, "run") != mine
    assert made_once("number", number, "another run") != mine
    forget("run")
    assert made_once("number", number, "run") != mine


def test_a_process_alone_keeps_nothing(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(TEST_RUN, raising=False)
    assert made_once("number", number) != made_once("number", number)
    assert not list(folder.iterdir())
