# mypy: disable-error-code="no-untyped-call"
"""The counts of a run on the dashboard's port: all tasks of all stages, and what failed."""

from __future__ import annotations

import json
from urllib.request import urlopen

import pytest
from distributed import Client, LocalCluster

from cityflow.core.building import Status
from cityflow.flow.progress import Silent
from cityflow.flow.progress_counts import Expected
from cityflow.flow.run_page import page_address, publisher
from flow.test_records import a_record


@pytest.mark.cluster
def test_the_page_counts_what_dask_forgets() -> None:
    watch = Silent()
    watch.expect({"reconstruct": Expected(160, 0.1)}, 1)
    watch.finished(a_record("1"), fresh=True)
    watch.finished(a_record("2", status=Status.FAILED), fresh=True)
    with (
        LocalCluster(n_workers=0, protocol="tcp", dashboard_address="127.0.0.1:0") as cluster,
        Client(cluster) as client,
    ):
        publisher(client)({})
        publish = publisher(client)  # a second run on the same scheduler
        publish(watch.counts.as_json())
        told = json.loads(urlopen(page_address(client), timeout=10).read())
    assert told["stages"]["reconstruct"] == {
        "total": 160, "finished": 2, "done": 1, "degraded": 0, "failed": 1, "refused": 0, "from_before": 0,
    }  # fmt: skip
    assert told["share"] == pytest.approx(2 / 160, abs=1e-3)
