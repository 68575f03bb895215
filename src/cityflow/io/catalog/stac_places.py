"""Where the items of a collection and of its children are."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Mapping
from typing import Any

import pystac
from pystac.utils import make_absolute_href

from cityflow.io.catalog.stac_files import contents
from cityflow.io.catalog.stac_outside import check_places
from cityflow.io.given_files import json_of

_PLAIN = re.compile(r"\./(?!.*\.\.)[\w./-]+")
"""A reference downwards without anything that has a meaning in a URL."""


def links_of(tree: Mapping[str, Any], relation: str) -> list[str]:
    """References of a relation, in their order. Raises TypeError where one is no text."""
    found = [link["href"] for link in tree.get("links", ()) if link.get("rel") == relation]
    for href in found:
        if not isinstance(href, str):
            raise TypeError(f"a link leads to {href!r:.60}")
    return found


def item_places(tree: Mapping[str, Any], href: str, allow_outside: bool) -> list[str]:
    """Places of all items, child by child.

    Parameters
    ----------
    tree : the collection;  href : its own place

    Raises
    ------
    ValueError
        A child is its own ancestor.
    CatalogError
        A link leads elsewhere, and may not.
    """
    base = posixpath.dirname(href)
    left, seen, places = [(tree, href)], {href}, []
    while left:
        node, place = left.pop(0)
        items, children = ([_absolute(link, place) for link in links_of(node, kind)] for kind in ("item", "child"))
        if not allow_outside:
            check_places(base, [*items, *children])
        places += items
        for child in children:
            if child in seen:
                raise ValueError(f"its child {child} is listed twice, or is its own ancestor")
            seen.add(child)
            found = json_of(contents(child))
            pystac.Catalog.from_dict({**found, "links": []}, href=child, migrate=True)
            left.append((found, child))
    return places


def _absolute(link: str, place: str) -> str:
    if _PLAIN.fullmatch(link):
        return f"{posixpath.dirname(place)}/{posixpath.normpath(link)}"
    return str(make_absolute_href(link, place))
