"""Surfaces from images of half their size: the same heights, coarser cells, a quarter of the pixels."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cityflow.core.depth_map import joined
from cityflow.flow.store import Store
from cityflow.flow.task import Task
from cityflow.handover.depth_map_files import decode_depth_map
from cityflow.io.catalog.stac import read_catalog
from cityflow.pipeline.city_source import CitySource
from cityflow.pipeline.workflow_parameters import CityParameters
from cluster.small_flight import GSD_M, WORKFLOW, make_flight, truth
from image_point_scenes import points_of
from in_process import outcome_of, record_of


def source(catalog: Path, level: int) -> CitySource:
    tree = {k: v for k, v in WORKFLOW.items() if k != "name"}
    return CitySource(read_catalog(catalog), CityParameters.model_validate({**tree, "images": {"level": level}}))


def first_match(city: CitySource, store: Store) -> Task:
    """Ingest until a nadir image can be matched."""
    ready = list(city.initial())
    while ready:
        task = ready.pop()
        if task.stage == "match" and task.arguments["reference"].startswith("n"):
            return task
        if task.stage == "ingest":
            ready.extend(city.after(task, record_of(task, outcome_of(store, task))))
    raise AssertionError("nothing to match")


def test_half_size_gives_the_same_heights_in_coarser_cells(tmp_path: Path) -> None:
    flight = make_flight(tmp_path / "flight", described=False)
    flight.describe(gains=False)
    whole, half = source(flight.catalog, 0), source(flight.catalog, 1)
    assert half.survey.images.cell_m == 2 * whole.survey.images.cell_m == 2 * GSD_M
    assert half.survey.images.views["n0"].image.camera == whole.survey.images.views["n0"].image.camera
    store = Store.open(str(tmp_path / "run"))
    task = first_match(half, store)
    outcome = outcome_of(store, task)
    base = half.survey.images.flown[task.arguments["reference"]].image
    assert base.camera.width * 2 == half.survey.images.views[base.name].image.camera.width
    points = joined([points_of(decode_depth_map(store.read_bytes(path)), base) for path in outcome.outputs])
    assert len(points) == outcome.result["points"]
    known = truth()
    col = np.floor((points.xyz[:, 0] - known.grid.bounds[0]) / known.grid.cell).astype(int)
    row = np.abs(points.xyz[:, 1, None] - known.grid.y_centres()[None]).argmin(axis=1)
    inside = (col >= 0) & (col < known.dsm.shape[1])
    errors = points.xyz[inside, 2] - known.dsm[row[inside], col[inside]]
    open_cells = known.open_cells[row[inside], col[inside]]
    errors = errors[open_cells]
    assert len(errors) > 2000
    assert abs(np.median(errors)) < GSD_M
    assert np.median(np.abs(errors)) < 1.5 * GSD_M
