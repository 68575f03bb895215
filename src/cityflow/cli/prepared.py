"""Processes that begin before they are needed: ``python -m cityflow.cli.prepared``.

With ``workers N`` it holds a local cluster and prints its address. Without, it imports all that a rerun does, and waits for the words of one `cityflow`
command, as JSON on its standard input. Both end when that is closed, and so with whoever started them.
"""

from __future__ import annotations

import json
import os
import sys


def hold_workers(count: int) -> None:
    """Print where a scheduler with so many workers is reached, 0: one for each core; until the standard input ends."""
    from cityflow.flow.cluster import connect

    with connect(None, count or os.cpu_count() or 1) as client:
        sys.stdout.write(f"{client.scheduler_info()['address']}\n")
        sys.stdout.flush()
        sys.stdin.read()


def wait_for_words() -> None:
    """Carry out the command that the standard input names; nothing where it ends without one."""
    import cityflow.workflow.rerun  # noqa: F401 - its imports take longer than all else of a small rerun
    from cityflow.cli import main

    words = sys.stdin.read()
    if words:
        sys.argv[1:] = json.loads(words)
        main()


if __name__ == "__main__":
    if sys.argv[1:2] == ["workers"]:
        hold_workers(int(sys.argv[2]))
    else:
        wait_for_words()
