"""A run on a machine that has little memory, beside one on this machine: never more than there is, the same bytes.

    python benchmarks/small_memory.py WORKFLOW --catalog CATALOG --out FOLDER [--megabytes 1200] [--workers 2]

Linux does not enforce the limit that the second run is given (`prlimit --rss`), but Dask, and with it cityflow, takes it for the memory of the machine; nine
tenths of it are for tasks. The children of its workers are measured every 50 ms. FOLDER/whole is left as it is where it is finished.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import psutil

from kills import products, statuses, victims


def command(given: argparse.Namespace, out: Path) -> list[str]:
    """The run, as a user types it."""
    return [
        sys.executable, "-m", "cityflow", "run", given.workflow, "--catalog", given.catalog, "--out", str(out), "--workers", str(given.workers), "--quiet",
        "--allow-outside",
    ]  # fmt: skip


def measured(words: list[str], megabytes: int) -> list[float]:
    """Memory of all children that do tasks, MB, every 50 ms of the run."""
    running = subprocess.Popen(["prlimit", f"--rss={megabytes << 20}", *words])
    driver, found = psutil.Process(running.pid), list[float]()
    while running.poll() is None:
        time.sleep(0.05)
        total = 0.0
        with suppress(psutil.Error):
            for child in victims(driver, children=True).get("child", []):
                with suppress(psutil.Error):
                    total += child.memory_info().rss / (1 << 20)
        found.append(total)
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("workflow")
    parser.add_argument("--catalog", required=True)
    parser.add_argument("--out", required=True, type=Path)
    for name, value in (("megabytes", 1200), ("workers", 2)):
        parser.add_argument(f"--{name}", type=int, default=value)
    given = parser.parse_args()
    whole, small = given.out / "whole", given.out / "small"
    subprocess.run(command(given, whole), check=True)
    start = time.monotonic()
    found = np.array(measured(command(given, small), given.megabytes))
    expected, made = products(whole), products(small)
    other = sorted(path for path in expected.keys() | made.keys() if expected.get(path) != made.get(path))
    allowed = 0.9 * given.megabytes
    print(
        f"{time.monotonic() - start:.0f} s, {dict(statuses(small))}, {len(made)} products, {len(other)} differ {other[:3]}; "
        f"children at most {found.max():.0f} of {allowed:.0f} MB, above it {np.mean(found > allowed):.2%} of the time, in the median {np.median(found):.0f}"
    )


if __name__ == "__main__":
    main()
