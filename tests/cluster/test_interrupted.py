"""Runs of the small town that are interrupted, that lose a worker, or one of whose buildings kills its process: the bytes are the same."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from cluster.small_city import Commands, SmallCity, attempts, contents, newest, redone
from flow.conftest import free_port
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


def test_an_interrupted_run_is_continued_on_two_workers_one_of_which_is_killed(
    small_city: SmallCity, small_run: Path, tmp_path: Path
) -> None:
    """Interrupted on a worker of its own, it goes on with those of a scheduler, and the bytes are the same."""
    run = tmp_path / "run"
    interrupt(small_city, run)
    done_before = attempts(run).keys()
    cluster = Cluster(tmp_path)
    try:
        cluster.start(free_port(), 2)
        with started(small_city, run, "--scheduler", cluster.address) as driver:
            kill_halfway(cluster.workers[1], run, len(newest(small_run, "reconstruct")))
            text, _ = driver.communicate(timeout=600)
        assert driver.returncode == 0, text.decode()
    finally:
        cluster.stop()
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


def interrupt(city: SmallCity, run: Path) -> None:
    """Begin a run, and end it by Ctrl-C as soon as a surface is there."""
    with started(city, run, "--workers", "1") as driver:
        while not (run / "records" / "surface").is_dir():
            assert driver.poll() is None
            time.sleep(0.05)
        driver.send_signal(signal.SIGINT)
        start = time.monotonic()
        driver.communicate(timeout=60)
    assert time.monotonic() - start < 15
    assert driver.returncode == 130


def kill_halfway(victim: subprocess.Popen[bytes], run: Path, buildings: int) -> None:
    """SIGKILL a worker when some buildings are done and others are not."""
    folder = run / "records" / "reconstruct"
    deadline = time.monotonic() + 400
    while time.monotonic() < deadline:
        done = sum(1 for _ in folder.iterdir()) if folder.is_dir() else 0
        if done >= 3:
            assert done < buildings
            os.kill(victim.pid, signal.SIGKILL)
            return
        time.sleep(0.02)
    raise AssertionError("no building was ever done")
