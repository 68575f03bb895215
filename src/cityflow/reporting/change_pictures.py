"""Pictures of a change: the outlines before and after over the surface of today, and both models from one place in one scale."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import shapely

from cityflow.core.arrays import ByteArray
from cityflow.core.building import Lod, Polyhedron
from cityflow.core.grid import Grid, grown
from cityflow.evaluation.change_pairs import EpochUnit
from cityflow.evaluation.changes import Change
from cityflow.flow.store import Store
from cityflow.io.rasters.surface_dataset import read_layers
from cityflow.survey.survey import Survey
from cityflow.viewer.model_view import Surfaces, draw_models, no_terrain, surfaces_of, terrain_surfaces
from cityflow.viewer.picture import Picture, picture
from cityflow.viewer.plan_view import Strokes, draw_plan
from cityflow.viewer.relief import height_range, shaded_heights

MARGIN_M, PIXELS, MOST_CELLS = 8.0, 420, 1200
BEFORE, AFTER = ("before", (255, 150, 40)), ("after", (60, 150, 255))


def change_pictures(store: Store, survey: Survey, change: Change) -> Iterator[Picture]:
    """Plan, model before, model after; of a building that is too large to draw, none."""
    units = [u for u in (change.before, change.after) if u is not None]
    bounds = grown(shapely.union_all([u.footprint for u in units]).bounds, MARGIN_M)
    if max(bounds[2] - bounds[0], bounds[3] - bounds[1]) > MOST_CELLS * survey.lattice.cell_m:
        return
    zarr = store.zarr_store(survey.source.zarr)
    grid, layers = read_layers(zarr, survey.lattice.grid, bounds, ("dsm_filled", "dtm"))
    if np.isfinite(layers["dsm_filled"]).any():
        yield _plan(change, grid, layers["dsm_filled"])
    yield from _models(change, terrain_surfaces(layers["dtm"], grid))


def _plan(change: Change, grid: Grid, heights: np.ndarray) -> Picture:
    times = max(PIXELS // max(grid.shape), 1)
    pixels = shaded_heights(heights, grid.cell, height_range(heights))
    larger = np.repeat(np.repeat(pixels, times, axis=0), times, axis=1)
    fine = Grid(grid.x_min, grid.y_max, grid.cell / times, *larger.shape[:2])
    drawn = [
        Strokes(text, colour, 2.5, [unit.footprint])
        for (text, colour), unit in ((BEFORE, change.before), (AFTER, change.after)) if unit is not None
    ]  # fmt: skip
    key = tuple((s.meaning, s.colour) for s in drawn)
    return picture("Outlines", "Over the heights after the update, north is up.", draw_plan(larger, fine, drawn), key)


def _models(change: Change, terrain: Surfaces) -> Iterator[Picture]:
    both = [_models_of(unit) for unit in (change.before, change.after)]
    every = np.concatenate([s.corners.reshape(-1, 3) for s in (*both, terrain)])
    if not len(every):
        return
    low, high = every.min(axis=0), every.max(axis=0)
    for title, models in zip(("Before", "After"), both, strict=True):
        if len(models.corners) or len(terrain.corners):
            yield picture(title, "", _drawn(models, terrain, low, high))


def _models_of(unit: EpochUnit | None) -> Surfaces:
    return surfaces_of(_shells(unit)) if unit is not None else no_terrain()


def _shells(unit: EpochUnit) -> list[Polyhedron]:
    building = unit.building
    if building is None or Lod.LOD22 not in building.solids:
        return []
    return [building.solids[Lod.LOD22], *([building.beyond] if building.beyond is not None else [])]


def _drawn(models: Surfaces, terrain: Surfaces, low: np.ndarray, high: np.ndarray) -> ByteArray:
    """With two triangles of no area at the ends of what both pictures show, so that both have one frame."""
    ends = np.stack([np.tile(low, (3, 1)), np.tile(high, (3, 1))])
    framed = Surfaces(
        np.concatenate([models.corners, ends]),
        np.concatenate([models.colours, np.zeros((2, 3))]),
        np.concatenate([models.faces, np.full(2, -1)]),
    )
    return draw_models(framed, terrain, PIXELS)
