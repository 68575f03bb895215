"""The models of a run in one picture: all of them, or of a large city those around its densest spot."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from cityflow.core.arrays import ByteArray, FloatArray
from cityflow.core.building import Building, Lod, Polyhedron, Status
from cityflow.core.grid import Bounds, Grid
from cityflow.flow.store import Store
from cityflow.flow.task import Record
from cityflow.io.cityjson import read_feature
from cityflow.stages import reconstruct
from cityflow.stages.survey import HULL
from cityflow.viewer.model_view import (
    SEMANTIC_COLOURS,
    TERRAIN_COLOUR,
    Surfaces,
    draw_models,
    surfaces_of,
    terrain_surfaces,
)
from cityflow.viewer.mosaic import known_window
from cityflow.viewer.picture import MOST_PIXELS, Picture, picture
from cityflow.viewer.relief import ortho_pixels
from cityflow.viewer.rows import UnitRow
from cityflow.workflow.current import CurrentRecords
from cityflow.workflow.raster_pictures import CityRasters

MOST_MODELS = 600
"""More would be specks and take long to read."""
MARGIN_M = 12.0
"""Ground shown around the models."""
BLOCK_M = 60.0
"""Edge of the squares in which models are counted to find the densest spot."""


def model_pictures(
    store: Store, units: Sequence[UnitRow], records: CurrentRecords, rasters: CityRasters
) -> Iterator[Picture]:
    """LoD2.2 hulls over the terrain; nothing where no unit has a hull."""
    middles = {u.id: u.rings[0].mean(axis=0) for u in units if len(u.rings)}
    hulls = hull_files(records)
    known = {u: middles[u] for u in sorted(hulls) if u in middles}
    if not known:
        return
    spot = densest_spot(np.array(list(known.values())))
    chosen = nearest(known, spot, MOST_MODELS)
    models = surfaces_of(
        shell for _, data in store.read_many([hulls[u] for u in chosen]) for shell in _shells(read_feature(data))
    )
    all_bounds = _around(models)
    count = (
        f"{len(chosen):,}"
        if len(chosen) == len(known)
        else f"The {len(chosen):,} around the densest spot of {len(known):,}"
    )
    yield _drawn(
        "Models",
        f"{count} LoD2.2 {'model' if len(known) == 1 else 'models'} over the terrain, seen from the south-south-west.",
        models,
        rasters,
        all_bounds,
    )


def hull_files(records: CurrentRecords) -> dict[str, str]:
    """Unit → the file of its hull."""
    good = (Status.DONE, Status.DEGRADED)
    return {r.unit: p for r in records.of(reconstruct.STAGE) if r.status in good for p in _hull(r)}


def _shells(building: Building) -> Iterator[Polyhedron]:
    """The solid, and what of its roof lies beyond the walls."""
    yield building.solids[Lod.LOD22]
    if building.beyond is not None:
        yield building.beyond


def _hull(record: Record) -> list[str]:
    return [p for p in record.outputs if p.endswith(HULL)]


def densest_spot(points: FloatArray, weights: FloatArray | None = None) -> FloatArray:
    """(2,) mean of the (N, 2) points in the square of `BLOCK_M` that holds most of them, or the greatest sum of (N,) weights; the first of equals.

    >>> densest_spot(np.array([[0.0, 0.0], [300.0, 10.0], [302.0, 12.0]])).tolist()
    [301.0, 11.0]
    """
    blocks, of_point = np.unique(np.floor(points / BLOCK_M).astype(np.int64), axis=0, return_inverse=True)
    sums = np.bincount(of_point.reshape(-1), weights, len(blocks))
    return np.asarray(points[of_point.reshape(-1) == int(np.argmax(sums))].mean(axis=0))


def nearest(middles: Mapping[str, FloatArray], spot: FloatArray, most: int) -> list[str]:
    """Names of the `most` nearest to a spot, sorted by name."""
    distance = {u: float(np.hypot(*(m - spot))) for u, m in middles.items()}
    return sorted(sorted(distance, key=lambda u: (distance[u], u))[:most])


def _around(models: Surfaces) -> Bounds:
    xy = models.corners.reshape(-1, 3)[:, :2]
    (x_0, y_0), (x_1, y_1) = xy.min(axis=0).tolist(), xy.max(axis=0).tolist()
    return x_0 - MARGIN_M, y_0 - MARGIN_M, x_1 + MARGIN_M, y_1 + MARGIN_M


def _drawn(title: str, text: str, models: Surfaces, rasters: CityRasters, bounds: Bounds) -> Picture:
    grid, (heights,) = rasters.dtm
    rows, cols = _window(grid, bounds)
    part = Grid(
        grid.x_min + cols.start * grid.cell,
        grid.y_max - rows.start * grid.cell,
        grid.cell,
        rows.stop - rows.start,
        cols.stop - cols.start,
    )
    terrain = terrain_surfaces(heights[rows, cols], part)
    pixels = draw_models(models, terrain, MOST_PIXELS, _ground(rasters))
    return picture(title, text, pixels, tuple(SEMANTIC_COLOURS.values())[:3], wide=True)


def _window(grid: Grid, bounds: Bounds) -> tuple[slice, slice]:
    """Cells of a grid within bounds."""
    x, y = grid.x_centres(), grid.y_centres()
    return known_window(((y >= bounds[1]) & (y < bounds[3]))[:, None] & ((x >= bounds[0]) & (x < bounds[2]))[None, :])


def _ground(rasters: CityRasters) -> tuple[ByteArray, Grid] | None:
    if rasters.ortho is None or not np.isfinite(rasters.ortho[1]).any():
        return None
    known = np.isfinite(rasters.ortho[1][0])[..., None]
    return np.where(known, ortho_pixels(rasters.ortho[1]), np.array(TERRAIN_COLOUR, np.uint8)), rasters.ortho[0]
