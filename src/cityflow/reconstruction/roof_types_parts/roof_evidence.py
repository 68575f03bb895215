"""What an outline, a surface and an ortho give to read a roof from."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.parameters import Parameters
from cityflow.core.reconstruction import Evidence
from cityflow.reconstruction.extruded import moved
from cityflow.reconstruction.roof_types_parts import heights as heights_of
from cityflow.reconstruction.roof_types_parts import ortho_shift, roof_lines
from cityflow.reconstruction.roof_types_parts.decomposition import DecompositionParameters
from cityflow.reconstruction.roof_types_parts.dormer_values import DormerParameters
from cityflow.reconstruction.roof_types_parts.heights import HeightCells, RoofLevels
from cityflow.reconstruction.roof_types_parts.hypothesis import HypothesisParameters
from cityflow.reconstruction.roof_types_parts.line_categories import (
    Category,
    SortedLines,
    categorise,
)
from cityflow.reconstruction.roof_types_parts.outline_sides import sides_of
from cityflow.reconstruction.roof_types_parts.regular_outline import REACH_M, RegularParameters, Rim, regular_outline
from cityflow.reconstruction.roof_types_parts.roof_lines import LineParameters, RoofLines
from cityflow.reconstruction.roof_types_parts.shape_fit import Clues, noise_of

Origin = tuple[float, float, float]

LEAST_FILL = 0.9
"""An outline that fills its four sides so far (share) is one part; set by hand, as are the next two."""
MOST_REST = 0.15
"""Share of an outline that its parts may leave uncovered."""
MOST_OFF = 0.4
"""A roof that leaves more of its heights (share) beyond three sigma is of unknown type."""
LEAST_CELLS = 4
"""Fewer heights than this tell nothing: a plane has three numbers."""
STRAIGHTEN_M = 0.3
"""Bends of the outline below this make no side, m: the accuracy of usual outlines; set by hand."""
MARGIN_M = 0.5
"""Heights nearer to the outline than this are not fitted, m: a cell of a usual surface mixes roof and ground."""


class RoofTypesParameters(Parameters):
    """How lines are found and sorted, what roofs may look like, and when a roof is of no known type."""

    lines: LineParameters = LineParameters()
    regular: RegularParameters = RegularParameters()
    parts: DecompositionParameters = DecompositionParameters()
    roofs: HypothesisParameters = HypothesisParameters()
    dormers: DormerParameters = DormerParameters()


@dataclass(frozen=True, slots=True)
class Reading:
    """What was found before any roof was tried: for pictures and reports, too.

    Attributes
    ----------
    origin : world, of the local frame
    outline : Polygon, local
    fitted : Polygon, local; the outline without the errors of its corners, over which roofs are fitted
    cells, levels, lines : heights and sorted lines, local
    clues : what hypotheses are compared with
    segments : (M, 4) float64, lines as they were detected, before any were joined
    """

    origin: Origin
    outline: Polygon
    fitted: Polygon
    cells: HeightCells
    levels: RoofLevels
    lines: SortedLines
    clues: Clues
    segments: FloatArray = field(default_factory=lambda: np.empty((0, 4)))


def read(evidence: Evidence, parameters: RoofTypesParameters) -> Reading:
    """Heights and lines of one unit."""
    x0, y0 = (float(np.floor(v)) for v in evidence.outline.bounds[:2])
    origin = (x0, y0, float(np.floor(evidence.ground_height)))
    outline = moved(evidence.outline, -x0, -y0)
    cells = heights_of.height_cells(evidence, outline, origin, MARGIN_M)
    if len(cells) < LEAST_CELLS:
        none = SortedLines(roof_lines.joined([]), np.empty(0, np.int64), np.empty((0, 2)))
        return Reading(
            origin, outline, outline, cells, RoofLevels(0, 0), none, Clues(cells, 1.0, np.empty((0, 4)), 0.0)
        )
    levels = heights_of.roof_levels(evidence, outline, origin, cells)
    lines, detected = find_lines(evidence, origin, outline, levels, parameters)
    fitted = fitted_outline(evidence, origin, outline, lines, parameters)
    if fitted is not outline:
        inside = heights_of.height_cells(evidence, fitted, origin, MARGIN_M)
        if len(inside) >= LEAST_CELLS:
            cells, levels = inside, heights_of.roof_levels(evidence, fitted, origin, inside)
        else:  # of few points, those at the rim may all lie beyond sides that have moved
            fitted = outline
    z = heights_of.height_at(evidence, origin, lines.ends.reshape(-1, 2)).reshape(-1, 2)
    kinds = categorise(lines, z, fitted, levels)
    inner = kinds.lines.take(kinds.category != Category.EAVE)
    trust = 1.0 if len(lines) else 0.0
    clues = Clues(cells, noise_of(cells), np.ascontiguousarray(inner.ends.reshape(-1, 4)), trust)
    segments = np.ascontiguousarray(detected.ends.reshape(-1, 4))
    return Reading(origin, outline, fitted, cells, levels, kinds, clues, segments)


def fitted_outline(
    evidence: Evidence, origin: Origin, outline: Polygon, lines: RoofLines, parameters: RoofTypesParameters
) -> Polygon:
    """The outline that roofs are fitted over; the given one itself where there is no reason to doubt it."""
    sides = sides_of(outline, STRAIGHTEN_M)
    around = heights_of.height_cells(evidence, outline.buffer(REACH_M, join_style="mitre"), origin, 0.0)
    return regular_outline(outline, sides, Rim(around, lines), parameters.regular)


def find_lines(
    evidence: Evidence, origin: Origin, outline: Polygon, levels: RoofLevels, parameters: RoofTypesParameters
) -> tuple[RoofLines, RoofLines]:
    """Lines of all epochs in the local frame, joined within their epoch, duplicates of all together left out; and all as detected."""
    own, found, detected = parameters.lines, list[RoofLines](), list[RoofLines]()
    for epoch, picture in enumerate(evidence.pictures):
        raw = roof_lines.picture_lines(picture, epoch, evidence.outline, own)
        lines = roof_lines.merged(raw)
        for each, kept in ((raw, detected), (lines, found)):
            local = each.shifted(-np.asarray(origin[:2]))
            kept.append(local if picture.true else _over_walls(evidence, local, origin, outline, levels))
    if not found and evidence.heights is not None:
        lines = roof_lines.merged(roof_lines.relief_lines(evidence.heights, evidence.outline, own))
        found = [lines.shifted(-np.asarray(origin[:2]))]
    return roof_lines.without_duplicates(roof_lines.joined(found)), roof_lines.joined(detected)


def _over_walls(
    evidence: Evidence,
    lines: RoofLines,
    origin: Origin,
    outline: Polygon,
    levels: RoofLevels,
) -> RoofLines:
    """Lines of a plain ortho without the displacement of the roof."""
    shift = ortho_shift.rim_shift(lines, sides_of(outline, STRAIGHTEN_M))
    ground = evidence.ground_height - origin[2]
    z = heights_of.height_at(evidence, origin, lines.ends.mean(axis=1) - shift)
    z = np.clip(np.nan_to_num(z, nan=levels.bottom), levels.bottom, levels.top)
    return ortho_shift.brought_back(lines, shift, z - ground, levels.bottom - ground)
