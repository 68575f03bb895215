"""The whole chain on the real survey of Delft, as a user runs it: commands, processes, and processes that die.

The whole town is run once; its middle, where four tiles meet, is run again and again, and must be left with the same bytes each time.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
import trimesh

from cityflow.core.written_geometry import GeometryKind
from cityflow.evaluation.written import faulty
from cluster.small_city import Commands
from flow.conftest import free_port
from flow.processes import hear_ctrl_c
from written_products import written

ROOT = Path(__file__).parents[2]
WORKFLOW = ROOT / "workflows" / "lidar_city.yaml"
CATALOG = ROOT / "catalogs" / "delft"
BUILDINGS = 160
MIDDLE = "84950,447460,85020,447530"
POISON = "cluster.poison:segmentation_fault"

pytestmark = pytest.mark.cluster


def environment() -> dict[str, str]:
    return {**os.environ, "COLUMNS": "200"}


def product_digests(run: Path) -> dict[str, str]:
    """SHA-256 of everything that must not depend on who did what when."""
    files = [p for folder in ("products", "surface.zarr") for p in sorted((run / folder).rglob("*")) if p.is_file()]
    return {str(p.relative_to(run)): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}


def records_of(run: Path, stage: str) -> dict[str, list[dict[str, object]]]:
    """Unit → its records, oldest first."""
    folders = sorted((run / "records" / stage).iterdir())
    return {f.name: [json.loads(p.read_bytes()) for p in sorted(f.glob("*.json"))] for f in folders}


def attempts(run: Path) -> dict[tuple[str, str], int]:
    stages = [p.name for p in (run / "records").iterdir()]
    return {(stage, unit): len(found) for stage in stages for unit, found in records_of(run, stage).items()}


@contextmanager
def processes(*commands: list[str]) -> Iterator[list[subprocess.Popen[bytes]]]:
    started = [
        subprocess.Popen(
            c, env=environment(), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
        )
        for c in commands
    ]
    try:
        yield started
    finally:
        for process in started:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished run of the town, on one worker; read only."""
    run = tmp_path_factory.mktemp("reference") / "run"
    done = subprocess.run(
        [sys.executable, "-m", "cityflow", "run", WORKFLOW, "--catalog", CATALOG, "--out", run, "--workers", "1"],
        capture_output=True, text=True, env=environment(), timeout=600, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return run


@pytest.fixture(scope="module")
def middle(cityflow: Commands, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished run of the middle, on the two workers that the tests share; read only."""
    run = tmp_path_factory.mktemp("middle") / "run"
    done = cityflow(*of_the_middle(run))
    assert done.code == 0, done.text
    return run


def of_the_middle(run: Path) -> tuple[str, ...]:
    return "run", str(WORKFLOW), "--catalog", str(CATALOG), "--out", str(run), "--aoi", MIDDLE


def test_every_outline_leaves_a_record_and_a_solid(reference: Path) -> None:
    records = records_of(reference, "reconstruct")
    assert len(records) == BUILDINGS
    lines = (reference / "products" / "city.city.jsonl").read_text().splitlines()
    features = [json.loads(line) for line in lines[1:]]
    buildings = [o for f in features for o in f["CityObjects"].values() if o["type"] == "Building"]
    assert len(buildings) == BUILDINGS
    assert all({g["lod"] for g in b["geometry"]} >= {"0", "1.2", "1.3", "2.2"} for b in buildings)


@pytest.mark.parametrize("form", ["cityjson", "citygml"])
def test_every_exported_geometry_keeps_the_rules(reference: Path, form: str) -> None:
    """Solids, surfaces beyond walls, footprints and terrain, read back from the files."""
    read = [g for path in sorted((reference / "products" / form).iterdir()) for g in written(path)]
    kinds = Counter(g.kind for g in read)
    assert kinds[GeometryKind.SOLID] >= 2 * BUILDINGS
    assert kinds[GeometryKind.COMPOSITE_SURFACE] > 0
    assert [(f.geometry.owner, f.geometry.lod, str(f.faults[0])) for f in faulty(read)] == []


def test_every_object_of_obj_and_every_triangle_of_3d_tiles_keeps_the_rules(reference: Path) -> None:
    read = [g for path in sorted((reference / "products" / "obj").glob("*.obj")) for g in written(path)]
    assert len(read) >= BUILDINGS
    assert [(f.geometry.owner, str(f.faults[0])) for f in faulty(read)] == []
    for path in sorted((reference / "products" / "tiles3d").rglob("*.glb")):
        for mesh in trimesh.load_scene(str(path), process=False).geometry.values():
            edges = mesh.triangles - np.roll(mesh.triangles, 1, axis=1)
            heights = 2 * mesh.area_faces / np.linalg.norm(edges, axis=2).max(axis=1)
            assert heights.min() > 0.001, f"{path}: a triangle without area"


def test_no_model_that_is_far_off_is_called_good(reference: Path) -> None:
    """Both were done, with an RMSE of 4.0 and 3.2 m over all points and a claim of centimetres."""
    found = {unit: known[-1]["result"] for unit, known in records_of(reference, "reconstruct").items()}
    results = {unit: r for unit, r in found.items() if isinstance(r, dict)}
    assert len(results) == BUILDINGS
    assert {r["verdict"] for r in results.values()} <= {"good", "look", "poor"}
    assert "good" not in (results[f"0503100000{n}"]["verdict"] for n in ("026157", "022859"))
    good = [r for r in results.values() if r["verdict"] == "good"]
    assert len(good) > 0.15 * BUILDINGS
    assert min(r["share_explained"] for r in good) > 0.95
    # echoes of façades and what stands above or below are in no figure of the roof: 109 of the units were over half a metre with them
    assert sum(r["rmse"] > 0.5 for r in results.values() if r["rmse"] is not None) < 0.2 * BUILDINGS


def test_an_area_of_interest_gives_the_same_buildings(reference: Path, middle: Path) -> None:
    mine, whole = records_of(middle, "reconstruct"), records_of(reference, "reconstruct")
    assert 20 < len(mine) < BUILDINGS / 2
    assert {u: outputs_of(found[-1]) for u, found in mine.items()} == {u: outputs_of(whole[u][-1]) for u in mine}


def outputs_of(record: dict[str, object]) -> list[str]:
    """Digests of what a task has written."""
    outputs = record["outputs"]
    assert isinstance(outputs, dict)
    return sorted(outputs.values())


def test_a_second_run_does_nothing(cityflow: Commands, middle: Path) -> None:
    before = attempts(middle)
    done = cityflow(*of_the_middle(middle))
    assert done.code == 0, done.text
    assert attempts(middle) == before


def test_a_poisonous_building_stops_nothing_and_is_rerun_alone(
    cityflow: Commands, middle: Path, tmp_path: Path
) -> None:
    run = tmp_path / "run"
    shutil.copytree(middle, run)
    expected = product_digests(middle)
    unit = sorted(records_of(run, "reconstruct"))[7]
    done = cityflow("rerun", run, "--unit", unit, "--set", f"reconstruct.methods=[{POISON}]")
    assert done.code == 0, done.text
    newest = records_of(run, "reconstruct")[unit][-1]
    assert newest["status"] == "failed"
    assert "SIGSEGV" in str(newest["reason"])
    assert unit in done.text
    assert product_digests(run) != expected
    before = attempts(run)
    done = cityflow("rerun", run, "--failed", "--clear-overrides")
    assert done.code == 0, done.text
    changed = {node for node, n in attempts(run).items() if n != before[node]}
    assert ("reconstruct", unit) in changed
    assert {stage for stage, _ in changed} == {"reconstruct", "export"}
    assert len([1 for stage, _ in changed if stage == "reconstruct"]) == 1
    assert product_digests(run) == expected


def test_an_interrupted_run_is_continued_on_two_workers_one_of_which_is_killed(middle: Path, tmp_path: Path) -> None:
    """Interrupted on workers of its own, it goes on with those of a scheduler, and the bytes are the same."""
    run = tmp_path / "run"
    driver = subprocess.Popen(
        [sys.executable, "-m", "cityflow", *of_the_middle(run), "--workers", "2"],
        env=environment(),
        preexec_fn=hear_ctrl_c,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    while not (run / "records" / "surface").is_dir():
        assert driver.poll() is None
        time.sleep(0.05)
    driver.send_signal(signal.SIGINT)
    start = time.monotonic()
    driver.communicate(timeout=60)
    assert time.monotonic() - start < 15
    assert driver.returncode == 130
    done_before = {node for node, n in attempts(run).items() if n}
    continue_and_kill(run, len(records_of(middle, "reconstruct")))
    again = {node for node, n in attempts(run).items() if n > 1 and node in done_before}
    assert not {node for node in again if node[0] in ("ingest", "reconstruct")}
    assert product_digests(run) == product_digests(middle)


def continue_and_kill(run: Path, buildings: int) -> None:
    port = free_port()
    address = f"tcp://127.0.0.1:{port}"
    dask = [sys.executable, "-m", "dask"]
    worker = [*dask, "worker", address, "--nthreads", "1", "--memory-limit", "0", "--no-dashboard", "--no-nanny"]
    scheduler = [*dask, "scheduler", "--host", "127.0.0.1", "--port", str(port), "--no-dashboard"]
    with processes(scheduler, worker, worker) as (_, _, victim):
        driver = subprocess.Popen(
            [sys.executable, "-m", "cityflow", *of_the_middle(run), "--scheduler", address],
            env=environment(), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        )  # fmt: skip
        kill_halfway(victim, run, buildings)
        text, _ = driver.communicate(timeout=600)
    assert driver.returncode == 0, text


def kill_halfway(victim: subprocess.Popen[bytes], run: Path, buildings: int) -> None:
    """SIGKILL a worker when some buildings are done and others are not."""
    folder = run / "records" / "reconstruct"
    deadline = time.monotonic() + 400
    while time.monotonic() < deadline:
        done = sum(1 for _ in folder.iterdir()) if folder.is_dir() else 0
        if done >= 3:
            assert done < buildings
            os.killpg(victim.pid, signal.SIGKILL)
            return
        time.sleep(0.02)
    raise AssertionError("no building was ever done")
