"""A run whose workers are killed at random, beside an undisturbed one: the same bytes, all units done.

    python benchmarks/kills.py WORKFLOW --catalog CATALOG --out FOLDER [--kills 50] [--seed 1] [--workers 2] [--every 6] [--aoi BOUNDS]

Runs the command twice, into FOLDER/quiet (left as it is where it is finished) and FOLDER/killed. Of the second, a process is ended with SIGKILL
after every `--every` seconds on average: a Dask worker, with --children also the child that does its task (which counts as a crash of that task: it
is tried once more). Should the run end before all kills are spent, it is begun anew in a fresh folder with the rest.
"""

from __future__ import annotations

import argparse
import hashlib
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np
import psutil

from cityflow.flow.ledger import Ledger
from cityflow.flow.store import Store


def command(given: argparse.Namespace, out: Path) -> list[str]:
    """The run, as a user types it."""
    return [
        sys.executable, "-m", "cityflow", "run", given.workflow, "--catalog", given.catalog, "--out", str(out), "--workers", str(given.workers), "--quiet",
        "--allow-outside", *(["--aoi", given.aoi] if given.aoi else []),
    ]  # fmt: skip


def victims(driver: psutil.Process, children: bool) -> dict[str, list[psutil.Process]]:
    """Workers, and their children at work."""
    found: dict[str, list[psutil.Process]] = {"worker": [], "child": []}
    for process in driver.children(recursive=True):
        try:
            line = " ".join(process.cmdline())
            if "sys.path[:] = json.loads" in line:
                found["child"].append(process)
            elif "spawn_main" in line and process.children():
                found["worker"].append(process)
        except psutil.Error:
            continue
    return {kind: processes for kind, processes in found.items() if processes and (children or kind == "worker")}


def disturbed(given: argparse.Namespace, out: Path, kills: int, rng: np.random.Generator) -> tuple[int, Counter[str]]:
    """Exit code of the run, and what was killed."""
    running, killed = subprocess.Popen(command(given, out)), Counter[str]()
    driver = psutil.Process(running.pid)
    due = time.monotonic() + rng.exponential(given.every)
    while running.poll() is None:
        time.sleep(0.05)
        if killed.total() >= kills or time.monotonic() < due:
            continue
        try:
            found = victims(driver, given.children)
            if not found:
                continue
            kind = str(rng.choice(sorted(found)))
            found[kind][int(rng.integers(len(found[kind])))].send_signal(signal.SIGKILL)
        except psutil.Error:
            continue
        killed[kind] += 1
        due = time.monotonic() + rng.exponential(given.every)
    return running.returncode, killed


def products(run: Path) -> dict[str, str]:
    """Path → SHA-256 of every product."""
    files = sorted(p for p in (run / "products").rglob("*") if p.is_file())
    return {str(p.relative_to(run)): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}


def statuses(run: Path) -> Counter[str]:
    """Tasks by status of their newest record, and attempts beyond the first."""
    with Ledger.open(Store.open(str(run))) as ledger:
        rows = list(ledger.rows())
    return Counter([*(str(row.status.value) for row in rows), *("again" for row in rows if row.attempt > 1)])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("workflow")
    parser.add_argument("--catalog", required=True)
    parser.add_argument("--out", required=True, type=Path)
    for name, value in (("kills", 50), ("seed", 1), ("workers", 2)):
        parser.add_argument(f"--{name}", type=int, default=value)
    parser.add_argument("--aoi", default="", help="as of the command")
    parser.add_argument("--every", type=float, default=6.0, help="seconds between two kills, on average")
    parser.add_argument("--children", action="store_true", help="kill children of workers, too")
    given = parser.parse_args()
    quiet, killed_run = given.out / "quiet", given.out / "killed"
    start = time.monotonic()
    subprocess.run(command(given, quiet), check=True)
    print(f"undisturbed: {time.monotonic() - start:.0f} s, {dict(statuses(quiet))}")
    expected, rng, left = products(quiet), np.random.default_rng(given.seed), given.kills
    while left > 0:
        shutil.rmtree(killed_run, ignore_errors=True)
        start = time.monotonic()
        code, killed = disturbed(given, killed_run, left, rng)
        found = products(killed_run)
        other = sorted(path for path in expected.keys() | found.keys() if expected.get(path) != found.get(path))
        left -= killed.total()
        print(
            f"{dict(killed)} killed: {time.monotonic() - start:.0f} s, exit code {code}, {dict(statuses(killed_run))}, "
            f"{len(found)} products, {len(other)} differ {other[:3]}"
        )


if __name__ == "__main__":
    main()
