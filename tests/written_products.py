"""Geometries of exported files, read back by readers that know nothing of the writers."""

from __future__ import annotations

from pathlib import Path

from cityflow.core.written_geometry import WrittenGeometry
from cityflow.io.city_models.written_citygml import written_in_citygml
from cityflow.io.city_models.written_cityjson import written_in_cityjson
from cityflow.io.city_models.written_obj import written_in_obj


def written(path: Path) -> list[WrittenGeometry]:
    """All geometries of a file: a CityJSON text sequence, an OBJ, else CityGML."""
    if path.name.endswith(".jsonl"):
        return list(written_in_cityjson(path.read_bytes().splitlines()))
    if path.suffix == ".obj":
        return list(written_in_obj(path.read_bytes().splitlines()))
    with path.open("rb") as source:
        return list(written_in_citygml(source))
