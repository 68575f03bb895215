"""Processes that begin before they are needed: ``python -m cityflow.cli.prepared``.

With ``workers N`` it holds a local cluster and prints its address; each line on its standard input has the workers make their child processes ready.
With ``rerun RUN`` it imports all that a rerun does, looks at the RUN as one would, and waits for the words of one `cityflow` command, as JSON on its
standard input. Both end when that is closed, and so with whoever started them.
"""

from __future__ import annotations

import json
import os
import sys
from contextlib import suppress
from typing import Any

STAGES = "cityflow.pipeline.pipeline:PIPELINE"
CHILD_MB = 450.0
"""What a child holds that has imported all stages and loaded their kernels."""
SHARE = 0.25
"""Of the free memory that children may take before they are needed."""
BEHIND = -(10**9)
"""Dask's priority of making children ready: those of tasks count down from 0."""


def hold_workers(count: int) -> None:
    """Print where a scheduler with so many workers is reached, 0: one for each core; until the standard input ends."""
    from cityflow.flow.cluster import connect

    with connect(None, count or os.cpu_count() or 1) as client:
        sys.stdout.write(f"{client.scheduler_info()['address']}\n")
        sys.stdout.flush()
        promised: list[Any] = []
        for _ in sys.stdin:
            promised[:] = ready(client)


def ready(client: Any) -> list[Any]:
    """Have the workers make their children ready for any stage, as many as memory is free for; what Dask promises."""
    import psutil

    from cityflow.flow.sandbox import prepare_child

    most = int(SHARE * psutil.virtual_memory().available / 2**20 / CHILD_MB)
    workers = sorted(client.scheduler_info(n_workers=-1)["workers"])[:most]
    return [client.submit(prepare_child, STAGES, workers=[w], pure=False, priority=BEHIND) for w in workers]


def wait_for_words(run: str) -> None:
    """Carry out the command that the standard input names; nothing where it ends without one."""
    from cityflow.core.quietly import quietly

    quietly(lambda: rehearse(run))
    from cityflow.cli import main

    words = sys.stdin.read()
    if words:
        sys.argv[1:] = json.loads(words)
        main()


def rehearse(run: str) -> None:
    """Choose a building as a rerun would: imports and first looks at a RUN take longer than all else of a small rerun. Nothing is written."""
    from cityflow.errors import CityflowError
    from cityflow.flow.exclusive import is_held
    from cityflow.flow.ledger import Ledger
    from cityflow.runs.run_folder import open_run
    from cityflow.stages import reconstruct
    from cityflow.workflow.chosen_part import Selection
    from cityflow.workflow.rerun import Rerun, chosen_units

    with suppress(CityflowError, OSError):
        wanted = open_run(run)
        if not is_held(wanted.store):
            with Ledger.open(wanted.store) as ledger:
                first = tuple(ledger.units(reconstruct.NAME))[:1]
                chosen_units(wanted, ledger, Rerun(Selection(stage=reconstruct.NAME, units=first)))


if __name__ == "__main__":
    if sys.argv[1] == "workers":
        hold_workers(int(sys.argv[2]))
    else:
        wait_for_words(sys.argv[2])
