"""``obj/TILE.obj`` with materials and a sidecar of attributes, for any program that reads OBJ."""

from __future__ import annotations

from cityflow.core.texture import TextureSet
from cityflow.io.city_models.appearance import Appearance
from cityflow.io.city_models.cityjson import Transform
from cityflow.io.city_models.obj import write_obj
from cityflow.io.export_formats.formats import folder_of
from cityflow.io.export_formats.tile import CityTile, Files

ORIGIN_STEP_M = 10_000
"""Tiles within such a square have one origin, so that several load side by side; m. Single precision is off by half a millimetre at its far end."""


def write(tile: CityTile) -> Files:
    """For `formats.written`."""
    return obj_files(tile, folder_of("obj"), tile.rectified)


def obj_files(tile: CityTile, folder: str, textures: TextureSet | None) -> Files:
    """A tile in a folder, with one of its sets of textures."""
    look = Appearance(folder, textures, tile.drape)
    origin = Transform.over(tile.bounds, ORIGIN_STEP_M)
    files = write_obj(tile.name, tile.buildings, tile.reference, origin, tile.relief, appearance=look)
    for name, data in files.items():
        yield f"{folder}/{name}", data
