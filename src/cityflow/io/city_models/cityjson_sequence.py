"""CityJSONSeq and CityJSON files: header, terrain, and joining the lines of many buildings without holding them."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from itertools import chain
from typing import Any

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.building import Building, Scalar
from cityflow.core.reference import Reference
from cityflow.io.attributes import scalars, xml_text
from cityflow.io.city_models.appearance import BARE, Appearance
from cityflow.io.city_models.cityjson import ORIGIN, Transform, json_line, object_line
from cityflow.io.city_models.cityjson_appearance import Gathered, draped, relocated
from cityflow.io.crs import vertical_datum

Json = Any
Bounds3 = tuple[float, float, float, float, float, float]
"""x_min, y_min, z_min, x_max, y_max, z_max in metres."""

TERRAIN_LOD = "2"


def header_line(
    reference: Reference,
    bounds: Bounds3 | None = None,
    transform: Transform = ORIGIN,
    title: str = "",
    reference_date: str = "",
) -> bytes:
    """The first line of a CityJSONSeq file.

    Parameters
    ----------
    reference_date : date of the source data, ``YYYY-MM-DD``; empty where unknown
    """
    metadata: dict[str, Json] = {}
    if bounds is not None:
        metadata["geographicalExtent"] = [round(float(v), 4) for v in bounds]
    if reference_date:
        metadata["referenceDate"] = reference_date
    if not reference.is_local:
        metadata["referenceSystem"] = crs_url(reference)
        if "+" in reference.code:
            metadata["verticalDatum"] = vertical_datum(reference)
    if title:
        metadata["title"] = xml_text(title)
    return json_line(
        {
            "type": "CityJSON",
            "version": "2.0",
            "transform": transform.json,
            "metadata": metadata,
            "CityObjects": {},
            "vertices": [],
        }
    )


def crs_url(reference: Reference) -> str:
    """The CRS as OGC writes it; of a compound without a code of its own (``EPSG:a+b``) the horizontal part.

    The schema admits no other form.
    """
    return f"https://www.opengis.net/def/crs/EPSG/0/{reference.code.removeprefix('EPSG:').partition('+')[0]}"


def extent_of(buildings: Iterable[Building], more: Iterable[FloatArray] = ()) -> Bounds3 | None:
    """Bounds of all vertices and footprints, and of `more` points, (N, 3) each; None where there are none."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for points in chain(chain.from_iterable(map(_points_of, buildings)), more):
        if len(points):
            low, high = np.minimum(low, points.min(axis=0)), np.maximum(high, points.max(axis=0))
    if not np.isfinite(low).all():
        return None
    x_min, y_min, z_min, x_max, y_max, z_max = (float(v) for v in (*low, *high))
    return x_min, y_min, z_min, x_max, y_max, z_max


def extent_of_headers(headers: Iterable[bytes]) -> Bounds3 | None:
    """Bounds of all files whose headers say theirs; None where none does."""
    extents = [json.loads(header)["metadata"].get("geographicalExtent") for header in headers]
    boxes = np.array([box for box in extents if box is not None])
    return extent_of((), [boxes[:, :3], boxes[:, 3:]]) if len(boxes) else None


def join(files: Iterable[Iterable[bytes]], header: bytes, folders: tuple[str, str] | None = None) -> Iterator[bytes]:
    """Lines of one CityJSONSeq from those of several, each with its header first; in the transform of `header`.

    Parameters
    ----------
    folders : of the files, and of the one that they become, where these differ: images are named relative to them
    """
    target = Transform.of_header(json.loads(header))
    yield header
    for lines in files:
        source: Transform | None = None
        for line in lines:
            if source is None:
                source = Transform.of_header(json.loads(line))
                continue
            # a line is only read where something in it changes; those without images are most of an untextured city
            if folders is not None and b'"appearance":{' in line:
                line = json_line(relocated(line, *folders))
            yield line if source == target else moved(line, source, target)


def moved(line: bytes, source: Transform, target: Transform) -> bytes:
    """A feature line of one transform in another one."""
    feature = json.loads(line)
    shift = source.shift - target.shift
    feature["vertices"] = (np.asarray(feature["vertices"], np.int64).reshape(-1, 3) + shift).tolist()
    return json_line(feature)


def document(lines: Iterable[bytes]) -> bytes:
    """A plain CityJSON file from the lines of a CityJSONSeq, header first."""
    iterator = iter(lines)
    city, appearance = json.loads(next(iterator)), Gathered()
    for line in iterator:
        feature = json.loads(line)
        appearance.take(feature)
        start = len(city["vertices"])
        city["vertices"] += feature["vertices"]
        for city_object in feature["CityObjects"].values():
            for geometry in city_object["geometry"]:
                geometry["boundaries"] = _offset(geometry["boundaries"], start)
        city["CityObjects"].update(feature["CityObjects"])
    return json_line(city | ({"appearance": appearance.json} if appearance.json else {}))


def terrain_feature_line(
    name: str,
    vertices: FloatArray,
    triangles: IntArray,
    transform: Transform = ORIGIN,
    attributes: Mapping[str, Scalar] | None = None,
    appearance: Appearance = BARE,
) -> bytes:
    """A TINRelief: (V, 3) world vertices, (T, 3) vertex indices, counter-clockwise seen from above.

    Where the appearance has an ortho it lies on the triangles.
    """
    surface: dict[str, Json] = {
        "type": "CompositeSurface",
        "lod": TERRAIN_LOD,
        "boundaries": [[[a, b, c]] for a, b, c in np.asarray(triangles, np.int64).tolist()],
    }
    look: dict[str, Json] = {}
    if appearance.drape is not None:
        member, look = draped(appearance, appearance.drape, vertices, np.asarray(triangles, np.int64))
        surface |= member
    relief: dict[str, Json] = {"type": "TINRelief", "attributes": scalars(attributes or {}), "geometry": [surface]}
    return object_line(name, relief, transform.encode(vertices).tolist(), look)


def _points_of(building: Building) -> Iterator[FloatArray]:
    for solid in building.solids.values():
        yield solid.vertices
    if not building.footprint.is_empty:
        xy = np.asarray(building.footprint.exterior.coords)[:, :2]
        yield np.column_stack([xy, np.full(len(xy), building.ground_height)])


def _offset(nested: Json, start: int) -> Json:
    return [_offset(part, start) if isinstance(part, list) else part + start for part in nested]
