"""A run into an object store, over HTTP: the same bytes as into a folder, and every command works on it."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from urllib.request import urlopen

import boto3
import pytest

from cluster.small_city import S3, S3_PORT, WEST_AREA, Commands, SmallCity, contents, newest, redone, report
from flow.processes import Cluster

pytestmark = pytest.mark.cluster


@pytest.fixture(scope="module")
def bucket(two_workers: Cluster) -> Iterator[str]:
    """An empty bucket of a server in a process of its own; the workers know its address."""
    process = subprocess.Popen(
        [sys.executable, "-m", "moto.server", "-p", str(S3_PORT)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        wait_for(S3["AWS_ENDPOINT_URL"])
        boto3.client("s3").create_bucket(Bucket="city")
        yield "s3://city"
    finally:
        process.kill()
        process.wait()


def wait_for(url: str) -> None:
    deadline = time.monotonic() + 60
    while True:
        try:
            urlopen(url, timeout=1).close()
            return
        except OSError:
            assert time.monotonic() < deadline, "the server did not start"
            time.sleep(0.1)


@pytest.fixture(scope="module")
def stored_run(bucket: str, cityflow: Commands, small_city: SmallCity) -> str:
    run = f"{bucket}/some where/run"
    cityflow.run(small_city, run, *WEST_AREA)
    return run


def test_the_products_are_those_of_a_local_run(stored_run: str, west_run: Path) -> None:
    assert contents(stored_run) == contents(west_run)


def test_hulls_are_those_of_a_local_run(stored_run: str, west_run: Path) -> None:
    mine, theirs = newest(stored_run, "reconstruct"), newest(west_run, "reconstruct")
    assert {u: r["outputs"] for u, r in mine.items()} == {u: r["outputs"] for u, r in theirs.items()}


def test_a_second_run_does_nothing(cityflow: Commands, small_city: SmallCity, stored_run: str) -> None:
    assert redone(stored_run, lambda: cityflow.run(small_city, stored_run, *WEST_AREA)) == set()


def test_commands_work_on_it(cityflow: Commands, small_city: SmallCity, stored_run: str, west_run: Path) -> None:
    status = cityflow("status", stored_run)
    assert status.code == 0, status.text
    units = len(newest(west_run, "reconstruct"))
    assert units >= 4
    assert ["reconstruct", str(units), str(units)] in [line.split()[:3] for line in status.out.splitlines()]
    explained = cityflow("explain", stored_run, "u00005")
    assert explained.code == 0, explained.text
    assert f"wrote {stored_run}/work/reconstruct/u00005/" in explained.out
    assert cityflow("report", stored_run).code == 0
    shown = [u["id"] for u in report(stored_run)["units"]]
    assert shown == [u["id"] for u in report(west_run)["units"]] != []
    plan = cityflow("plan", small_city.workflow, "--catalog", small_city.catalog, "--out", stored_run, *WEST_AREA)
    assert plan.code == 0, plan.text


def test_a_lost_product_is_made_again(
    cityflow: Commands, small_city: SmallCity, stored_run: str, west_run: Path
) -> None:
    boto3.client("s3").delete_object(Bucket="city", Key="some where/run/products/dtm.vrt")
    again = redone(stored_run, lambda: cityflow.run(small_city, stored_run, *WEST_AREA))
    assert again == {("export", "city")}
    assert contents(stored_run) == contents(west_run)


def test_another_wish_is_planned_and_leaves_nothing_stale(
    cityflow: Commands, small_city: SmallCity, stored_run: str
) -> None:
    only = ("--set", "export.formats=[obj]")
    words = (small_city.workflow, "--catalog", small_city.catalog, "--out", stored_run, *WEST_AREA, *only)
    assert "formats" in cityflow("plan", *words).out
    again = redone(stored_run, lambda: cityflow.run(small_city, stored_run, *WEST_AREA, *only))
    assert {stage for stage, _ in again} == {"export"}
    assert not [p for p in contents(stored_run) if p.endswith((".gml", ".jsonl"))]


def test_an_absent_bucket_is_named(cityflow: Commands, small_city: SmallCity, bucket: str) -> None:
    done = cityflow.run(small_city, "s3://no-such-bucket/run", ok=False)
    assert "s3://no-such-bucket/run" in done.err
    assert "→" in done.err
    assert "no run here" in cityflow("status", "s3://no-such-bucket/run").err
    arguments = (small_city.workflow, "--catalog", small_city.catalog, "--out", "s3://no-such-bucket/run")
    assert cityflow("plan", *arguments).code == 0
