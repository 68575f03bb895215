"""The stages one after the other in this process, without a cluster: what survives of the source, and what depends on the order."""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import geopandas
import numpy as np
import pytest

from cityflow.core.building import Status
from cityflow.flow.store import Store
from cityflow.flow.task import Outcome
from cityflow.io.catalog.stac import read_catalog
from cityflow.pipeline.city_source import CitySource
from cityflow.runs.settings import load_workflow
from cluster.small_city import SmallCity, contents, make_city, scene
from in_process import Records, run_all

HOSTILE = {
    "status": "Pand in gebruik",
    "reason": "because",
    "attributes": "none",
    "lod": "9.9",
    "planes": -1,
    "id": "x",
}
"""Columns of a source that bear the project's own names."""


@dataclass(frozen=True)
class Done:
    """A finished run."""

    folder: Path
    records: Records


def run_here(
    city: SmallCity, folder: Path, seed: int, known: Done | None = None, fated: Mapping[str, Outcome] | None = None
) -> Done:
    """All tasks in a random order, without those that are done in `known`; those in `fated` end as said there without being run."""
    if known is not None:
        shutil.copytree(known.folder, folder)
    source = CitySource(read_catalog(city.catalog), load_workflow(city.workflow).city)
    rng, ends = np.random.default_rng(seed), fated or {}
    records = run_all(
        source, Store.open(folder), lambda ready: int(rng.integers(len(ready))), known.records if known else None,
        lambda task: ends.get(task.name),
    )  # fmt: skip
    return Done(folder, records)


@pytest.fixture(scope="module")
def city(tmp_path_factory: pytest.TempPathFactory) -> SmallCity:
    """The small town, its outlines with hostile columns; with whole shapes, since its points are sparse."""
    made = make_city(tmp_path_factory.mktemp("town"), described=False)
    outlines = list(scene().outlines.items())
    columns: dict[str, list[Any]] = {
        "name": [i for i, _ in outlines],
        **{k: [v] * len(outlines) for k, v in HOSTILE.items()},
    }
    frame = geopandas.GeoDataFrame(columns, geometry=[g for _, g in outlines], crs="EPSG:28992")
    frame.to_file(made.outlines, layer="outlines")
    made.change_workflow(reconstruct={"sparse_per_m2": 4.0})
    made.describe()
    return made


@pytest.fixture(scope="module")
def plain(city: SmallCity, tmp_path_factory: pytest.TempPathFactory) -> Done:
    return run_here(city, tmp_path_factory.mktemp("plain"), seed=0)


def test_columns_of_the_source_do_not_pass_for_our_own(plain: Done) -> None:
    status = geopandas.read_file(plain.folder / "products" / "outlines.gpkg", layer="status")
    assert set(status["status"]) <= set(map(str, Status))
    assert set(status["id"]) == set(scene().outlines)
    lines = (plain.folder / "products" / "city.city.jsonl").read_text().splitlines()[1:]
    objects = {k: o for line in lines for k, o in json.loads(line)["CityObjects"].items() if o["type"] == "Building"}
    assert set(objects) == set(scene().outlines)
    for found in (o["attributes"] for o in objects.values()):
        assert found["cityflow_status"] in set(map(str, Status))
        assert found["lod"] in ("1.2", "2.2")
        assert found["planes"] >= 1
        assert "Pand in gebruik" in found.values()
        assert (found["source_lod"], found["source_planes"]) == ("9.9", -1)


def test_the_order_of_tasks_changes_no_byte(city: SmallCity, plain: Done, tmp_path: Path) -> None:
    run_here(city, tmp_path / "run", seed=1)
    assert contents(tmp_path / "run") == contents(plain.folder)


def test_a_unit_that_crashed_is_exported_as_a_block_and_says_so(city: SmallCity, plain: Done, tmp_path: Path) -> None:
    unit = sorted(scene().outlines)[0]
    fated = {f"reconstruct-{unit}": Outcome(Status.FAILED, "crashed with signal SIGSEGV")}
    before = replace(plain, records={node: r for node, r in plain.records.items() if node != ("reconstruct", unit)})
    records = run_here(city, tmp_path / "run", 0, before, fated).records
    lines = (tmp_path / "run" / "products" / "city.city.jsonl").read_text().splitlines()[1:]
    objects = {k: o for line in lines for k, o in json.loads(line)["CityObjects"].items()}
    assert objects[unit]["attributes"]["cityflow_status"] == "failed"
    assert objects[unit]["attributes"]["cityflow_reason"] == "crashed with signal SIGSEGV"
    assert {g["lod"] for g in objects[unit]["geometry"]} == {"0", "1.2", "1.3", "2.2"}
    assert all(r.status is Status.DONE for (stage, _), r in records.items() if stage == "export")
