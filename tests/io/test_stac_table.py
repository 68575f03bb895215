"""The table of items beside them: holds what the items hold, and is not used where it does not fit them."""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import fsspec
import geopandas as gpd
import numpy as np
import pyarrow.parquet as pq
import pytest

from cityflow.core.camera import Camera, OrientedImage
from cityflow.geometry.rotations import from_omega_phi_kappa
from cityflow.io.catalog import stac_item_reader
from cityflow.io.catalog.stac import (
    Catalog,
    ImageAsset,
    LidarAsset,
    OutlineAsset,
    RasterAsset,
    SparseAsset,
    read_catalog,
)
from cityflow.io.catalog.stac_items import TABLE
from cityflow.io.catalog.stac_table_read import image_items, other_items
from cityflow.io.catalog.stac_write import write_catalog
from cityflow.io.crs import resolve

BOX = (340_600.0, 548_100.0, 340_700.5, 548_200.25)
CAMERAS = (
    Camera(160, 120, 150.25, 150.5, 80.0, 61.0),
    Camera(150, 100, 1 / 3, 99.0, 75.0, 50.0, (0.1, -0.2, 1e-17, 0.0), "fisheye"),
)


def survey(folder: Path, crs: str = "EPSG:2180") -> Catalog:
    images = tuple(
        ImageAsset(
            f"i{k}", f"{folder}/data/i{k}.jpg", f"{k:064x}", 1000 + k, BOX,
            OrientedImage(f"i{k}", CAMERAS[k % 2], from_omega_phi_kappa(0.1 * k, -0.05, 0.3), np.array([340_650.1, 548_150.0 + k, 1 / 7])),
            (60.0, 72.5), *((3, "uint8", (1.0, 0.9, 1.1)) if k else (1, "uint16", (1.0,), "2024-05-17", 0.004, (1.1,), 0.25, 0.8, 4095.0)),
        )
        for k in range(3)
    )  # fmt: skip
    return Catalog(
        str(folder), "Town", resolve(crs), "CC0-1.0", "",
        (LidarAsset("west", f"{folder}/data/west.laz", "a" * 64, 9, BOX, (1.0, 2.5), 77, "2014-03-04", (1, 2, 6), 3, "named"),),
        OutlineAsset("outlines", f"{folder}/data/o.gpkg", "b" * 64, 8, BOX, 160, "id", None, "houses"),
        {"dsm": RasterAsset("dsm", "dsm", f"{folder}/data/dsm.tif", "c" * 64, 7, BOX, 0.5, (120, 240))}, images,
        SparseAsset("sparse", f"{folder}/data/sparse.laz", "d" * 64, 6, BOX, (1.0, 2.0), 5),
    )  # fmt: skip


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    catalog = survey(tmp_path / "c")
    write_catalog(tmp_path / "c", catalog, {a.name: f"../data/{Path(a.href).name}" for a in catalog.assets})
    return tmp_path / "c"


@pytest.fixture(autouse=True)
def always_the_table(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stac_item_reader, "TABLE_FROM", 0)


def without_items(folder: Path) -> Catalog:
    """Read where no item can be parsed: nothing but the table tells what is in them."""
    for item in (folder / "items").glob("*.json"):
        status = item.stat()
        item.write_text(" " * status.st_size)
        os.utime(item, ns=(status.st_atime_ns, status.st_mtime_ns - 10**9))
    return read_catalog(folder)


@pytest.mark.parametrize("crs", ["EPSG:2180", "EPSG:7415", "EPSG:2180+5621", "local"])
def test_the_table_holds_what_the_items_hold(tmp_path: Path, crs: str) -> None:
    catalog = survey(tmp_path, crs)
    write_catalog(tmp_path, catalog, {a.name: f"../data/{Path(a.href).name}" for a in catalog.assets})
    table = pq.ParquetFile(tmp_path / TABLE)
    for tree in other_items(table):
        item = json.loads((tmp_path / "items" / f"{tree['id']}.json").read_text())
        for gone in ("bbox", "geometry"):
            item.pop(gone, None), tree.pop(gone, None)
        # the same CRS for all, which the collection has
        item["properties"] = {k: v for k, v in item["properties"].items() if v is not None and k != "proj:projjson"}
        assert tree == item
    frame = gpd.read_parquet(tmp_path / TABLE)
    for tree in image_items(table):
        item = json.loads((tmp_path / "items" / f"{tree['id']}.json").read_text())
        row = frame[frame["id"] == tree["id"]].iloc[0]
        assert tree["properties"] == {k: item["properties"][k] for k in tree["properties"]}
        assert {k for k, v in item["properties"].items() if v is not None} <= {*frame.columns, "proj:projjson"}
        assert row["view:azimuth"] == item["properties"]["view:azimuth"]
        assert (row.geometry is None) == (item["geometry"] is None) == (crs == "local")
        assert item["geometry"] is None or list(row.geometry.bounds) == pytest.approx(item["bbox"], abs=0)


def test_the_table_gives_the_same_catalog_as_the_items(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stac_item_reader, "TABLE_FROM", 10**9)
    one_by_one = read_catalog(folder)
    monkeypatch.setattr(stac_item_reader, "TABLE_FROM", 0)
    assert one_by_one == survey(folder)
    found = without_items(folder)
    assert (found, found.notes) == (one_by_one, ())
    for a, b in zip(found.images, one_by_one.images, strict=True):
        assert a.oriented.rotation.tobytes() == b.oriented.rotation.tobytes()
        assert a.oriented.centre.tobytes() == b.oriented.centre.tobytes()
    assert found.images[0].oriented.camera is found.images[2].oriented.camera


def _item(folder: Path) -> Path:
    return folder / "items" / "i1.json"


def _other_bands(folder: Path) -> None:
    text = _item(folder).read_text()
    assert '"cityflow:bands": 3' in text
    _item(folder).write_text(text.replace('"cityflow:bands": 3', '"cityflow:bands": 4'))


def _longer_but_old(folder: Path) -> None:
    before = _item(folder).stat().st_mtime_ns - 10**12
    _item(folder).write_text(_item(folder).read_text().replace('"cityflow:bands": 3', '"cityflow:bands":  4'))
    os.utime(_item(folder), ns=(before, before))


def _collection(folder: Path, change: Callable[[dict[str, Any]], object]) -> None:
    tree = json.loads((folder / "collection.json").read_text())
    change(tree)
    (folder / "collection.json").write_text(json.dumps(tree))


def _one_item_less(folder: Path) -> None:
    _collection(
        folder, lambda tree: tree["links"].remove(next(x for x in tree["links"] if x["href"].endswith("i1.json")))
    )


def _one_item_more(folder: Path) -> None:
    item = json.loads(_item(folder).read_text())
    (folder / "items" / "i9.json").write_text(json.dumps({**item, "id": "i9"}))
    _collection(folder, lambda tree: tree["links"].append({"rel": "item", "href": "./items/i9.json"}))


def _table(folder: Path, data: bytes, digest: bool) -> None:
    (folder / TABLE).write_bytes(data)
    if digest:
        checksum = "1220" + hashlib.sha256(data).hexdigest()
        _collection(folder, lambda tree: tree["assets"]["items"].update({"file:checksum": checksum}))


CHANGES: dict[str, tuple[Callable[[Path], object], str]] = {
    "an item of the same size": (_other_bands, r"i1\.json has changed"),
    "an item with an old time": (_longer_but_old, r"i1\.json has changed"),
    "an item less": (_one_item_less, "rows for"),
    "an item more": (_one_item_more, "rows for"),
    "no table": (lambda folder: (folder / TABLE).unlink(), "cannot be read"),
    "another table": (lambda folder: _table(folder, b"PAR1" * 9, False), "another digest"),
    "no parquet": (lambda folder: _table(folder, b"PAR1" * 9, True), "damaged"),
}


@pytest.mark.parametrize("name", CHANGES)
def test_what_does_not_fit_the_items_is_noticed_and_the_items_are_read(
    folder: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    change, problem = CHANGES[name]
    change(folder)
    found = read_catalog(folder)
    monkeypatch.setattr(stac_item_reader, "TABLE_FROM", 10**9)
    assert found == read_catalog(folder)
    assert len(found.notes) == 1
    assert re.search(rf"items\.parquet is not used: .*{problem}", found.notes[0])
    changed = {"an item of the same size": 4, "an item with an old time": 4}.get(name, 3)
    assert [i.bands for i in found.images if i.name == "i1"] == ([] if name == "an item less" else [changed])


def test_an_item_that_is_gone_is_an_error_as_before(folder: Path) -> None:
    _item(folder).unlink()
    with pytest.raises(Exception, match=r"i1\.json"):
        read_catalog(folder)


def test_a_copy_without_times_still_has_its_table(folder: Path, tmp_path: Path) -> None:
    shutil.copytree(folder, tmp_path / "d", copy_function=shutil.copyfile)
    for item in (tmp_path / "d" / "items").glob("*.json"):
        item.touch()
    found = read_catalog(tmp_path / "d")
    assert found.notes == ()
    assert len(found.assets) == len(survey(folder).assets)
    assert found.images[0].href == str(tmp_path / "d" / "data" / "i0.jpg")


def test_behind_a_url_the_md5_is_compared(folder: Path) -> None:
    remote = fsspec.filesystem("memory")
    remote.put(str(folder), "/surveys/table", recursive=True)
    found = read_catalog("memory://surveys/table")
    assert found.notes == ()
    assert [replace(a, href="") for a in found.assets] == [replace(a, href="") for a in survey(folder).assets]
    text = remote.cat("/surveys/table/items/i1.json").replace(b'"cityflow:bands": 3', b'"cityflow:bands": 4')
    remote.pipe("/surveys/table/items/i1.json", text)
    found = read_catalog("memory://surveys/table")
    assert "i1.json has changed" in found.notes[0]
    assert found.images[1].bands == 4
    remote.rm("/surveys/table", recursive=True)


def test_where_no_folder_can_be_listed_the_items_are_read(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    remote = fsspec.filesystem("memory")
    remote.put(str(folder), "/surveys/unlisted", recursive=True)

    def refuse(*_: object, **__: object) -> None:
        raise OSError("no listing here")

    monkeypatch.setattr(type(remote), "ls", refuse)
    found = read_catalog("memory://surveys/unlisted")
    assert "cannot be listed" in found.notes[0]
    assert len(found.assets) == len(survey(folder).assets)


def test_same_items_same_bytes(folder: Path, tmp_path: Path) -> None:
    write_catalog(
        tmp_path / "d", survey(folder), {a.name: f"../data/{Path(a.href).name}" for a in survey(folder).assets}
    )
    assert (tmp_path / "d" / TABLE).read_bytes() == (folder / TABLE).read_bytes()
