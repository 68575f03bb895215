"""``python -m cityflow.flow.retire [SECONDS]``: a worker ends the unit that it has begun and begins no other. For the hook that a machine calls before it goes.

Scheduler and worker are those of ``DASK_SCHEDULER_ADDRESS`` and ``DASK_WORKER_NAME``, as the Dask operator sets them in the pods of workers. What the worker
has not begun goes to others when it ends.
"""

# mypy: disable-error-code="no-untyped-call"
from __future__ import annotations

import os
import sys
import time
from collections.abc import Mapping

from distributed import Client, Worker
from distributed.core import Status

POLL_S = 0.2
LONGEST_S = 600.0
CONNECT_S = 10.0


def retire(scheduler: str, name: str, longest_s: float = LONGEST_S) -> bool:
    """Whether the worker has nothing at hand any more; False where it still had after so long, or is not known."""
    with Client(scheduler, timeout=CONNECT_S, set_as_default=False) as client:
        found = [
            address
            for address, worker in client.scheduler_info(n_workers=-1)["workers"].items()
            if worker["name"] == name
        ]
        if not found:
            return False
        client.run(_pause, workers=found)
        end = time.monotonic() + longest_s
        while time.monotonic() < end:
            if not client.run(_at_hand, workers=found)[found[0]]:
                return True
            time.sleep(POLL_S)
    return False


def _pause(dask_worker: Worker) -> None:
    dask_worker.status = Status.paused


def _at_hand(dask_worker: Worker) -> int:
    """Tasks that run; a driver waits without a thread, and is not counted: another worker starts it anew."""
    return len(dask_worker.state.executing)


def main(arguments: list[str], environment: Mapping[str, str]) -> int:
    """The exit code: 0 when the worker may end."""
    longest_s = float(arguments[0]) if arguments else LONGEST_S
    return 0 if retire(environment["DASK_SCHEDULER_ADDRESS"], environment["DASK_WORKER_NAME"], longest_s) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:], os.environ))
