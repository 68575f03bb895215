"""Items of a catalog as values."""

from __future__ import annotations

import os
from typing import Any
from urllib.parse import unquote

import pystac

from cityflow.io.catalog.catalog_kinds import KIND
from cityflow.io.catalog.stac_assets import (
    LidarAsset,
    OutlineAsset,
    RasterAsset,
    SparseAsset,
)
from cityflow.io.orientation.oriented_images import FARTHEST_M

ASSET = "data"


CRS_KEY = "cityflow:crs"


SHA256_MULTIHASH = "1220"
"""Multihash prefix: function SHA2-256, 32 bytes."""
ITEM_SIZE, ITEM_MD5 = "cityflow:item_size", "cityflow:item_md5"
"""Columns of the table of items: size and MD5 of the item's own file."""
TABLE, TABLE_ASSET = "items/items.parquet", "items"
"""The table of all items, and the collection's asset that names it."""


class StaleTable(ValueError):
    """The table of items is damaged, or not that of the items."""


def item_place(name: str) -> str:
    """Where the item of an asset lies in the catalog's folder."""
    return f"items/{name}.json"


def kind_of(item: pystac.Item) -> str:
    return str(item.properties.get(KIND, ""))


def _common(item: pystac.Item) -> dict[str, Any]:
    asset = item.assets[ASSET]
    extra = asset.extra_fields
    x_min, y_min, x_max, y_max = _finite(item, "proj:bbox")
    unknown = item.properties.get("cityflow:date_unknown", False) or item.datetime is None
    return {
        "name": item.id,
        "href": _absolute(item, asset),
        "checksum": str(extra["file:checksum"]).removeprefix(SHA256_MULTIHASH),
        "size": int(extra["file:size"]),
        "bounds": (x_min, y_min, x_max, y_max),
        "date": "" if unknown or item.datetime is None else item.datetime.date().isoformat(),
        "crs_in_file": str(item.properties.get("cityflow:crs_in_file", "")),
    }


def _finite(item: pystac.Item, key: str) -> list[float]:
    """Numbers of a property; places and heights beyond any CRS are mistakes."""
    values = [float(v) for v in item.properties[key]]
    if not all(abs(v) <= FARTHEST_M for v in values):
        raise ValueError(f"{key} of '{item.id}' is {item.properties[key]!r:.100}")
    return values


def _absolute(item: pystac.Item, asset: pystac.Asset) -> str:
    href = asset.get_absolute_href()
    if href is None:
        raise ValueError(f"item {item.id} has an asset without an address")
    return href if "://" in href else os.path.normpath(unquote(href))


def lidar_of(item: pystac.Item) -> LidarAsset:
    p = item.properties
    low, high = _finite(item, "cityflow:z_range")
    return LidarAsset(
        **_common(item),
        z_range=(low, high),
        points=int(p["pc:count"]),
        classes=tuple(int(c) for c in p.get("cityflow:classes", ())),
        returns=int(p.get("cityflow:returns", 1)),
    )


def sparse_of(item: pystac.Item) -> SparseAsset:
    p, common = item.properties, _common(item)
    common.pop("crs_in_file")
    low, high = _finite(item, "cityflow:z_range")
    return SparseAsset(**common, z_range=(low, high), points=int(p["pc:count"]))


def outlines_of(item: pystac.Item) -> OutlineAsset:
    p = item.properties
    return OutlineAsset(
        **_common(item),
        count=int(p["cityflow:count"]),
        id_column=p.get("cityflow:id_column"),
        id_format=p.get("cityflow:id_format"),
        layer=p.get("cityflow:layer"),
    )


def raster_of(item: pystac.Item) -> RasterAsset:
    p = item.properties
    rows, cols = p["proj:shape"]
    return RasterAsset(
        **_common(item), kind=kind_of(item), cell=float(p["proj:transform"][0]), shape=(int(rows), int(cols))
    )
