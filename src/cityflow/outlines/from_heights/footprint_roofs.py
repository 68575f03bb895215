"""Outlines of roofs from building regions (Gross, Thoennessen and von Hansen 2005, §2.3–2.4, and beyond)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.outlines.footprint_parameters import FindParameters
from cityflow.outlines.from_heights.edge_directions import chord_directions, principal_orientations
from cityflow.outlines.from_heights.generalise import CORNER_COST_M2
from cityflow.outlines.from_heights.polygonal import polygonal_ring
from cityflow.outlines.from_heights.rectilinear import rectilinear_rings
from cityflow.outlines.from_heights.regions import Region, crack_midpoints
from cityflow.outlines.noded.rings import on_lattice

QUALITY_M2 = 1.5
"""Parts of a region smaller than this need not be followed; set by hand on synthetic towns."""

_CHORDS_M = 1.5, 5.0
"""Long chords tell small angles from the staircase of cells; short ones see the short edges, too; set by hand, as are those below."""
_POINTS_PER_CELL = 2.0
"""Where the surface does not say: 8 points per m² in cells of half a metre."""
RECTANGLES = "rectangles"


def roof_outlines(region: Region, parameters: FindParameters) -> list[tuple[Polygon, str]]:
    """The outline of one region, and how it was found; then the best one found in the other way, if there is any.

    By rectangles and by free edges, each in the region's principal orientations; the best is the one with the least
    area in disagreement with the region, corners counted.
    """
    cells = region.polygon()
    rings = [crack_midpoints(shapely.get_coordinates(r), region.grid.cell) for r in (cells.exterior, *cells.interiors)]
    estimates = [_orientations(rings, region.grid.cell, chord_m) for chord_m in _CHORDS_M]
    candidates = [(_polygon(c), how) for known in estimates for c, how in _candidates(region, rings, known, parameters)]
    valid = [(p, how) for p, how in candidates if p is not None]
    if not valid:
        return [(shapely.simplify(cells, region.grid.cell), "boundary of the cells")]

    def cost(polygon: Polygon) -> float:
        off = shapely.symmetric_difference(polygon, cells).area
        return float(off + CORNER_COST_M2 * shapely.get_num_coordinates(polygon))

    ranked = sorted(valid, key=lambda candidate: cost(candidate[0]))
    bias = edge_bias_m(region, parameters)
    other = [c for c in ranked if (c[1] == RECTANGLES) != (ranked[0][1] == RECTANGLES)]
    return [(_moved_inwards(polygon, bias), how) for polygon, how in (ranked[0], *other[:1])]


def edge_bias_m(region: Region, parameters: FindParameters) -> float:
    """How far the edges of a region lie outside those of the outline.

    A cell that the roof covers by a share f is high where at least one of its n points lies on the roof: with the
    probability 1 − (1 − f)ⁿ. Over all positions of the edge that is 1/2 − 1/(n + 1) cells more than the roof covers.
    A cell with the median of its points is high where the roof covers half of it.
    """
    if not region.highest:
        return parameters.eaves_m
    n = region.points_per_cell if np.isfinite(region.points_per_cell) else _POINTS_PER_CELL
    return region.grid.cell * max(0.0, 0.5 - 1 / (n + 1)) + parameters.spot_m + parameters.eaves_m


def orientations_of(region: Region) -> list[float]:
    """Principal orientations of a region's edges, radians from east, each for itself and its perpendicular."""
    cells = region.polygon()
    rings = [crack_midpoints(shapely.get_coordinates(r), region.grid.cell) for r in (cells.exterior, *cells.interiors)]
    return _orientations(rings, region.grid.cell, _CHORDS_M[1])


def _orientations(rings: Sequence[FloatArray], cell: float, chord_m: float) -> list[float]:
    """Principal orientations of all rings of a region, by the directions of chords of twice this length."""
    votes = [chord_directions(ring, max(2, min(round(chord_m / cell), len(ring) // 16))) for ring in rings]
    return principal_orientations(np.concatenate([v[0] for v in votes]), np.concatenate([v[1] for v in votes]))


def _candidates(
    region: Region, rings: Sequence[FloatArray], orientations: list[float], parameters: FindParameters
) -> list[tuple[list[FloatArray], str]]:
    shortest, points = parameters.shortest_edge_m, np.concatenate(rings)
    result = [(rectilinear_rings(region, o, points, shortest, QUALITY_M2), RECTANGLES) for o in orientations]
    free = [polygonal_ring(ring, orientations, region.grid.cell, shortest) for ring in rings]
    if free[0] is not None:
        result.append(([ring for ring in free if ring is not None], f"free edges, {len(orientations)} orientations"))
    return result


def _polygon(rings: Sequence[FloatArray]) -> Polygon | None:
    """A valid polygon of the rings, holes that do not fit left out; None where the exterior crosses itself."""
    shell = Polygon(on_lattice(rings[0]))
    if not shell.is_valid or shell.area <= 0:
        return None
    for ring in rings[1:]:
        hole = Polygon(on_lattice(ring))
        cut = shapely.difference(shell, hole) if hole.is_valid else shell
        shell = cut if isinstance(cut, Polygon) and cut.is_valid else shell
    return shapely.orient_polygons(shell, exterior_cw=False)


def _moved_inwards(polygon: Polygon, distance: float) -> Polygon:
    """Each edge moved by the distance, if that leaves one polygon."""
    if distance == 0:
        return polygon
    moved = shapely.buffer(polygon, -distance, join_style="mitre", mitre_limit=5)
    return moved if isinstance(moved, Polygon) and not moved.is_empty else polygon
