"""What may happen to a whole run, beside an undisturbed one: it says what is wrong, goes on when it is begun again, and leaves the same bytes.

    python benchmarks/faults.py WORKFLOW --catalog CATALOG --out FOLDER [--only scheduler guilty full read-only two] [--unit UNIT]

- `scheduler`: it is killed with half of the buildings done; another is started, and the same command given to it.
- `guilty`: a building (`--unit`) kills its worker each time; all others are modelled by the same method (`scenes/guilty.py`).
- `full`: RUN is on a file system (tmpfs, mounted here: needs the right to) with half of the room that a run takes; it is enlarged, and the command repeated.
- `read-only`: half-way, every write into RUN fails as on a file system mounted read-only (`scenes/read_only`), in all processes; then no more.
- `two`: two whole drivers begin in the same RUN on an object store (moto) at the same time.

FOLDER/quiet and FOLDER/quiet-guilty are left as they are where these runs are finished.
"""

# mypy: disable-error-code="no-untyped-call"
from __future__ import annotations

import argparse
import os
import shutil
import socket
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from distributed import Client

from cityflow.flow.ledger import Ledger
from cityflow.flow.store import Store
from scenes.guilty import UNIT, WHILE
from store_outage import products, server

HERE = Path(__file__).parent
BY_GUILTY = ("--set", "reconstruct.methods=[scenes.guilty:kill_worker]")
S3 = {"AWS_ACCESS_KEY_ID": "a", "AWS_SECRET_ACCESS_KEY": "b", "AWS_DEFAULT_REGION": "us-east-1"}


class Town:
    """The survey, and the command that runs it."""

    def __init__(self, given: argparse.Namespace) -> None:
        self.out: Path = given.out
        self.unit: str = given.unit
        self.workers = str(given.workers)
        self._workflow, self._catalog = given.workflow, given.catalog

    def start(
        self, run: str | Path, *more: str, environment: Mapping[str, str] | None = None, first: str = ""
    ) -> subprocess.Popen[str]:
        command = [
            sys.executable, "-m", "cityflow", "run", self._workflow, "--catalog", self._catalog, "--out", str(run), "--quiet", "--allow-outside", *more,
        ]  # fmt: skip
        path = os.pathsep.join(p for p in (first, str(HERE), os.environ.get("PYTHONPATH", "")) if p)
        environment = {**os.environ, **(environment or {}), "PYTHONPATH": path}
        return subprocess.Popen(command, env=environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)

    def quiet(self, name: str, *more: str) -> Path:
        """The undisturbed run."""
        run = self.out / name
        code, text = ended(self.start(run, "--workers", self.workers, *more))
        assert code == 0, text
        return run


def ended(running: subprocess.Popen[str]) -> tuple[int, str]:
    """Exit code, and the last words."""
    text, _ = running.communicate(timeout=3000)
    return running.returncode, " ".join(text.split())[-400:]


def compared(name: str, expected: Path, run: str | Path) -> None:
    one, other = products(Store.open(str(expected))), products(Store.open(str(run)))
    differ = sorted(path for path in one.keys() | other.keys() if one.get(path) != other.get(path))
    print(f"{name}: {statuses(run)}; {len(other)} products, {len(differ)} differ {differ[:3]}", flush=True)


def statuses(run: str | Path) -> str:
    """Tasks by status of their newest record, and attempts beyond the first."""
    with Ledger.open(Store.open(str(run))) as ledger:
        rows = list(ledger.rows())
    counts = Counter([*(row.status.value for row in rows), *("again" for row in rows if row.attempt > 1)])
    return ", ".join(f"{n} {word}" for word, n in counts.items())


def half_way(running: subprocess.Popen[str], run: Path, stage: str = "surface") -> None:
    """Waits until the first task of a stage has a record."""
    while running.poll() is None and not (run / "records" / stage).is_dir():
        time.sleep(0.05)


@contextmanager
def scheduler(folder: Path) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """A scheduler and a worker, and their processes."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    address, dask = f"tcp://127.0.0.1:{port}", [sys.executable, "-m", "dask"]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join((str(HERE), os.environ.get("PYTHONPATH", "")))}
    worker = ["worker", address, "--nthreads", "1", "--no-dashboard", "--local-directory", str(folder)]
    commands = [["scheduler", "--host", "127.0.0.1", "--port", str(port), "--no-dashboard"], worker]
    found = [subprocess.Popen([*dask, *c], env=environment, stderr=subprocess.DEVNULL) for c in commands]
    try:
        with Client(address, timeout=300, set_as_default=False) as client:
            client.wait_for_workers(1, timeout=300)
        yield address, found
    finally:
        for process in reversed(found):
            process.terminate()
            process.wait()


def killed_scheduler(town: Town) -> None:
    run = town.out / "scheduler"
    with scheduler(town.out) as (address, processes):
        running = town.start(run, "--scheduler", address)
        half_way(running, run, "reconstruct")
        processes[0].kill()
        code, text = ended(running)
    print(f"scheduler killed: exit code {code}, {statuses(run)}: {text}", flush=True)
    with scheduler(town.out) as (address, _):
        code, text = ended(town.start(run, "--scheduler", address))
    compared(f"another scheduler: exit code {code} {text}", town.quiet("quiet"), run)


def guilty_building(town: Town) -> None:
    expected, run, mark = town.quiet("quiet-guilty", *BY_GUILTY), town.out / "guilty", town.out / "guilty while"
    mark.touch()
    environment = {UNIT: town.unit, WHILE: str(mark)}
    start = time.monotonic()
    code, _ = ended(town.start(run, "--workers", town.workers, *BY_GUILTY, environment=environment))
    hulls = [{r.unit: (r.status, r.outputs) for r in _records(r, "reconstruct")} for r in (expected, run)]
    differ = [unit for unit in hulls[0] if hulls[0][unit] != hulls[1].get(unit)]
    (record,) = (r for r in _records(run, "reconstruct") if r.unit == town.unit)
    print(
        f"guilty: exit code {code}, {time.monotonic() - start:.0f} s, {statuses(run)}; {record.status}: {record.reason}"
    )
    print(f"models that differ: {differ}", flush=True)
    mark.unlink()
    again = [sys.executable, "-m", "cityflow", "rerun", str(run), "--failed", "--workers", town.workers, "--trust"]
    path = os.pathsep.join((str(HERE), os.environ.get("PYTHONPATH", "")))
    code = subprocess.run(
        again, env={**os.environ, "PYTHONPATH": path}, stdout=subprocess.DEVNULL, check=False
    ).returncode
    compared(f"rerun of the failed: exit code {code}", expected, run)


def _records(run: Path, stage: str) -> list:  # type: ignore[type-arg]
    with Ledger.open(Store.open(str(run))) as ledger:
        return [r for r in ledger.records() if r.stage == stage]


def full_disk(town: Town) -> None:
    place, expected = town.out / "tmpfs", town.quiet("quiet")
    taken = sum(p.stat().st_size for p in expected.rglob("*") if p.is_file())
    place.mkdir(exist_ok=True)
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={taken // 2}", "tmpfs", str(place)], check=True)
    try:
        code, text = ended(town.start(place / "run", "--workers", town.workers))
        print(f"full at {taken / 2e6:.1f} MB: exit code {code}: {text}", flush=True)
        subprocess.run(["mount", "-o", f"remount,size={4 * taken}", str(place)], check=True)
        print(f"before the next run: {statuses(place / 'run')}", flush=True)  # a full disk takes no index
        code, text = ended(town.start(place / "run", "--workers", town.workers))
        compared(f"enlarged: exit code {code} {text}", expected, place / "run")
    finally:
        subprocess.run(["umount", str(place)], check=True)


def read_only(town: Town) -> None:
    run, mark = town.out / "read-only", town.out / "read-only while"
    environment, first = {"READ_ONLY_WHILE": str(mark)}, str(HERE / "scenes" / "read_only")
    running = town.start(run, "--workers", town.workers, environment=environment, first=first)
    half_way(running, run)
    mark.touch()
    code, text = ended(running)
    print(f"read-only: exit code {code}, {statuses(run)}: {text}", flush=True)
    mark.unlink()
    code, text = ended(town.start(run, "--workers", town.workers, environment=environment, first=first))
    compared(f"writable again: exit code {code} {text}", town.quiet("quiet"), run)


def two_drivers(town: Town) -> None:
    expected = town.quiet("quiet")
    with server(5557) as url:
        os.environ.update(S3, AWS_ENDPOINT_URL=url)
        import boto3

        boto3.client("s3").create_bucket(Bucket="city")
        drivers = [town.start("s3://city/run", "--workers", "1") for _ in range(2)]
        for k, (code, text) in enumerate(map(ended, drivers)):
            print(f"driver {k + 1} of two: exit code {code} {text}", flush=True)
        compared("two drivers", expected, "s3://city/run")


FAULTS: Mapping[str, Callable[[Town], None]] = {
    "scheduler": killed_scheduler, "guilty": guilty_building, "full": full_disk, "read-only": read_only, "two": two_drivers,
}  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("workflow")
    parser.add_argument("--catalog", required=True)
    parser.add_argument("--out", required=True, type=Path)
    parser.add_argument("--only", nargs="+", choices=FAULTS, default=list(FAULTS))
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--unit", default="u00005", help="the building that kills its worker")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    town = Town(given)
    for name in given.only:
        for old in (given.out / name, given.out / f"{name} while"):
            shutil.rmtree(old, ignore_errors=True)
        FAULTS[name](town)


if __name__ == "__main__":
    main()
