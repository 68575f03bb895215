"""Steps of a finished model, and borders to higher or lower neighbours, that photographs show elsewhere.

A border is where the outlines were parted, and steps that would not leave a valid solid were not moved; the points beside both are smoothed by matching.
What lies between such an edge and the place where photographs show it is wrong, whatever the points say.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Polyhedron
from cityflow.core.reconstruction import Evidence, HeightRaster
from cityflow.edges.edge_line import LEAST_LENGTH_M, EdgeLine
from cityflow.geometry.straight_edges import WallEdge, wall_edges
from cityflow.reconstruction.overhangs.faces_at_edges import face_planes, faces_beside
from cityflow.reconstruction.seen_steps.edge_lines import LEAST_STEP_M, roof_steps
from cityflow.reconstruction.seen_steps.with_seen_steps import edge_places
from cityflow.reconstruction.verdicts.beside_outline import at
from cityflow.reconstruction.verdicts.placement import HARM

SIGNIFICANCE = 2.0
"""An edge is seen where it is more of one than any other place by so many standard deviations of the images' votes, as for steps that move."""
ALONG_M, INSIDE_M = 0.25, 0.06
"""Places along a border; so far inside it the roof's face is looked up."""
ACROSS_M = (0.8, 1.1, 1.4, 1.7, 2.0)
"""The neighbour's roof is a plane through the surface so far beyond the border: nearer, matching draws a slope; set by hand, as is the next one."""
UNEVEN_M = 0.2
"""If the surface departs more from that plane (root mean square), nothing is known of the neighbour's roof."""
LEAST_SPREAD = 1e-3
"""Of a share; rounding."""


class _Beside(NamedTuple):
    """A roof at the middle of a piece of a border: its height, metres, and (2,) its rise in x and y."""

    height: float
    gradient: FloatArray


def seen_elsewhere(solid: Polyhedron, evidence: Evidence) -> FloatArray:
    """(E, 2) square metres of the unit's roof between each edge that photographs show and the place where they show it, and their standard deviation.

    Empty without photographs. What lies beyond the outline is the neighbour's matter.
    """
    heights = evidence.heights
    if heights is None or not evidence.photographs:
        return np.empty((0, 2))
    edges = [(e, 0) for step in roof_steps(solid, evidence.outline) for e in step.edges]
    for side in wall_edges(evidence.outline, evidence.party):
        if side.party:
            edges += _at_border(solid, side, heights)
    if not edges:
        return np.empty((0, 2))
    rows = []
    places = edge_places([e for e, _ in edges], evidence.photographs, heights.grid.cell)
    for (edge, own), place in zip(edges, places, strict=True):
        if place is not None and place.sigmas >= SIGNIFICANCE:
            off = abs(place.off_m) if own == 0 else max(-own * place.off_m, 0.0)
            rows.append((edge.length * off, edge.length * place.sigma_m))
    return np.array(rows, np.float64).reshape(-1, 2)


def probability_of_harm(seen: FloatArray, area_m2: float) -> float:
    """That more of a roof lies between its edges and where photographs show them than a good model can bear; 0 where none is seen.

    Parameters
    ----------
    seen : (E, 2) of `seen_elsewhere`;  area_m2 : of the roof
    """
    if not len(seen):
        return 0.0
    share, spread = seen[:, 0].sum() / area_m2, math.sqrt(float((seen[:, 1] ** 2).sum())) / area_m2
    return 0.5 * math.erfc((HARM - share) / (max(spread, LEAST_SPREAD) * math.sqrt(2.0)))


def _at_border(solid: Polyhedron, side: WallEdge, heights: HeightRaster) -> Iterator[tuple[EdgeLine, int]]:
    """The upper edges along a border, piece by piece of one face of the roof: 1 where the unit is above its neighbour, −1 where it is below."""
    origin = np.floor(solid.vertices.min(axis=0))
    polygons, planes = face_planes(solid, origin)
    s = np.arange(ALONG_M / 2, side.length, ALONG_M)
    face = faces_beside(polygons, side.start + s[:, None] * side.along - INSIDE_M * side.outward - origin[:2])
    for run in np.split(np.arange(len(s)), np.flatnonzero(np.diff(face)) + 1):
        length = len(run) * ALONG_M
        if length < LEAST_LENGTH_M or face[run[0]] < 0:
            continue
        start = side.start + (s[run[0]] - ALONG_M / 2) * side.along
        middle = start + length / 2 * side.along
        *gradient, height = planes[face[run[0]]]
        mine = _Beside(float(gradient @ (middle - origin[:2]) + height + origin[2]), np.array(gradient))
        other = _neighbour(start, length, side, heights)
        if other is None or abs(mine.height - other.height) < LEAST_STEP_M:
            continue
        drop = mine.height - other.height
        turn = 1 if drop > 0 else -1
        along, outward, upper = turn * side.along, turn * side.outward, mine if turn > 0 else other
        slope = np.array([upper.gradient @ along, upper.gradient @ outward])
        first = start if turn > 0 else start + length * side.along
        yield EdgeLine(first, along, outward, length, upper.height, slope, abs(drop)), turn


def _neighbour(start: FloatArray, length: float, side: WallEdge, heights: HeightRaster) -> _Beside | None:
    """By the surface beyond a piece of a border; None where it is unknown or uneven there."""
    s = np.arange(ALONG_M / 2, length, ALONG_M) - length / 2
    middle = start + length / 2 * side.along
    off = (s[:, None, None] * side.along + np.array(ACROSS_M)[None, :, None] * side.outward).reshape(-1, 2)
    z = at(heights, heights.dsm, middle + off)
    known = np.isfinite(z)
    if known.mean() < 0.5:
        return None
    table = np.column_stack([np.ones(known.sum()), off[known]])
    found, *_ = np.linalg.lstsq(table, z[known], rcond=None)
    if float(np.sqrt(np.mean((table @ found - z[known]) ** 2))) > UNEVEN_M:
        return None
    return _Beside(float(found[0]), found[1:])
