"""How soon the command line answers a typing error, and says the status of a run, against a bare interpreter in the same run.

python benchmarks/first_answer.py RUN [--repeats 5]

Processor time of user code, the least of some repeats, so that other work on the machine counts little; ratios are against `python -c pass` and against
the import of what a run needs. Asked for on a quiet machine: ≤ 0.5 s for typing errors, ≤ 1.5 s for `status`.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
WORKFLOW, FLIGHT = (str(ROOT / "workflows" / f"{name}.yaml") for name in ("lidar_city", "demo_flight"))


def user_seconds(command: list[str]) -> float:
    """Of a command that may fail: processor time of its user code."""
    before = os.times().children_user
    subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, stdin=subprocess.DEVNULL, check=False)
    return os.times().children_user - before


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", help="a finished run")
    parser.add_argument("--repeats", type=int, default=5)
    asked = parser.parse_args()
    cityflow = [sys.executable, "-m", "cityflow"]
    measured = {
        "bare interpreter": [sys.executable, "-c", "pass"],
        "import of what a run needs": [sys.executable, "-c", "import cityflow.workflow.run"],
        "mistyped workflow": [*cityflow, "run", "workflows/lidar.yaml"],
        "mistyped catalog": [*cityflow, "plan", WORKFLOW, "--catalog", "catalogs/delf"],
        "no catalog named": [*cityflow, "plan", FLIGHT],
        "a workflow for images, a catalog of LiDAR": [
            *cityflow,
            "plan",
            FLIGHT,
            "--catalog",
            str(ROOT / "catalogs" / "delft"),
        ],
        "mistyped key": [*cityflow, "plan", WORKFLOW, "--set", "surface.cel_m=1"],
        "mistyped value": [*cityflow, "plan", WORKFLOW, "--set", "surface.cell_m=wide"],
        "mistyped run": [*cityflow, "status", f"{asked.run}x"],
        "mistyped id": [*cityflow, "explain", asked.run, "no such unit"],
        "mistyped unit of a rerun": [*cityflow, "rerun", asked.run, "--unit", "no such unit"],
        "mistyped stage of a rerun": [*cityflow, "rerun", asked.run, "--stage", "no such stage"],
        "mistyped method": [*cityflow, "plan", WORKFLOW, "--set", "reconstruct.methods=levels"],
        "status": [*cityflow, "status", asked.run],
        "help": [*cityflow, "--help"],
    }
    user_seconds([*cityflow, "status", asked.run])  # notes what was asked, compiles modules
    user_seconds([*cityflow, "parameters"])
    least = {name: min(user_seconds(command) for _ in range(asked.repeats)) for name, command in measured.items()}
    bare, whole = least["bare interpreter"], least["import of what a run needs"]
    print("| | user s | of a bare interpreter | of importing what a run needs |\n|---|---|---|---|")
    for name, seconds in least.items():
        print(f"| {name} | {seconds:.2f} | {seconds / bare:.0f} | {seconds / whole:.2f} |")


if __name__ == "__main__":
    main()
