"""A reconstruction method that kills the Dask worker of one building, each time."""

from __future__ import annotations

import os
import signal

from cityflow.core.reconstruction import Candidate, Evidence
from cityflow.reconstruction.extruded import ExtrudedParameters, reconstruct

UNIT, WHILE = "GUILTY_UNIT", "GUILTY_WHILE"
"""Variables of the environment: the building, and the file that has to be there."""


def kill_worker(evidence: Evidence, parameters: object = None) -> Candidate:  # noqa: ARG001 - the signature of methods
    """An extruded block, for all others."""
    if evidence.id == os.environ.get(UNIT) and os.path.exists(os.environ.get(WHILE, "")):
        os.kill(os.getppid(), signal.SIGKILL)
        os.kill(os.getpid(), signal.SIGKILL)
    return reconstruct(evidence, ExtrudedParameters())
