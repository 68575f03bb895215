"""The products of a run as a static STAC catalog: location, CRS, date, licence.

A tile has an item. Items hang on the one collection, in a large city on catalogs of districts below it.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any

import numpy as np
import pystac
import shapely
from pyproj import CRS

from cityflow.core.grid import Bounds
from cityflow.core.reference import Reference
from cityflow.io.attributes import ncname
from cityflow.io.catalog.stac_write import WHOLE_EARTH
from cityflow.io.crs import crs_of, horizontal_transform, vertical_datum

ROOT, COLLECTION = "catalog.json", "collection.json"
ITEMS, DISTRICTS = "items", "districts"
PROJECTION = "https://stac-extensions.github.io/projection/v2.0.0/schema.json"
FILE = "https://stac-extensions.github.io/file/v2.1.0/schema.json"
MEDIA_TYPES: Mapping[str, str] = {
    ".tif": "image/tiff; application=geotiff; profile=cloud-optimized",
    ".vrt": "application/xml",
    ".gml": "application/gml+xml",
    ".city.jsonl": "application/city+json-seq",
    ".city.json": "application/city+json",
    ".gpkg": "application/geopackage+sqlite3",
    ".obj": "model/obj",
    ".mtl": "model/mtl",
    ".glb": "model/gltf-binary",
    ".jpg": "image/jpeg",
    ".png": "image/png",
    ".laz": "application/vnd.laszip",
    ".parquet": "application/vnd.apache.parquet",
    ".json": "application/json",
    ".html": "text/html",
    ".zarr": "application/vnd.zarr; version=3",
}
COLLECTION_ID = "city"
UNKNOWN_DATE = (datetime(1900, 1, 1, tzinfo=UTC), datetime(2100, 1, 1, tzinfo=UTC))
"""STAC wants some time: the range of a survey that says none."""


@dataclass(frozen=True, slots=True)
class ProductFile:
    """One file: its path relative to the products' folder, and what it is."""

    path: str
    title: str
    role: str = "data"
    sha256: str = ""
    size: int | None = None


@dataclass(frozen=True, slots=True)
class ProductItem:
    """The files of one place: a ground tile, a district, or the whole city. Keys of `files` name contents (``dsm``, ``obj``)."""

    id: str
    bounds: Bounds
    files: Mapping[str, ProductFile]
    properties: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Source:
    """Where the products come from, and on which terms.

    Attributes
    ----------
    licence : SPDX identifier, or ``other``
    attribution : what whoever uses the products has to say
    date : of the survey, ``YYYY-MM-DD`` or ISO 8601; two of them with ``/`` between for a range; empty where unknown
    """

    title: str
    description: str = "City model, surface and outlines"
    licence: str = "other"
    attribution: str = ""
    date: str = ""


@dataclass(frozen=True, slots=True)
class ItemFile:
    """An item as it is written: its path among the products, its contents, and west, south, east, north in degrees; None in a local frame."""

    path: str
    data: bytes
    box: tuple[float, ...] | None


def district_path(name: str) -> str:
    """Of the catalog of a district, among the products."""
    return f"{DISTRICTS}/{name}.json"


def item_path(name: str) -> str:
    """Of an item, among the products."""
    return f"{ITEMS}/{ncname('p', name)}.json"


def item_file(item: ProductItem, source: Source, reference: Reference, parent: str = COLLECTION) -> ItemFile:
    """An item; `parent` is the path of the catalog that it hangs on."""
    tree = _item(item, source, reference, parent)
    return ItemFile(item_path(item.id), _json(tree), tuple(tree["bbox"]) if tree.get("bbox") else None)


def city_files(
    items: Sequence[str], districts: Sequence[str], boxes: Iterable[Sequence[float]], source: Source
) -> dict[str, bytes]:
    """``catalog.json`` and its one ``collection.json`` with extent and licence, by path.

    Parameters
    ----------
    items, districts : paths of what hangs on the collection
    boxes : west, south, east, north in degrees, of all that is in it
    """
    catalog = pystac.Catalog("products", source.description, title=source.title or None)
    catalog.catalog_type = pystac.CatalogType.SELF_CONTAINED
    root = catalog.to_dict(include_self_link=False)
    root["links"] = [_link("root", f"./{ROOT}"), _link("child", f"./{COLLECTION}")]
    return {ROOT: _json(root), COLLECTION: _json(_collection(items, districts, boxes, source))}


def district_file(
    name: str, items: Sequence[str], districts: Sequence[str], source: Source, parent: str = COLLECTION
) -> tuple[str, bytes]:
    """Path and contents of the catalog of a district; what hangs on it is given by paths, as in `city_files`."""
    path = district_path(name)
    tree = pystac.Catalog(name, f"{source.description}, district {name}").to_dict(include_self_link=False)
    links = [_link("root", f"../{ROOT}"), _link("parent", f"../{parent}")]
    links += [_link("child", f"../{p}") for p in districts] + [_item_link(f"../{p}") for p in items]
    return path, _json({**tree, "links": links})


def _collection(
    items: Sequence[str], districts: Sequence[str], boxes: Iterable[Sequence[float]], source: Source
) -> dict[str, Any]:
    """All products: where and of when they are, on which terms. A local frame is somewhere on the globe."""
    known = np.array(list(boxes))
    box = [*known[:, :2].min(axis=0).tolist(), *known[:, 2:].max(axis=0).tolist()] if len(known) else WHOLE_EARTH
    moment, start, end = _dates(source.date)
    extent = pystac.Extent(pystac.SpatialExtent([box]), pystac.TemporalExtent([[moment or start, moment or end]]))
    provider = pystac.Provider(source.attribution, roles=[pystac.ProviderRole.PRODUCER])
    made = pystac.Collection(
        COLLECTION_ID,
        source.description,
        extent,
        title=source.title or None,
        license=source.licence,
        providers=[provider] if source.attribution else None,
    )
    properties: dict[str, Any] = made.to_dict(include_self_link=False)
    properties["links"] = [_link("root", f"./{ROOT}"), _link("parent", f"./{ROOT}")]
    properties["links"] += [_item_link(f"./{p}") for p in items] + [_link("child", f"./{p}") for p in districts]
    return properties


def _item(item: ProductItem, source: Source, reference: Reference, parent: str) -> dict[str, Any]:
    moment, start, end = _dates(source.date)
    polygon, box = _on_the_globe(reference, item.bounds)
    stac = pystac.Item(
        ncname("p", item.id),
        geometry=polygon,
        bbox=box,
        datetime=moment,
        start_datetime=start,
        end_datetime=end,
        properties={**_properties(source, reference, item.bounds), "title": item.id, **item.properties},
        stac_extensions=[FILE, PROJECTION],
    )
    for key, product in item.files.items():
        stac.add_asset(key, _asset(product))
    written: dict[str, Any] = stac.to_dict(include_self_link=False, transform_hrefs=False)
    written["collection"] = COLLECTION_ID
    links = {"root": ROOT, "parent": parent, "collection": COLLECTION}
    written["links"] = [_link(relation, f"../{path}") for relation, path in links.items()]
    return written


def _properties(source: Source, reference: Reference, bounds: Bounds) -> dict[str, Any]:
    crs = crs_of(reference)
    properties: dict[str, Any] = {
        "license": source.licence,
        "proj:code": _epsg(reference),
        "proj:bbox": [float(v) for v in bounds],
        "vertical_datum": vertical_datum(reference),
    }
    if crs is not None and properties["proj:code"] != reference.code:
        properties["proj:wkt2"] = crs.to_wkt()
    if source.attribution:
        properties |= {
            "attribution": source.attribution,
            "providers": [{"name": source.attribution, "roles": ["producer"]}],
        }
    return properties


def _epsg(reference: Reference) -> str | None:
    """The code; None for a local frame and for a compound CRS without one, which its WKT tells."""
    return None if reference.is_local or "+" in reference.code else reference.code


def _asset(product: ProductFile) -> pystac.Asset:
    extra: dict[str, Any] = {}
    if product.sha256:
        # a multihash: SHA-256 is 0x12, its length 0x20
        extra["file:checksum"] = f"1220{product.sha256}"
    if product.size is not None:
        extra["file:size"] = product.size
    endings = [ending for ending in MEDIA_TYPES if product.path.endswith(ending)]
    media_type = MEDIA_TYPES[max(endings, key=len)] if endings else None
    return pystac.Asset(f"../{product.path}", product.title, None, media_type, [product.role], extra)


def _dates(text: str) -> tuple[datetime | None, datetime | None, datetime | None]:
    """Moment, or start and end."""
    if not text:
        return None, *UNKNOWN_DATE
    start, _, end = text.partition("/")
    if not end:
        return _moment(start), None, None
    return None, _moment(start), _moment(end)


def _moment(text: str) -> datetime:
    moment = datetime.fromisoformat(text.strip())
    return moment if moment.tzinfo else moment.replace(tzinfo=UTC)


def _on_the_globe(reference: Reference, bounds: Bounds) -> tuple[dict[str, Any] | None, list[float] | None]:
    """The rectangle as a polygon in longitude and latitude, and its box; None for a local frame."""
    if reference.is_local:
        return None, None
    # edges of a projected rectangle are curves in degrees
    rectangle = shapely.segmentize(shapely.box(*bounds), max(bounds[2] - bounds[0], bounds[3] - bounds[1]) / 8)
    x, y = shapely.get_coordinates(shapely.orient_polygons(rectangle)).T
    lon, lat = horizontal_transform(reference, CRS.from_epsg(4326)).transform(x, y)
    ring = np.round(np.column_stack([lon, lat]), 7).tolist()
    box = [min(p[0] for p in ring), min(p[1] for p in ring), max(p[0] for p in ring), max(p[1] for p in ring)]
    return {"type": "Polygon", "coordinates": [ring]}, box


def _link(relation: str, target: str) -> dict[str, str]:
    return {"rel": relation, "href": target, "type": "application/json"}


def _item_link(target: str) -> dict[str, str]:
    return {**_link("item", target), "type": "application/geo+json"}


def _json(value: Mapping[str, Any]) -> bytes:
    return (json.dumps(value, indent=1, ensure_ascii=False, allow_nan=False) + "\n").encode()
