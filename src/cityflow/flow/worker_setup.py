"""Preloaded by the workers of a local cluster: they ignore Ctrl-C, which the driver handles.

A terminal sends Ctrl-C to all processes of its group. The workers would die at once, each with a traceback, and their
units would look like crashes; so they ignore it and end when the driver closes the cluster.
"""

from __future__ import annotations

import signal
from typing import Any


async def dask_setup(worker: Any) -> None:  # noqa: ARG001 - the signature is Dask's
    """Called by Dask in the main thread of the worker's process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
