"""How soon a run begins: its driver and the process of every worker load these modules first."""

from __future__ import annotations

import subprocess
import sys

SLOW = ("pandas", "geopandas", "pyogrio", "scipy.stats", "scipy.interpolate", "open3d", "matplotlib")
"""Together they take longer to load than all that a run needs; who reads a vector file or draws a picture loads what it wants."""


def test_a_run_loads_no_library_that_it_may_not_need() -> None:
    code = f"import sys, cityflow.workflow.run; print([m for m in {SLOW!r} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
