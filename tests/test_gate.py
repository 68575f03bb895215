"""Tests that share what is slow to make are found where `shared_processes` says."""

from __future__ import annotations

from pathlib import Path

import pytest

from shared_processes import TOGETHER, group, turn

HERE = Path(__file__).parent


@pytest.mark.parametrize("place", [p for places in TOGETHER.values() for p in places])
def test_places_that_share_are_there(place: str) -> None:
    assert (HERE / place).exists()


def test_who_shares_a_cluster_shares_a_process() -> None:
    """Another process would start a cluster of its own, with all that its workers import."""
    users = [f"tests/cluster/{p.name}" for p in sorted((HERE / "cluster").glob("test_*.py"))]
    assert len(users) > 8
    (one,) = {group(u) for u in users}
    assert one in TOGETHER
    assert group("tests/core/test_pixels.py") == "tests/core/test_pixels.py"
    assert turn("tests/core/test_pixels.py") > max(turn(u) for u in users)
