"""Models as triangles, as a picture, and as a file; a surface as an xarray Dataset."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from cityflow.core.arrays import ByteArray, Float32Array
from cityflow.core.building import Building, Lod
from cityflow.core.grid import Grid
from cityflow.geometry.polyhedron import Mesh, triangulate
from cityflow.io.city_models.cityjson import Transform, feature_line
from cityflow.io.city_models.cityjson_sequence import extent_of, header_line
from cityflow.io.crs import crs_of, resolve
from cityflow.surface.tile_surface import TileSurface
from cityflow.viewer.model_view import LOOKING_DEG, draw_models, no_terrain, surfaces_of, terrain_surfaces

if TYPE_CHECKING:
    import xarray as xr

LAYERS = {"dsm": "dsm", "dsm_filled": "dsm_filled", "dtm": "dtm", "ndsm": "ndsm", "class": "klass", "count": "count", "holes": "holes"}  # fmt: skip
"""Names in ``surface.zarr`` → those of `TileSurface`."""


def triangles_of(building: Building, lod: str = "2.2") -> Mesh:
    """(V, 3) vertices in world metres, (T, 3) triangles, counter-clockwise seen from outside, and (T,) the face that each is a part of.

    Parameters
    ----------
    lod : 1.2, 1.3 or 2.2
    """
    return triangulate(building.solids[Lod(lod)])


def draw_buildings(
    buildings: Sequence[Building], terrain: tuple[Float32Array, Grid] | None = None, most_px: int = 800,
    looking_deg: float = LOOKING_DEG,
) -> ByteArray:  # fmt: skip
    """(rows, cols, 3) uint8 picture of models at LoD 2.2 with their overhangs, by semantic: roofs red, walls light.

    Parameters
    ----------
    terrain : (rows, cols) heights in world metres with their grid; None: no ground is drawn
    most_px : longest side of the picture
    looking_deg : where the viewer looks, clockwise from north
    """
    solids = [s for b in buildings for s in (b.solids[Lod.LOD22], b.beyond) if s is not None]
    ground = no_terrain() if terrain is None else terrain_surfaces(*terrain)
    return draw_models(surfaces_of(solids), ground, most_px, looking_deg=looking_deg)


def write_cityjson(path: str | os.PathLike[str], buildings: Sequence[Building], crs: str) -> None:
    """A CityJSONSeq file (``.city.jsonl``) of buildings.

    Parameters
    ----------
    crs : of their coordinates, such as EPSG:7415
    """
    reference, extent = resolve(crs), extent_of(buildings)
    transform = Transform.over(extent[:2] if extent else (0.0, 0.0))
    lines = [header_line(reference, extent, transform), *(feature_line(b, transform) for b in buildings)]
    Path(path).write_bytes(b"".join(lines))


def surface_dataset(surface: TileSurface, crs: str) -> xr.Dataset:
    """The layers of a surface by the names of ``surface.zarr``; x and y are world metres of cell centres, `.rio.crs` the CRS.

    Parameters
    ----------
    crs : of its coordinates, such as EPSG:7415
    """
    import rioxarray  # noqa: F401 - gives arrays their `.rio`
    import xarray as xr

    places = {"y": surface.grid.y_centres(), "x": surface.grid.x_centres()}
    layers = {name: (("y", "x"), getattr(surface, own)) for name, own in LAYERS.items()}
    found = crs_of(resolve(crs))
    made = xr.Dataset(layers, places)
    return made if found is None else made.rio.write_crs(found.to_wkt())
