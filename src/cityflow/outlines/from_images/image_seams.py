"""Gaps that images show and the surface does not: lines from roof to roof along which they disagree about what stands between.

Along a line each image shows its own brightness of a gap, from border to border. On a roof what differs from cell to cell, by dormers and noise, is small in
the mean of a line; where two roofs of different colour meet, images differ in a strip of less than half a metre; below a step they differ, too, since the
surface rounds it off. Three figures of the profile across a line tell these apart.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.core.colour_image import ColourImage
from cityflow.core.grid import Grid, grown
from cityflow.outlines.from_heights.seam_lattice import STEP_M, Lattice, Seam, roofs_beside, runs
from cityflow.outlines.from_images.disagreement import CELL_M, LEAST_IMAGES, REACH_M, RoofCells, shown_on
from cityflow.outlines.from_images.photographed import Photographed

PROMISING = 0.045
"""Least disagreement of the best lines' thirds, of which profiles are made; set by hand, as are those below."""
OFF = np.arange(-10, 11)
"""Lines beside a line whose means make its profile."""
BESIDE = np.r_[0:6, 15:21]
"""Of these, those on the roofs beside it."""
NARROWEST, WIDEST, ASIDE = 3, 11, 2.5
"""Lines that a gap has, and how far its middle may lie beside its line."""
MARGIN = 2
"""Lines beside a gap that belong to neither."""
HIGHEST_STEP_M = 5.0
WEIGHTS = (-1.85, 5.11, -4.09, -1.58)
"""Of one, of ln(disagreement in the gap / 0.1), of ln(disagreement beside it / 0.03), of the step between the roofs in metres: logit of a gap.

Fitted to 140 places in ten matched flights (`benchmarks/image_gaps.py`), 5 of them gaps."""
LEAST_PROBABILITY = 0.5


@dataclass(frozen=True, slots=True)
class Profile:
    """Across a line from roof to roof.

    Attributes
    ----------
    inside, beside : disagreement of images in the gap, median, and beside it, the most
    step_m : between the roofs on both sides
    aside : lines from the line to the middle of the gap
    """

    inside: float
    beside: float
    step_m: float
    aside: float

    @property
    def probability(self) -> float:
        """That it is a gap."""
        return 1.0 / (1.0 + math.exp(-sum(w * f for w, f in zip(WEIGHTS, figures_of(self), strict=True))))


def figures_of(profile: Profile) -> tuple[float, float, float, float]:
    """What `WEIGHTS` count."""
    step = min(profile.step_m, HIGHEST_STEP_M)
    return 1.0, math.log(profile.inside / 0.1), math.log(profile.beside / 0.03), step


@dataclass(frozen=True, slots=True)
class Line:
    """A line's number, its first and after-last place, and its profile."""

    lattice: Lattice
    at: tuple[int, int, int]
    profile: Profile


def image_seams(mask: BoolArray, grid: Grid, directions: Sequence[float], seen: Photographed) -> list[Seam]:
    """Lines through a region that are gaps more probably than not, in cells of `grid`.

    Parameters
    ----------
    mask : (rows, cols) bool, one region
    directions : of the region's edges, radians in rows and columns (x right, y down)
    """
    fine, roof = roof_cells(mask, grid)
    lines = image_lines(roof, seen.heights(fine), fine, directions, seen.images)
    origin = np.array([fine.x_min - grid.x_min, grid.y_max - fine.y_max]) / grid.cell
    return [
        Seam(s.start * fine.cell / grid.cell + origin, s.end * fine.cell / grid.cell + origin, s.share)
        for s in seams_of(lines)
    ]


def roof_cells(mask: BoolArray, grid: Grid) -> tuple[Grid, BoolArray]:
    """Cells of `CELL_M` over a region on `grid` and `REACH_M` around it, and which of them lie in it."""
    fine = Grid.covering(grown(grid.bounds, REACH_M), CELL_M)
    row, col = grid.indices(*fine.centres())
    on = (row >= 0) & (col >= 0) & (row < grid.rows) & (col < grid.cols)
    return fine, on & mask[np.clip(row, 0, grid.rows - 1), np.clip(col, 0, grid.cols - 1)]


def image_lines(
    mask: BoolArray, heights: Float32Array, grid: Grid, directions: Sequence[float], images: Sequence[ColourImage]
) -> list[Line]:
    """Lines through a region along which images may show a gap.

    Parameters
    ----------
    mask, heights : (rows, cols) roof cells of `grid`, whose cells are of `CELL_M`; metres, NaN where unknown; they reach `REACH_M` beyond the region
    directions : of the region's edges, radians in rows and columns (x right, y down)
    """
    row, col = np.nonzero(mask & np.isfinite(heights))
    if not len(row):
        return []
    cells = RoofCells(grid, heights, row, col)
    shown = shown_on(cells, images)
    if len(shown.values) < LEAST_IMAGES:
        return []
    spread, values = cells.raster(shown.spread), cells.raster(shown.values)
    return [line for d in directions for line in _lines(Lattice.over(grid.shape, CELL_M, d), spread, values, heights)]


def _lines(lattice: Lattice, spread: Float32Array, values: Float32Array, heights: Float32Array) -> Iterator[Line]:
    """Those of one direction."""
    off = np.where(lattice.on, spread[lattice.row, lattice.col], np.nan)
    known = np.isfinite(off)
    _, between = roofs_beside(np.where(known, 1.0, np.nan), known)
    filled = np.nan_to_num(off)
    least = np.minimum(np.minimum(np.roll(filled, 1, axis=0), filled), np.roll(filled, -1, axis=0))
    for line, first, after in runs(between):
        third = (after - first) // 3
        parts = (
            least[line, first : first + third],
            least[line, first + third : after - third],
            least[line, after - third : after],
        )
        if min(float(p.mean()) for p in parts) < PROMISING:
            continue
        lines = np.clip(line + OFF, 0, len(least) - 1)
        at = lattice.row[lines, first:after], lattice.col[lines, first:after]
        profile = profile_of(values[:, at[0], at[1]], heights[at])
        if profile is not None:
            yield Line(lattice, (line, first, after), profile)


def profile_of(values: Float32Array, heights: Float32Array) -> Profile | None:
    """None where it has not the shape of a gap.

    Parameters
    ----------
    values : (images, lines, places) log brightness; NaN where an image does not see it
    heights : (lines, places) metres
    """
    middle = slice(len(OFF) // 2 - 4, len(OFF) // 2 + 5)
    values = values[np.isfinite(values[:, middle]).mean(axis=(1, 2)) > 0.5].astype(np.float64)
    if len(values) < LEAST_IMAGES:
        return None
    known = np.isfinite(values)
    count = known.sum(axis=2)
    if (count == 0).any():
        return None
    mean = np.where(known, values, 0.0).sum(axis=2) / count
    own = mean - mean.mean(axis=0)
    left, right = own[:, BESIDE[:6]].mean(axis=1, keepdims=True), own[:, BESIDE[6:]].mean(axis=1, keepdims=True)
    own -= left + (right - left) * (OFF + 7.5) / 15.0
    spread = own.std(axis=0)
    first, after = _strip(spread)
    outside = np.r_[spread[: max(first - MARGIN, 0)], spread[after + MARGIN :]]
    aside = (first + after - 1) / 2 - len(OFF) // 2
    if not NARROWEST <= after - first <= WIDEST or abs(aside) > ASIDE or not len(outside):
        return None
    step = np.abs(np.nanmedian(heights[2]) - np.nanmedian(heights[-3]))
    inside = float(np.median(spread[first:after]))
    return Profile(max(inside, 1e-6), max(float(outside.max()), 1e-6), float(np.nan_to_num(step)), aside)


def _strip(spread: FloatArray) -> tuple[int, int]:
    """First and after-last line about the middle with at least half of the most there."""
    middle = len(OFF) // 2
    most = middle - 1 + int(np.argmax(spread[middle - 1 : middle + 2]))
    low = spread < spread[most] / 2
    before, beyond = np.flatnonzero(low[:most]), np.flatnonzero(low[most:])
    return int(before[-1]) + 1 if len(before) else 0, most + int(beyond[0]) if len(beyond) else len(spread)


def seams_of(lines: Sequence[Line]) -> list[Seam]:
    """Those that are gaps more probably than not, in cells of the lines' raster."""
    found = []
    for line in lines:
        if (p := line.profile.probability) >= LEAST_PROBABILITY:
            seam = line.lattice.seam(*line.at, p)
            aside = line.profile.aside * STEP_M / CELL_M * line.lattice.across
            found.append(Seam(seam.start + aside, seam.end + aside, p))
    return found
