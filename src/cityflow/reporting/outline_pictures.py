"""A picture of outlines, roofs and cut lines over the ortho, or the shaded surface where there is none: the densest spot of the city."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from cityflow.core.arrays import BoolArray, ByteArray, FloatArray
from cityflow.core.building import Outline
from cityflow.core.grid import Bounds, Grid, bounds_meet
from cityflow.core.splitting import CutLine
from cityflow.flow.store import Store
from cityflow.handover.outline_lines import decode_all
from cityflow.handover.split_lines import read_splits
from cityflow.io.rasters.surface_dataset import read_layers
from cityflow.reporting.model_pictures import densest_spot
from cityflow.reporting.raster_pictures import CityRasters, Raster
from cityflow.runs.current import CurrentRecords
from cityflow.stages import outline, units
from cityflow.stages.units import SPLITS
from cityflow.survey.surface_source import IMAGES, ZARR
from cityflow.survey.survey import Survey
from cityflow.viewer.mosaic import Mosaic
from cityflow.viewer.picture import MOST_PIXELS, Picture, picture
from cityflow.viewer.plan_view import Strokes, draw_plan
from cityflow.viewer.relief import height_range, ortho_pixels, shaded_heights
from cityflow.viewer.relief_gaps import quiet_gaps, without_specks
from cityflow.viewer.report_rows import UnitRow

CLOSE_M = 150.0
NEARLY = 0.995
"""Of the most that can be known; set by hand."""
GIVEN, WALL, ROOF = (250, 250, 250), (255, 226, 60), (90, 170, 255)
EDGE, INNER, CUT, REJECTED = (90, 220, 110), (240, 110, 240), (235, 50, 40), (150, 120, 190)


def outline_pictures(
    store: Store, survey: Survey, rows: Sequence[UnitRow], records: CurrentRecords, rasters: CityRasters
) -> Iterator[Picture]:
    """Nothing where outlines are given and stay whole: the map of units shows these."""
    middles = [u.rings[0].mean(axis=0) for u in rows if len(u.rings)]
    if not middles or not (survey.splits or not survey.outlines_given):
        return
    bounds = _over_known(_square(densest_spot(np.array(middles)), rasters.known), rasters.background)
    ground = _ground(store, survey, bounds)
    if ground is None:
        return
    grid, pixels = ground
    outlines, cuts, rejected = _found(store, records, grid.bounds)
    strokes = _strokes(outlines, cuts, rejected)
    yield picture(
        "Outlines and units",
        f"Walls, roofs and borders of single units; the densest {bounds[2] - bounds[0]:.0f} × {bounds[3] - bounds[1]:.0f} m.",
        draw_plan(pixels, grid, strokes),
        tuple((s.meaning, s.colour) for s in strokes if len(s.shapes)),
        wide=True,
    )


def _square(spot: FloatArray, known: Bounds) -> Bounds:
    """The square around a spot (x, y), moved into what is known; where that is narrower, as much as there is.

    >>> _square(np.array([10.0, 400.0]), (0.0, 0.0, 500.0, 100.0))
    (0.0, 0.0, 150.0, 100.0)
    """
    low, high = np.array(known[:2]), np.array(known[2:])
    half = np.minimum(CLOSE_M, high - low) / 2
    middle = np.clip(spot, low + half, high - half)
    x_min, y_min, x_max, y_max = np.concatenate([middle - half, middle + half]).tolist()
    return x_min, y_min, x_max, y_max


def _over_known(square: Bounds, background: Raster) -> Bounds:
    """The square, moved by at most half its width to where the background is known: an ortho does not fill the box around it."""
    grid, values = background
    half = (square[2] - square[0]) / 2, (square[3] - square[1]) / 2
    near = grid.part_over((square[0] - half[0], square[1] - half[1], square[2] + half[0], square[3] + half[1]))
    if near is None:
        return square
    rows, cols = grid.slices(near)
    known = np.isfinite(values[0, rows, cols])
    left, top = (square[0] - grid.x_min) / grid.cell - cols.start, (grid.y_max - square[3]) / grid.cell - rows.start
    right, down = least_move(
        known, round(left), round(top), round(2 * half[0] / grid.cell), round(2 * half[1] / grid.cell)
    )
    dx, dy = right * grid.cell, -down * grid.cell
    return square[0] + dx, square[1] + dy, square[2] + dx, square[3] + dy


def least_move(known: BoolArray, left: int, top: int, width: int, height: int) -> tuple[int, int]:
    """By how many cells to the right and down a window has to move so that nearly as much of it is known as of any other; all in cells.

    >>> known = np.ones((6, 12), bool)
    >>> known[:, 8:] = False
    >>> least_move(known, 6, 1, 4, 4), least_move(known, 2, 1, 4, 4)
    ((-2, 0), (0, 0))
    """
    rows, cols = min(height, known.shape[0]), min(width, known.shape[1])
    summed = np.pad(np.cumsum(np.cumsum(known, axis=0, dtype=np.int64), axis=1), ((1, 0), (1, 0)))
    counts = summed[rows:, cols:] - summed[:-rows, cols:] - summed[rows:, :-cols] + summed[:-rows, :-cols]
    moves = np.argwhere(counts >= NEARLY * counts.max()) - [top, left]
    down, right = moves[np.argmin((moves**2).sum(axis=1))]
    return int(right), int(down)


def _ground(store: Store, survey: Survey, bounds: Bounds) -> tuple[Grid, ByteArray] | None:
    whole = survey.lattice.product_grid
    if not bounds_meet(survey.lattice.bounds, bounds):
        return None
    names = ("ortho", "ortho_seen") if survey.source.kind == IMAGES else ("dsm",)
    window, found = read_layers(store.zarr_store(ZARR), whole, bounds, names)
    values = found[names[0]] if survey.source.kind == IMAGES else found["dsm"][None]
    known = found["ortho_seen"] if survey.source.kind == IMAGES else np.isfinite(found["dsm"])
    if not known.any():
        return None
    mosaic = Mosaic(window, MOST_PIXELS, len(values))
    mosaic.add(window, values, known)
    mean = without_specks(mosaic.mean())
    shown = (
        ortho_pixels(mean)
        if survey.source.kind == IMAGES
        else shaded_heights(mean[0], mosaic.grid.cell, height_range(mean[0]))
    )
    shown = quiet_gaps(shown, np.isfinite(mean[0]))
    # a survey of half a metre a cell has few pixels: lines need more
    times = max(1, round(MOST_PIXELS / max(mosaic.grid.shape)))
    grid = Grid(mosaic.grid.x_min, mosaic.grid.y_max, mosaic.grid.cell / times, *(n * times for n in mosaic.grid.shape))
    return grid, np.repeat(np.repeat(shown, times, axis=0), times, axis=1)


def _found(store: Store, records: CurrentRecords, bounds: Bounds) -> tuple[list[Outline], list[CutLine], list[CutLine]]:
    """Outlines that meet the bounds, with the cut lines used and those that were not."""
    lines = sorted(
        {
            e["path"]
            for r in records.of(outline.NAME)
            for e in r.result.get("units", [])
            if bounds_meet(e["bounds"], bounds)
        }
    )
    outlines = [
        s.outline
        for p in lines
        for s in decode_all(store.read_bytes(p))
        if bounds_meet(s.outline.polygon.bounds, bounds)
    ]
    near = {o.id for o in outlines}
    paths = sorted(p for r in records.of(units.NAME) for p in r.outputs if p.endswith(SPLITS))
    splits = [s for p in paths for name, s in read_splits(store.read_bytes(p)) if name in near]
    return outlines, [c for s in splits for c in s.cut_lines], [c for s in splits for c in s.rejected]


def _strokes(outlines: Sequence[Outline], cuts: Sequence[CutLine], rejected: Sequence[CutLine]) -> list[Strokes]:
    edges = [e for o in outlines for e in o.edges]
    return [
        Strokes("roof", ROOF, 1.0, [o.roof for o in outlines if o.roof is not None]),
        Strokes("outline", EDGE if edges else GIVEN, 2.0, [o.polygon for o in outlines]),
        Strokes("wall seen", WALL, 2.0, [e.line for e in edges if e.source == "wall"]),
        Strokes("wall above a lower roof", INNER, 1.5, [e.line for o in outlines for e in o.inner_edges]),
        Strokes("candidate", REJECTED, 1.0, [c.line for c in rejected]),
        Strokes("border of units", CUT, 2.5, [c.line for c in cuts]),
    ]
