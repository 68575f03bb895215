"""Building outlines found in the surface, where no outlines are given (Gross 2005 §2.3–2.4, and beyond)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from pydantic import Field
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Outline
from cityflow.core.parameters import Parameters
from cityflow.outlines.identity import ids_from_geometry
from cityflow.outlines.noding import node_outlines
from cityflow.outlines.orientation import chord_directions, principal_orientations
from cityflow.outlines.polygonal import polygonal_ring
from cityflow.outlines.rectilinear import rectilinear_rings
from cityflow.outlines.regions import Region, RegionParameters, RegionSurface, building_regions, crack_midpoints
from cityflow.outlines.rings import on_lattice

__all__ = ["FindParameters", "RegionSurface", "find_outlines"]

_NODING_M = 0.05
_CHORDS_M = 1.5, 5.0
"""Long chords tell small angles from the staircase of cells; short ones see the short edges, too."""
_POINTS_PER_CELL = 2.0
"""Where the surface does not say: 8 points per m² in cells of half a metre."""


class FindParameters(Parameters):
    """How building regions become outlines."""

    regions: RegionParameters = Field(default_factory=RegionParameters, description="what is a building region")
    halo_m: float = Field(100.0, ge=0, le=1000, description="surface needed around a tile; larger regions are cut, m")
    shortest_edge_m: float = Field(1.2, ge=0.2, le=10, description="shorter edges are generalised away, m")
    quality_m2: float = Field(1.5, gt=0, le=100, description="parts smaller than this need not be followed, m²")
    corner_cost_m2: float = Field(
        0.5, ge=0, le=100, description="what one corner more must gain in area to be worth it, m²"
    )
    spot_m: float = Field(
        0.12, ge=0, le=2, description="how far a roof is seen beyond its edge (size of the laser's spot, noise), m"
    )
    eaves_m: float = Field(0.0, ge=0, le=3, description="how far roofs reach beyond the outlines wanted, m")


def find_outlines(surface: RegionSurface, parameters: FindParameters | None = None) -> list[Outline]:
    """Outlines of the building regions of one tile and its halo, noded, with ids from their geometry.

    Keep those whose representative point the tile owns. A region wider than the halo is cut along the edges of the
    tile's core, if that is given, so that neighbouring tiles agree on it.

    Parameters
    ----------
    surface : RegionSurface
    parameters : FindParameters
    """
    chosen = parameters or FindParameters()
    found = [o for r in building_regions(surface, chosen.regions) for o in _outlines_of(r, surface, chosen)]
    names = ids_from_geometry([polygon for polygon, _ in found]) if found else []
    return node_outlines(
        [Outline(name, polygon, {}, remark) for name, (polygon, remark) in zip(names, found, strict=True)], _NODING_M
    )


def _outlines_of(region: Region, surface: RegionSurface, parameters: FindParameters) -> list[tuple[Polygon, str]]:
    """Polygons of a region and their remark: one, unless the region is too large and has to be cut."""
    polygon, remark = region_outline(region, parameters)
    if region.grid.cell * max(region.grid.shape) <= parameters.halo_m:
        return [(polygon, remark)]
    if surface.core is None:
        return [(polygon, f"{remark}; wider than the halo of {parameters.halo_m:g} m")]
    parts = shapely.get_parts(shapely.intersection(polygon, shapely.box(*surface.core)))
    large = [p for p in parts if isinstance(p, Polygon) and p.area >= parameters.regions.minimum_area_m2]
    return [(p, f"{remark}; wider than the halo of {parameters.halo_m:g} m, cut at the tile's edge") for p in large]


def region_outline(region: Region, parameters: FindParameters) -> tuple[Polygon, str]:
    """The outline of one region, and how it was found.

    By rectangles and by free edges, each in the region's principal orientations; of these the one with the least area
    in disagreement with the region, corners counted.
    """
    cells = region.polygon()
    rings = [crack_midpoints(shapely.get_coordinates(r), region.grid.cell) for r in (cells.exterior, *cells.interiors)]
    estimates = [_orientations(rings, region.grid.cell, chord_m) for chord_m in _CHORDS_M]
    candidates = [(_polygon(c), how) for known in estimates for c, how in _candidates(region, rings, known, parameters)]
    valid = [(p, how) for p, how in candidates if p is not None]
    if not valid:
        return shapely.simplify(cells, region.grid.cell), "boundary of the cells"

    def cost(candidate: tuple[Polygon, str]) -> float:
        off = shapely.symmetric_difference(candidate[0], cells).area
        return float(off + parameters.corner_cost_m2 * shapely.get_num_coordinates(candidate[0]))

    polygon, how = min(valid, key=cost)
    return _moved_inwards(polygon, edge_bias_m(region, parameters)), how


def edge_bias_m(region: Region, parameters: FindParameters) -> float:
    """How far the edges of a region lie outside those of the outline.

    A cell that the roof covers by a share f is high where at least one of its n points lies on the roof: with the
    probability 1 − (1 − f)ⁿ. Over all positions of the edge that is 1/2 − 1/(n + 1) cells more than the roof covers.
    """
    n = region.points_per_cell if np.isfinite(region.points_per_cell) else _POINTS_PER_CELL
    return region.grid.cell * max(0.0, 0.5 - 1 / (n + 1)) + parameters.spot_m + parameters.eaves_m


def _orientations(rings: Sequence[FloatArray], cell: float, chord_m: float) -> list[float]:
    """Principal orientations of all rings of a region, by the directions of chords of twice this length."""
    votes = [chord_directions(ring, max(2, min(round(chord_m / cell), len(ring) // 16))) for ring in rings]
    return principal_orientations(np.concatenate([v[0] for v in votes]), np.concatenate([v[1] for v in votes]))


def _candidates(
    region: Region, rings: Sequence[FloatArray], orientations: list[float], parameters: FindParameters
) -> list[tuple[list[FloatArray], str]]:
    shortest, points = parameters.shortest_edge_m, np.concatenate(rings)
    result = [
        (rectilinear_rings(region, o, points, shortest, parameters.quality_m2), "rectangles") for o in orientations
    ]
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
