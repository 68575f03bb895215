"""The catalog: a static STAC collection whose items are LiDAR files, oriented images, rasters and outlines.

What STAC has a field for is written there (projection, file and point-cloud extensions, as plain JSON); the rest bears the prefix
``cityflow:``. An unknown kind of item is left alone, so that newer catalogs can be read.
"""

from __future__ import annotations

import hashlib
import json
import os
import posixpath
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import fsspec
import pystac
from pystac.stac_io import DefaultStacIO

from cityflow.errors import CatalogError
from cityflow.io.reference import resolve
from cityflow.io.stac_assets import (
    IMAGE,
    LIDAR,
    OUTLINES,
    RASTERS,
    SPARSE,
    Asset,
    Catalog,
    ImageAsset,
    LidarAsset,
    OutlineAsset,
    RasterAsset,
    SparseAsset,
    united,
)
from cityflow.io.stac_images import image_of_item

__all__ = [
    "ASSET", "COLLECTION", "CRS_KEY", "IMAGE", "KIND", "LIDAR", "OUTLINES", "RASTERS", "SHA256_MULTIHASH", "SPARSE", "UNKNOWN_DATE",
    "Asset", "Catalog", "ImageAsset", "LidarAsset", "OutlineAsset", "RasterAsset", "SparseAsset",
    "is_catalog", "read_catalog", "sha256_of", "united",
]  # fmt: skip

COLLECTION = "collection.json"
ASSET = "data"
KIND, CRS_KEY = "cityflow:kind", "cityflow:crs"
SHA256_MULTIHASH = "1220"
"""Multihash prefix: function SHA2-256, 32 bytes."""
UNKNOWN_DATE = "1970-01-01"
"""STAC wants a date of every item; one with `cityflow:date_unknown` means none."""
BATCH = 500
"""Items fetched at once from a remote place."""


class _FsspecIO(DefaultStacIO):
    """pystac's reader for any URL that fsspec opens."""

    def read_text_from_href(self, href: str) -> str:
        with fsspec.open(href, "rt", encoding="utf-8") as file:
            return str(file.read())


def sha256_of(href: str | Path) -> tuple[str, int]:
    """SHA-256 (hexadecimal) and size in bytes of a local or remote file."""
    digest, size = hashlib.sha256(), 0
    with fsspec.open(str(href), "rb") as file:
        while block := file.read(1 << 20):
            digest.update(block)
            size += len(block)
    return digest.hexdigest(), size


def is_catalog(folder: str | Path) -> bool:
    """True where a local folder holds a catalog of ours."""
    try:
        tree = json.loads((Path(folder) / COLLECTION).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    return isinstance(tree, dict) and CRS_KEY in tree


def read_catalog(folder: str | Path) -> Catalog:
    """The catalog in a local folder or under a URL (its folder, or its ``collection.json``).

    Raises
    ------
    CatalogError
        Where there is none, it is damaged, or it lacks what a run needs.
    """
    href = _collection_href(str(folder))
    base = posixpath.dirname(href)
    try:
        collection = pystac.Collection.from_file(href, stac_io=_FsspecIO())
        images, rest = _items(collection)
        items = sorted(rest, key=lambda item: item.id)
        code = str(collection.extra_fields[CRS_KEY])
        lidar = tuple(_lidar(item) for item in items if _kind(item) == LIDAR)
        outlines = [_outlines(item) for item in items if _kind(item) == OUTLINES]
        sparse = [_sparse(item) for item in items if _kind(item) == SPARSE]
        rasters = _rasters(items)
    except (FileNotFoundError, NotADirectoryError) as error:
        remedy = "make one with `cityflow catalog create`, or check the path"
        raise CatalogError(f"no catalog here ({error})", where=str(folder), remedy=remedy) from error
    except KeyError as error:
        raise CatalogError(
            f"the catalog lacks {error}", where=href, remedy="make it with `cityflow catalog create`"
        ) from error
    except (ValueError, TypeError, pystac.STACError, pystac.STACTypeError) as error:
        raise CatalogError(
            f"the catalog is damaged ({error})", where=href, remedy="make it again with `cityflow catalog create`"
        ) from error
    if len(outlines) > 1:
        raise CatalogError(f"the catalog has {len(outlines)} outline files", where=href, remedy="join them into one")
    return Catalog(
        href=base,
        title=collection.title or collection.id,
        reference=resolve(code),
        licence=collection.license,
        attribution=str(collection.extra_fields.get("cityflow:attribution", "")),
        lidar=lidar,
        outlines=outlines[0] if outlines else None,
        rasters=rasters,
        images=tuple(sorted(images, key=lambda image: image.name)),
        sparse=sparse[0] if sparse else None,
    )


def _rasters(items: Sequence[pystac.Item]) -> dict[str, RasterAsset]:
    """By kind; further ones of a kind (orthos of other epochs) as ``ortho-2``, ``ortho-3``, in the order of their ids."""
    found: dict[str, RasterAsset] = {}
    for item in items:
        kind = _kind(item)
        if kind in RASTERS:
            number = 1 + sum(r.kind == kind for r in found.values())
            found[kind if number == 1 else f"{kind}-{number}"] = _raster(item)
    return found


def _collection_href(folder: str) -> str:
    place = folder if "://" in folder else Path(folder).absolute().as_posix()
    return place if place.endswith(".json") else f"{place.rstrip('/')}/{COLLECTION}"


def _items(collection: pystac.Collection) -> tuple[list[ImageAsset], list[pystac.Item]]:
    """Images, and all other items.

    There may be very many images, and pystac's objects are slow: their items are read as plain JSON.
    """
    images, rest = [], []
    places = [str(link.get_absolute_href()) for link in collection.get_item_links()]
    for place, text in _texts(places):
        tree = json.loads(text)
        if tree["properties"].get(KIND) == IMAGE:
            images.append(image_of_item(tree, place, ASSET))
        else:
            rest.append(pystac.Item.from_dict(tree, href=place))
    for child in collection.get_children():
        rest += child.get_items(recursive=True)
    return images, rest


def _texts(places: list[str]) -> Iterator[tuple[str, str | bytes]]:
    """Contents of files; remote ones many at a time."""
    for start in range(0, len(places), BATCH):
        batch = places[start : start + BATCH]
        if any("://" in place for place in batch):
            fs, _ = fsspec.core.url_to_fs(batch[0])
            paths = [fs._strip_protocol(place) for place in batch]
            contents = fs.cat(paths)
            yield from ((place, contents[path]) for place, path in zip(batch, paths, strict=True))
        else:
            yield from ((place, Path(place).read_text(encoding="utf-8")) for place in batch)


def _kind(item: pystac.Item) -> str:
    return str(item.properties.get(KIND, ""))


def _common(item: pystac.Item) -> dict[str, Any]:
    asset = item.assets[ASSET]
    extra = asset.extra_fields
    x_min, y_min, x_max, y_max = (float(v) for v in item.properties["proj:bbox"])
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


def _absolute(item: pystac.Item, asset: pystac.Asset) -> str:
    href = asset.get_absolute_href()
    if href is None:
        raise ValueError(f"item {item.id} has an asset without a place")
    return href if "://" in href else os.path.normpath(unquote(href))


def _lidar(item: pystac.Item) -> LidarAsset:
    p = item.properties
    low, high = p["cityflow:z_range"]
    return LidarAsset(
        **_common(item),
        z_range=(float(low), float(high)),
        points=int(p["pc:count"]),
        classes=tuple(int(c) for c in p.get("cityflow:classes", ())),
        returns=int(p.get("cityflow:returns", 1)),
    )


def _sparse(item: pystac.Item) -> SparseAsset:
    p, common = item.properties, _common(item)
    common.pop("crs_in_file")
    low, high = p["cityflow:z_range"]
    return SparseAsset(**common, z_range=(float(low), float(high)), points=int(p["pc:count"]))


def _outlines(item: pystac.Item) -> OutlineAsset:
    p = item.properties
    return OutlineAsset(
        **_common(item),
        count=int(p["cityflow:count"]),
        id_column=p.get("cityflow:id_column"),
        id_format=p.get("cityflow:id_format"),
        layer=p.get("cityflow:layer"),
    )


def _raster(item: pystac.Item) -> RasterAsset:
    p = item.properties
    rows, cols = p["proj:shape"]
    return RasterAsset(
        **_common(item), kind=_kind(item), cell=float(p["proj:transform"][0]), shape=(int(rows), int(cols))
    )
