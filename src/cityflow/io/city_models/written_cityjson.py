"""Reads every geometry of a CityJSON text sequence, independently of cityflow's writer."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.written_geometry import GeometryKind, WrittenGeometry


def written_in_cityjson(lines: Iterable[bytes]) -> Iterator[WrittenGeometry]:
    """Geometries of the lines of a sequence, its header first, in their order.

    Raises
    ------
    ValueError
        A geometry is of a kind that is not known here.
    """
    iterator = iter(lines)
    transform = json.loads(next(iterator))["transform"]
    for line in iterator:
        feature = json.loads(line)
        vertices = np.asarray(feature["vertices"], np.float64).reshape(-1, 3) * transform["scale"]
        vertices += np.asarray(transform["translate"])
        for owner, city_object in feature["CityObjects"].items():
            for geometry in city_object.get("geometry", ()):
                yield _geometry(owner, geometry, vertices)


def _geometry(owner: str, geometry: dict[str, Any], vertices: FloatArray) -> WrittenGeometry:
    kind, boundaries = GeometryKind(geometry["type"]), geometry["boundaries"]
    if kind is GeometryKind.SOLID:
        if len(boundaries) != 1:
            raise ValueError(f"{owner}: a solid with {len(boundaries)} shells is not known here")
        boundaries = boundaries[0]
    polygons = tuple(tuple(vertices[ring] for ring in polygon) for polygon in boundaries)
    return WrittenGeometry(owner, kind, str(geometry["lod"]), polygons)
