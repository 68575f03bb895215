"""Runs of the small town that are interrupted, that lose a worker, or one of whose buildings kills its process: the bytes are the same."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from cluster.small_city import Commands, SmallCity, attempts, contents, newest, redone
from flow.processes import Cluster, environment, hear_ctrl_c

pytestmark = pytest.mark.cluster

POISON = "cluster.poison:segmentation_fault"


def test_a_poisonous_building_stops_nothing_and_is_rerun_alone(
    cityflow: Commands, small_run: Path, copied_run: Path
) -> None:
    unit = sorted(newest(copied_run, "reconstruct"))[7]
    done = cityflow("rerun", copied_run, "--unit", unit, "--set", f"reconstruct.methods=[{POISON}]")
    assert done.code == 0, done.text
    poisoned = newest(copied_run, "reconstruct")[unit]
    assert poisoned["status"] == "failed"
    assert "SIGSEGV" in poisoned["reason"]
    assert unit in done.text
    assert contents(copied_run) != contents(small_run)
    changed = redone(copied_run, lambda: cityflow("rerun", copied_run, "--failed", "--clear-overrides"))
    assert {stage for stage, _ in changed} == {"reconstruct", "export"}
    assert {u for stage, u in changed if stage == "reconstruct"} == {unit}
    assert contents(copied_run) == contents(small_run)


OTHER_CELLS = ("--set", "tiles.index_cell_m=37")


def test_an_interrupted_run_is_continued_on_workers_one_of_which_is_killed(
    cityflow: Commands, two_workers: Cluster, small_city: SmallCity, small_run: Path, tmp_path: Path
) -> None:
    """Interrupted on a worker of its own, it goes on with those of a scheduler, and the bytes are the same: with other cells of the index, too."""
    run = tmp_path / "run"
    interrupt(small_city, run, *OTHER_CELLS)
    done_before = attempts(run).keys()
    with two_workers.one_more() as victim, ThreadPoolExecutor(1) as driver:
        done = driver.submit(cityflow.run, small_city, run, *OTHER_CELLS)
        kill_halfway(victim, run, len(newest(small_run, "reconstruct")))
        done.result(timeout=600)
    again = {node for node, n in attempts(run).items() if n > 1 and node in done_before}
    assert not {node for node in again if node[0] in ("ingest", "reconstruct")}
    assert contents(run) == contents(small_run)


def started(city: SmallCity, run: Path, *more: str) -> subprocess.Popen[bytes]:
    """The command as a user starts it, in a process of its own."""
    command = [
        sys.executable,
        "-m",
        "cityflow",
        "run",
        str(city.workflow),
        "--catalog",
        str(city.catalog),
        "--out",
        str(run),
        *more,
    ]
    return subprocess.Popen(
        command, env=environment(), preexec_fn=hear_ctrl_c, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    )


def interrupt(city: SmallCity, run: Path, *more: str) -> None:
    """Begin a run, and end it by Ctrl-C as soon as a surface is there; that it ends within seconds: `flow/test_cluster.py`."""
    with started(city, run, "--workers", "1", *more) as driver:
        while not (run / "records" / "surface").is_dir():
            assert driver.poll() is None
            time.sleep(0.05)
        driver.send_signal(signal.SIGINT)
        driver.communicate(timeout=600)
    assert driver.returncode == 130


def kill_halfway(victim: subprocess.Popen[bytes], run: Path, buildings: int) -> None:
    """SIGKILL a worker when some buildings are done and others are not."""
    folder = run / "records" / "reconstruct"
    deadline = time.monotonic() + 400
    while time.monotonic() < deadline:
        done = sum(1 for _ in folder.iterdir()) if folder.is_dir() else 0
        if done >= 3:
            assert done < buildings
            victim.kill()
            return
        time.sleep(0.02)
    raise AssertionError("no building was ever done")
