"""Values of single units that an earlier version has written are read by a later one."""

from __future__ import annotations

from pathlib import Path

from cityflow.flow.store import Store
from cityflow.runs.overrides import read_overrides, write_overrides


def test_keys_that_are_gone_are_left_out(tmp_path: Path) -> None:
    store = Store.open(str(tmp_path))
    kept = {"volumetric": {"surfaces": {"min_area_m2": 3.0}}}
    older = {"volumetric": {"surfaces": {"min_area_m2": 3.0, "gone": 1}}, "also_gone": {"a": True}}
    write_overrides(
        store, {("reconstruct", "7"): older, ("reconstruct", "8"): {"also_gone": 1}, ("gone", "9"): {"a": 1}}
    )
    assert read_overrides(store) == {("reconstruct", "7"): kept}
