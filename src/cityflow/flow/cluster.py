"""A Dask client: to a scheduler by address, or to a cluster of local processes."""

# mypy: disable-error-code="no-untyped-call"
from __future__ import annotations

import asyncio
import gc
import logging
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib.metadata import version
from pathlib import Path
from typing import Any

import dask
from distributed import Client, LocalCluster

import cityflow
from cityflow.core.dask_address import NO_ANSWER, NO_ANSWER_REMEDY
from cityflow.errors import RunError
from cityflow.flow.room import forget

DASHBOARD_PORT = 8787
CONNECT_S = 10.0
WORKERS_S = 20.0
CLOSE_S = 5.0
WORKER_CLOSE_S = 0.5

CONFIG: dict[str, Any] = {
    # All tasks in flight go to the workers at once: their number is bounded by the driver already, and the default
    # queue of the scheduler costs five times as long for tasks of milliseconds.
    "distributed.scheduler.worker-saturation": "inf",
    "distributed.comm.timeouts.connect": "10s",
    "distributed.comm.timeouts.tcp": "60s",
    "distributed.admin.tick.limit": "1h",
    "distributed.worker.profile.enabled": False,
}
"""Dask settings of driver and local cluster; ``deploy/`` gives the same to schedulers and workers elsewhere."""


@contextmanager
def connect(scheduler: str | None, workers: int, *, connect_s: float = CONNECT_S) -> Iterator[Client]:
    """A client, closed at the end of the block; a local cluster ends with it.

    It is not made Dask's default: a stage's or reader's own arrays never go to the cluster behind their back.

    Parameters
    ----------
    scheduler : address (``tcp://host:8786``), or None for a cluster of `workers` local processes
    workers : number of local processes with one thread each; of no meaning with an address

    Raises
    ------
    RunError : nobody answers there, no worker is connected, or the workers have other versions
    """
    with dask.config.set(CONFIG):
        if scheduler is None:
            with _local(workers) as client:
                yield client
        else:
            with _remote(scheduler, connect_s) as client:
                yield client


@contextmanager
def _local(workers: int) -> Iterator[Client]:
    # The nanny's memory limit is off: it would kill a worker and with it the innocent tasks beside the greedy one.
    # The worker itself holds no arrays; they live in the sandbox's child, which has its own limit per task.
    try:
        cluster = LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            memory_limit=0,
            dashboard_address=f"127.0.0.1:{_free_port(DASHBOARD_PORT)}",
            silence_logs=logging.CRITICAL,
            preload=["cityflow.flow.worker_setup"],
        )
    except RuntimeError as error:
        remedy = "run the command again; if it stays so, look at the machine's memory or take fewer --workers"
        raise RunError("a worker process died while it started", where="local cluster", remedy=remedy) from error
    client = Client(cluster, set_as_default=False)
    folders = {Path(nanny.local_directory) for nanny in cluster.workers.values()}
    try:
        yield client
    finally:
        # A task that runs on after Ctrl-C must not hold up the end; the processes die with this one at the latest.
        with suppress(TimeoutError):
            cluster.sync(_end_workers, cluster)
            client.close(timeout=CLOSE_S)
            cluster.close(timeout=CLOSE_S)
        for folder in folders:
            forget(folder, cluster.scheduler_address)


async def _end_workers(cluster: LocalCluster) -> None:
    """End the workers soon: asked politely, they wait for their threads, and a unit may run for many minutes.

    They hold nothing: what has a record is in the store, what has none runs again.
    """
    closing = [nanny.close(timeout=WORKER_CLOSE_S) for nanny in cluster.workers.values()]
    await asyncio.gather(*closing, return_exceptions=True)


@contextmanager
def _remote(address: str, connect_s: float) -> Iterator[Client]:
    # A connection that is closed while something is sent is told with a traceback, which says nothing to whoever pressed Ctrl-C
    logging.getLogger("distributed.batched").setLevel(logging.WARNING)
    client = _client(address, connect_s)
    if client is None:
        # What is left of it closes itself when it is collected; if that happened while another client starts, both would wait for ever
        gc.collect()
        raise RunError(NO_ANSWER, where=address, remedy=NO_ANSWER_REMEDY)
    try:
        _check_workers(client, address)
        yield client
    finally:
        client.close(timeout=CLOSE_S)


def _client(address: str, connect_s: float) -> Client | None:
    """One that is connected; None where nobody answers."""
    try:
        return Client(address, timeout=connect_s, set_as_default=False)
    except (OSError, TimeoutError, ValueError, TypeError):
        return None  # TypeError: what Dask raises where it has no certificates for a tls:// address


def _check_workers(client: Client, address: str) -> None:
    try:
        client.wait_for_workers(1, timeout=WORKERS_S)
    except TimeoutError as error:
        remedy = f"start at least one: dask worker {address} --nthreads 1"
        raise RunError("the scheduler has no workers", where=address, remedy=remedy) from error
    ours = versions()
    try:
        found = client.run(versions)
    except ModuleNotFoundError as error:
        raise RunError(f"a worker lacks a package: {error}", where=address, remedy=_same()) from error
    for worker, theirs in sorted(found.items()):
        differing = [
            f"{name} {theirs.get(name)} instead of {ours[name]}" for name in ours if theirs.get(name) != ours[name]
        ]
        if differing:
            raise RunError(f"other versions than here: {', '.join(differing)}", where=worker, remedy=_same())


def threads_of(client: Client) -> int:
    """Threads of all workers, each of which runs one task."""
    return sum(client.nthreads().values())


def versions() -> dict[str, str]:
    """What driver and workers must have in common."""
    return {
        "cityflow": cityflow.__version__,
        "python": f"{sys.version_info.major}.{sys.version_info.minor}",
        "dask": version("dask"),
    }


def _same() -> str:
    return f"install cityflow {cityflow.__version__} with the same Python and constraints on all workers"


def _free_port(wanted: int) -> int:
    """`wanted` where it is free, else 0 (any)."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", wanted))
        except OSError:
            return 0
    return wanted
