"""An object store that fails for some seconds while a run is at work costs no unit and changes no byte; `benchmarks/store_outage.py` has the minute."""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
import rasterio

from cityflow.core import object_store
from cityflow.flow.cluster import connect
from cityflow.flow.executor import run_tasks
from cityflow.flow.ledger import Ledger
from cityflow.flow.progress import Silent
from cityflow.flow.store import Store
from cityflow.io.fetch import local_file
from cityflow.io.rasters.remote_raster import raster_file
from flow.toy_sources import Town
from scenes.failing_proxy import failing_proxy

OUTAGE_S = 5.0


@pytest.fixture(autouse=True)
def _no_other_tries(monkeypatch: pytest.MonkeyPatch) -> None:
    """The tries of the library below would pass over some seconds, but not over a minute."""
    monkeypatch.setenv("AWS_MAX_ATTEMPTS", "1")


@pytest.mark.cluster
def test_a_run_goes_on_after_an_outage_to_the_same_bytes(
    s3_url: str, s3_endpoint: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with failing_proxy(s3_endpoint) as proxy:
        monkeypatch.setenv("AWS_ENDPOINT_URL", proxy.url)

        class Failing(Silent):
            """The store fails when the first units have ended."""

            began = 0.0

            def tick(self) -> None:
                if not Failing.began and len(source.told) >= 3:
                    Failing.began = time.monotonic()
                    proxy.fail(OUTAGE_S)

        left = {}
        with connect(None, 2) as client:
            for name, url in (("remote", f"{s3_url}/run"), ("local", str(tmp_path / "run"))):
                store, source = Store.open(url), Town()
                with Ledger.open(store, segment=10) as ledger:
                    run_tasks(source, client, store, ledger, max_in_flight=4, progress=Failing())
                    records = list(ledger.records())
                assert {(str(r.status), r.attempt, r.traceback) for r in records} == {("done", 1, "")}
                left[name] = {path: store.read_bytes(path) for path in store.find("work")}
        assert time.monotonic() - Failing.began > OUTAGE_S
        assert proxy.answered[503] >= 3, "driver, workers and their children met it"
    assert left["remote"] == left["local"]
    assert len(left["remote"]) == Town().size


@pytest.fixture
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(object_store._STATE, "is_patient", True)


def test_readers_of_a_run_wait_for_the_store(
    s3_url: str, s3_endpoint: str, monkeypatch: pytest.MonkeyPatch, patient: None
) -> None:
    """Listings, files, windows of rasters, chunks of Zarr arrays."""
    import zarr

    with failing_proxy(s3_endpoint) as proxy:
        monkeypatch.setenv("AWS_ENDPOINT_URL", proxy.url)
        store = Store.open(f"{s3_url}/run")
        store.write_bytes("a/b.txt", b"1")
        with rasterio.io.MemoryFile() as file:
            with file.open(driver="GTiff", width=9, height=9, count=1, dtype="uint8") as raster:
                raster.write(np.full((1, 9, 9), 7, np.uint8))
            store.write_bytes("a/raster.tif", file.read())
        array = zarr.create_array(store.zarr_store("z.zarr"), shape=(4,), dtype="i4")
        array[:] = 3

        def window() -> int:
            with raster_file(store.url("a/raster.tif")) as name, rasterio.open(name) as opened:
                return int(opened.read(1, window=((0, 2), (0, 2))).max())

        def copy() -> bytes:
            with local_file(store.url("a/b.txt")) as path:
                return path.read_bytes()

        readers: list[Callable[[], object]] = [
            window, copy, lambda: int(np.asarray(array[0])), lambda: store.find("a"), lambda: store.read_bytes("a/b.txt"), lambda: store.exists("a/c"),
        ]  # fmt: skip
        expected = [read() for read in readers]
        proxy.fail(3.0)
        with ThreadPoolExecutor(len(readers)) as pool:
            assert list(pool.map(lambda read: read(), readers)) == expected
        assert proxy.answered[503] > 2 * len(readers)


def test_who_only_looks_is_told_soon(s3_url: str, s3_endpoint: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(object_store._STATE, "is_patient", False)
    with failing_proxy(s3_endpoint) as proxy:
        monkeypatch.setenv("AWS_ENDPOINT_URL", proxy.url)
        proxy.fail(600)
        begun = time.monotonic()
        with pytest.raises(OSError, match=r"503|Service"):
            Store.open(f"{s3_url}/run").read_bytes("a")
        assert time.monotonic() - begun < 60
