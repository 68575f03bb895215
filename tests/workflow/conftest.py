"""One scheduler for all that orients."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from cityflow.flow.cluster import connect


@pytest.fixture(scope="session")
def scheduler() -> Iterator[str]:
    """Address of one whose worker serves all commands: each command's own would load every library anew."""
    with connect(None, 1) as client:
        yield client.scheduler_info()["address"]
