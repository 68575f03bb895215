from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import fsspec
import jsonschema_rs
import pystac
import pytest
from pystac.extensions.file import FileExtension
from pystac.extensions.pointcloud import PointcloudExtension
from pystac.extensions.projection import ProjectionExtension

from cityflow.errors import CatalogError
from cityflow.io.catalog.catalog_kinds import kinds_in
from cityflow.io.catalog.stac import COLLECTION, Catalog, is_catalog, read_catalog, sha256_of
from cityflow.io.catalog.stac_assets import RasterAsset
from survey_files import DELFT

SCHEMAS = Path(str(pystac.__file__)).parent / "validation" / "jsonschemas"


@pytest.fixture(scope="module")
def delft() -> Catalog:
    return read_catalog(DELFT)


def test_delft_says_what_a_run_needs(delft: Catalog) -> None:
    assert delft.title == "Delft"
    assert delft.reference.code == "EPSG:7415"
    assert delft.date == "2014-03-04"
    assert [a.name for a in delft.lidar] == ["ahn3_cropped_1", "ahn3_cropped_2"]
    assert sum(a.points for a in delft.lidar) == 848_942
    assert delft.bounds == pytest.approx((84808.3, 447412.8, 85072.299, 447641.299))
    assert delft.outlines is not None
    assert (delft.outlines.count, delft.outlines.id_column) == (160, "identificatiebagpnd")
    assert "Kadaster" in delft.attribution
    assert Path(delft.href) == DELFT


def test_delft_is_whole(delft: Catalog) -> None:
    for asset in delft.assets:
        assert Path(asset.href).is_absolute()
        assert sha256_of(asset.href) == (asset.checksum, asset.size)
    assert sum(a.size for a in delft.assets) < 5_000_000


def test_pystac_and_its_extensions_read_it(delft: Catalog) -> None:
    collection = pystac.Collection.from_file(str(DELFT / COLLECTION))
    items = {item.id: item for item in collection.get_items()}
    assert sorted(items) == ["ahn3_cropped_1", "ahn3_cropped_2", "outlines"]
    item = items["ahn3_cropped_2"]
    assert ProjectionExtension.ext(item).code == "EPSG:7415"
    assert PointcloudExtension.ext(item).count == 208_432
    assert PointcloudExtension.ext(item).schemas[0].name == "X"
    asset = item.assets["data"]
    assert FileExtension.ext(asset).checksum == "1220" + delft.lidar[1].checksum
    assert not asset.href.startswith("/")
    assert Path(str(asset.get_absolute_href())).stat().st_size == FileExtension.ext(asset).size


def _official_schemas() -> dict[str, dict[str, object]]:
    """The copies that pystac ships, by the addresses that they have in each other."""
    core, known = "https://schemas.stacspec.org/v1.1.0", {}
    for path in SCHEMAS.rglob("*.json"):
        folder = path.stem if path.stem in ("item", "catalog", "collection") else "item"
        uri = f"{core}/{folder}-spec/json-schema/{path.name}"
        known[f"https://geojson.org/schema/{path.name}" if path.parent.name == "geojson" else uri] = json.loads(
            path.read_text(encoding="utf-8")
        )
    return known


def problems(path: Path, kind: str) -> list[str]:
    """What the official schema of STAC 1.1 has against a file."""
    schemas = _official_schemas()
    registry = jsonschema_rs.Registry(list(schemas.items()))
    schema = schemas[f"https://schemas.stacspec.org/v1.1.0/{kind}-spec/json-schema/{kind}.json"]
    validator = jsonschema_rs.validator_for(schema, registry=registry)
    return [str(error) for error in validator.iter_errors(json.loads(path.read_text(encoding="utf-8")))]


def test_it_is_valid_stac_by_the_official_schemas(tmp_path: Path) -> None:
    assert problems(DELFT / COLLECTION, "collection") == []
    for item in (DELFT / "items").glob("*.json"):
        assert problems(item, "item") == []
    broken = json.loads((DELFT / "items" / "outlines.json").read_text(encoding="utf-8"))
    del broken["properties"]["datetime"]
    (tmp_path / "broken.json").write_text(json.dumps(broken))
    assert problems(tmp_path / "broken.json", "item")


def test_catalog_may_be_moved(tmp_path: Path, delft: Catalog) -> None:
    shutil.copytree(DELFT, tmp_path / "elsewhere")
    moved = read_catalog(tmp_path / "elsewhere")
    assert [a.href for a in moved.assets] != [a.href for a in delft.assets]
    assert all(Path(a.href).is_file() for a in moved.assets)
    assert [a.checksum for a in moved.assets] == [a.checksum for a in delft.assets]


def test_catalog_behind_a_url(delft: Catalog) -> None:
    remote = fsspec.filesystem("memory")
    remote.put(str(DELFT), "/surveys/delft", recursive=True)
    found = read_catalog("memory://surveys/delft")
    assert found.href == "memory://surveys/delft"
    assert [a.checksum for a in found.assets] == [a.checksum for a in delft.assets]
    assert found.lidar[0].href == "memory://surveys/delft/data/ahn3_cropped_1.laz"
    assert sha256_of(found.lidar[1].href) == (delft.lidar[1].checksum, delft.lidar[1].size)


def test_items_of_other_kinds_are_left_alone(tmp_path: Path, delft: Catalog) -> None:
    shutil.copytree(DELFT, tmp_path / "c")
    item = json.loads((tmp_path / "c" / "items" / "outlines.json").read_text())
    item["id"], item["properties"]["cityflow:kind"] = "flight-1", "mesh"
    (tmp_path / "c" / "items" / "flight-1.json").write_text(json.dumps(item))
    collection = json.loads((tmp_path / "c" / COLLECTION).read_text())
    collection["links"].append({"rel": "item", "href": "./items/flight-1.json", "type": "application/geo+json"})
    (tmp_path / "c" / COLLECTION).write_text(json.dumps(collection))
    assert len(read_catalog(tmp_path / "c").assets) == len(delft.assets)


def test_no_catalog_and_damaged_ones_are_named(tmp_path: Path) -> None:
    with pytest.raises(CatalogError, match="no catalog here"):
        read_catalog(tmp_path)
    shutil.copytree(DELFT, tmp_path / "c")
    (tmp_path / "c" / "items" / "outlines.json").unlink()
    with pytest.raises(CatalogError, match=r"outlines\.json"):
        read_catalog(tmp_path / "c")
    collection = json.loads((tmp_path / "c" / COLLECTION).read_text())
    del collection["cityflow:crs"]
    (tmp_path / "c" / COLLECTION).write_text(json.dumps(collection))
    assert not is_catalog(tmp_path / "c")
    with pytest.raises(CatalogError, match="catalog create"):
        read_catalog(tmp_path / "c")
    (tmp_path / "c" / COLLECTION).write_text("{ not json")
    with pytest.raises(CatalogError, match="damaged"):
        read_catalog(tmp_path / "c")


def test_an_outline_far_away_makes_no_survey_larger(delft: Catalog) -> None:
    far = replace(delft.outlines, bounds=(0.0, 0.0, 300_000.0, 600_000.0)) if delft.outlines else None
    dsm = RasterAsset("dsm", "dsm", "dsm.tif", "", 0, (10.0, 20.0, 30.0, 40.0), 1.0, (20, 20))
    ortho = replace(dsm, name="ortho", kind="ortho", bounds=(0.0, 0.0, 90.0, 90.0))
    assert replace(delft, outlines=far).bounds == delft.bounds
    assert replace(delft, lidar=(), outlines=far, rasters={"dsm": dsm, "ortho": ortho}).bounds == dsm.bounds
    assert replace(delft, lidar=(), outlines=far, rasters={"ortho": ortho}).bounds == ortho.bounds


def test_kinds_are_told_early_or_not_at_all(tmp_path: Path) -> None:
    """Nothing is read beyond the catalog's folder, and what is odd is left to those who read it."""
    assert kinds_in(DELFT / COLLECTION) == frozenset({"lidar", "outlines"})
    collection = json.loads((DELFT / COLLECTION).read_text())
    for links in (
        [{"rel": "child", "href": "./more/collection.json"}],
        [{"rel": "item", "href": "../items/a.json"}],
        [{"rel": "item", "href": "https://example.org/a.json"}],
        [{"rel": "item", "href": "./missing.json"}],
        [{"rel": "item"}],
        [{"rel": "item", "href": "./a.json"}] * 1000,
    ):
        (tmp_path / COLLECTION).write_text(json.dumps({**collection, "links": links}))
        assert kinds_in(tmp_path / COLLECTION) is None
    assert kinds_in(tmp_path / "none.json") is None
