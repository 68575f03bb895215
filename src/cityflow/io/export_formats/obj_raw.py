"""``obj_raw/TILE.obj``: OBJ for renderers that divide, with textures in the geometry of the photographs; its texture coordinates are triplets."""

from __future__ import annotations

from cityflow.io.export_formats.formats import folder_of
from cityflow.io.export_formats.obj import obj_files
from cityflow.io.export_formats.tile import CityTile, Files


def write(tile: CityTile) -> Files:
    """For `formats.written`."""
    return obj_files(tile, folder_of("obj_raw"), tile.raw)
