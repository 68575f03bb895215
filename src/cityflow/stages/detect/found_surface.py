"""The surface that a tile's outlines are found in."""

from __future__ import annotations

from collections.abc import Sequence

import shapely

from cityflow.core.arrays import Float32Array
from cityflow.core.grid import Bounds, Grid, Tile
from cityflow.flow.store import Store
from cityflow.handover.colour_images import ColourInputs
from cityflow.handover.surface_windows import read_windows
from cityflow.handover.surfaces import Surfaces
from cityflow.handover.wall_point_files import read_walls
from cityflow.outlines.find_outlines import FindParameters, RegionSurface, bounds_of_regions, is_seen_whole
from cityflow.outlines.from_images.photographed import Photographed
from cityflow.survey.surface_source import ZARR


def surface_of_regions(
    store: Store, surfaces: Surfaces, walls: Sequence[str] | None, tile: Tile, parameters: FindParameters
) -> RegionSurface:
    """The surface of the tile and its halo, and of all of a wide building that reaches further.

    Parameters
    ----------
    walls : RUN-relative paths of façade points; None where a laser has seen the city
    """
    near = tile.buffered(parameters.halo_m)
    region = _within(store, surfaces, walls, tile, near)
    if is_seen_whole(region, parameters):
        return region
    wide = _within(store, surfaces, walls, tile, tile.buffered(parameters.widest_m))
    parts = [near, *bounds_of_regions(wide, parameters)]
    x_min, y_min, x_max, y_max = shapely.total_bounds([shapely.box(*b) for b in parts]).tolist()
    return _within(store, surfaces, walls, tile, (x_min, y_min, x_max, y_max))


def photographed(store: Store, surfaces: Surfaces, colours: ColourInputs) -> Photographed:
    """The images of a surface, by name; it is read where it is asked for."""

    def heights(bounds: Bounds) -> tuple[Grid, Float32Array]:
        grid, layers = read_windows(store, ZARR, surfaces.fine, bounds, ["dsm_filled"])
        return grid, layers["dsm_filled"]

    return Photographed(sorted(colours.opened(store), key=lambda c: c.image.name), heights)


def _within(store: Store, surfaces: Surfaces, walls: Sequence[str] | None, tile: Tile, bounds: Bounds) -> RegionSurface:
    grid, layers = read_windows(store, surfaces.group, surfaces.working, bounds)
    points = None if walls is None else read_walls(store, walls, grid.bounds)
    return RegionSurface(
        grid, layers["ndsm"], layers["class"], layers["holes"], tile.bounds, layers["count"], points, layers["dtm"],
        highest=walls is None,
    )  # fmt: skip
