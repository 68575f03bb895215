"""Table of export formats. The parameter ``export.formats``, the export of tiles and the catalog of products derive from it.

A format is a file of this folder with a function ``write(tile) -> Files``, which puts everything below ``products/NAME``, and its line here.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cityflow.io.export_formats.tile import CityTile, Files

TITLES: Mapping[str, str] = {
    "cityjson": "City model (CityJSONSeq 2.0)",
    "citygml": "City model (CityGML 2.0)",
    "obj": "City model (OBJ)",
    "obj_raw": "City model (OBJ, textures in the geometry of the photographs)",
    "tiles3d": "City model (3D Tiles 1.1)",
    "glb": "City model (GLB, a node per building)",
}
"""Name → what the catalog of products calls it."""


def written(name: str, tile: CityTile) -> Files:
    """The files of a tile in the format `name`."""
    files: Files = import_module(f"cityflow.io.export_formats.{name}").write(tile)
    return files


def folder_of(name: str) -> str:
    """Where a format's files stand, RUN-relative."""
    return f"products/{name}"
