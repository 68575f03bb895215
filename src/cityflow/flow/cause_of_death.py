"""What a child process died of."""

from __future__ import annotations

import signal
import subprocess


def cause_of_death(process: subprocess.Popen[bytes]) -> str:
    """For a record."""
    try:
        code = process.wait(timeout=5)
    except subprocess.TimeoutExpired:
        return "crashed: its channel broke"
    if code >= 0:
        return f"crashed: the process exited with code {code}"
    try:
        return f"crashed with signal {signal.Signals(-code).name}"
    except ValueError:
        return f"crashed with signal {-code}"
