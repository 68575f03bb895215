"""The catalog: a static STAC collection whose items are LiDAR files, rasters and outlines.

What STAC has a field for is written there (projection, file and point-cloud extensions, as plain JSON); the rest bears the prefix
``cityflow:``. An unknown kind of item is left alone, so that newer catalogs can be read.
"""

from __future__ import annotations

import hashlib
import json
import os
import posixpath
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import fsspec
import pystac
from pystac.stac_io import DefaultStacIO

from cityflow.core.grid import Bounds
from cityflow.core.reference import Reference
from cityflow.errors import CatalogError
from cityflow.io.reference import resolve

COLLECTION = "collection.json"
ASSET = "data"
KIND, CRS_KEY = "cityflow:kind", "cityflow:crs"
LIDAR, OUTLINES = "lidar", "outlines"
RASTERS = ("dsm", "dtm", "ortho")
SHA256_MULTIHASH = "1220"
"""Multihash prefix: function SHA2-256, 32 bytes."""
UNKNOWN_DATE = "1970-01-01"
"""STAC wants a date of every item; one with `cityflow:date_unknown` means none."""


@dataclass(frozen=True, slots=True)
class LidarAsset:
    """One LiDAR file.

    Attributes
    ----------
    name : unique in the catalog, from the file's name
    href : absolute path or URL
    checksum : SHA-256, 64 hexadecimal digits;  size : bytes
    bounds : x_min, y_min, x_max, y_max, metres;  z_range : lowest and highest
    points : number of points
    date : ISO 8601 day, empty where unknown
    classes : ASPRS classes seen when the catalog was made (in a sample, for large files)
    returns : largest number of returns
    crs_in_file : name of the CRS in the file's header, empty where it has none
    """

    name: str
    href: str
    checksum: str
    size: int
    bounds: Bounds
    z_range: tuple[float, float]
    points: int
    date: str = ""
    classes: tuple[int, ...] = ()
    returns: int = 1
    crs_in_file: str = ""


@dataclass(frozen=True, slots=True)
class OutlineAsset:
    """The file of given outlines.

    Attributes
    ----------
    name, href, checksum, size, date : as in `LidarAsset`
    bounds : metres, in the catalog's CRS
    count : number of features
    id_column, id_format, layer : how to read it, see `io.vector.read_outlines`
    crs_in_file : name of the file's own CRS, empty where it has none
    """

    name: str
    href: str
    checksum: str
    size: int
    bounds: Bounds
    count: int
    id_column: str | None = None
    id_format: str | None = None
    layer: str | None = None
    date: str = ""
    crs_in_file: str = ""


@dataclass(frozen=True, slots=True)
class RasterAsset:
    """A given DSM, DTM or ortho image; `kind` is one of ``dsm``, ``dtm``, ``ortho``; `cell` in metres."""

    name: str
    kind: str
    href: str
    checksum: str
    size: int
    bounds: Bounds
    cell: float
    shape: tuple[int, int]
    date: str = ""
    crs_in_file: str = ""


@dataclass(frozen=True, slots=True)
class Catalog:
    """A survey: what there is, where it lies, and in which reference.

    Attributes
    ----------
    href : the catalog's folder, absolute path or URL
    reference : that of every coordinate in here, and of a run
    date : newest ISO day of the LiDAR, else of anything; empty where unknown
    bounds : of all LiDAR files, or of all items where there is no LiDAR
    rasters : kind → raster
    """

    href: str
    title: str
    reference: Reference
    licence: str
    attribution: str
    lidar: tuple[LidarAsset, ...]
    outlines: OutlineAsset | None = None
    rasters: Mapping[str, RasterAsset] = field(default_factory=dict)

    @property
    def assets(self) -> tuple[LidarAsset | OutlineAsset | RasterAsset, ...]:
        given = (self.outlines,) if self.outlines is not None else ()
        return *self.lidar, *given, *self.rasters.values()

    @property
    def date(self) -> str:
        return max((a.date for a in self.lidar if a.date), default=max((a.date for a in self.assets), default=""))

    @property
    def bounds(self) -> Bounds:
        return united([a.bounds for a in self.lidar or self.assets])


class _FsspecIO(DefaultStacIO):
    """pystac's reader for any URL that fsspec opens."""

    def read_text_from_href(self, href: str) -> str:
        with fsspec.open(href, "rt", encoding="utf-8") as file:
            return str(file.read())


def united(bounds: list[Bounds]) -> Bounds:
    """The box around several.

    >>> united([(0, 0, 1, 1), (2, -1, 3, 0)])
    (0, -1, 3, 1)
    """
    return min(b[0] for b in bounds), min(b[1] for b in bounds), max(b[2] for b in bounds), max(b[3] for b in bounds)


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
        items = sorted(_items(collection), key=lambda item: item.id)
        code = str(collection.extra_fields[CRS_KEY])
        lidar = tuple(_lidar(item) for item in items if _kind(item) == LIDAR)
        outlines = [_outlines(item) for item in items if _kind(item) == OUTLINES]
        rasters = {_kind(item): _raster(item) for item in items if _kind(item) in RASTERS}
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
    )


def _collection_href(folder: str) -> str:
    place = folder if "://" in folder else Path(folder).absolute().as_posix()
    return place if place.endswith(".json") else f"{place.rstrip('/')}/{COLLECTION}"


def _items(collection: pystac.Collection) -> Iterator[pystac.Item]:
    return iter(collection.get_items(recursive=True))


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
