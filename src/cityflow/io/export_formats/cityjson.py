"""``cityjson/TILE.city.jsonl``: header, a line per building, the terrain."""

from __future__ import annotations

from cityflow.io.city_models.appearance import Appearance
from cityflow.io.city_models.cityjson import Transform, feature_line
from cityflow.io.city_models.cityjson_sequence import header_line, terrain_feature_line
from cityflow.io.export_formats.formats import folder_of
from cityflow.io.export_formats.tile import CityTile, Files

FOLDER = folder_of("cityjson")


def write(tile: CityTile) -> Files:
    """For `formats.written`."""
    transform, look = Transform.over(tile.bounds), Appearance(FOLDER, tile.rectified, tile.drape)
    lines = [header_line(tile.reference, tile.extent, transform, tile.title, tile.date)]
    lines += [feature_line(b, transform, look, tile.openings) for b in tile.buildings]
    lines += [terrain_feature_line(*part, transform, appearance=look) for part in tile.relief]
    yield f"{FOLDER}/{tile.name}.city.jsonl", b"".join(lines)
