"""``citygml/TILE.gml``."""

from __future__ import annotations

import io

from cityflow.io.city_models.appearance import Appearance
from cityflow.io.city_models.citygml import write_citygml
from cityflow.io.export_formats.formats import folder_of
from cityflow.io.export_formats.tile import CityTile, Files

FOLDER = folder_of("citygml")


def write(tile: CityTile) -> Files:
    """For `formats.written`."""
    target, look = io.BytesIO(), Appearance(FOLDER, tile.rectified, tile.drape)
    write_citygml(
        target,
        tile.buildings,
        tile.reference,
        tile.extent,
        tile.relief,
        tile.title,
        appearance=look,
        openings=tile.openings,
    )
    yield f"{FOLDER}/{tile.name}.gml", target.getvalue()
