"""A Dask cluster of Slurm jobs by dask-jobqueue, as long as this program runs: ``python deploy/slurm.py --queue NAME --jobs 20``.

It prints the scheduler's address. Run it in a job of its own, or on a login node that allows it, with the environment of cityflow active; the workers get the
same one. ``pip install dask-jobqueue`` first. Beside it: ``cityflow submit … --scheduler ADDRESS``; what to expect: docs/deploy.md.
"""

# mypy: disable-error-code="no-untyped-call"
from __future__ import annotations

import argparse
import signal
import sys
import threading
from collections.abc import Sequence
from typing import Any

import dask

from cityflow.flow.cluster import CONFIG

DEATH_TIMEOUT_S = 300


def options(arguments: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--queue", help="Slurm's partition")
    parser.add_argument("--account", help="Slurm's account")
    parser.add_argument("--jobs", type=int, default=10, help="most jobs at a time")
    parser.add_argument("--cores", type=int, default=8, help="cores of a job: so many workers of one thread")
    parser.add_argument(
        "--memory-gb", type=int, default=52, help="memory of a job, GB; 6.5 a core suffice for all stages"
    )
    parser.add_argument("--hours", type=float, default=12.0, help="wall time of a job")
    parser.add_argument("--interface", help="network interface that all nodes have, e.g. ib0")
    parser.add_argument("--port", type=int, default=8786, help="port of the scheduler")
    return parser.parse_args(arguments)


def job_settings(given: argparse.Namespace) -> dict[str, Any]:
    """What `dask_jobqueue.SLURMCluster` takes.

    The nannies' memory limit is off, since cityflow limits tasks itself. Workers end some minutes before Slurm ends their job, each at a moment of its own,
    and hand back what they have not begun. Each offers its share of the job's memory, less what the workers take themselves.
    """
    minutes = round(60 * given.hours)
    offer = round(0.9e9 * given.memory_gb / given.cores)
    lifetime, stagger = max(minutes - 15, minutes // 2), min(10, minutes // 10)
    return {
        "queue": given.queue,
        "account": given.account,
        "cores": given.cores,
        "processes": given.cores,
        "memory": f"{given.memory_gb}GB",
        "walltime": f"{minutes // 60:02d}:{minutes % 60:02d}:00",
        "interface": given.interface,
        "death_timeout": DEATH_TIMEOUT_S,
        "worker_extra_args": [
            "--memory-limit",
            "0",
            "--resources",
            f"cityflow_memory={offer}",
            "--lifetime",
            f"{lifetime}m",
            "--lifetime-stagger",
            f"{stagger}m",
        ],
        "job_script_prologue": ["export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1"],
        "scheduler_options": {
            "port": given.port,
            "dashboard_address": ":8787",
            "interface": given.interface,
            "preload": ["cityflow.flow.run_page"],
        },
    }


def main(arguments: Sequence[str]) -> None:
    from dask_jobqueue import SLURMCluster

    given = options(arguments)
    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    with dask.config.set(CONFIG), SLURMCluster(**job_settings(given)) as cluster:
        cluster.adapt(minimum_jobs=1, maximum_jobs=given.jobs, wait_count=60)
        print(f"Scheduler: {cluster.scheduler_address}\nDashboard: {cluster.dashboard_link}", flush=True)  # noqa: T201
        stop.wait()


if __name__ == "__main__":
    main(sys.argv[1:])
