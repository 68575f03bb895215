"""All evidence at every station of an axis strip."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.splitting import SplitEvidence
from cityflow.splitting.borders.roof_marks import RoofMarks, roof_marks, roof_rows
from cityflow.splitting.scores.score_colour import Change, facade_changes, roof_changes
from cityflow.splitting.scores.score_pipe import stripes
from cityflow.splitting.strips.axis_strips import AxisStrip
from cityflow.splitting.strips.slices import SegmentPoints, SliceEvidence, slice_evidence
from cityflow.splitting.strips.strip_rasters import Cells, FacadeRaster, RoofRaster, eaves, facade_rasters, roof_raster

ROOF_WINDOW_M, ROOF_GUARD_M = 2.0, 0.16
FACADE_WINDOW_M, FACADE_GUARD_M = 3.0, 0.2
FACADE_CELL_M = 0.2


@dataclass(frozen=True, slots=True)
class StripEvidence:
    """Of one strip.

    Attributes
    ----------
    roof : its roof laid out along it
    rows : (U, R) heights of the roof along the axis, metres;  marks : what they tell at the borders between columns
    slices : what of the segments lies in each slice
    roof_colour : changes seen from above; None without an ortho
    facades : of each side (0 lower, 1 upper end of the chords) the changes in every local frame that shows it
    stripes : (S, 2) how distinct a narrow upright stripe stands on either façade
    """

    strip: AxisStrip
    roof: RoofRaster
    rows: FloatArray
    marks: RoofMarks
    slices: SliceEvidence
    roof_colour: Change | None
    facades: tuple[tuple[Change, ...], tuple[Change, ...]]
    stripes: FloatArray

    @property
    def stations(self) -> FloatArray:
        return self.strip.stations


def look_at_strip(
    strip: AxisStrip, outline: Polygon, evidence: SplitEvidence, points: SegmentPoints, cells: Sequence[Cells]
) -> StripEvidence:
    """Look at a strip in every frame.

    Parameters
    ----------
    outline : the part of the evidence's outline that the strip belongs to
    points : on the filtered segments
    cells : of the oblique local frames
    """
    roof = roof_raster(strip, outline, evidence.frames[0])
    heights = eaves(strip, roof)
    facades = facade_rasters(strip, cells, heights, evidence.ground_height, _facade_cell(evidence))
    sides: tuple[list[Change], list[Change]] = ([], [])
    changes = facade_changes(facades, strip.stations, FACADE_WINDOW_M, FACADE_GUARD_M)
    for facade, change in zip(facades, changes, strict=True):
        sides[facade.side].append(change)
    best = {max((s for s in facades if s.side == side), key=_seen).frame for side in {s.side for s in facades}}
    finest = max((f.grid.cell for f in evidence.frames[1:]), default=FACADE_CELL_M)
    fine = facade_rasters(strip, [cells[k] for k in sorted(best)], heights, evidence.ground_height, float(finest))
    rows = roof_rows(roof)
    return StripEvidence(
        strip,
        roof,
        rows,
        roof_marks(rows, roof.u),
        slice_evidence(strip, points, heights, evidence.ground_height),
        roof_changes(roof, strip.stations, ROOF_WINDOW_M, ROOF_GUARD_M),
        (tuple(sides[0]), tuple(sides[1])),
        stripes(fine, strip),
    )


def _facade_cell(evidence: SplitEvidence) -> float:
    coarsest = max((f.grid.cell for f in evidence.frames[1:]), default=FACADE_CELL_M)
    return max(FACADE_CELL_M, 1.6 * float(coarsest))


def _seen(facade: FacadeRaster) -> int:
    return int(np.isfinite(facade.colour[..., 0]).sum())


def at_stations(values: FloatArray, default: float = 0.0) -> FloatArray:
    """Unknown becomes the default."""
    return np.where(np.isfinite(values), values, default)
