"""What kinds of items a local catalog has, told without the packages that read it."""

from __future__ import annotations

from pathlib import Path

from cityflow.errors import CatalogError
from cityflow.io.given_files import json_of, read_small

KIND = "cityflow:kind"
"""Property of an item: ``lidar``, ``image``, ``outlines``, ``sparse``, or the layer of a raster."""
MOST_ITEMS = 200
"""More items take longer to read than the packages take to load."""


def kinds_in(collection: Path) -> frozenset[str] | None:
    """Kinds of the items of a collection; None where they are many or elsewhere, or something does not fit: whoever reads the catalog says so."""
    try:
        tree = json_of(read_small(collection))
        links = [(str(link["rel"]), str(link["href"])) for link in tree["links"]]
        items = [href for relation, href in links if relation == "item"]
        elsewhere = any(":" in href or href.startswith("/") or ".." in href for href in items)
        if len(items) > MOST_ITEMS or elsewhere or any(relation == "child" for relation, _ in links):
            return None
        found = (json_of(read_small(collection.parent / href)) for href in items)
        return frozenset(str(item["properties"][KIND]) for item in found)
    except (OSError, ValueError, KeyError, TypeError, CatalogError):
        return None
