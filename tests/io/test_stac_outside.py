"""What a catalog names outside of its folder."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from cityflow.errors import CatalogError
from cityflow.io.catalog.stac import read_catalog
from cityflow.io.catalog.stac_outside import is_inside, refuse_outside
from cluster.small_city import SmallCity, make_city


@pytest.fixture(scope="module")
def city(tmp_path_factory: pytest.TempPathFactory) -> SmallCity:
    return make_city(tmp_path_factory.mktemp("town"))


@pytest.fixture
def folder(city: SmallCity, tmp_path: Path) -> Path:
    return Path(shutil.copytree(city.catalog, tmp_path / "catalog"))


def change(folder: Path, link: dict[str, str] | None = None, **fields: Any) -> None:
    path = folder / "collection.json"
    tree = {**json.loads(path.read_text()), **fields}
    tree["links"] += [link] if link else []
    path.write_text(json.dumps(tree))


def test_files_that_its_maker_named_are_used_where_it_was_made(city: SmallCity, folder: Path) -> None:
    refuse_outside(read_catalog(city.catalog))
    with pytest.raises(CatalogError, match=r"'east' lies outside.*was not made here.*--allow-outside"):
        refuse_outside(read_catalog(folder))


def test_a_catalog_with_its_files_goes_anywhere(city: SmallCity, folder: Path) -> None:
    shutil.copytree(city.folder / "lidar", folder / "lidar")
    shutil.copy(city.outlines, folder)
    for item in (folder / "items").glob("*.json"):
        tree = json.loads(item.read_text())
        name = Path(tree["assets"]["data"]["href"]).name
        tree["assets"]["data"]["href"] = f"../lidar/{name}" if name.endswith("laz") else f"../{name}"
        item.write_text(json.dumps(tree))
    refuse_outside(read_catalog(folder))
    (folder / "lidar/east.laz").unlink()
    (folder / "lidar/east.laz").symlink_to(city.lidar("east.laz"))
    with pytest.raises(CatalogError, match="'east' lies outside"):
        refuse_outside(read_catalog(folder))


@pytest.mark.parametrize("relation", ["item", "child"])
@pytest.mark.parametrize("place", ["/dev/zero", "../other.json", "http://127.0.0.1:9/x.json", "foo://x/y.json"])
def test_links_that_leave_are_refused_before_they_are_followed(folder: Path, relation: str, place: str) -> None:
    change(folder, {"rel": relation, "href": place})
    with pytest.raises(CatalogError, match=r"a link leaves the catalog: .*--allow-outside"):
        read_catalog(folder)


@pytest.mark.parametrize("place", ["/dev/zero", "http://127.0.0.1:9/x.json", "foo://x/y.json"])
def test_links_that_may_leave_still_have_an_end(folder: Path, place: str) -> None:
    change(folder, {"rel": "item", "href": place})
    with pytest.raises(CatalogError, match=r"device|cannot be read|damaged"):
        read_catalog(folder, allow_outside=True)


def test_a_child_that_is_its_own_ancestor_is_refused(folder: Path) -> None:
    change(folder, {"rel": "child", "href": "./collection.json"})
    with pytest.raises(CatalogError, match=r"collection\.json is listed twice, or is its own ancestor"):
        read_catalog(folder)


def test_items_of_children_are_read(folder: Path) -> None:
    tree = json.loads((folder / "collection.json").read_text())
    items = [link for link in tree["links"] if link["rel"] == "item"]
    child = {"type": "Catalog", "id": "c", "stac_version": "1.1.0", "description": "d", "links": items[:1]}
    (folder / "child.json").write_text(json.dumps(child))
    change(folder, {"rel": "child", "href": "./child.json"}, links=[k for k in tree["links"] if k != items[0]])
    assert len(read_catalog(folder).assets) == len(items)


@pytest.mark.parametrize(
    ("root", "place", "inside"),
    [
        ("s3://a/cat", "s3://a/cat/%2e%2e/b.json", False),
        ("s3://a/cat", "s3://a/catalogue/b.json", False),
        ("https://h/cat", "https://h/cat/items/a.json", True),
    ],
)
def test_places_of_object_stores(root: str, place: str, inside: bool) -> None:
    assert is_inside(root, place) == inside
