"""All pictures of the report of a run, also of an unfinished one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Building
from cityflow.flow.store import Store
from cityflow.io.city_models.cityjson import read_feature
from cityflow.reporting.atlas_cell_faces import atlas_cell_files, read_atlas_cells
from cityflow.reporting.model_pictures import densest_spot, hull_files, model_pictures, nearest
from cityflow.reporting.outline_pictures import outline_pictures
from cityflow.reporting.raster_pictures import city_rasters, frame_pictures
from cityflow.reporting.side_pictures import Spot, ground_m, side_pictures, viewed_spot
from cityflow.runs.current import CurrentRecords
from cityflow.stages import atlas
from cityflow.survey.survey import Survey
from cityflow.viewer.picture import Picture
from cityflow.viewer.report_parameters import ReportParameters
from cityflow.viewer.report_rows import UnitRow

MOST_AROUND = 300
"""Models around the densest spot; more would be behind those in front."""


class RunPictures(NamedTuple):
    """Those that are shown by themselves, and the relief that lies below the map of buildings."""

    shown: tuple[Picture, ...] = ()
    relief: Picture | None = None


def run_pictures(
    store: Store, survey: Survey, units: Sequence[UnitRow], records: CurrentRecords, parameters: ReportParameters
) -> RunPictures:
    """Models, views from four sides, outlines, surface, ortho, classes, terrain, oblique orthos; none where no tile has a surface yet."""
    middles = [u.rings[0].mean(axis=0) for u in units if len(u.rings)]
    rasters = city_rasters(store, survey, records, densest_spot(np.array(middles)) if middles else None)
    if rasters is None:
        return RunPictures()
    models = model_pictures(store, units, records, rasters, parameters.models)
    plans = outline_pictures(store, survey, units, records, rasters)
    sides = _sides(store, survey, units, records, parameters.across_m)
    shown = (*models, *sides, *plans, *rasters.pictures(), *frame_pictures(store, survey, records))
    return RunPictures(shown, rasters.relief())


def _sides(
    store: Store, survey: Survey, units: Sequence[UnitRow], records: CurrentRecords, across_m: float
) -> Iterator[Picture]:
    """The densest spot of what has textures, else of all models."""
    hulls = hull_files(records, [u.id for u in units if len(u.rings)])
    middles = {u.id: u.rings[0].mean(axis=0) for u in units if len(u.rings) and u.id in hulls}
    sizes = {u.id: float(np.hypot(*np.ptp(u.rings[0], axis=0))) for u in units if u.id in middles}
    atlas_cell_of = _atlas_cells(records)
    # by size: many sheds are less of a town than a few houses
    shown = sorted(u for u in middles if u in atlas_cell_of) or sorted(middles)
    if not shown:
        return
    spot = viewed_spot(np.array([middles[u] for u in shown]), np.array([sizes[u] for u in shown]), across_m)
    near = set(_within(middles, spot, ground_m(across_m)))
    paths = atlas_cell_files(records)
    atlas_cells = list(read_atlas_cells(store, sorted({paths[atlas_cell_of[u]] for u in near if u in atlas_cell_of})))
    textured = {unit for atlas_cell in atlas_cells for unit in atlas_cell.unit}
    bare = nearest({u: middles[u] for u in near - textured}, spot, MOST_AROUND)
    yield from side_pictures(
        store, survey, Spot(spot, across_m), atlas_cells, _buildings(store, [hulls[u] for u in bare])
    )


def _atlas_cells(records: CurrentRecords) -> dict[str, str]:
    """Unit → the atlas cell that holds its texture."""
    known = atlas_cell_files(records)
    return {
        name.partition(" ")[2]: r.unit
        for r in records.of(atlas.NAME) if r.unit in known
        for name in r.inputs if name.startswith("texture ")
    }  # fmt: skip


def _within(middles: Mapping[str, FloatArray], spot: FloatArray, edge_m: float) -> list[str]:
    return [u for u, m in middles.items() if np.abs(m - spot).max() < edge_m / 2]


def _buildings(store: Store, paths: Sequence[str]) -> Iterator[Building]:
    for _, data in store.read_many(paths):
        yield read_feature(data)
