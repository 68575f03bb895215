"""Checks paths of a catalog: files outside its folder are only used if the catalog was made here, or on request."""

from __future__ import annotations

import os
import posixpath
from collections.abc import Callable, Iterable, Mapping

from cityflow.errors import CatalogError
from cityflow.io.catalog.stac_assets import Catalog

MADE_IN = "cityflow:made_in"
"""The folder that a catalog was made in, where it names files elsewhere: those that its maker named on the command line."""

REMEDY = "where you know whose catalog this is, add --allow-outside"


def is_inside(root: str, place: str) -> bool:
    """Whether a path or URL lies below a folder or URL, after every link and `..`.

    >>> is_inside("s3://a/cat", "s3://a/cat/items/1.json"), is_inside("s3://a/cat", "s3://a/cat/../b.json")
    (True, False)
    >>> is_inside("s3://a/cat", "/etc/passwd"), is_inside("/cat", "file:///cat/x"), is_inside("/cat", "/catalogue/x")
    (False, False, False)
    """
    return _insider(root)(place)


def _insider(root: str) -> Callable[[str], bool]:
    """`is_inside` for many places: what a folder really is is looked up once."""
    if "://" in root:
        start = f"{root.rstrip('/')}/"
        return lambda place: (
            place.startswith(start)
            and not posixpath.normpath(place[len(start) :]).startswith("..")
            and "%2e" not in place[len(start) :].lower()
        )
    top = os.path.realpath(root)
    folders: dict[str, bool] = {}

    def is_local_inside(place: str) -> bool:
        if "://" in place:
            return False
        folder, name = os.path.split(place)
        if name in ("", ".", "..") or os.path.islink(place):
            folder = os.path.realpath(place)
        if folder not in folders:
            folders[folder] = os.path.commonpath([top, os.path.realpath(folder)]) == top
        return folders[folder]

    return is_local_inside


def check_places(root: str, places: Iterable[str]) -> None:
    """Places that a catalog's own links name, which are never elsewhere in one that cityflow made.

    Raises
    ------
    CatalogError
        One leaves the catalog's folder.
    """
    inside = _insider(root)
    for place in places:
        if not inside(place):
            raise CatalogError(f"a link leaves the catalog: {place:.200}", where=root, remedy=REMEDY)


def refuse_outside(catalog: Catalog) -> None:
    """Make sure that the files of a catalog lie in its folder, or that it was made where it stands.

    Raises
    ------
    CatalogError
        One lies elsewhere, and the catalog came from elsewhere.
    """
    if (
        catalog.made_in
        and "://" not in catalog.href
        and os.path.realpath(catalog.made_in) == os.path.realpath(catalog.href)
    ):
        return
    inside = _insider(catalog.href)
    for asset in catalog.assets:
        if not inside(asset.href):
            raise CatalogError(
                f"'{asset.name}' lies outside the catalog, which was not made here: {asset.href:.200}", where=catalog.href,
                remedy=f"make it here with `cityflow catalog create`; {REMEDY}",
            )  # fmt: skip


def leaves(hrefs: Mapping[str, str]) -> bool:
    """Whether one of the references of items, relative to ``<folder>/items``, leaves the folder."""
    return any(
        "://" in h or posixpath.isabs(h) or posixpath.normpath(posixpath.join("items", h)).startswith("..")
        for h in hrefs.values()
    )
