"""``tiles3d/TILE/``: a tileset of its own with rectified textures, and one with triplets for viewers that divide."""

from __future__ import annotations

from cityflow.core.reference import Reference
from cityflow.io.city_models.tiles3d import About, Scene, tile_files
from cityflow.io.export_formats.tile import CityTile, Files
from cityflow.io.globe import Globe, globe_of
from cityflow.io.globe_frame import frame_at


def write(tile: CityTile) -> Files:
    """For `formats.written`."""
    globe = globe_of(tile.reference, tile.city or tile.bounds)
    x_min, y_min, x_max, y_max = tile.bounds
    frame = frame_at(globe, ((x_min + x_max) / 2, (y_min + y_max) / 2, 0.0))
    scene = Scene(tile.name, tile.buildings, tile.terrain, tile.rectified, tile.raw, tile.drape, tile.coarse)
    about = about_tiles(tile.title, tile.attribution, tile.date, tile.reference, globe)
    yield from tile_files(scene, frame, about).items()


def about_tiles(title: str, attribution: str, date: str, reference: Reference, globe: Globe | None) -> About:
    """What tilesets say of themselves."""
    code = "local" if reference.is_local else reference.code
    return About(title, attribution, date, code, None if globe is None else globe.placing)
