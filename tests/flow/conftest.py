from __future__ import annotations

import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from itertools import count
from pathlib import Path
from urllib.request import urlopen

import dask
import pytest
from distributed import Client

from cityflow.flow.cluster import connect
from cityflow.flow.ledger import Ledger
from cityflow.flow.store import Store


@pytest.fixture
def store(tmp_path: Path) -> Store:
    return Store.open(tmp_path / "run")


@pytest.fixture
def ledger(store: Store) -> Iterator[Ledger]:
    with Ledger.open(store) as ledger:
        yield ledger


@pytest.fixture(scope="session")
def client() -> Iterator[Client]:
    """Of two workers here. One death is enough for their scheduler to give up on a task: the tests need not wait for four."""
    with dask.config.set({"distributed.scheduler.allowed-failures": 0}), connect(None, 2) as client:
        yield client


PORTS = count(20000 + 40 * (os.getpid() % 300))
"""Below those that the system gives to whoever asks for any, and others in each process of the tests."""


def free_port() -> int:
    """A port that nobody else takes before it is used, be it minutes later."""
    for port in PORTS:
        with socket.socket() as probe, suppress(OSError):
            probe.bind(("127.0.0.1", port))
            return port
    raise AssertionError("unreachable")


@pytest.fixture(scope="session")
def s3_endpoint() -> Iterator[str]:
    """A real S3 server over HTTP, in a process of its own."""
    url = f"http://127.0.0.1:{(port := free_port())}"
    process = subprocess.Popen(
        [sys.executable, "-m", "moto.server", "-p", str(port)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        deadline = time.monotonic() + 60
        while True:
            try:
                urlopen(url, timeout=1).close()
                break
            except OSError:
                assert time.monotonic() < deadline, "moto did not start"
                time.sleep(0.1)
        yield url
    finally:
        process.kill()
        process.wait()


@pytest.fixture
def s3_url(s3_endpoint: str, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> str:
    """A new bucket's URL; endpoint and keys are in the environment."""
    for name, value in {
        "AWS_ENDPOINT_URL": s3_endpoint,
        "AWS_ACCESS_KEY_ID": "test",
        "AWS_SECRET_ACCESS_KEY": "test",
        "AWS_DEFAULT_REGION": "us-east-1",
    }.items():
        monkeypatch.setenv(name, value)
    import boto3

    bucket = f"bucket-{os.getpid()}-{time.monotonic_ns()}"
    boto3.client("s3").create_bucket(Bucket=bucket)
    return f"s3://{bucket}"
