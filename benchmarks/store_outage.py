"""A run into an object store that answers 503 for a while, beside one into a folder: the same bytes, no unit failed or run twice.

    python benchmarks/store_outage.py WORKFLOW --catalog CATALOG --out FOLDER [--seconds 60] [--after 40] [--workers 2]

An S3 server (moto, in memory) stands behind a proxy that fails `--seconds` long as soon as `--after` records are there. FOLDER/folder is left as it is
where that run is finished.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.request import urlopen

from cityflow.flow.ledger import Ledger
from cityflow.flow.store import Store
from scenes.failing_proxy import FailingProxy, failing_proxy

BUCKET = "city"


@contextmanager
def server(port: int) -> Iterator[str]:
    """An S3 server in a process of its own."""
    command = [sys.executable, "-m", "moto.server", "-p", str(port)]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    url = f"http://127.0.0.1:{port}"
    try:
        for _ in range(600):
            try:
                urlopen(url, timeout=1).close()
                break
            except OSError:
                time.sleep(0.1)
        yield url
    finally:
        process.kill()
        process.wait()


def command(given: argparse.Namespace, out: str) -> list[str]:
    """The run, as a user types it."""
    return [
        sys.executable, "-m", "cityflow", "run", given.workflow, "--catalog", given.catalog, "--out", out, "--workers", str(given.workers), "--quiet",
        "--allow-outside",
    ]  # fmt: skip


def products(store: Store) -> dict[str, str]:
    """Path → SHA-256 of every product."""
    return {path: hashlib.sha256(store.read_bytes(path)).hexdigest() for path in store.find("products")}


def statuses(store: Store) -> Counter[str]:
    """Tasks by status of their newest record, attempts beyond the first, and tries that were made again."""
    with Ledger.open(store) as ledger:
        records = list(ledger.records())
    more = [*("again" for r in records if r.attempt > 1), *("tried twice" for r in records if r.traceback)]
    return Counter([*(str(r.status) for r in records), *more])


def interrupted(given: argparse.Namespace, proxy: FailingProxy, url: str) -> int:
    """Exit code of the run whose store fails."""
    store, running = Store.open(url), subprocess.Popen(command(given, url))
    while running.poll() is None and len(store.find("records")) < given.after:
        time.sleep(0.5)
    print(f"the store fails for {given.seconds:g} s, {len(store.find('records'))} records")
    proxy.fail(given.seconds)
    return running.wait()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("workflow")
    parser.add_argument("--catalog", required=True)
    parser.add_argument("--out", required=True, type=Path)
    parser.add_argument("--seconds", type=float, default=60.0)
    for name, value in (("after", 40), ("workers", 2), ("port", 5555)):
        parser.add_argument(f"--{name}", type=int, default=value)
    given = parser.parse_args()
    folder = str(given.out / "folder")
    subprocess.run(command(given, folder), check=True)
    with server(given.port) as behind, failing_proxy(behind) as proxy:
        os.environ.update(
            AWS_ENDPOINT_URL=proxy.url, AWS_ACCESS_KEY_ID="a", AWS_SECRET_ACCESS_KEY="b", AWS_DEFAULT_REGION="us-east-1"
        )
        import boto3

        boto3.client("s3").create_bucket(Bucket=BUCKET)
        start = time.monotonic()
        code = interrupted(given, proxy, f"s3://{BUCKET}/run")
        store = Store.open(f"s3://{BUCKET}/run")
        expected, found = products(Store.open(folder)), products(store)
        other = sorted(path for path in expected.keys() | found.keys() if expected.get(path) != found.get(path))
        print(
            f"{time.monotonic() - start:.0f} s, exit code {code}, {dict(statuses(store))}, {len(found)} products, {len(other)} differ {other[:3]}; "
            f"answers {dict(proxy.answered)}"
        )


if __name__ == "__main__":
    main()
