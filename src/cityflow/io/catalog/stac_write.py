"""Writing the catalog that `io.catalog.stac` reads."""

from __future__ import annotations

import hashlib
import json
from datetime import UTC, datetime
from functools import lru_cache
from pathlib import Path
from typing import Any

import pystac
import shapely

from cityflow.core.grid import Bounds
from cityflow.core.reference import Reference
from cityflow.io.catalog.catalog_kinds import KIND
from cityflow.io.catalog.stac import (
    COLLECTION,
    LIDAR,
    OUTLINES,
    SPARSE,
    UNKNOWN_DATE,
    Asset,
    Catalog,
    ImageAsset,
    LidarAsset,
    OutlineAsset,
    RasterAsset,
    SparseAsset,
)
from cityflow.io.catalog.stac_images import PERSPECTIVE_IMAGERY, VIEW, image_properties
from cityflow.io.catalog.stac_items import ASSET, CRS_KEY, SHA256_MULTIHASH, TABLE, TABLE_ASSET, item_place
from cityflow.io.catalog.stac_orientation import ORIENTATION, orientation_tree
from cityflow.io.catalog.stac_outside import MADE_IN, leaves
from cityflow.io.catalog.stac_table import ItemTable
from cityflow.io.crs import crs_of, geographic_bounds, vertical_datum
from cityflow.io.points.las_header import LasHeader
from cityflow.io.rasters.raster_header import RasterHeader

PROJECTION = "https://stac-extensions.github.io/projection/v2.0.0/schema.json"
FILE = "https://stac-extensions.github.io/file/v2.1.0/schema.json"
POINT_CLOUD = "https://stac-extensions.github.io/pointcloud/v1.0.0/schema.json"
WHOLE_EARTH = [-180.0, -90.0, 180.0, 90.0]
MEDIA = {
    ".laz": "application/vnd.laszip",
    ".las": "application/vnd.las",
    ".gpkg": "application/geopackage+sqlite3",
    ".geojson": "application/geo+json",
    ".json": "application/geo+json",
    ".tif": "image/tiff; application=geotiff",
    ".tiff": "image/tiff; application=geotiff",
    ".jpg": "image/jpeg",
    ".jpeg": "image/jpeg",
    ".png": "image/png",
}


def write_catalog(folder: Path, catalog: Catalog, hrefs: dict[str, str], made_in: str = "") -> list[Path]:
    """Write the collection and its items into a folder; the collection last.

    Parameters
    ----------
    hrefs : name of an asset → how its item refers to the file: relative to ``<folder>/items``, or absolute
    made_in : the folder where the catalog will stand; noted where a file lies outside

    Returns
    -------
    The files written.
    """
    written, table = [], ItemTable()
    links = [{"rel": "root", "href": f"./{COLLECTION}", "type": "application/json"}]
    for asset in catalog.assets:
        item = item_of(asset, catalog.reference, hrefs[asset.name])
        item["links"] = [_link("root"), _link("parent"), _link("collection")]
        item["collection"] = _identifier(catalog.title)
        # There may be very many images; their items have no indentation.
        text = _json_text(item, None if isinstance(asset, ImageAsset) else 2)
        written.append(_write(folder / item_place(asset.name), text))
        links.append({"rel": "item", "href": f"./{item_place(asset.name)}", "type": "application/geo+json"})
        table.add(item, text)
    data = table.as_bytes()
    # After its items: one that is younger than the table may have changed since.
    written.append(_write(folder / TABLE, data))
    place = {MADE_IN: made_in} if made_in and leaves(hrefs) else {}
    tree = {**collection_of(catalog), **place, "assets": {TABLE_ASSET: _table_asset(data)}, "links": links}
    written.append(_write(folder / COLLECTION, _json_text(tree)))
    return written


def _table_asset(data: bytes) -> dict[str, Any]:
    return {
        "href": f"./{TABLE}", "type": "application/vnd.apache.parquet", "title": "All items as one table (stac-geoparquet)",
        "roles": ["collection-mirror"], "file:checksum": SHA256_MULTIHASH + hashlib.sha256(data).hexdigest(), "file:size": len(data),
    }  # fmt: skip


def _link(relation: str) -> dict[str, str]:
    return {"rel": relation, "href": f"../{COLLECTION}", "type": "application/json"}


def _json_text(tree: dict[str, Any], indent: int | None = 2) -> bytes:
    return (json.dumps(tree, indent=indent, ensure_ascii=False, allow_nan=False) + "\n").encode()


def _write(path: Path, data: bytes) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)
    return path


def collection_of(catalog: Catalog) -> dict[str, Any]:
    """The collection as JSON, without links.

    In a local frame nothing has a place on Earth: the spatial extent, which STAC demands, is then the whole Earth.
    """
    degrees = geographic_bounds(catalog.reference, catalog.bounds)
    days = sorted({a.date for a in catalog.assets if a.date})
    interval: list[datetime | None] = [_day(days[0]), _day(days[-1])] if days else [None, None]
    collection = pystac.Collection(
        id=_identifier(catalog.title),
        title=catalog.title,
        description=f"{catalog.title}: {_contents(catalog)}",
        license=catalog.licence or "other",
        extent=pystac.Extent(
            pystac.SpatialExtent([list(degrees) if degrees else WHOLE_EARTH]), pystac.TemporalExtent([interval])
        ),
        extra_fields={
            CRS_KEY: catalog.reference.code,
            "cityflow:crs_name": catalog.reference.name,
            "cityflow:vertical_datum": vertical_datum(catalog.reference),
            "cityflow:attribution": catalog.attribution,
            "cityflow:bbox": list(catalog.bounds),
            **({ORIENTATION: orientation_tree(catalog.orientation)} if catalog.orientation is not None else {}),
        },
    )
    return collection.to_dict(include_self_link=False)


def _contents(catalog: Catalog) -> str:
    parts = [f"{len(catalog.lidar)} LiDAR files"] if catalog.lidar or not catalog.images else []
    parts += [f"{len(catalog.images)} oriented images"] if catalog.images else []
    parts += [f"{catalog.outlines.count} building outlines"] if catalog.outlines else []
    return ", ".join(parts)


def _identifier(title: str) -> str:
    return "-".join("".join(c if c.isalnum() else " " for c in title.lower()).split()) or "survey"


def _day(text: str) -> datetime:
    return datetime.fromisoformat(f"{text}T00:00:00+00:00").astimezone(UTC)


def item_of(asset: Asset, reference: Reference, href: str) -> dict[str, Any]:
    """One asset's item as JSON, without links.

    It has a geometry in degrees where the reference is known; else none, as STAC asks of things without a place, and its
    extent stands in ``proj:bbox`` alone.
    """
    degrees = geographic_bounds(reference, asset.bounds)
    properties, extensions = _properties(asset, reference), [FILE, PROJECTION]
    properties |= {**_crs_properties(reference), "proj:bbox": list(asset.bounds)}
    if isinstance(asset, LidarAsset | SparseAsset):
        extensions.append(POINT_CLOUD)
    if isinstance(asset, ImageAsset):
        extensions += [PERSPECTIVE_IMAGERY, VIEW]
    elif not isinstance(asset, SparseAsset) and asset.crs_in_file:
        properties["cityflow:crs_in_file"] = asset.crs_in_file
    if not asset.date:
        properties["cityflow:date_unknown"] = True
    item = pystac.Item(
        id=asset.name,
        geometry=shapely.geometry.mapping(shapely.box(*degrees)) if degrees else None,
        bbox=list(degrees) if degrees else None,
        datetime=_day(asset.date or UNKNOWN_DATE),
        properties=properties,
        stac_extensions=sorted(extensions),
    )
    item.add_asset(ASSET, _asset(asset, href))
    return item.to_dict(include_self_link=False)


@lru_cache(maxsize=8)
def _crs_properties(reference: Reference) -> dict[str, Any]:
    crs = crs_of(reference)
    if crs is not None and crs.to_epsg() is None:
        # `proj:code` takes registered codes only.
        return {"proj:code": None, "proj:projjson": crs.to_json_dict()}
    return {"proj:code": None if reference.is_local else reference.code}


def _asset(asset: Asset, href: str) -> pystac.Asset:
    suffix = Path(asset.href).suffix.lower()
    extra = {"file:checksum": SHA256_MULTIHASH + asset.checksum, "file:size": asset.size}
    return pystac.Asset(_as_reference(href), media_type=MEDIA.get(suffix), roles=["data"], extra_fields=extra)


def _as_reference(href: str) -> str:
    """A path as a URI reference: the characters that mean something there are escaped, others stay readable."""
    return href if "://" in href else href.replace("%", "%25").replace("#", "%23").replace("?", "%3F")


def _properties(asset: Asset, reference: Reference) -> dict[str, Any]:
    if isinstance(asset, ImageAsset):
        return image_properties(asset, reference)
    if isinstance(asset, SparseAsset):
        return {
            KIND: SPARSE,
            "pc:count": asset.points,
            "pc:type": "eopc",
            "pc:encoding": "LAZ",
            "pc:schemas": [{"name": n, "size": s, "type": t} for n, s, t in _DIMENSIONS[:3]],
            "cityflow:z_range": list(asset.z_range),
        }
    if isinstance(asset, LidarAsset):
        return {
            KIND: LIDAR,
            "pc:count": asset.points,
            "pc:type": "lidar",
            "pc:encoding": Path(asset.href).suffix.lstrip(".").upper(),
            "pc:schemas": [{"name": n, "size": s, "type": t} for n, s, t in _DIMENSIONS],
            "cityflow:z_range": list(asset.z_range),
            "cityflow:classes": list(asset.classes),
            "cityflow:returns": asset.returns,
        }
    if isinstance(asset, OutlineAsset):
        how = {"id_column": asset.id_column, "id_format": asset.id_format, "layer": asset.layer}
        return {KIND: OUTLINES, "cityflow:count": asset.count} | {
            f"cityflow:{k}": v for k, v in how.items() if v is not None
        }
    x_min, _, _, y_max = asset.bounds
    transform = [asset.cell, 0.0, x_min, 0.0, -asset.cell, y_max]
    return {KIND: asset.kind, "proj:shape": list(asset.shape), "proj:transform": transform}


_DIMENSIONS = (
    ("X", 8, "floating"),
    ("Y", 8, "floating"),
    ("Z", 8, "floating"),
    ("Classification", 1, "unsigned"),
    ("ReturnNumber", 1, "unsigned"),
    ("NumberOfReturns", 1, "unsigned"),
)
"""What is read of a point; files may hold more."""


def lidar_asset(header: LasHeader, name: str, checksum: str, classes: tuple[int, ...], date: str = "") -> LidarAsset:
    """A LiDAR file as the catalog describes it; without a given date, that of the header."""
    return LidarAsset(
        name=name,
        href=header.path,
        checksum=checksum,
        size=header.size,
        bounds=_rounded(header.bounds),
        z_range=(round(header.z_range[0], 4), round(header.z_range[1], 4)),
        points=header.points,
        date=date or (header.created.isoformat() if header.created else ""),
        classes=classes,
        returns=header.returns,
        crs_in_file=header.crs.name if header.crs is not None else "",
    )


def raster_asset(header: RasterHeader, name: str, kind: str, checksum: str, size: int, date: str = "") -> RasterAsset:
    """A raster as the catalog describes it."""
    crs = header.crs.name if header.crs is not None else ""
    return RasterAsset(name, kind, header.path, checksum, size, header.bounds, header.cell, header.shape, date, crs)


def _rounded(bounds: Bounds) -> Bounds:
    x_min, y_min, x_max, y_max = (round(v, 4) for v in bounds)
    return x_min, y_min, x_max, y_max
