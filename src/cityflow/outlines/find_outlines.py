"""Building outlines found in the surface, where no outlines are given (Gross 2005 §2.3–2.4, and beyond)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.core.building import Outline
from cityflow.core.facade_points import WallPoints
from cityflow.core.grid import Bounds, Grid, grown
from cityflow.outlines.footprint_parameters import FindParameters
from cityflow.outlines.from_heights.footprint_roofs import orientations_of, roof_outlines
from cityflow.outlines.from_heights.regions import (
    Region,
    RegionSurface,
    building_mask,
    building_regions,
    crack_midpoints,
)
from cityflow.outlines.from_heights.seams import parts_of
from cityflow.outlines.from_heights.survey_end import marked
from cityflow.outlines.from_walls.wall_line import Heights
from cityflow.outlines.from_walls.wall_lines import find_wall_lines
from cityflow.outlines.identity import ids_from_geometry
from cityflow.outlines.joined.combine import (
    CLOSED_SHARE,
    FACADE_SHARE,
    ROUGH_SHARE,
    Footprint,
    footprints,
)
from cityflow.outlines.joined.combine_edges import KnownLines
from cityflow.outlines.joined.combine_gaps import parts_between_gaps
from cityflow.outlines.joined.combine_lines import Roofs
from cityflow.outlines.joined.combine_places import Places
from cityflow.outlines.joined.combine_wall_bases import known_walls
from cityflow.outlines.noded.noding import node_outlines

__all__ = ["FindParameters", "RegionSurface", "bounds_of_regions", "find_outlines", "is_seen_whole"]

AROUND_M = 10.0
"""How far from a roof its façades and their ends are looked for, m; set by hand, several times what eaves reach."""
_NODING_M = 0.05
"""Gaps and overlaps below this are closed, m: the default of `outline.noding_tolerance_m`."""


def find_outlines(surface: RegionSurface, parameters: FindParameters | None = None) -> list[Outline]:
    """Outlines of the building regions of one tile and its halo, noded, with ids from their geometry.

    Keep those whose representative point the tile owns. A region wider than `parameters.widest_m` is cut along the edges
    of the tile's core, if that is given, so that neighbouring tiles agree on it.

    Parameters
    ----------
    surface : RegionSurface
    parameters : FindParameters
    """
    chosen = parameters or FindParameters()
    if surface.walls is None or not len(surface.walls):
        return _from_roofs(surface, chosen)
    return _from_walls(surface, surface.walls, chosen)


def is_seen_whole(surface: RegionSurface, parameters: FindParameters) -> bool:
    """Whether no region of the tile is so wide that it may end beyond `parameters.halo_m` around it."""
    return all(r.width_m <= parameters.halo_m for r in building_regions(surface, parameters.regions))


def bounds_of_regions(surface: RegionSurface, parameters: FindParameters) -> list[Bounds]:
    """Places of the tile's regions that stay whole, with what stands around them."""
    regions = building_regions(surface, parameters.regions)
    return [grown(r.grid.bounds, AROUND_M) for r in regions if r.width_m <= parameters.widest_m]


def _from_roofs(surface: RegionSurface, parameters: FindParameters) -> list[Outline]:
    """Outlines without a search for façades."""
    regions = _parted_regions(surface, parameters)
    found = [Footprint(p, None, how) for r in regions for p, how in _outlines_of(r, surface, parameters)]
    known = KnownLines([], _boundary_points(regions, surface), surface.grid.cell)
    return [marked(replace(o, edges=known.edges_of(o.polygon)), surface) for o in _named(found)]


def _parted_regions(surface: RegionSurface, parameters: FindParameters) -> list[Region]:
    """Building regions, parted where narrow gaps go through them."""
    whole = building_regions(surface, parameters.regions)
    least = parameters.regions.minimum_area_m2
    if surface.walls is not None:
        surface = replace(surface, walls=surface.walls.take(np.argsort(surface.walls.xyz[:, 0], kind="stable")))
    return [part for r in whole for part in parts_of(r, surface, orientations_of(r), least)]


def _from_walls(surface: RegionSurface, walls: WallPoints, parameters: FindParameters) -> list[Outline]:
    """Outlines where façades were seen: walls before roofs."""
    ground = _terrain(surface)
    regions, mask = _parted_regions(surface, parameters), building_mask(surface, parameters.regions)
    lines = find_wall_lines(walls, ground, parameters.walls, _roofs(surface, mask))
    places = Places(surface, mask, known_walls(lines, walls, ground), parameters.regions)
    known = KnownLines(lines, _boundary_points(regions, surface), surface.grid.cell)
    found = [
        f
        for region in regions
        for f in _footprints_of(region, places, surface, parameters)
        if not _is_foliage(f.polygon, known, places)
    ]
    alone = _walls_alone(places, surface, parameters)
    found += [f for f in alone if known.seen_share(f.polygon) >= CLOSED_SHARE]
    return [
        marked(replace(o, edges=known.edges_of(o.polygon), inner_edges=known.inner_edges_of(o.polygon)), surface)
        for o in _named(found)
    ]


def _footprints_of(
    region: Region, places: Places, surface: RegionSurface, parameters: FindParameters
) -> list[Footprint]:
    """The footprints in one region; its roof where no wall stands near, or where walls make nothing of it."""
    if region.width_m > parameters.widest_m:
        return [Footprint(polygon, None, remark) for polygon, remark in _outlines_of(region, surface, parameters)]
    roofs = roof_outlines(region, parameters)
    roof, how = roofs[0]
    around, walls = places.around(region, parameters.combine.overhang_m)
    minimum = parameters.regions
    gaps = parts_between_gaps(around, region, minimum.minimum_height_m, minimum.minimum_area_m2) if walls else []
    shapes = Roofs(tuple(p for p, _ in roofs), tuple(roof_outlines(part, parameters)[0][0] for part in gaps))
    around = replace(around, divided=bool(gaps))
    found = footprints(around, shapes, walls, parameters.combine) if walls else []
    large = [f for f in found if f.polygon.area >= parameters.regions.minimum_area_m2]
    return [replace(f, remark=f"{f.remark}; roof: {how}") for f in large] or [Footprint(roof, roof, how)]


def _is_foliage(polygon: Polygon, known: KnownLines, places: Places) -> bool:
    """True for what is rough and has no façade, where others have them."""
    return known.seen_share(polygon) < FACADE_SHARE and places.rough_share(polygon) > ROUGH_SHARE


def _walls_alone(places: Places, surface: RegionSurface, parameters: FindParameters) -> list[Footprint]:
    """Footprints that walls close where no roof was found."""
    found = []
    for around, walls in places.lonely(parameters.combine.overhang_m):
        for f in footprints(around, Roofs(), walls, parameters.combine):
            if f.polygon.area >= parameters.regions.minimum_area_m2 and _in_core(f.polygon, surface):
                found.append(f)
    return found


def _in_core(polygon: Polygon, surface: RegionSurface) -> bool:
    return surface.core is None or bool(shapely.intersects(polygon, shapely.box(*surface.core)))


def _terrain(surface: RegionSurface) -> Heights:
    """Heights of the terrain at any place, NaN if unknown."""
    return _heights(surface.grid, surface.dtm)


def _roofs(surface: RegionSurface, mask: BoolArray) -> Heights:
    """World heights of the roofs of building regions, NaN elsewhere."""
    dtm = surface.dtm
    return _heights(
        surface.grid, None if dtm is None else np.where(mask, dtm.astype(np.float64) + surface.ndsm, np.nan)
    )


def _heights(grid: Grid, raster: FloatArray | Float32Array | None) -> Heights:
    """A raster's value at any place, NaN beyond."""

    def heights(x: FloatArray, y: FloatArray) -> FloatArray:
        if raster is None:
            return np.full(np.shape(x), np.nan)
        row, col = grid.indices(np.asarray(x, np.float64), np.asarray(y, np.float64))
        inside = (row >= 0) & (col >= 0) & (row < grid.rows) & (col < grid.cols)
        found = raster[np.clip(row, 0, grid.rows - 1), np.clip(col, 0, grid.cols - 1)]
        return np.asarray(np.where(inside, found, np.nan), np.float64)

    return heights


def _boundary_points(regions: Sequence[Region], surface: RegionSurface) -> FloatArray:
    """(n, 2) middles of the cell sides around all regions, world metres."""
    if not regions:
        return np.empty((0, 2))
    polygons = [r.polygon() for r in regions]
    rings = [ring for p in polygons for ring in (p.exterior, *p.interiors)]
    return np.concatenate([crack_midpoints(shapely.get_coordinates(r), surface.grid.cell) for r in rings])


def _named(found: Sequence[Footprint]) -> list[Outline]:
    """Outlines with ids from their geometry, noded."""
    names = ids_from_geometry([f.polygon for f in found]) if found else []
    outlines = [Outline(n, f.polygon, {}, f.remark, roof=f.roof) for n, f in zip(names, found, strict=True)]
    return node_outlines(outlines, _NODING_M)


def _outlines_of(region: Region, surface: RegionSurface, parameters: FindParameters) -> list[tuple[Polygon, str]]:
    """Polygons of a region and their remark: one, unless the region is too large and has to be cut."""
    polygon, remark = roof_outlines(region, parameters)[0]
    if region.width_m <= parameters.widest_m:
        return [(polygon, remark)]
    if surface.core is None:
        return [(polygon, f"{remark}; wider than {parameters.widest_m:g} m")]
    parts = shapely.get_parts(shapely.intersection(polygon, shapely.box(*surface.core)))
    large = [p for p in parts if isinstance(p, Polygon) and p.area >= parameters.regions.minimum_area_m2]
    return [(p, f"{remark}; wider than {parameters.widest_m:g} m, cut at the tile's edge") for p in large]
