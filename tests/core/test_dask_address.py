"""An address where nobody answers: one message with a remedy, wherever the command first looks at it."""

from __future__ import annotations

import socket

import pytest

from cityflow.core.dask_address import NO_ANSWER, NO_ANSWER_REMEDY
from cityflow.errors import RunError
from cityflow.runs.look_at_places import look_at_scheduler


@pytest.fixture
def address() -> str:
    """Of a port that nobody listens to."""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
    return f"tcp://127.0.0.1:{port}"


def test_nobody_at_an_address_is_told_with_address_and_remedy(address: str) -> None:
    with pytest.raises(RunError) as refused:
        look_at_scheduler(address)
    assert (refused.value.problem, refused.value.where, refused.value.remedy) == (NO_ANSWER, address, NO_ANSWER_REMEDY)


def test_a_port_that_somebody_listens_to_is_not_refused() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        look_at_scheduler(f"tcp://127.0.0.1:{server.getsockname()[1]}")


@pytest.mark.parametrize("word", ["tls://", "DASK_CONFIG", "--scheduler"])
def test_the_remedy_names_what_may_be_wrong(word: str) -> None:
    assert word in NO_ANSWER_REMEDY
