"""A driver on the scheduler's side: a Dask task that starts it as a process of its worker, and waits.

The task belongs to no client, so it outlives the one that submits it. Where its worker dies, Dask runs it again on another, and the new driver continues
from the records. It gives its thread back while it waits, and the driver is a process of its own: its memory and its lock are not the worker's.
"""

# mypy: disable-error-code="no-untyped-call"
from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from dataclasses import replace
from typing import IO, Any

from distributed import Client, Scheduler, fire_and_forget, get_worker, secede

from cityflow.core.credentials import without_credentials
from cityflow.core.object_store import be_patient
from cityflow.errors import RunError
from cityflow.flow.driver_note import DriverNote, Phase, read_note, write_note
from cityflow.flow.exclusive import is_held
from cityflow.flow.spawner import SPAWNER
from cityflow.flow.store import Store

LOG = "driver.log"
LOG_BYTES = 200_000
"""Of what a driver prints, the end is kept in the RUN."""
LOG_EVERY_S = 10.0
POLL_S = 0.2
ARRIVES_S = 20.0
FREE_S = 120.0
"""A file server may take so long to give back the lock of a host that is gone."""
STARTS = 4
"""A driver that is killed again and again, for memory perhaps, is given up."""
PRIORITY = 1000
_COMMAND = (
    "import sys, json; sys.path[:] = json.loads(sys.argv[1]); "
    "from cityflow.flow.child import die_with_parent; die_with_parent(); "
    "import importlib; sys.exit(importlib.import_module(sys.argv[2]).main(json.load(sys.stdin)))"
)


def submit_driver(client: Client, store: Store, request: str, module: str, given: Mapping[str, Any]) -> None:
    """Hand a driver to the scheduler; returns as soon as it has it.

    Parameters
    ----------
    request : names the command; the driver gives it to its `Heartbeat`
    module : its function ``main(given) -> exit code`` is the driver; ``given["scheduler"]`` is filled in
    """
    write_note(store, DriverNote(request, Phase.SUBMITTED, told=time.time()))
    key = driver_key(request)
    future = client.submit(
        drive, store, request, module, dict(given), key=key, pure=False, retries=0, priority=PRIORITY
    )
    fire_and_forget(future)
    end = time.monotonic() + ARRIVES_S
    while not client.run_on_scheduler(knows, key):
        if time.monotonic() > end:
            raise RunError(
                "the scheduler does not take the run", where=store.root, remedy="see its log; submit it again"
            )
        time.sleep(POLL_S)


def driver_key(request: str) -> str:
    return f"cityflow_driver-{request[:12]}"


def knows(key: str, dask_scheduler: Scheduler) -> bool:
    """Runs on the scheduler: whether a driver waits there or is at work."""
    return key in dask_scheduler.tasks


def drive(store: Store, request: str, module: str, given: Mapping[str, Any]) -> int:
    """Runs on a worker: start the driver, and wait for its end; what it had no time to say goes into the note."""
    worker = get_worker()
    secede()
    be_patient()
    _await_lock(store)
    environment = {**os.environ, **_tls(worker.security)}
    for _ in range(STARTS):
        with tempfile.TemporaryFile() as printed:
            code = _ended(
                store, _started(module, {**given, "scheduler": worker.scheduler.address}, environment, printed), printed
            )
            text = _tail(printed).decode(errors="replace").strip()
        if code >= 0:
            break
        text = f"its driver was killed by signal {-code} {STARTS} times"
    note = read_note(store)
    if note is not None and note.request == request and note.is_open:
        last = text.splitlines()[-1] if text else f"exit code {code}"
        phase = Phase.FAILED if code else Phase.ENDED  # one that follows another may find nothing left to do
        write_note(store, replace(note, phase=phase, text=last.removeprefix("cityflow: ")))
    return code


def _await_lock(store: Store) -> None:
    end = time.monotonic() + FREE_S
    while is_held(store) and time.monotonic() < end:
        time.sleep(POLL_S)


def _started(
    module: str, given: Mapping[str, Any], environment: Mapping[str, str], printed: IO[bytes]
) -> subprocess.Popen[bytes]:
    """The driver; what it is given may hold passwords, and everybody on the machine can read the command line of a process."""
    path = json.dumps([p or os.getcwd() for p in sys.path])
    command = [sys.executable, "-c", _COMMAND, path, module]
    with tempfile.TemporaryFile() as told:
        told.write(json.dumps(given).encode())
        told.seek(0)
        return SPAWNER.call(
            lambda: subprocess.Popen(
                command, stdin=told, stdout=printed, stderr=subprocess.STDOUT, env=environment, start_new_session=True
            )
        )


def _ended(store: Store, process: subprocess.Popen[bytes], printed: IO[bytes]) -> int:
    """Exit code of the driver; what it prints is written into the RUN meanwhile."""
    written, due = 0, 0.0
    while True:
        code = process.poll()
        size = os.fstat(printed.fileno()).st_size
        if size != written and (code is not None or time.monotonic() >= due):
            store.write_bytes(LOG, _tail(printed))
            written, due = size, time.monotonic() + LOG_EVERY_S
        if code is not None:
            return code
        time.sleep(POLL_S)


def _tail(printed: IO[bytes]) -> bytes:
    """The end of what it prints, without users, passwords and keys of addresses: a traceback may hold some."""
    size = os.fstat(printed.fileno()).st_size
    text = os.pread(printed.fileno(), LOG_BYTES, max(0, size - LOG_BYTES)).decode(errors="replace")
    return without_credentials(text).encode()


def _tls(security: Any) -> dict[str, str]:
    """The worker's certificates for the driver's client: Dask reads them from the environment."""
    files = {
        "CA_FILE": security.tls_ca_file, "CLIENT__CERT": security.tls_worker_cert, "CLIENT__KEY": security.tls_worker_key,
    }  # fmt: skip
    return {f"DASK_DISTRIBUTED__COMM__TLS__{name}": str(file) for name, file in files.items() if file}
