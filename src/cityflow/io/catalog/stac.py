"""The catalog: a static STAC collection whose items are LiDAR files, oriented images, rasters and outlines.

What STAC has a field for is written there (projection, file and point-cloud extensions, as plain JSON); the rest bears the prefix
``cityflow:``. An unknown kind of item is left alone, so that newer catalogs can be read.
"""

from __future__ import annotations

import hashlib
import posixpath
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar

import fsspec
import pystac

from cityflow.errors import CatalogError
from cityflow.io.catalog.catalog_kinds import KIND
from cityflow.io.catalog.stac_assets import (
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
from cityflow.io.catalog.stac_files import contents
from cityflow.io.catalog.stac_item_reader import MISFITS, naming, read_items
from cityflow.io.catalog.stac_items import (
    ASSET,
    CRS_KEY,
    SHA256_MULTIHASH,
    kind_of,
    lidar_of,
    outlines_of,
    raster_of,
    sparse_of,
)
from cityflow.io.catalog.stac_orientation import ORIENTATION, orientation_of
from cityflow.io.catalog.stac_outside import MADE_IN
from cityflow.io.crs import resolve
from cityflow.io.given_files import json_of, read_small

__all__ = [
    "ASSET", "COLLECTION", "CRS_KEY", "IMAGE", "KIND", "LIDAR", "OUTLINES", "RASTERS", "SHA256_MULTIHASH", "SPARSE", "UNKNOWN_DATE",
    "Asset", "Catalog", "ImageAsset", "LidarAsset", "OutlineAsset", "RasterAsset", "SparseAsset",
    "is_catalog", "read_catalog", "sha256_of", "united",
]  # fmt: skip

COLLECTION = "collection.json"
UNKNOWN_DATE = "1970-01-01"
"""STAC wants a date of every item; one with `cityflow:date_unknown` means none."""
T = TypeVar("T")


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
        tree = json_of(read_small(Path(folder) / COLLECTION))
    except (OSError, ValueError, CatalogError):
        return False
    return isinstance(tree, dict) and CRS_KEY in tree


def read_catalog(folder: str | Path, *, allow_outside: bool = False) -> Catalog:
    """The catalog in a local folder or under a URL (its folder, or its ``collection.json``).

    Parameters
    ----------
    allow_outside : its links may lead out of its folder

    Raises
    ------
    CatalogError
        Where there is none, it is damaged, it lacks what a run needs, or a link leads elsewhere.
    """
    href = _collection_href(str(folder))
    base = posixpath.dirname(href)
    try:
        tree = json_of(contents(href))
        own_links = [link for link in tree.get("links", ()) if link.get("rel") not in ("item", "child")]
        collection = pystac.Collection.from_dict({**tree, "links": own_links}, href=href, migrate=True)
        found, note = read_items(tree, href, allow_outside)
        items = sorted(found.rest, key=lambda item: str(item.id))
        code, title = str(collection.extra_fields[CRS_KEY]), collection.title or collection.id
        made_in = collection.extra_fields.get(MADE_IN, "")
        if not isinstance(title, str) or not isinstance(made_in, str):
            raise ValueError(f"its title is {title!r:.60}, not a text")
        lidar = tuple(_made(lidar_of, item) for item in items if kind_of(item) == LIDAR)
        outlines = [_made(outlines_of, item) for item in items if kind_of(item) == OUTLINES]
        sparse = [_made(sparse_of, item) for item in items if kind_of(item) == SPARSE]
        rasters = _rasters(items)
        orientation = orientation_of(collection.extra_fields.get(ORIENTATION))
    except (FileNotFoundError, NotADirectoryError) as error:
        remedy = "make one with `cityflow catalog create`, or check the path"
        raise CatalogError(f"no catalog here ({error})", where=str(folder), remedy=remedy) from error
    except KeyError as error:
        raise CatalogError(
            f"the catalog lacks {error}", where=href, remedy="make it with `cityflow catalog create`"
        ) from error
    except RecursionError:
        raise CatalogError("the catalog is nested too deeply", where=href, remedy="check who made it") from None
    except (*MISFITS, OSError) as error:
        raise CatalogError(
            f"the catalog is damaged ({error!s:.300})",
            where=href,
            remedy="make it again with `cityflow catalog create`",
        ) from error
    if len(outlines) > 1:
        raise CatalogError(f"the catalog has {len(outlines)} outline files", where=href, remedy="join them into one")
    return Catalog(
        href=base,
        title=title,
        reference=resolve(code),
        licence=collection.license,
        attribution=str(collection.extra_fields.get("cityflow:attribution", "")),
        lidar=lidar,
        outlines=outlines[0] if outlines else None,
        rasters=rasters,
        images=tuple(sorted(found.images, key=lambda image: image.name)),
        sparse=sparse[0] if sparse else None,
        orientation=orientation,
        made_in=made_in,
        notes=(note,) if note else (),
    )


def _made(make: Callable[[pystac.Item], T], item: pystac.Item) -> T:
    with naming(str(item.get_self_href())):
        return make(item)


def _rasters(items: Sequence[pystac.Item]) -> dict[str, RasterAsset]:
    """By kind; further ones of a kind (orthos of other epochs) as ``ortho-2``, ``ortho-3``, in the order of their ids."""
    found: dict[str, RasterAsset] = {}
    for item in items:
        kind = kind_of(item)
        if kind in RASTERS:
            number = 1 + sum(r.kind == kind for r in found.values())
            found[kind if number == 1 else f"{kind}-{number}"] = _made(raster_of, item)
    return found


def _collection_href(folder: str) -> str:
    place = folder if "://" in folder else Path(folder).absolute().as_posix()
    return place if place.endswith(".json") else f"{place.rstrip('/')}/{COLLECTION}"
