"""Refused outlines of a task as a file, for the map and for the check of edits."""

from __future__ import annotations

import json
from collections.abc import Iterable

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from cityflow.flow.store import Store
from cityflow.flow.task import Record

REFUSED = "refused.json"


def encode_refused(refused: Iterable[tuple[str, BaseGeometry | None]]) -> bytes:
    """Id and geometry of each that has an extent; lines, points and coordinates that are no numbers are left out."""
    drawn = {name: shapely.to_wkb(shape, hex=True) for name, shape in refused if _has_extent(shape)}
    return json.dumps(drawn, ensure_ascii=False, sort_keys=True).encode()


def refused_shapes(store: Store, records: Iterable[Record]) -> dict[str, Polygon | MultiPolygon]:
    """Id → polygon or polygons, of what the tasks of these records refused."""
    paths = [p for r in records for p in r.outputs if p.endswith(f"/{REFUSED}")]
    return shapes_of(data for _, data in store.read_many(paths))


def shapes_of(files: Iterable[bytes]) -> dict[str, Polygon | MultiPolygon]:
    """Id → polygon or polygons, from the contents of such files."""
    return {name: shapely.from_wkb(wkb) for data in files for name, wkb in json.loads(data).items()}


def _has_extent(shape: BaseGeometry | None) -> bool:
    return (
        isinstance(shape, Polygon | MultiPolygon)
        and not shape.is_empty
        and bool(np.isfinite(shapely.get_coordinates(shape)).all())
    )
