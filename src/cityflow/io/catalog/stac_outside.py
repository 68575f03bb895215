"""Checks paths of a catalog: files outside its folder are only used if the catalog was made here, or on request."""

from __future__ import annotations

import os
import posixpath
from collections.abc import Mapping

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
    if "://" in root:
        rest = place.removeprefix(f"{root.rstrip('/')}/")
        return rest != place and not posixpath.normpath(rest).startswith("..") and "%2e" not in rest.lower()
    if "://" in place:
        return False
    top, file = os.path.realpath(root), os.path.realpath(place)
    return os.path.commonpath([top, file]) == top


def check_place(root: str, place: str) -> str:
    """A place that a catalog's own links name, which are never elsewhere in one that cityflow made.

    Raises
    ------
    CatalogError
        It leaves the catalog's folder.
    """
    if not is_inside(root, place):
        raise CatalogError(f"a link leaves the catalog: {place:.200}", where=root, remedy=REMEDY)
    return place


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
    for asset in catalog.assets:
        if not is_inside(catalog.href, asset.href):
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
