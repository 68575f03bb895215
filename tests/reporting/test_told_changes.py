"""The report's links to pages of changes."""

from __future__ import annotations

import json
from pathlib import Path

from cityflow.flow.store import Store
from cityflow.reporting.change_report import told_changes
from cityflow.viewer.report import write_report
from cityflow.viewer.report_rows import ReportData


def test_the_last_update_comes_first_and_one_that_was_not_compared_is_left_out(tmp_path: Path) -> None:
    store = Store.open(tmp_path)
    for number in (1, 2, 10):
        store.write_bytes(f"updates/{number}/changes.json", json.dumps({"in_short": f"{number} new"}).encode())
    store.write_bytes("updates/11/update.json", b"{}")
    found = told_changes(store)
    assert found == [(f"updates/{n}/changes.html", f"{n} new") for n in (10, 2, 1)]
    page = write_report(ReportData("Town", "city", "EPSG:28992", "NAP", changes=tuple(found)))[1].decode()
    assert '<a href="updates/10/changes.html">Changes by the last update</a> <span class="muted">10 new' in page
    assert '<a href="updates/1/changes.html">Changes by an earlier update</a>' in page
