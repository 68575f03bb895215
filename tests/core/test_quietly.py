from __future__ import annotations

import os
import sys

import pytest

from cityflow.core.quietly import quietly


def test_it_gives_back_what_the_action_returns_or_raises() -> None:
    assert quietly(lambda: 7) == 7
    with pytest.raises(ValueError, match="no such"):
        quietly(lambda: int("no such"))


@pytest.mark.skipif(sys.platform != "linux", reason="waiting for a core is counted otherwise")
def test_only_the_action_gives_way() -> None:
    before = os.sched_getscheduler(0)
    assert quietly(lambda: os.sched_getscheduler(0)) == os.SCHED_BATCH
    assert os.sched_getscheduler(0) == before
