"""The models of a run in one picture: all of them, or of a large city those around its densest spot."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np

from cityflow.core.arrays import ByteArray, FloatArray
from cityflow.core.building import Building, Lod, Polyhedron, Status
from cityflow.core.grid import Bounds, Grid
from cityflow.flow.store import Store
from cityflow.flow.task import Record
from cityflow.io.city_models.cityjson import read_feature
from cityflow.reporting.raster_pictures import CityRasters
from cityflow.runs.current import CurrentRecords
from cityflow.stages import reconstruct
from cityflow.survey.results import HULL
from cityflow.viewer.model_view import (
    TERRAIN_COLOUR,
    Surfaces,
    draw_models,
    semantic_key,
    surfaces_of,
    terrain_surfaces,
)
from cityflow.viewer.mosaic import known_window
from cityflow.viewer.picture import MOST_PIXELS, Picture, picture
from cityflow.viewer.relief import ortho_pixels
from cityflow.viewer.relief_gaps import without_specks
from cityflow.viewer.report_rows import UnitRow

MARGIN_M = 12.0
"""Ground shown around the models."""
BLOCK_M = 60.0
"""Edge of the squares in which models are counted to find the densest spot."""


def model_pictures(
    store: Store, units: Sequence[UnitRow], records: CurrentRecords, rasters: CityRasters, most: int
) -> Iterator[Picture]:
    """Hulls over the terrain, `most` of them; nothing where no unit has a hull."""
    middles = {u.id: u.rings[0].mean(axis=0) for u in units if len(u.rings)}
    hulls = hull_files(records, middles)
    known = {u: middles[u] for u in sorted(hulls) if u in middles}
    if not known:
        return
    spot = densest_spot(np.array(list(known.values())))
    chosen = nearest(known, spot, most)
    models = surfaces_of(
        shell for _, data in store.read_many([hulls[u] for u in chosen]) for shell in _shells(read_feature(data))
    )
    text = f"{_counted([u.lod for u in units if u.id in set(chosen)], len(known))}, over the terrain, seen from the south-south-west."
    yield _drawn("Models", text, models, rasters, _around(models))


def _counted(lods: Sequence[str], known: int) -> str:
    """How many models of each level of detail are shown, and of how many.

    >>> _counted(["2.2", "1.2", "2.2"], 3), _counted(["2.2"], 1200)
    ('2 models with roof shapes (LoD2.2) and 1 block (LoD1.2)', 'Of 1,200 those around the densest spot: 1 model with roof shapes (LoD2.2)')
    """
    full = sum(lod == Lod.LOD22.value for lod in lods)
    simpler = [
        f"{n:,} {_noun('block', n)} (LoD{lod})"
        for lod in sorted(set(lods))
        if lod != Lod.LOD22.value and (n := lods.count(lod))
    ]
    shapes = [f"{full:,} {_noun('model', full)} with roof shapes (LoD2.2)"] if full else []
    caption = " and ".join([*shapes, *simpler])
    return caption if len(lods) == known else f"Of {known:,} those around the densest spot: {caption}"


def _noun(word: str, count: int) -> str:
    return word if count == 1 else f"{word}s"


def hull_files(records: CurrentRecords, units: Iterable[str]) -> dict[str, str]:
    """Unit → the file of its hull, of some units."""
    good = (Status.DONE, Status.DEGRADED)
    return {r.unit: p for r in records.some(reconstruct.NAME, units) if r.status in good for p in _hull(r)}


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
    return picture(title, text, pixels, semantic_key(models), wide=True)


def _window(grid: Grid, bounds: Bounds) -> tuple[slice, slice]:
    """Cells of a grid within bounds."""
    x, y = grid.x_centres(), grid.y_centres()
    return known_window(((y >= bounds[1]) & (y < bounds[3]))[:, None] & ((x >= bounds[0]) & (x < bounds[2]))[None, :])


def _ground(rasters: CityRasters) -> tuple[ByteArray, Grid] | None:
    """The ortho on the terrain; what no image sees is plain, in a quiet colour of the place."""
    if rasters.ortho is None or not np.isfinite(rasters.ortho[1]).any():
        return None
    whole = without_specks(rasters.ortho[1])
    known, pixels = np.isfinite(whole[0]), ortho_pixels(whole)
    quiet = 0.5 * pixels[known].mean(axis=0) + 0.5 * np.array(TERRAIN_COLOUR)
    return np.where(known[..., None], pixels, quiet.astype(np.uint8)), rasters.ortho[0]
