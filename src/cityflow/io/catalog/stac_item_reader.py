"""Items of a collection as images and as pystac's items: from its table where that fits them, else one by one."""

from __future__ import annotations

import posixpath
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import pystac

from cityflow.core.camera import Camera
from cityflow.io.catalog.catalog_kinds import KIND
from cityflow.io.catalog.stac_assets import IMAGE, ImageAsset
from cityflow.io.catalog.stac_files import texts
from cityflow.io.catalog.stac_images import image_of_item
from cityflow.io.catalog.stac_items import ASSET, TABLE, StaleTable, item_place
from cityflow.io.catalog.stac_places import item_places, links_of
from cityflow.io.given_files import json_of

MISFITS = (ValueError, TypeError, AttributeError, IndexError, OverflowError, pystac.STACError, pystac.STACTypeError)
"""What JSON that is no catalog of ours may raise on its way into values."""
TABLE_FROM = 1000
"""Fewer items are read about as fast as their table, with the packages that it needs; measured by `benchmarks/catalog_scale.py`."""
Tree = dict[str, Any]


@dataclass(slots=True)
class Items:
    """There may be very many images, and pystac's objects are slow: images are made of plain JSON."""

    images: list[ImageAsset] = field(default_factory=list)
    rest: list[pystac.Item] = field(default_factory=list)
    _cameras: dict[Any, Camera] = field(default_factory=dict)

    def add_image(self, tree: Tree, place: str) -> None:
        with naming(place):
            self.images.append(image_of_item(tree, place, ASSET, self._cameras))

    def add_other(self, tree: Tree, place: str) -> None:
        with naming(place):
            self.rest.append(pystac.Item.from_dict(tree, href=place))


def read_items(tree: Tree, href: str, allow_outside: bool) -> tuple[Items, str]:
    """Items of a collection and of its children, and why its table of them was not used, where it has one."""
    base, links, note = posixpath.dirname(href), links_of(tree, "item"), ""
    if len(links) >= TABLE_FROM:
        try:
            if (found := _table_items(tree, base, links)) is not None:
                return found, ""
        except StaleTable as error:
            note = f"{TABLE} is not used: {error}; make the catalog again, and it opens faster"
    return _single_items(item_places(tree, href, allow_outside)), note


def _table_items(tree: Tree, base: str, links: list[str]) -> Items | None:
    # Loaded where it is used: pyarrow takes longer than a small catalog
    from cityflow.io.catalog.stac_table_read import image_items, open_table, other_items

    table = open_table(tree, base, links + links_of(tree, "child"))
    if table is None:
        return None
    found = Items()
    for item in image_items(table):
        found.add_image(item, f"{base}/{item_place(item['id'])}")
    for item in other_items(table):
        found.add_other(item, f"{base}/{item_place(item['id'])}")
    return found


def _single_items(places: list[str]) -> Items:
    found = Items()
    for place, text in texts(places):
        with naming(place):
            tree = json_of(text)
        if not isinstance(tree, dict) or not isinstance(tree.get("properties"), dict):
            raise ValueError(f"{place} is no item")
        is_image = tree["properties"].get(KIND) == IMAGE
        (found.add_image if is_image else found.add_other)(tree, place)
    return found


@contextmanager
def naming(place: str) -> Iterator[None]:
    """Whatever does not fit in an item becomes a ValueError that names its file."""
    try:
        yield
    except KeyError as error:
        raise ValueError(f"{place} lacks {error}") from error
    except MISFITS as error:
        raise ValueError(f"{place}: {error}") from error
