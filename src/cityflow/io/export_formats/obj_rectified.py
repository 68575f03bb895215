"""``obj_rectified/TILE.obj``: OBJ for programs that do not divide."""

from __future__ import annotations

from cityflow.io.export_formats.formats import folder_of
from cityflow.io.export_formats.obj import obj_files
from cityflow.io.export_formats.tile import CityTile, Files


def write(tile: CityTile) -> Files:
    """For `formats.written`."""
    return obj_files(tile, folder_of("obj_rectified"), tile.rectified)
