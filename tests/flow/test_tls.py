"""A scheduler with TLS, as `deploy/tls.sh` makes it: with real processes on this machine."""

# mypy: disable-error-code="no-untyped-call"
from __future__ import annotations

import json
import shutil
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.request import urlopen

import dask
import pytest
import yaml

from cityflow.core.unit_status import Status
from cityflow.errors import RunError
from cityflow.flow.cluster import connect
from cityflow.flow.driver_note import Phase, read_note
from cityflow.flow.executor import run_tasks
from cityflow.flow.ledger import Ledger
from cityflow.flow.run_page import page_address
from cityflow.flow.store import Store
from flow import toy_driver
from flow.conftest import free_port
from flow.processes import Cluster
from flow.toy_sources import Given, Town
from flow.toy_stages import toy

NO_OPENSSL = "no openssl here (Debian: apt-get install openssl)"
pytestmark = [pytest.mark.cluster, pytest.mark.skipif(shutil.which("openssl") is None, reason=NO_OPENSSL)]
SCRIPT = Path(__file__).parents[2] / "deploy" / "tls.sh"


@contextmanager
def with_certificates(folder: Path) -> Iterator[None]:
    """As ``DASK_CONFIG`` gives them to a process that begins."""
    added = yaml.safe_load((folder / "dask-tls.yaml").read_text())
    with dask.config.set(distributed=dask.config.merge(dask.config.config, added)["distributed"]):
        yield


@pytest.fixture(scope="module")
def certificates(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("certificates")
    told = subprocess.run(
        ["sh", SCRIPT, folder, "127.0.0.1", "localhost"], capture_output=True, text=True, check=True
    ).stdout
    assert told.splitlines()[0] == f"export DASK_CONFIG={folder}/dask-tls.yaml"
    assert all(path.stat().st_mode & 0o077 == 0 for path in folder.iterdir()), "for their owner only"
    return folder


@pytest.fixture(scope="module")
def cluster(certificates: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    more = {"DASK_CONFIG": str(certificates / "dask-tls.yaml")}
    cluster = Cluster(tmp_path_factory.mktemp("cluster"), scheme="tls", more=more)
    try:
        with with_certificates(certificates):
            cluster.start(free_port(), 1, "--preload", "cityflow.flow.run_page")
        yield cluster
    finally:
        cluster.stop()


def test_a_run_over_tls(cluster: Cluster, certificates: Path, store: Store) -> None:
    with with_certificates(certificates):
        with connect(cluster.address, 0) as client, Ledger.open(store) as ledger:
            page = page_address(client).replace("/cityflow?run=", "/cityflow/runs.json")
            assert json.loads(urlopen(page, timeout=60).read()) == {}, "the preload has made it before the first run"
            run_tasks(Given([toy("good"), toy("bad", "unusable")]), client, store, ledger)
            assert {r.unit: r.status for r in ledger.records()} == {"good": Status.DONE, "bad": Status.FAILED}
        toy_driver.submit(cluster.address, f"{store.root}-submitted", 0)
    submitted = Store.open(f"{store.root}-submitted")
    deadline = time.monotonic() + 60
    while (note := read_note(submitted)) is None or note.is_open:
        assert time.monotonic() < deadline, note
        time.sleep(0.1)
    assert note.phase is Phase.ENDED, note.text
    assert len(submitted.find("records")) == Town(4, 8).size


def test_without_a_certificate_nobody_gets_in(cluster: Cluster, tmp_path: Path) -> None:
    plain = cluster.address.replace("tls://", "tcp://")
    for address in (cluster.address, plain):
        with pytest.raises(RunError, match="no scheduler answers") as caught, connect(address, 0, connect_s=2):
            pass
        assert "DASK_CONFIG" in caught.value.remedy
    strangers = tmp_path / "strangers"
    subprocess.run(["sh", SCRIPT, strangers, "127.0.0.1"], capture_output=True, check=True)
    with (
        with_certificates(strangers),
        pytest.raises(RunError, match="no scheduler answers"),
        connect(cluster.address, 0, connect_s=2),
    ):
        pass
